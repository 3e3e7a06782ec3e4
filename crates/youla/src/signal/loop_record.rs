//! The record of a loop: inputs and outputs of the plant, and what is known of the signals that drive the loop from outside.

use super::Channel;
use crate::linalg::{block, check_finite, check_shape};
use crate::lti::Discrete;
use crate::{Mat, MatRef, Result};

/// The record of a loop, samples x channels, row k at time `k ts`.
///
/// ```text
/// u = K (y - r) + d            d: `input_excitation`,  r: `reference`
/// u = F x^ + alpha             alpha of an observer-based controller
/// ```
/// Inputs u are those that the plant received, outputs y those that the sensors measured. What is not known of the excitation stays out.
///
/// ```
/// use youla::{Mat, lti::Discrete, signal::LoopRecord};
/// let (u, y) = (Mat::zeros(100, 2), Mat::zeros(100, 1));
/// let record = LoopRecord::new(Discrete::new(1e-3)?, u.clone(), y)?.with_input_excitation(u)?.named("run 1");
/// assert_eq!((record.samples(), record.inputs(), record.outputs()), (100, 2, 1));
/// # Ok::<(), youla::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LoopRecord {
    name: String,
    time: Discrete,
    u: Mat<f64>,
    y: Mat<f64>,
    input_excitation: Option<Mat<f64>>,
    reference: Option<Mat<f64>>,
    alpha: Option<Mat<f64>>,
    disturbance: Option<Mat<f64>>,
    output_errors: Option<Mat<f64>>,
    channels: Option<[Vec<Channel>; 2]>,
}

impl LoopRecord {
    /// Inputs u, N x m, and outputs y, N x p, of the plant.
    ///
    /// # Errors
    /// [`crate::Error::Shape`] for unequal lengths, [`crate::Error::NotFinite`] with the place of the number.
    pub fn new(time: Discrete, u: Mat<f64>, y: Mat<f64>) -> Result<Self> {
        check_finite("u", u.as_ref())?;
        let record = LoopRecord {
            name: String::new(),
            time,
            u,
            y: Mat::new(),
            input_excitation: None,
            reference: None,
            alpha: None,
            disturbance: None,
            output_errors: None,
            channels: None,
        };
        let columns = y.ncols();
        Ok(LoopRecord { y: record.signal("y", y, columns)?, ..record })
    }

