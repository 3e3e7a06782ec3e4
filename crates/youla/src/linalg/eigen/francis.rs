//! The QR iteration with implicit double shifts that reduces a Hessenberg matrix to quasi-triangular form: J. G. F. Francis,
//! The QR transformation, Comput. J. 4 (1961-62), 265 and 332; the test for deflation is that of M. Ahues and F. Tisseur,
//! LAPACK Working Note 122 (1997). `schur` says why it is not that of faer.

use crate::linalg::eigen::bulge_chasing::sweep;
use crate::linalg::eigen::schur::standardise;
use crate::linalg::eigen::shifts::Shifts;
use crate::linalg::square::Square;
use crate::{Error, Result};
use faer::Mat;
use pulp::{Arch, Simd, WithSimd};

/// Turns the Hessenberg matrix `t` into quasi-triangular form, deflating from the bottom until nothing is left, and
/// accumulates the transformations in `q`.
pub(crate) fn quasi_triangular(what: &str, t: &mut Mat<f64>, q: &mut Mat<f64>) -> Result<()> {
    let (mut t_square, mut q_square) = (Square::new(t.as_ref()), Square::new(q.as_ref()));
    Arch::new().dispatch(Iteration { what, t: &mut t_square, q: &mut q_square })?;
    (*t, *q) = (t_square.to_mat(), q_square.to_mat());
    Ok(())
}

/// The iteration, compiled for each kind of processor.
struct Iteration<'a> {
    what: &'a str,
    t: &'a mut Square,
    q: &'a mut Square,
}

impl WithSimd for Iteration<'_> {
    type Output = Result<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Result<()> {
        let Iteration { what, t, q } = self;
        let n = t.order();
        let limit = 30 * n.max(10);
        let (mut end, mut total, mut since_deflation) = (n, 0, 0);
        while end > 0 {
            let start = deflate(t, end);
            match end - start {
                1 => (end, since_deflation) = (end - 1, 0),
                2 => {
                    standardise(t, q, start);
                    (end, since_deflation) = (end - 2, 0);
                }
                _ if total == limit => {
                    let what = format!("the Schur form of {what}");
                    return Err(Error::NoConvergence { what, iterations: total });
                }
                _ => {
                    total += 1;
                    since_deflation += 1;
                    let shifts = Shifts::choose(t, start, end, since_deflation);
                    sweep(t, q, start..end, shifts.first_row(t, start, end), shifts);
                }
            }
        }
        Ok(())
    }
}

/// Sets the lowest negligible subdiagonal entry above row `end` to zero and returns the first row of the unreduced block.
fn deflate(t: &mut Square, end: usize) -> usize {
    for k in (1..end).rev() {
        if is_negligible(t, k) {
            t[(k, k - 1)] = 0.0;
            return k;
        }
    }
    0
}

/// Whether the subdiagonal entry of row k may be set to zero at no more than the cost of a rounding, also for graded
/// matrices (Ahues and Tisseur 1997).
fn is_negligible(t: &Square, k: usize) -> bool {
    let eps = f64::EPSILON;
    let (below, above) = (t[(k, k - 1)].abs(), t[(k - 1, k)].abs());
    let (upper, lower) = (t[(k - 1, k - 1)], t[(k, k)]);
    let mut neighbours = upper.abs() + lower.abs();
    if neighbours == 0.0 {
        neighbours = t.norm_max();
    }
    if below <= f64::MIN_POSITIVE / eps {
        return true;
    }
    if below > eps * neighbours {
        return false;
    }
    let (small, large) = (below.min(above), below.max(above));
    let gap = (upper - lower).abs();
    let (least, most) = (lower.abs().min(gap), lower.abs().max(gap));
    let sum = most + large;
    small * (large / sum) <= (f64::MIN_POSITIVE / eps).max(eps * (least * (most / sum)))
}
