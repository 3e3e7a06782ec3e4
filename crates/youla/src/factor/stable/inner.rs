//! Feedback that mirrors the poles of one block at the stability boundary and makes the denominator inner.
//!
//! ```text
//! continuous   A Y + Y A' = B B'     F = -B' Y^-1            V = I
//! discrete     A Y A' - Y = B B'     F = -B' A^-T Y^-1       V V' = (I + B' Y^-1 B)^-1, V upper triangular
//! ```
//!
//! With `Y = L L'`, L from a square-root solver, Y itself is not formed.

use super::BlockFeedback;
use crate::linalg::{discrete_gramian_factor, eye, gramian_factor, solve};
use crate::lti::TimeDomain;
use crate::{Error, Result};
use faer::{Mat, Scale, Side, c64};

/// Instability, relative to the size of the block, below which its poles count as lying on the boundary.
const ON_BOUNDARY: f64 = 1e-13;

pub(super) fn feedback<T: TimeDomain>(time: T, a: &Mat<f64>, b: &Mat<f64>, pole: c64) -> Result<BlockFeedback> {
    if time.instability(pole) <= ON_BOUNDARY * pole.norm() {
        return Err(Error::NoSolution {
            what: "the coprime factorisation with inner denominator".into(),
            condition: format!("the pole {} lies on the stability boundary", crate::error::Pole(pole)),
            residual: f64::NAN,
        });
    }
    let minus = Scale(-1.0);
    match time.sample_time() {
        None => {
            let l = gramian_factor((minus * a).as_ref(), b.as_ref())?.l;
            let scaled = solve(WHAT, l.as_ref(), b.as_ref())?;
            let f = solve(WHAT, l.transpose(), scaled.as_ref())?;
            Ok(BlockFeedback { f: minus * f.transpose(), v: eye(b.ncols()) })
        }
        Some(_) => {
            let inverse = solve("an unstable diagonal block", a.as_ref(), eye(a.nrows()).as_ref())?;
            let before = &inverse * b;
            let l = discrete_gramian_factor(inverse.as_ref(), before.as_ref())?.l;
            let whitened = |rhs: &Mat<f64>| solve(WHAT, l.as_ref(), rhs.as_ref());
            let f = solve(WHAT, l.transpose(), whitened(&before)?.as_ref())?;
            let scaled = whitened(b)?;
            Ok(BlockFeedback {
                f: minus * f.transpose(),
                v: upper_root(&(eye(b.ncols()) + scaled.transpose() * &scaled))?,
            })
        }
    }
}

const WHAT: &str = "the Gramian of a diagonal block of the coprime factorisation";

/// Upper triangular V with `V V' = W^-1`, W positive definite.
fn upper_root(w: &Mat<f64>) -> Result<Mat<f64>> {
    let singular = |_| Error::Singular { what: "the feedthrough of an inner denominator".into(), rcond: 0.0 };
    let lower = w.llt(Side::Lower).map_err(singular)?;
    solve("the feedthrough of an inner denominator", lower.L().transpose(), eye(w.nrows()).as_ref())
}
