//! Scaling of states: a similarity by powers of two, which rounds nothing but saves digits where units differ by orders
//! of magnitude (um against um/s).

use super::{StateSpace, TimeDomain};
use crate::Result;
use crate::linalg::{balance, block};
use faer::Mat;

impl<T: TimeDomain> StateSpace<T> {
    /// The factors t (powers of two) of the states `x = diag(t) z` in which the rows and columns of `[A B; C 0]` have
    /// like norms.
    ///
    /// # Errors
    /// Never for a valid system.
    pub fn state_scales(&self) -> Result<Vec<f64>> {
        let (n, m, p) = (self.order(), self.inputs(), self.outputs());
        let io = m.max(p);
        let mut b = Mat::zeros(n, io);
        b.as_mut().subcols_mut(0, m).copy_from(self.b());
        let mut c = Mat::zeros(io, n);
        c.as_mut().subrows_mut(0, p).copy_from(self.c());
        let zero = Mat::zeros(io, io);
        let all = block(&[&[self.a(), b.as_ref()], &[c.as_ref(), zero.as_ref()]]);
        let mut scale = balance("the system", all.as_ref())?.scale;
        scale.truncate(n);
        Ok(scale)
    }

    /// The same system in the states z of `x = diag(scale) z`: `(T^-1 A T, T^-1 B, C T, D)`.
    ///
    /// # Panics
    /// When there is not one factor per state.
    pub fn with_scaled_states(&self, scale: &[f64]) -> Self {
        let n = self.order();
        assert_eq!(scale.len(), n, "one factor per state");
        let a = Mat::from_fn(n, n, |i, j| self.a()[(i, j)] * scale[j] / scale[i]);
        let b = Mat::from_fn(n, self.inputs(), |i, j| self.b()[(i, j)] / scale[i]);
        let c = Mat::from_fn(self.outputs(), n, |i, j| self.c()[(i, j)] * scale[j]);
        Self::from_checked(a, b, c, self.d().to_owned(), self.time())
    }

    /// The same system in balanced states, [`Self::state_scales`].
    ///
    /// # Errors
    /// Never for a valid system.
    pub fn balanced(&self) -> Result<Self> {
        Ok(self.with_scaled_states(&self.state_scales()?))
    }
}