    /// With the excitation d that was added to the plant inputs behind the controller, N x m.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_input_excitation(self, d: Mat<f64>) -> Result<Self> {
        let d = self.signal("the excitation of the inputs", d, self.inputs())?;
        Ok(LoopRecord { input_excitation: Some(d), ..self })
    }

    /// With the reference r of the outputs, N x p.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_reference(self, r: Mat<f64>) -> Result<Self> {
        let r = self.signal("the reference", r, self.outputs())?;
        Ok(LoopRecord { reference: Some(r), ..self })
    }

    /// With the signal alpha that was added to the command of an observer-based controller, N x m.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_alpha(self, alpha: Mat<f64>) -> Result<Self> {
        let alpha = self.signal("alpha", alpha, self.inputs())?;
        Ok(LoopRecord { alpha: Some(alpha), ..self })
    }

    /// With additive disturbances of the outputs whose shape is known and whose size is not, N x signals, for example
    /// [`crate::identify::subspace::lines`].
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_disturbance(self, signals: Mat<f64>) -> Result<Self> {
        let columns = signals.ncols();
        let signals = self.signal("the disturbance", signals, columns)?;
        Ok(LoopRecord { disturbance: Some(signals), ..self })
    }

    /// With known errors of the measured outputs, N x p, which the controller saw: wrong samples of a sensor, as the check of the data finds
    /// them. The model is that of `y` without them; the law of the controller is that of `y` as it is.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_output_errors(self, errors: Mat<f64>) -> Result<Self> {
        let errors = self.signal("the errors of the outputs", errors, self.outputs())?;
        Ok(LoopRecord { output_errors: Some(errors), ..self })
    }

    /// With the same excitation and other inputs and outputs, without disturbances of known shape and errors: a further experiment.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_response(&self, u: Mat<f64>, y: Mat<f64>) -> Result<Self> {
        let (u, y) = (self.signal("u", u, self.inputs())?, self.signal("y", y, self.outputs())?);
        Ok(LoopRecord { u, y, disturbance: None, output_errors: None, ..self.clone() })
    }

    /// With names and units of inputs and outputs, for messages and figures.
    #[must_use]
    pub fn with_channels(self, inputs: Vec<Channel>, outputs: Vec<Channel>) -> Self {
        LoopRecord { channels: Some([inputs, outputs]), ..self }
    }

    /// With a name, which messages state.
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Self {
        LoopRecord { name: name.into(), ..self }
    }

    fn signal(&self, what: &str, signal: Mat<f64>, columns: usize) -> Result<Mat<f64>> {
        check_shape(what, signal.as_ref(), (self.samples(), columns))?;
        check_finite(what, signal.as_ref())?;
        Ok(signal)
    }

    /// Its name; empty where none was given.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its sample time.
    pub fn time(&self) -> Discrete {
        self.time
    }

    /// Samples N.
    pub fn samples(&self) -> usize {
        self.u.nrows()
    }

    /// Inputs m of the plant.
    pub fn inputs(&self) -> usize {
        self.u.ncols()
    }

    /// Outputs p of the plant.
    pub fn outputs(&self) -> usize {
        self.y.ncols()
    }

    /// u, N x m.
    pub fn u(&self) -> MatRef<'_, f64> {
        self.u.as_ref()
    }

    /// y, N x p.
    pub fn y(&self) -> MatRef<'_, f64> {
        self.y.as_ref()
    }

    /// d, N x m.
    pub fn input_excitation(&self) -> Option<MatRef<'_, f64>> {
        self.input_excitation.as_ref().map(|d| d.as_ref())
    }

    /// r, N x p.
    pub fn reference(&self) -> Option<MatRef<'_, f64>> {
        self.reference.as_ref().map(|r| r.as_ref())
    }

    /// alpha, N x m.
    pub fn alpha(&self) -> Option<MatRef<'_, f64>> {
        self.alpha.as_ref().map(|alpha| alpha.as_ref())
    }

    /// Disturbances of known shape, N x signals.
    pub fn disturbance(&self) -> Option<MatRef<'_, f64>> {
        self.disturbance.as_ref().map(|w| w.as_ref())
    }

    /// Known errors of the measured outputs.
    pub fn output_errors(&self) -> Option<MatRef<'_, f64>> {
        self.output_errors.as_ref().map(|e| e.as_ref())
    }

    /// Names and units of inputs and outputs, where they were given.
    pub fn channels(&self) -> Option<&[Vec<Channel>; 2]> {
        self.channels.as_ref()
    }

    /// All known external signals side by side, N x their channels; `None` where none is known.
    pub fn excitation(&self) -> Option<Mat<f64>> {
        let known: Vec<_> = [self.input_excitation(), self.reference(), self.alpha()].into_iter().flatten().collect();
        (!known.is_empty()).then(|| block(&[&known]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;

    #[test]
    fn unequal_lengths_and_numbers_that_are_none_are_refused_by_name() {
        let time = Discrete::new(1.0).unwrap();
        let record = || LoopRecord::new(time, Mat::zeros(10, 2), Mat::zeros(10, 1)).unwrap();
        assert!(matches!(LoopRecord::new(time, Mat::zeros(10, 1), Mat::zeros(9, 1)), Err(Error::Shape { .. })));
        assert!(matches!(record().with_reference(Mat::zeros(10, 2)), Err(Error::Shape { .. })));
        let mut d = Mat::zeros(10, 2);
        d[(3, 1)] = f64::NAN;
        assert!(matches!(record().with_input_excitation(d), Err(Error::NotFinite { .. })));
        let known = record().with_alpha(Mat::zeros(10, 2)).unwrap().with_reference(Mat::zeros(10, 1)).unwrap();
        assert_eq!(known.excitation().map(|x| x.ncols()), Some(3));
        assert!(record().excitation().is_none());
    }
}
