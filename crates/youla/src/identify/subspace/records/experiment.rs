//! The records of one experiment.

use crate::signal::LoopRecord;
use faer::MatRef;

/// Records of one experiment, as views: row k is time k.
///
/// ```
/// use youla::{Mat, identify::subspace::{Experiment, lines}, lti::Discrete};
/// let (u, y) = (Mat::zeros(100, 2), Mat::zeros(100, 1));
/// let hum = lines(&[50.0], 100, Discrete::new(1e-3)?)?;
/// let experiment = Experiment::new(u.as_ref(), y.as_ref()).with_disturbance(hum.as_ref());
/// assert_eq!(experiment.disturbance.map(|w| w.ncols()), Some(2));
/// # Ok::<(), youla::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Experiment<'a> {
    /// Inputs, N x m.
    pub u: MatRef<'a, f64>,
    /// Outputs, N x p.
    pub y: MatRef<'a, f64>,
    /// Disturbances of the outputs, of known shape and unknown size, N x signals: see [`crate::identify::subspace::lines`] and [`crate::identify::subspace::harmonics`].
    pub disturbance: Option<MatRef<'a, f64>>,
}

/// Inputs and outputs of a loop with the disturbances of known shape.
impl<'a> From<&'a LoopRecord> for Experiment<'a> {
    fn from(record: &'a LoopRecord) -> Self {
        Experiment { u: record.u(), y: record.y(), disturbance: record.disturbance() }
    }
}

impl<'a> Experiment<'a> {
    /// Inputs and outputs without a known disturbance. Shapes and values are checked by the method that takes the experiment.
    pub fn new(u: MatRef<'a, f64>, y: MatRef<'a, f64>) -> Self {
        Experiment { u, y, disturbance: None }
    }

    /// With additive disturbances of the outputs whose shape is known: `y = (model) + signals a + noise`. The coefficients a,
    /// signals x outputs, are found for each experiment on its own.
    #[must_use]
    pub fn with_disturbance(self, signals: MatRef<'a, f64>) -> Self {
        Experiment { disturbance: Some(signals), ..self }
    }

    /// The known disturbances; no columns where there are none.
    pub(crate) fn known(&self) -> MatRef<'a, f64> {
        self.disturbance.unwrap_or(self.y.subcols(0, 0))
    }
}
