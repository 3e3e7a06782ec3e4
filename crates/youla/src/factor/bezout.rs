//! The Bezout identity (15) as a number: how exactly the two factor systems are inverses of each other.

use super::CoprimeFactors;
use crate::lti::{TimeDomain, frequency_response};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};

/// Bezout residual beyond which factors of an arbitrary controller are refused.
const ACCEPTED_RESIDUAL: f64 = 1e-9;

/// Frequencies at which it is computed.
const FREQUENCIES: usize = 12;

/// Their distance to those of the poles, as a factor: a pole on the stability boundary must not be hit.
const BESIDE_POLES: f64 = 1.3;

impl<T: TimeDomain> CoprimeFactors<T> {
    /// Largest relative residual of (15) in both orders over the angular frequencies `omega` (rad/s):
    ///
    /// ```text
    /// max over w of  || R(w) L(w) - I || / (||R|| ||L||)   and   || L(w) R(w) - I || / (||R|| ||L||)     (Frobenius)
    /// ```
    ///
    /// A number far above 1e-12 says that the factors were lost in rounding, usually by states of very different scale.
    ///
    /// # Errors
    /// As [`frequency_response`].
    pub fn bezout_residual(&self, omega: &[f64]) -> Result<f64> {
        let right = frequency_response(self.right().system(), omega)?;
        let left = frequency_response(self.left().system(), omega)?;
        let residual = |k: usize| {
            let (r, l) = (right.at(k), left.at(k));
            let scale = (r.norm_l2() * l.norm_l2()).max(1.0);
            distance_to_identity(r, l).max(distance_to_identity(l, r)) / scale
        };
        Ok((0..omega.len()).map(residual).fold(0.0, f64::max))
    }

    /// The factors, unless their Bezout residual shows that they were lost in rounding.
    pub(super) fn without_loss(self) -> Result<Self> {
        let residual = self.bezout_residual(&self.probed_frequencies()?)?;
        if residual <= ACCEPTED_RESIDUAL {
            return Ok(self);
        }
        let what = "the coprime factorisation of the nominal model and the controller".to_owned();
        let condition =
            "the two are so near to a loop that is not well posed or not stable that the Bezout identity is \
                         lost to rounding"
                .to_owned();
        Err(Error::NoSolution { what, condition, residual })
    }

    /// Frequencies beside those of the poles, evenly through their list with both ends, in discrete time up to Nyquist.
    fn probed_frequencies(&self) -> Result<Vec<f64>> {
        let time = self.nominal().time();
        let poles = [self.right().system().poles()?, self.left().system().poles()?].concat();
        let nyquist = time.sample_time().map(|ts| std::f64::consts::PI / ts);
        let mut omega: Vec<f64> = poles.into_iter().map(|p| BESIDE_POLES * time.continuous_pole(p).norm()).collect();
        omega.retain(|w| w.is_finite() && nyquist.is_none_or(|n| *w < n));
        omega.extend(nyquist);
        let highest = omega.iter().copied().fold(0.0, f64::max);
        omega.retain(|w| *w > 1e-8 * highest);
        omega.sort_by(f64::total_cmp);
        let count = FREQUENCIES.min(omega.len());
        Ok((0..count).map(|k| omega[k * (omega.len() - 1) / (count - 1).max(1)]).collect())
    }
}

fn distance_to_identity(x: MatRef<'_, c64>, y: MatRef<'_, c64>) -> f64 {
    (x * y - Mat::<c64>::identity(x.nrows(), x.nrows())).norm_l2()
}
