//! The gains of a controller that is a PID, whatever form it was stated in.
//!
//! The filter follows from the pole that is neither 0 nor 1, p: `filter = p ts / (1 - p)` by backward differences,
//! `filter = ts/2 (1 + p) / (1 - p)` by Tustin's rule; the gains from the response, which is linear in them.

use super::pid::{Discretisation, PidController, PidGains};
use super::scenarios::Grid;
use crate::error::Result;
use youla::linalg::least_squares;
use youla::lti::{Discrete, StateSpace, frequency_response};
use youla::{Mat, c64};

/// A response that is nearer than this, relative to its size, is the same. Rounding of coefficients with six digits passes.
const SAME: f64 = 1e-4;
/// A pole nearer to 0 or 1 than this is there. Chosen, not measured.
const AT: f64 = 1e-6;

/// The PID of one of the rules that `u = K y` is, with the dead time of its machine; `None` where it is none.
pub(super) fn recognise(
    grid: &Grid,
    k: &StateSpace<Discrete>,
    rules: &[Discretisation],
    delay: usize,
) -> Result<Option<PidController>> {
    let poles = k.poles()?;
    let lag = poles.iter().filter(|p| p.norm() > AT && (**p - 1.0).norm() > AT).collect::<Vec<_>>();
    let pole = match lag[..] {
        [] => 0.0,
        [p] if p.re < 1.0 && p.im == 0.0 => p.re,
        _ => return Ok(None),
    };
    let integral = poles.iter().any(|p| (p - 1.0).norm() < AT);
    let response = frequency_response(k, &grid.omega)?.entry(0, 0);
    for rule in rules {
        let filter = match rule {
            Discretisation::BackwardEuler => pole * grid.ts / (1.0 - pole),
            Discretisation::Tustin => 0.5 * grid.ts * (1.0 + pole) / (1.0 - pole),
        };
        if filter < 0.0 || (*rule == Discretisation::Tustin && filter == 0.0) {
            continue;
        }
        let found = fitted(grid, &response, (*rule, filter), integral, delay)?;
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
}

fn fitted(
    grid: &Grid,
    response: &[c64],
    (discretisation, derivative_filter): (Discretisation, f64),
    integral: bool,
    delay: usize,
) -> Result<Option<PidController>> {
    let of = |kp, ki, kd| {
        let gains = PidGains { discretisation, kp, ki, kd, derivative_filter };
        let c = PidController { gains, notches: Vec::new(), delay };
        grid.q.iter().map(|q| c.at(grid.ts, *q)).map(|[n, d]| n / d).collect::<Vec<c64>>()
    };
    // Parts of one size each, so that the least squares are well conditioned; each line relative to the response.
    let units = [1.0, if integral { 1.0 / grid.ts } else { 0.0 }, grid.ts];
    let parts = [of(units[0], 0.0, 0.0), of(0.0, units[1], 0.0), of(0.0, 0.0, units[2])];
    let lines = response.len();
    let split = |z: c64, i: usize| if i < lines { z.re } else { z.im };
    let relative = |z: c64, i: usize| split(z / response[i % lines].norm().max(1e-300), i);
    let a = Mat::from_fn(2 * lines, 3, |i, j| relative(parts[j][i % lines], i));
    let b = Mat::from_fn(2 * lines, 1, |i, _| relative(-response[i % lines], i));
    let x = least_squares("the gains of the running controller", a.as_ref(), b.as_ref())?.x;
    let none = 1e-9 * x.norm_max();
    let gain = |j: usize| if x[(j, 0)].abs() > none { x[(j, 0)] * units[j] } else { 0.0 };
    let gains = PidGains { discretisation, kp: gain(0), ki: gain(1), kd: gain(2), derivative_filter };
    let error = (&a * &x - &b).norm_max();
    Ok((error < SAME).then_some(PidController { gains, notches: Vec::new(), delay }))
}
