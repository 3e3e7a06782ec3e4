//! States without which a system has the same response: those that no input reaches and those that no output shows.

use super::{StateSpace, TimeDomain};
use crate::Result;
use crate::linalg::{Orthonormal, TINY};
use faer::{Col, Mat, MatRef, Scale};

/// Part of a direction beyond those before it, over the norm of A, from which it is one. Realisations of polynomials with 16 digits leave 1e-14
/// of a state that their response lacks; an integrator whose time is a million samples has 1e-6.
const REACHED: f64 = 1e-10;

impl<T: TimeDomain> StateSpace<T> {
    /// The same response from the states that the inputs reach and the outputs show (Kalman); the system itself where these are all.
    ///
    /// A realisation of several channels entry by entry, or over one denominator, has each integrator of the denominators several times. Those in excess
    /// are poles of every loop, on the unit circle but for rounding.
    ///
    /// # Errors
    /// Never for a valid system.
    ///
    /// ```
    /// use youla::lti::{Discrete, StateSpace};
    /// use youla::Mat;
    /// // [1 1; 1 1] / (z - 1) has one integrator, its realisation over one denominator two.
    /// let each = |c: &[f64]| vec![vec![c.to_vec(); 2]; 2];
    /// let time = Discrete::new(0.1)?;
    /// let k = StateSpace::transfer_matrix(&each(&[1.0]), &each(&[1.0, -1.0]), time)?;
    /// assert_eq!((k.order(), k.minimal()?.order()), (2, 1));
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn minimal(&self) -> Result<Self> {
        let shown = self.balanced()?.reached().dual();
        let both = shown.reached().dual();
        Ok(if both.order() < self.order() { both } else { self.clone() })
    }

    /// In an orthonormal basis of the states that the inputs reach: `V' A V`, `V' B`, `C V`.
    fn reached(&self) -> Self {
        let v = basis(self.a(), self.b());
        let a = v.transpose() * self.a() * &v;
        Self::from_checked(a, v.transpose() * self.b(), self.c() * &v, self.d().to_owned(), self.time())
    }
}

/// Orthonormal columns that span those of `[B A B A^2 B ...]` (block Arnoldi).
fn basis(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let (n, norm) = (a.nrows(), a.norm_l2().max(TINY));
    let mut found = Orthonormal::default();
    let mut next: Vec<Col<f64>> = b.col_iter().map(|c| Scale(1.0 / c.norm_l2().max(TINY)) * c.to_owned()).collect();
    while !next.is_empty() {
        let first = found.columns().len();
        for column in next {
            if found.columns().len() < n {
                found.add(column, REACHED);
            }
        }
        next = found.columns()[first..].iter().map(|v| Scale(1.0 / norm) * (a * v)).collect();
    }
    Mat::from_fn(n, found.columns().len(), |i, j| found.columns()[j][i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lti::{Discrete, frequency_response};

    /// Two loops with an integrator and a lag in common, coupled: four states over one denominator, of which the response has two integrators and
    /// one lag where the gains of the lag are of rank one.
    #[test]
    fn states_in_excess_are_left_out_and_others_kept() {
        let time = Discrete::new(0.01).unwrap();
        let gains = [[[2.0, 0.3], [0.5, 1.0]], [[1.0, 2.0], [2.0, 4.0]]];
        // gains[0] / (z - 1) + gains[1] / (z - 0.6)
        let entry = |i: usize, j: usize| {
            let [a, b] = [gains[0][i][j], gains[1][i][j]];
            vec![a + b, -0.6 * a - b]
        };
        let num = (0..2).map(|i| (0..2).map(|j| entry(i, j)).collect()).collect();
        let den = vec![vec![vec![1.0, -1.6, 0.6]; 2]; 2];
        let whole = StateSpace::transfer_matrix(&num, &den, time).unwrap();
        let found = whole.minimal().unwrap();
        assert_eq!((whole.order(), found.order()), (4, 3));
        let omega: Vec<f64> = [1e-4, 0.01, 1.0, 3.0].iter().map(|w| w / time.ts()).collect();
        let [all, some] = [&whole, &found].map(|s| frequency_response(s, &omega).unwrap());
        for k in 0..omega.len() {
            assert!((all.at(k) - some.at(k)).norm_l2() < 1e-9 * all.at(k).norm_l2());
        }
        assert_eq!(found.minimal().unwrap().order(), 3);
        // An integrator of a million samples beside a gain is none in excess.
        let slow = StateSpace::transfer_matrix(&vec![vec![vec![1.0, 1e-6 - 1.0]]], &vec![vec![vec![1.0, -1.0]]], time);
        assert_eq!(slow.unwrap().minimal().unwrap().order(), 1);
    }
}
