//! The response at one line: from its own values, or by a local polynomial over the lines where every input has lines of its own.
//!
//! With r the distance from the line, `Z = (T + r T1 + r^2 T2) D + V` over the lines of a window. The estimate keeps the form
//! `cov vec T = M^T (x) C`: M is the block of T of the inverse normal matrix, C the mean covariance in the window.
//!
//! Source: R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed. (2012), chapter 7.

use super::gather::Line;
use super::invertible;
use faer::{Mat, Scale, c64};

/// Degree of the polynomial.
const DEGREE: usize = 2;
/// Lines of the window for each input.
const WINDOW: usize = 5;

/// Response and factors of its covariance.
pub(super) struct Estimate {
    pub t: Mat<c64>,
    pub m: Mat<c64>,
    pub c: Mat<c64>,
}

/// `None` where the experiments do not excite the inputs independently at this line.
pub(super) fn at_line(line: &Line) -> Option<Estimate> {
    let m = invertible(line.d.as_ref() * line.d.adjoint())?;
    Some(Estimate { t: &line.z * line.d.adjoint() * &m, m, c: line.noise.clone() })
}

/// `None` where the lines of the window do not excite the inputs independently.
pub(super) fn interpolated(lines: &[usize], all: &[Line], k: usize) -> Option<Estimate> {
    let inputs = all[k].d.nrows();
    let count = (WINDOW * inputs).min(lines.len());
    let first = k.saturating_sub(count / 2).min(lines.len() - count);
    let window = first..first + count;
    let at = lines[k] as f64;
    let span = window.clone().map(|l| (lines[l] as f64 - at).abs()).fold(1.0, f64::max);
    let unknowns = (DEGREE + 1) * inputs;
    let (mut normal, mut right) = (Mat::<c64>::zeros(unknowns, unknowns), Mat::zeros(all[k].z.nrows(), unknowns));
    let mut c = Mat::<c64>::zeros(all[k].z.nrows(), all[k].z.nrows());
    for l in window {
        let (r, line) = ((lines[l] as f64 - at) / span, &all[l]);
        let power = |i: usize| r.powi((i / inputs) as i32);
        let theta = Mat::from_fn(unknowns, line.d.ncols(), |i, e| line.d[(i % inputs, e)] * power(i));
        normal += &theta * theta.adjoint();
        right += &line.z * theta.adjoint();
        c += &line.noise * Scale(c64::new(1.0 / count as f64, 0.0));
    }
    let inverse = invertible(normal)?;
    let t = (right * &inverse).subcols(0, inputs).to_owned();
    Some(Estimate { t, m: inverse.submatrix(0, 0, inputs, inputs).to_owned(), c })
}
