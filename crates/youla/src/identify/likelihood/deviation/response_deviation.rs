//! Standard deviations of the response of the recommended model.

use super::Directions;
use crate::identify::likelihood::data::spectra::Sizes;
use crate::lti::Discrete;
use crate::{Mat, MatRef};
use faer::c64;

/// Standard deviations of the frequency response.
#[derive(Debug, Clone)]
pub struct ResponseDeviation {
    /// Frequencies, Hz.
    pub hz: Vec<f64>,
    /// Root mean square of the complex error of each entry, p x m, one matrix per frequency, physical units.
    pub absolute: Vec<Mat<f64>>,
    sizes: Sizes,
    time: Discrete,
    directions: Directions,
}

impl ResponseDeviation {
    /// `stated` are frequencies as shares of the sample rate and variances there, scaled channels.
    pub(crate) fn new(
        sizes: Sizes,
        time: Discrete,
        (shares, variances): (&[f64], &[Vec<f64>]),
        directions: Directions,
    ) -> Self {
        let (m, p) = (sizes.u.len(), sizes.y.len());
        let of = |v: &Vec<f64>| Mat::from_fn(p, m, |i, j| v[i * m + j].sqrt() * sizes.y[i] / sizes.u[j]);
        let hz = shares.iter().map(|share| share / time.ts()).collect();
        ResponseDeviation { hz, absolute: variances.iter().map(of).collect(), sizes, time, directions }
    }

    /// The error at a frequency, Hz; below and above all of `hz` that at the first and at the last of them.
    pub fn at(&self, hz: f64) -> ResponseError {
        let inputs = self.sizes.u.len();
        let within = hz.max(self.hz[0]).min(self.hz[self.hz.len() - 1]);
        let mut directions = self.directions.at(within * self.time.ts());
        for k in 0..directions.ncols() {
            for i in 0..directions.nrows() {
                directions[(i, k)] *= self.sizes.y[i / inputs] / self.sizes.u[i % inputs];
            }
        }
        ResponseError { directions, inputs }
    }
}

/// The error of the response at a frequency, physical units.
#[derive(Debug, Clone)]
pub struct ResponseError {
    /// Entries of G, row by row; columns are independent errors of unit variance.
    directions: Mat<c64>,
    inputs: usize,
}

impl ResponseError {
    /// Covariance `[re re, re im, im im]` of the error of an entry (output, input).
    pub fn covariance(&self, (output, input): (usize, usize)) -> [f64; 3] {
        let row = output * self.inputs + input;
        let mut sums = [0.0; 3];
        for k in 0..self.directions.ncols() {
            let e = self.directions[(row, k)];
            sums = [sums[0] + e.re * e.re, sums[1] + e.re * e.im, sums[2] + e.im * e.im];
        }
        sums
    }

    /// Standard deviation of the magnitude of an entry with the response `g`, to first order.
    pub fn of_magnitude(&self, g: c64, (output, input): (usize, usize)) -> f64 {
        let (re, im) = if g.norm() > 0.0 { (g.re / g.norm(), g.im / g.norm()) } else { (1.0, 0.0) };
        let [rr, ri, ii] = self.covariance((output, input));
        (re * re * rr + 2.0 * re * im * ri + im * im * ii).max(0.0).sqrt()
    }

    /// Standard deviation of `Re sum_ij w_ij dG_ij`, `w` p x m: what a figure with these slopes inherits, errors of the entries that
    /// hang together included. A peak of the sensitivity is such a figure.
    pub fn along(&self, slopes: MatRef<'_, c64>) -> f64 {
        let of = |k: usize| {
            let entry = |i: usize| (self.directions[(i, k)] * slopes[(i / self.inputs, i % self.inputs)]).re;
            (0..self.directions.nrows()).map(entry).sum::<f64>()
        };
        (0..self.directions.ncols()).map(|k| of(k).powi(2)).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use crate::identify::likelihood::{Experiment, LikelihoodOptions, ResponseError, recommend};
    use crate::lti::{Discrete, frequency_response};
    use crate::{Mat, c64};
    use rand::{RngExt, SeedableRng};

    /// A first-order plant behind a dead time: its error at some frequencies, with its response there.
    fn errors(dead_time: usize) -> Vec<(ResponseError, c64)> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut random = || rng.random::<f64>() - 0.5;
        let u = Mat::from_fn(2000, 1, |_, _| random());
        let (mut x, mut y) = (0.0, Mat::zeros(2000, 1));
        for t in dead_time..2000 {
            y[(t, 0)] = x + 0.1 * random();
            x = 0.9 * x + u[(t - dead_time, 0)];
        }
        let options = LikelihoodOptions { order: Some(1), dead_time: Some(vec![dead_time]), ..Default::default() };
        let (records, time) = ([Experiment::new(u.as_ref(), y.as_ref())], Discrete::new(1e-3).unwrap());
        let found = recommend(&records, &[], None, time, &options).unwrap();
        [1.0, 5.0, 20.0, 90.0, 300.0]
            .map(|hz| {
                let g = frequency_response(&found.plant, &[std::f64::consts::TAU * hz]).unwrap().at(0)[(0, 0)];
                (found.response_deviation.at(hz), g)
            })
            .into()
    }

    /// The error turns with the response, at 90 Hz by 194 degrees. Other noise changes the deviations by a few per cent.
    #[test]
    fn the_deviation_of_the_magnitude_does_not_depend_on_a_dead_time() {
        for ((plain, g), (delayed, of_delayed)) in errors(0).iter().zip(errors(6)) {
            let ratio = delayed.of_magnitude(of_delayed, (0, 0)) / plain.of_magnitude(*g, (0, 0));
            assert!((0.85..1.15).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn a_figure_that_is_the_real_part_of_an_entry_has_its_deviation() {
        for (error, g) in errors(2) {
            let one = Mat::from_fn(1, 1, |_, _| c64::ONE);
            assert!((error.along(one.as_ref()).powi(2) / error.covariance((0, 0))[0] - 1.0).abs() < 1e-12);
            let turned = Mat::from_fn(1, 1, |_, _| g.conj() / g.norm());
            assert!((error.along(turned.as_ref()) / error.of_magnitude(g, (0, 0)) - 1.0).abs() < 1e-9);
        }
    }
}
