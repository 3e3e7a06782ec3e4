//! The Youla-Jabr-Bongiorno-Kucera parametrisation: all plants stabilised by the controller (16)-(18), all controllers
//! that stabilise the nominal plant (21)-(22), and the deviation system S of a given plant.

use super::CoprimeFactors;
use crate::Result;
use crate::linalg::{block, eye};
use crate::lti::{Partitioned, StateSpace, TimeDomain};
use faer::{Mat, Scale};

impl<T: TimeDomain> CoprimeFactors<T> {
    /// `J_G` of (18), `(epsilon, u) -> (eta, y)`: the plant as nominal part plus the port of its deviation,
    ///
    /// ```text
    /// J_G = [-M^-1 U  M^-1; Mt^-1  G(0)]
    /// ```
    ///
    /// obtained from `right` by solving its first row for eta.
    ///
    /// # Errors
    /// [`crate::Error::Singular`] when M has no invertible feedthrough.
    pub fn j_g(&self) -> Result<Partitioned<T>> {
        self.right().exchange_first()?.with_inputs_swapped()
    }

    /// `J_K` of (22), `(y, alpha) -> (u, beta)`: the controller with the ports of Fig. 3,
    ///
    /// ```text
    /// J_K = [K  Vt^-1; V^-1  -V^-1 N]
    /// ```
    ///
    /// obtained from `left` by solving its first row for u.
    ///
    /// # Errors
    /// [`crate::Error::Singular`] when Vt has no invertible feedthrough.
    pub fn j_k(&self) -> Result<Partitioned<T>> {
        self.left().exchange_first()?.with_inputs_swapped()
    }

    /// The controller K itself, `u = K y` (positive feedback).
    ///
    /// # Errors
    /// As [`Self::j_k`].
    pub fn controller(&self) -> Result<StateSpace<T>> {
        Ok(self.j_k()?.part(0, 0))
    }

    /// `K(Q) = F_l(J_K, Q)` of (21), for Q from beta (p) to alpha (m).
    ///
    /// # Errors
    /// Ports, sample times, or a loop that is not well posed.
    pub fn controller_of(&self, q: &StateSpace<T>) -> Result<StateSpace<T>> {
        self.j_k()?.lower_lft(q)
    }

    /// `G(S) = F_u(J_G, S)` of (18), for S from eta (m) to epsilon (p): one linear fractional transformation of order
    /// n + n_S for observer-based factors, always well posed there.
    ///
    /// # Errors
    /// Ports, sample times, or a loop that is not well posed.
    pub fn plant_of(&self, s: &StateSpace<T>) -> Result<StateSpace<T>> {
        self.j_g()?.upper_lft(s)
    }

    /// `G(S) = (N + V S)(M + U S)^-1` of (16), from the right factors.
    ///
    /// # Errors
    /// Ports, sample times, or `M + U S` without invertible feedthrough.
    pub fn plant_of_right(&self, s: &StateSpace<T>) -> Result<StateSpace<T>> {
        self.right_factors_of(s)?.divide_by_first_outputs(self.inputs())
    }

    /// The right factors `[M + U S; N + V S]` of G(S): from alpha to the parts of (u, y) that alpha causes. Always stable for
    /// a stable S, whatever the plant.
    ///
    /// # Errors
    /// Ports or sample times.
    pub fn right_factors_of(&self, s: &StateSpace<T>) -> Result<StateSpace<T>> {
        let m = self.inputs();
        let c = block(&[&[Mat::zeros(m, s.order()).as_ref()], &[s.c()]]);
        let d = block(&[&[eye(m).as_ref()], &[s.d()]]);
        let column = StateSpace::new(s.a().to_owned(), s.b().to_owned(), c, d, s.time())?;
        column.then(self.right().system())
    }

    /// `G(S) = (Mt + S Ut)^-1 (Nt + S Vt)` of (17), from the left factors.
    ///
    /// # Errors
    /// Ports, sample times, or `Mt + S Ut` without invertible feedthrough.
    pub fn plant_of_left(&self, s: &StateSpace<T>) -> Result<StateSpace<T>> {
        self.residual_filter(s)?.solve_last_inputs(self.outputs())
    }

    /// The filter `[-(Nt + S Vt), Mt + S Ut]` from (u, y) to `beta - S alpha`, the noise of (25). Always stable for a
    /// stable S.
    ///
    /// # Errors
    /// Ports or sample times.
    pub fn residual_filter(&self, s: &StateSpace<T>) -> Result<StateSpace<T>> {
        let p = self.outputs();
        let b = block(&[&[s.b(), Mat::zeros(s.order(), p).as_ref()]]);
        let d = block(&[&[(Scale(-1.0) * s.d()).as_ref(), eye(p).as_ref()]]);
        let row = StateSpace::new(s.a().to_owned(), b, (Scale(-1.0) * s.c()).to_owned(), d, s.time())?;
        self.left().system().then(&row)
    }

    /// The deviation system S of a given plant: `J_K` closed around it, `S = F_u(J_K, G)`. Stable exactly when the
    /// controller stabilises the plant. Not minimal.
    ///
    /// # Errors
    /// Ports, sample times, or a loop that is not well posed.
    pub fn deviation_of(&self, plant: &StateSpace<T>) -> Result<StateSpace<T>> {
        self.j_k()?.upper_lft(plant)
    }
}
