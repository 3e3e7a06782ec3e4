//! What follows from the covariance of the parameters: responses, modes and zeros, and the verdict in words.

use super::GreyBoxIntervals;
use super::response::{ModeBand, Reach, ResponseBand, SystemSlope, mode_change, response_changes};
use super::zeros::zero_changes;
use crate::Result;
use crate::delays::Shifted;
use crate::prediction::sampled::SampledSlope;
use youla::Mat;
use youla::lti::{Discrete, Eigen, Mode, StateSpace, frequency_response};
use youla::statistics::{ellipse, two_sided_student};

impl GreyBoxIntervals {
    /// The frequency response of the plant at the angular frequencies `omega`, rad/s, with its regions.
    ///
    /// # Errors
    /// As [`frequency_response`].
    pub fn response(&self, omega: &[f64]) -> Result<ResponseBand> {
        let response = frequency_response(&self.model, omega)?;
        let reach = Reach { student: self.half_width(), ellipse: ellipse(self.level, self.degrees_of_freedom as f64) };
        let changes = |w: f64| response_changes(&self.model, &self.slopes, w);
        Ok(ResponseBand::by_changes(response, changes, |slopes| self.variances(slopes), reach))
    }

    /// The modes of the plant with their intervals, in the order of [`StateSpace::modes`]; those of delays have none.
    ///
    /// # Errors
    /// [`youla::Error::NoConvergence`] of the eigenvalues.
    pub fn modes(&self) -> Result<Vec<ModeBand>> {
        let eigen = Eigen::new(&self.model)?;
        let slopes = |mode: &Mode| -> Vec<[f64; 2]> {
            let of = |slope: &SystemSlope| mode_change(mode.pole, eigen.change(mode.pole, &slope.a), self.model.time());
            self.slopes.iter().map(of).collect()
        };
        Ok(self.model.modes()?.into_iter().map(|mode| self.band(mode, &slopes(&mode))).collect())
    }

    /// The invariant zeros of a plant with as many inputs as outputs as modes, with their intervals: anti-resonances, and the
    /// zeros that sampling adds.
    ///
    /// # Errors
    /// [`youla::Error::Ports`] for a plant that is not square, [`youla::Error::NoConvergence`].
    pub fn zeros(&self) -> Result<Vec<ModeBand>> {
        let zeros = zero_changes(&self.model, &self.slopes)?;
        Ok(zeros.into_iter().map(|(zero, slopes)| self.band(zero, &slopes)).collect())
    }

    /// Half the width of an interval over the standard deviation.
    pub fn half_width(&self) -> f64 {
        two_sided_student(self.level, self.degrees_of_freedom as f64)
    }

    /// One sentence on whether the assumption behind the intervals passes its test.
    pub fn verdict(&self) -> String {
        let test = &self.residuals;
        let (lag, largest) = test.largest_autocorrelation();
        let colour = self.colour.iter().copied().fold(0.0, f64::max);
        let noise = match (test.white(), self.coloured) {
            (true, false) => "The residuals are white, as the intervals take them to be".to_owned(),
            (true, true) => "The residuals are white; the intervals would count their colour".to_owned(),
            (false, counted) => format!(
                "The residuals are coloured (auto-correlation {largest:.2} at lag {lag}), and the intervals {} (deviations up to \
                 {colour:.2} times those of white residuals)",
                if counted { "count that" } else { "do not count that" }
            ),
        };
        let cross = &test.cross;
        let inputs = if test.independent() {
            "they do not depend on past inputs".to_owned()
        } else {
            format!(
                "they depend on past inputs (output {} on input {} {} samples before: {:.1} standard deviations), so that the \
                 structure lacks something that no interval counts",
                cross.output + 1,
                cross.input + 1,
                cross.lag,
                cross.deviations.abs()
            )
        };
        format!("{noise}; {inputs}.")
    }

    fn band(&self, mode: Mode, slopes: &[[f64; 2]]) -> ModeBand {
        let [hz, _, zeta] = self.variances(slopes);
        ModeBand::new(mode, [hz, zeta], self.half_width())
    }

    /// Covariance `[11, 12, 22]` of two quantities from their slopes with respect to each parameter.
    fn variances(&self, slopes: &[[f64; 2]]) -> [f64; 3] {
        let product = |a: usize, b: usize| {
            let row = |j: usize| (0..slopes.len()).map(|k| self.covariance[(j, k)] * slopes[k][b]).sum::<f64>();
            (0..slopes.len()).map(|j| slopes[j][a] * row(j)).sum()
        };
        [product(0, 0), product(0, 1), product(1, 1)]
    }
}

/// The slopes of the sampled plant as changes of its matrices, those of delays behind.
pub(super) fn slopes_with_delays(
    plant: &StateSpace<Discrete>,
    slopes: &[SampledSlope],
    shifted: &Shifted<'_>,
) -> Result<Vec<SystemSlope>> {
    let (n, m, p) = (plant.order(), plant.inputs(), plant.outputs());
    let system = |part: &dyn Fn(usize, usize, usize) -> f64| {
        let matrix = |which: usize, rows, columns| Mat::from_fn(rows, columns, |i, j| part(which, i, j));
        let model = StateSpace::new(matrix(0, n, n), matrix(1, n, m), matrix(2, p, n), matrix(3, p, m), plant.time())?;
        shifted.delays.put_before(model)
    };
    // The delays' own entries are constant.
    let unmoved = system(&|_, _, _| 0.0)?;
    let change = |slope: &SampledSlope| {
        let entry = |which: usize, i: usize, j: usize| match which {
            0 => slope.states[(i, j)],
            1 => slope.states[(i, n + j)],
            2 => slope.outputs[(i, j)],
            _ => slope.outputs[(i, n + j)],
        };
        let moved = system(&entry)?;
        Ok(SystemSlope {
            a: moved.a() - unmoved.a(),
            b: moved.b() - unmoved.b(),
            c: moved.c() - unmoved.c(),
            d: moved.d() - unmoved.d(),
        })
    };
    slopes.iter().map(change).collect()
}
