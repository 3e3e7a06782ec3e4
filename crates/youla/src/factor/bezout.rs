//! The Bezout identity (15) as a number: how exactly the two factor systems are inverses of each other.

use super::CoprimeFactors;
use crate::lti::{StateSpace, TimeDomain, frequency_response};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};

/// Bezout residual beyond which factors of an arbitrary controller are refused.
const ACCEPTED_IDENTITY: f64 = 1e-9;

/// Relative error of G(0) or K from the left factors beyond which they are.
const ACCEPTED_FRACTIONS: f64 = 1e-8;

/// Frequencies at which both are computed.
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

    /// The factors, unless (15), or the fractions that should give G(0) and K, show that they were lost in rounding.
    pub(super) fn without_loss(self, controller: &StateSpace<T>) -> Result<Self> {
        let omega = self.probed_frequencies()?;
        let identity = self.bezout_residual(&omega)?;
        let fractions = self.fraction_residual(controller, &omega)?;
        if identity <= ACCEPTED_IDENTITY && fractions <= ACCEPTED_FRACTIONS {
            return Ok(self);
        }
        let what = "the coprime factorisation of the nominal model and the controller".to_owned();
        let condition =
            "the two are so near to a loop that is not well posed or not stable that the Bezout identity, or the \
                         model and the controller themselves, are lost to rounding"
                .to_owned();
        Err(Error::NoSolution { what, condition, residual: identity.max(fractions) })
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

    /// Largest relative residual of `Vt K = Ut` and `Mt G(0) = Nt`.
    fn fraction_residual(&self, controller: &StateSpace<T>, omega: &[f64]) -> Result<f64> {
        let left = frequency_response(self.left().system(), omega)?;
        let (g, k) = (frequency_response(self.nominal(), omega)?, frequency_response(controller, omega)?);
        let m = self.inputs();
        let residual = |i: usize| {
            let (first, second) = left.at(i).split_at_row(m);
            let (vt, ut) = first.split_at_col(m);
            let (nt, mt) = second.split_at_col(m);
            fraction_error(vt, k.at(i), ut).max(fraction_error(mt, g.at(i), nt))
        };
        Ok((0..omega.len()).map(residual).fold(0.0, f64::max))
    }
}

/// Size of `X Z + Y` relative to its terms; where Z = 0, to X.
fn fraction_error(x: MatRef<'_, c64>, z: MatRef<'_, c64>, y: MatRef<'_, c64>) -> f64 {
    let (x_size, z_size) = (x.norm_l2(), z.norm_l2());
    let size = if z_size == 0.0 { x_size } else { x_size * z_size + y.norm_l2() };
    (x * z + y).norm_l2() / size
}

fn distance_to_identity(x: MatRef<'_, c64>, y: MatRef<'_, c64>) -> f64 {
    (x * y - Mat::<c64>::identity(x.nrows(), x.nrows())).norm_l2()
}
