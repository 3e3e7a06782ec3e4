//! What forbids a factorisation, found out by other means than those of the library: the test of Popov, Belevitch and Hautus
//! and the closed loop, both in the coordinates in which the plant was drawn.

use super::draw::Drawn;
use youla::control::{closed_loop, with_input_port};
use youla::linalg::eigenvalues;
use youla::lti::{StateSpace, TimeDomain, frequency_response};
use youla::{Mat, c64};

/// Distances below which a mode counts as out of reach, or as lying on the stability boundary.
pub(crate) const NEAR: f64 = 1e-6;

/// How near a plant is to one that cannot be stabilised.
pub(crate) struct Nearness {
    /// Smallest singular value of `[A - p I, B]` over the modes p that are not clearly stable, relative to A.
    pub(crate) reach: f64,
    /// Smallest distance of a mode to the stability boundary, relative to A.
    pub(crate) boundary: f64,
}

impl Nearness {
    pub(crate) fn of<T: TimeDomain>(core: &StateSpace<T>) -> Self {
        let (n, m, a, time) = (core.order(), core.inputs(), core.a(), core.time());
        let size = a.norm_l2().max(if time.sample_time().is_some() { 1.0 } else { f64::MIN_POSITIVE });
        let mut nearness = Nearness { reach: f64::INFINITY, boundary: f64::INFINITY };
        for p in core.poles().unwrap() {
            let beyond = time.instability(p) / size;
            nearness.boundary = nearness.boundary.min(beyond.abs());
            if beyond > -NEAR {
                let pencil = Mat::from_fn(n, n + m, |i, j| match j.checked_sub(n) {
                    Some(j) => c64::new(core.b()[(i, j)], 0.0),
                    None => c64::new(a[(i, j)], 0.0) - if i == j { p } else { c64::new(0.0, 0.0) },
                });
                let values = pencil.singular_values().unwrap();
                nearness.reach = nearness.reach.min(values.last().unwrap() / size);
            }
        }
        nearness
    }

    /// Whether no stabilising solution is to be had in double precision.
    pub(crate) fn is_hard(&self) -> bool {
        self.reach <= NEAR || self.boundary <= NEAR
    }
}

/// The poles of the loop farthest beyond the stability boundary, relative to the largest; none where the loop is not well
/// posed.
pub(crate) fn worst_of_loop<T: TimeDomain>(plant: &StateSpace<T>, controller: &StateSpace<T>) -> Option<f64> {
    let closed = closed_loop(plant, &with_input_port(controller).unwrap()).ok()?;
    Some(worst(closed.poles().unwrap(), plant.time()))
}

/// Largest condition number of `[I -K; -G I]` over frequency, in the units of the draw: how near the loop is to one that is
/// not well posed or not stable.
pub(crate) fn condition_of_loop<T: TimeDomain>(drawn: &Drawn<T>, controller: &StateSpace<T>, omega: &[f64]) -> f64 {
    let (Ok(g), Ok(k)) = (frequency_response(&drawn.plant, omega), frequency_response(controller, omega)) else {
        return f64::INFINITY;
    };
    let (m, p) = (drawn.input.len(), drawn.output.len());
    let condition = |w: usize| {
        let whole = Mat::from_fn(m + p, m + p, |i, j| match (i < m, j < m) {
            (true, false) => -k.at(w)[(i, j - m)] * drawn.input[i] * drawn.output[j - m],
            (false, true) => -g.at(w)[(i - m, j)] / drawn.input[j] / drawn.output[i - m],
            _ => c64::new(f64::from(i == j), 0.0),
        });
        let values = whole.singular_values().unwrap();
        values[0] / values[m + p - 1]
    };
    (0..omega.len()).map(condition).fold(0.0, f64::max)
}

/// The same of `A + B F`, in the coordinates of the draw.
pub(crate) fn worst_of_feedback<T: TimeDomain>(drawn: &Drawn<T>, f: &Mat<f64>) -> f64 {
    let Drawn { core, state, input, .. } = drawn;
    let f = Mat::from_fn(f.nrows(), f.ncols(), |i, j| f[(i, j)] * input[i] / state[j]);
    worst(eigenvalues("A + B F", (core.a() + core.b() * f).as_ref()).unwrap(), core.time())
}

fn worst<T: TimeDomain>(poles: Vec<c64>, time: T) -> f64 {
    let size = poles.iter().map(|p| p.norm()).fold(1.0, f64::max);
    poles.into_iter().map(|p| time.instability(p)).fold(f64::NEG_INFINITY, f64::max) / size
}
