//! Regions of responses and intervals of modes, to first order in the slopes of the system matrices.
//!
//! ```text
//! dG = X (dA Y + dB) + dC Y + dD,   X = C (z I - A)^-1,   Y = (z I - A)^-1 B
//! ```

use faer::prelude::*;
use std::f64::consts::TAU;
use youla::lti::{Discrete, FrequencyResponse, Mode, StateSpace, TimeDomain};
use youla::{Mat, MatRef, c64};

/// The slope of a system with respect to one parameter.
#[derive(Debug, Clone)]
pub(super) struct SystemSlope {
    /// Slope of A, n x n.
    pub(super) a: Mat<f64>,
    /// Slope of B, n x m.
    pub(super) b: Mat<f64>,
    /// Slope of C, p x n.
    pub(super) c: Mat<f64>,
    /// Slope of D, p x m.
    pub(super) d: Mat<f64>,
}

/// A frequency response with the region of each of its entries.
#[derive(Debug, Clone)]
pub struct ResponseBand {
    /// The estimate.
    pub response: FrequencyResponse,
    /// Per frequency, and in it column by column, the covariance of real and imaginary part: `[rr, ri, ii]`.
    pub covariance: Vec<[f64; 3]>,
    /// In the same order, bounds of the magnitude at the level of the estimate.
    pub magnitude: Vec<[f64; 2]>,
    /// Bound of `d' V^-1 d` for the region of a complex value.
    pub ellipse: f64,
}

/// How far regions and intervals reach.
#[derive(Clone, Copy)]
pub(super) struct Reach {
    /// Half width of an interval over the standard deviation.
    pub(super) student: f64,
    /// Bound of `d' V^-1 d` for the two parts of a complex number.
    pub(super) ellipse: f64,
}

impl ResponseBand {
    /// `changes` of the response at a frequency (one entry per parameter, column by column), and the covariance `[11, 12, 22]` of two
    /// quantities from their changes with each parameter.
    pub(super) fn by_changes(
        response: FrequencyResponse,
        changes: impl Fn(f64) -> Vec<Vec<c64>>,
        covariance: impl Fn(&[[f64; 2]]) -> [f64; 3],
        reach: Reach,
    ) -> ResponseBand {
        let at = |omega: &f64| {
            let changes = changes(*omega);
            let entry = |e: usize| covariance(&changes.iter().map(|d| [d[e].re, d[e].im]).collect::<Vec<_>>());
            (0..changes.first().map_or(0, Vec::len)).map(entry).collect::<Vec<_>>()
        };
        let covariance: Vec<[f64; 3]> = response.omega.iter().flat_map(at).collect();
        let values = response.iter().flat_map(|at| at.col_iter().flat_map(|c| c.iter().copied()).collect::<Vec<_>>());
        let magnitude = values.zip(&covariance).map(|(g, v)| magnitude_interval(g, v, reach.student)).collect();
        ResponseBand { response, covariance, magnitude, ellipse: reach.ellipse }
    }

    /// Place of entry (output i, input j) at frequency number k.
    pub fn place(&self, k: usize, i: usize, j: usize) -> usize {
        let at = self.response.at(k);
        (k * at.ncols() + j) * at.nrows() + i
    }
}

/// What changes of a system make of its response at one frequency, rad/s; p m numbers each, column by column.
pub(super) fn response_changes(model: &StateSpace<Discrete>, changes: &[SystemSlope], omega: f64) -> Vec<Vec<c64>> {
    let z = model.time().boundary(omega);
    let (n, m, p) = (model.order(), model.inputs(), model.outputs());
    let a = model.a();
    let pencil = Mat::from_fn(n, n, |i, j| if i == j { z - a[(i, j)] } else { c64::new(-a[(i, j)], 0.0) });
    let lu = pencil.partial_piv_lu();
    let y = lu.solve(complex(model.b()));
    let x = lu.solve_transpose(complex(model.c()).transpose()).transpose().to_owned();
    let change = |slope: &SystemSlope| {
        let states = product(&slope.a, &y) + complex(slope.b.as_ref());
        let d = &x * states + product(&slope.c, &y) + complex(slope.d.as_ref());
        (0..m * p).map(|k| d[(k % p, k / p)]).collect()
    };
    changes.iter().map(change).collect()
}

/// `|g| -+ t sigma`, sigma that of the part of the error along g.
fn magnitude_interval(g: c64, v: &[f64; 3], student: f64) -> [f64; 2] {
    let size = g.norm();
    let (r, i) = if size > 0.0 { (g.re / size, g.im / size) } else { (1.0, 0.0) };
    let half = student * (r * r * v[0] + 2.0 * r * i * v[1] + i * i * v[2]).max(0.0).sqrt();
    [(size - half).max(0.0), size + half]
}

/// A mode with the intervals of its frequency and damping. For a real pole the frequency `|s| / 2 pi` is the inverse of
/// `2 pi` times the time constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeBand {
    /// The mode.
    pub mode: Mode,
    /// Standard deviation of the frequency, Hz.
    pub hz_deviation: f64,
    /// Standard deviation of the damping ratio; 0 for a real pole.
    pub zeta_deviation: f64,
    /// Interval of the frequency, Hz.
    pub hz: [f64; 2],
    /// Interval of the damping ratio.
    pub zeta: [f64; 2],
}

impl ModeBand {
    /// From the variances of frequency and damping and the half width of an interval over the deviation.
    pub(super) fn new(mode: Mode, variances: [f64; 2], student: f64) -> Self {
        let [hz, zeta] = variances.map(|v| v.max(0.0).sqrt());
        ModeBand {
            mode,
            hz_deviation: hz,
            zeta_deviation: zeta,
            hz: [(mode.hz - student * hz).max(0.0), mode.hz + student * hz],
            zeta: [mode.zeta - student * zeta, mode.zeta + student * zeta],
        }
    }
}

/// Change of frequency and damping with the pole: `s = ln(z) / ts`.
pub(super) fn mode_change(pole: c64, dz: c64, time: Discrete) -> [f64; 2] {
    let s = time.continuous_pole(pole);
    let size = s.norm();
    if !size.is_finite() || size == 0.0 {
        return [0.0; 2];
    }
    let ds = dz / pole / time.ts();
    let along = (s.re * ds.re + s.im * ds.im) / size;
    let dzeta = if pole.im == 0.0 && pole.re > 0.0 { 0.0 } else { (s.re * along / size - ds.re) / size };
    [along / TAU, dzeta]
}

fn complex(m: MatRef<'_, f64>) -> Mat<c64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0))
}

/// A real times a complex matrix.
fn product(a: &Mat<f64>, b: &Mat<c64>) -> Mat<c64> {
    Mat::from_fn(a.nrows(), b.ncols(), |i, j| {
        (0..a.ncols()).fold(c64::new(0.0, 0.0), |sum, k| sum + b[(k, j)] * a[(i, k)])
    })
}
