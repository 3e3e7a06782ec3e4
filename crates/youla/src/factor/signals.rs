//! From measured (u, y) to (alpha, beta): one filter, eq. (28) and its companion.

use super::CoprimeFactors;
use crate::linalg::{block, check_shape};
use crate::lti::{Discrete, simulate};
use crate::{Mat, MatRef, Result};

/// The signals of the Youla deviation system, samples x channels.
#[derive(Debug, Clone, PartialEq)]
pub struct YoulaSignals {
    /// `alpha = Vt u - Ut y`, the input of S (equals eta up to noise), samples x m.
    pub alpha: Mat<f64>,
    /// `beta = Mt y - Nt u` (28), the output of S plus noise (25), samples x p.
    pub beta: Mat<f64>,
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
        let filtered = self.filter(block(&[&[u, y]]).as_ref())?;
        let (alpha, beta) = filtered.split_at_col(m);
        Ok(YoulaSignals { alpha: alpha.to_owned(), beta: beta.to_owned() })
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
        Ok(self.filter(block(&[&[v1, minus_v2.as_ref()]]).as_ref())?.subcols(0, self.inputs()).to_owned())
    }

    /// Samples after which a transient of the signal filter has decayed to `fraction` (for example 1e-3).
    ///
    /// # Errors
    /// [`crate::Error::NoConvergence`] of the eigenvalues.
    pub fn settling_samples(&self, fraction: f64) -> Result<usize> {
        let slowest = self.left().system().worst_pole()?.map_or(0.0, |p| p.norm());
        Ok(if slowest == 0.0 { 0 } else { (fraction.ln() / slowest.ln()).ceil() as usize })
    }

    fn filter(&self, signals: MatRef<'_, f64>) -> Result<Mat<f64>> {
        let filter = self.left().system();
        simulate(filter, signals, &vec![0.0; filter.order()])
    }
}
