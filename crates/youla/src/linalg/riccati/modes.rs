//! Why a stabilising solution does not exist: the test of Popov, Belevitch and Hautus, mode by mode. A mode p of A that is
//! not stable must be within reach of the input, `rank [A - p I, B] = n`; a mode on the stability boundary must also be seen
//! by the weight, `rank [A - p I; Q] = n`, with the cross term absorbed. (An unstable mode that the weight does not see is
//! no obstacle: feedback reflects it.)

use super::normal_form::NormalForm;
use crate::linalg::eigenvalues;
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};

/// How near to the boundary, relative to A, a computed mode counts as lying on it (the square root of rounding, which a
/// double mode shows).
const BOUNDARY: f64 = 1e-6;

/// The refusal that names the mode in the way, or none where every mode passes the test.
pub(super) fn obstacle(what: &str, normal: &NormalForm) -> Result<Option<Error>> {
    let a = normal.a_without_cross_term();
    let q = normal.q_without_cross_term();
    let boundary = BOUNDARY * normal.size();
    let rounding = 1e-13 * (a.nrows() as f64) * normal.size();
    for pole in eigenvalues(&format!("the state matrix of {what}"), a.as_ref())? {
        let instability = normal.equation.instability(pole);
        let on_boundary = instability.abs() <= boundary;
        let p = if on_boundary { normal.equation.on_boundary(pole) } else { pole };
        if instability < -boundary {
            continue;
        }
        let reach = smallest_singular_value(a.as_ref(), p, normal.b.as_ref());
        if reach <= rounding {
            return Ok(Some(Error::NotStabilisable { what: what.to_owned(), pole, distance: reach }));
        }
        let sight = smallest_singular_value(a.transpose(), p, q.as_ref());
        if on_boundary && sight <= rounding {
            return Ok(Some(Error::NotDetectable { what: what.to_owned(), pole, distance: sight }));
        }
    }
    Ok(None)
}

/// Smallest singular value of `[A - p I, B]`.
fn smallest_singular_value(a: MatRef<'_, f64>, p: c64, b: MatRef<'_, f64>) -> f64 {
    let (n, m) = (a.nrows(), b.ncols());
    let pencil = Mat::from_fn(n, n + m, |i, j| match j.checked_sub(n) {
        Some(j) => c64::new(b[(i, j)], 0.0),
        None if i == j => c64::new(a[(i, j)], 0.0) - p,
        None => c64::new(a[(i, j)], 0.0),
    });
    match pencil.singular_values() {
        Ok(values) => values.last().map_or(0.0, |s| s.abs()),
        Err(_) => f64::INFINITY,
    }
}
