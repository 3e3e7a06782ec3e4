//! Errors of the response that are not small: beyond first order in the parameters.
//!
//! ```text
//! |dG|^2 = sum_k |d_k|^2 - |d v|^2 + max over s of |G(theta + s root v) - G(theta)|^2 / s^2,        v the unit error along which G moves most
//! ```
//! Beside a pole at distance a from z, a movement of the pole by s moves the response by `s / |a - s|` of itself, not by `s / a`: the response of an
//! integrator whose pole is estimated at 1 - a lies beyond every multiple of the deviation to first order as the frequency falls, though the pole is
//! less than two deviations off. Steps of one and two deviations on both sides hold it where it lies within two.

use super::{Directions, delayed};
use crate::identify::likelihood::deviation::response_error::ResponseError;
use faer::c64;

/// Steps along the error, in deviations.
const STEPS: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];
/// A deviation below this share of the response is that to first order: the terms of second order change it by less than a tenth.
const SMALL: f64 = 0.05;

impl Directions {
    /// Mean squares of the errors of the entries of `g` by the parameters, of which `errors` and `squares` are those to first order.
    ///
    /// Where each output has parameters of its own (eight outputs and more) it is to first order: a step of all parameters for every entry would cost
    /// their number squared.
    pub(super) fn finite(&self, share: f64, g: &[c64], errors: &ResponseError, squares: &[f64]) -> Vec<f64> {
        let of = |(i, square): (usize, &f64)| match errors.own.is_empty() && square.sqrt() > SMALL * g[i].norm() {
            true => self.finite_entry(share, (i, g[i]), errors, *square),
            false => *square,
        };
        squares.iter().enumerate().map(of).collect()
    }

    fn finite_entry(&self, share: f64, (entry, g): (usize, c64), errors: &ResponseError, square: f64) -> f64 {
        let row = errors.shared.row(entry);
        // The major axis of the ellipse of the error lies at half the angle of sum d_k^2.
        let turn = c64::cis(-0.5 * row.iter().map(|d| d * d).sum::<c64>().arg());
        let along: Vec<f64> = row.iter().map(|d| (d * turn).re).collect();
        let first = along.iter().map(|d| d * d).sum::<f64>();
        let moved = |s: f64| {
            let step: Vec<f64> = along.iter().map(|d| s * d / first.sqrt()).collect();
            let (model, delays) = self.moved(&step);
            (delayed(&model, delays, share)[entry] - g).norm_sqr() / (s * s)
        };
        let most = STEPS.into_iter().map(moved).filter(|square| square.is_finite()).fold(first, f64::max);
        square - first + most
    }
}

#[cfg(test)]
mod tests {
    use super::{Directions, c64};
    use crate::Mat;
    use crate::identify::likelihood::deviation::root::Root;
    use crate::identify::likelihood::search::chart::Chart;
    use crate::identify::likelihood::search::model::Model;

    const SHARE: f64 = 2e-4;

    /// A pole at 1 - `distance` that is known to `deviation`: the stated deviation of its response, to first order and as it is.
    fn deviations(distance: f64, deviation: f64) -> [f64; 2] {
        let one = Mat::<f64>::identity(1, 1);
        let model = Model::of((&one * (1.0 - distance)).as_ref(), one.as_ref(), one.as_ref(), vec![0.0]).unwrap();
        // A alone moves.
        let mut chart = Chart::fixed(&model);
        chart.directions[0] = Mat::from_fn(3, 1, |i, _| if i == 0 { 1.0 } else { 0.0 });
        let root = Root::dense(&one * deviation);
        let directions = Directions::of_parts((model, vec![0]), chart, root, Vec::new());
        [directions.columns(SHARE).squares[0], directions.parts(SHARE).noise[0]].map(f64::sqrt)
    }

    fn response(distance: f64) -> c64 {
        (c64::cis(std::f64::consts::TAU * SHARE) - (1.0 - distance)).inv()
    }

    /// The pole of an integrator is estimated 1.9 of its deviations inside the circle, so that the true response lies five deviations to first
    /// order beside the estimate, and within two as they are.
    #[test]
    fn the_response_of_an_integrator_is_held() {
        let (distance, deviation) = (0.0038, 0.002);
        let error = (response(0.0) - response(distance)).norm();
        let [first, stated] = deviations(distance, deviation);
        assert!(error / first > 5.0 && error / stated < 2.0, "{error} {first} {stated}");
        let moved = (response(distance - 2.0 * deviation) - response(distance)).norm() / 2.0;
        assert!((stated / moved - 1.0).abs() < 1e-9, "{stated} {moved}");
    }

    #[test]
    fn a_small_error_is_that_to_first_order() {
        let [first, stated] = deviations(0.05, 0.002);
        assert_eq!(first, stated);
        let [first, stated] = deviations(0.03, 0.002);
        assert!((stated / first - 1.0).abs() < 0.2, "{first} {stated}");
    }
}
