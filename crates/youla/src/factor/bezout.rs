//! The Bezout identity (15) as a number: how exactly the two factor systems are inverses of each other.

use super::CoprimeFactors;
use crate::Result;
use crate::lti::{TimeDomain, frequency_response};
use faer::{Mat, MatRef, c64};

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
}

fn distance_to_identity(x: MatRef<'_, c64>, y: MatRef<'_, c64>) -> f64 {
    (x * y - Mat::<c64>::identity(x.nrows(), x.nrows())).norm_l2()
}
