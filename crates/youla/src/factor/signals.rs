//! From measured (u, y) to (alpha, beta): one filter, eq. (28) and its companion.

use super::CoprimeFactors;
use crate::linalg::{block, check_shape};
use crate::lti::{Discrete, simulate_joined};
use crate::{Error, Mat, MatRef, Result};

/// The signals of the Youla deviation system S, samples x channels: what [`crate::identify::hansen::hansen`] identifies from.
#[derive(Debug, Clone)]
pub struct YoulaSignals {
    /// `[alpha beta]` as the filter gives them.
    filtered: Mat<f64>,
    inputs: usize,
    /// Known signals of a disturbance of the outputs, of the same samples.
    disturbance: Option<Mat<f64>>,
    /// Samples at the start that do not count.
    dropped: usize,
}

impl YoulaSignals {
    /// From alpha (samples x m) and beta (samples x p) that were computed elsewhere.
    ///
    /// # Errors
    /// [`crate::Error::Shape`] where they differ in length.
    pub fn new(alpha: MatRef<'_, f64>, beta: MatRef<'_, f64>) -> Result<Self> {
        check_shape("beta", beta, (alpha.nrows(), beta.ncols()))?;
        Ok(Self::of_filter(block(&[&[alpha, beta]]), alpha.ncols()))
    }

    fn of_filter(filtered: Mat<f64>, inputs: usize) -> Self {
        YoulaSignals { filtered, inputs, disturbance: None, dropped: 0 }
    }

    /// `alpha = Vt u - Ut y`, the input of S (equals eta up to noise), samples x m.
    pub fn alpha(&self) -> MatRef<'_, f64> {
        self.counted(&self.filtered).subcols(0, self.inputs)
    }

    /// `beta = Mt y - Nt u` (28), the output of S plus noise (25), samples x p.
    pub fn beta(&self) -> MatRef<'_, f64> {
        self.counted(&self.filtered).subcols(self.inputs, self.filtered.ncols() - self.inputs)
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.filtered.nrows() - self.dropped
    }

    /// Known signals of disturbances of the measured outputs, samples x signals, where there are any.
    pub(crate) fn disturbance(&self) -> Option<MatRef<'_, f64>> {
        self.disturbance.as_ref().map(|signals| self.counted(signals))
    }

    /// With disturbances of the measured outputs of known shape (samples x signals), as
    /// [`crate::identify::subspace::lines`] gives them, over all samples of the record.
    ///
    /// # Errors
    /// [`crate::Error::Shape`] for another number of samples.
    pub fn with_disturbance(self, signals: Mat<f64>) -> Result<Self> {
        check_shape("the known disturbance", signals.as_ref(), (self.filtered.nrows(), signals.ncols()))?;
        Ok(YoulaSignals { disturbance: Some(signals), ..self })
    }

    /// Without the first `samples`, in which the filter settles; nothing is copied.
    ///
    /// # Errors
    /// [`crate::Error::TooFewSamples`] where none is left.
    pub fn after(self, samples: usize) -> Result<Self> {
        if samples < self.samples() {
            return Ok(YoulaSignals { dropped: self.dropped + samples, ..self });
        }
        let what = format!("alpha and beta, of which the first {samples} samples are to be dropped");
        Err(Error::TooFewSamples { what, found: self.samples(), needed: samples.saturating_add(1) })
    }

    fn counted<'a>(&self, of: &'a Mat<f64>) -> MatRef<'a, f64> {
        of.as_ref().subrows(self.dropped, self.samples())
    }
}

impl CoprimeFactors<Discrete> {
    /// Filters measured signals to those of the deviation system,
    ///
    /// ```text
    /// [alpha; beta] = [Vt -Ut; -Nt Mt] [u; y]
    /// ```
    ///
    /// `u` (samples x m) is the plant input as applied, after saturation; `y` (samples x p) the measured output. Whatever
    /// excites the loop, alpha is its image: `alpha + Vt v1 + Ut v2` for excitations v1 at the plant input and v2 at the
    /// plant output. The filter starts at rest, so the first samples hold a transient that decays with
    /// [`Self::settling_samples`].
    ///
    /// # Errors
    /// [`crate::Error::Shape`] when the records do not fit the factors.
    pub fn signals(&self, u: MatRef<'_, f64>, y: MatRef<'_, f64>) -> Result<YoulaSignals> {
        let m = self.inputs();
        check_shape("the record of plant inputs", u, (u.nrows(), m))?;
        check_shape("the record of plant outputs", y, (u.nrows(), self.outputs()))?;
        Ok(YoulaSignals::of_filter(self.filter(&[u, y])?, m))
    }

    /// The alpha that known excitations cause: `Vt v1 + Ut v2`, with `v1` (samples x m) added at the plant input and
    /// `v2` (samples x p) added to the plant output that the controller sees (`v2 = -r` for a reference r).
    ///
    /// Agreement with the measured alpha shows that the declared controller is the one that ran.
    ///
    /// # Errors
    /// [`crate::Error::Shape`] when the records do not fit the factors.
    pub fn alpha_of_excitation(&self, v1: MatRef<'_, f64>, v2: MatRef<'_, f64>) -> Result<Mat<f64>> {
        let minus_v2 = faer::Scale(-1.0) * v2;
        check_shape("the excitation of the plant inputs", v1, (v1.nrows(), self.inputs()))?;
        check_shape("the excitation of the plant outputs", v2, (v1.nrows(), self.outputs()))?;
        Ok(self.filter(&[v1, minus_v2.as_ref()])?.subcols(0, self.inputs()).to_owned())
    }

    /// Samples after which a transient of the signal filter has decayed to `fraction` (for example 1e-3).
    ///
    /// # Errors
    /// [`crate::Error::NoConvergence`] of the eigenvalues.
    pub fn settling_samples(&self, fraction: f64) -> Result<usize> {
        let slowest = self.left().system().worst_pole()?.map_or(0.0, |p| p.norm());
        Ok(if slowest == 0.0 { 0 } else { (fraction.ln() / slowest.ln()).ceil() as usize })
    }

    fn filter(&self, signals: &[MatRef<'_, f64>]) -> Result<Mat<f64>> {
        let filter = self.left().system();
        simulate_joined(filter, signals, &vec![0.0; filter.order()])
    }
}
