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

    /// What noise of beta is at the plant outputs: with `beta = S alpha + H e`, the `noise` H p x p,
    ///
    /// ```text
    /// y = G(S) u + (Mt + S Ut)^-1 H e
    /// ```
    ///
    /// Of `H = I + C (z I - A)^-1 K` with the Kalman gain of S it is the noise model of G(S). Its inverse is stable where S and
    /// `H^-1` are, whatever the plant. Not minimal.
    ///
    /// # Errors
    /// Ports, sample times, or `Mt + S Ut` without invertible feedthrough.
    pub fn noise_of(&self, s: &StateSpace<T>, noise: &StateSpace<T>) -> Result<StateSpace<T>> {
        let (m, p) = (self.inputs(), self.outputs());
        noise.then(&self.residual_filter(s)?.part(0..p, m..m + p).inverse()?)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{LqrWeights, NoiseCovariance, kalman, lqr};
    use crate::lti::{Discrete, simulate};

    /// A plant with an unstable mode moved by noise in its states, `x+ = A x + B u + K e, y = C x + e`, in a loop: with the S of that
    /// plant and `H = beta / e`, the noise of beta comes out as that of the plant.
    #[test]
    fn noise_of_beta_is_noise_of_the_plant() {
        let time = Discrete::new(1e-2).unwrap();
        let entries = |r: usize, c: usize, s: f64, p: f64| {
            Mat::from_fn(r, c, |i, j| s * ((2 * i + 5 * j) as f64 * 1.7 + p).sin())
        };
        let a = Mat::from_fn(3, 3, |i, j| [[1.05, 0.2, 0.0], [0.0, 0.8, 0.3], [0.1, -0.2, 0.6]][i][j]);
        let plant = |shift: f64| {
            StateSpace::new(
                &a + entries(3, 3, shift, 0.4),
                entries(3, 2, 1.0, 0.0),
                entries(2, 3, 1.0, 0.9),
                Mat::zeros(2, 2),
                time,
            )
        };
        let (nominal, machine) = (plant(0.0).unwrap(), plant(0.02).unwrap());
        let weights = LqrWeights::on_outputs(&nominal, eye(2).as_ref(), eye(2).as_ref()).unwrap();
        let f = lqr(&nominal, &weights).unwrap().f;
        let covariance = NoiseCovariance::at_inputs(&nominal, eye(2).as_ref(), eye(2).as_ref()).unwrap();
        let l = kalman(&nominal, &covariance).unwrap().l;
        let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref()).unwrap();
        let s = factors.deviation_of(&machine).unwrap();
        // e to y of the machine with its own gain, and to beta: (Mt + S Ut) of it, which is the H to be found.
        let gain = entries(3, 2, 0.3, 2.0);
        let own = StateSpace::new(machine.a().to_owned(), gain, machine.c().to_owned(), eye(2), time).unwrap();
        let of_beta = own.then(&factors.residual_filter(&s).unwrap().part(0..2, 2..4)).unwrap();
        let back = factors.noise_of(&s, &of_beta).unwrap();
        let pulses = Mat::from_fn(40, 2, |k, j| if k == 3 * j { 1.0 } else { 0.0 });
        let response = |h: &StateSpace<Discrete>| simulate(h, pulses.as_ref(), &vec![0.0; h.order()]).unwrap();
        let (expected, found) = (response(&own), response(&back));
        let error = (&found - &expected).norm_l2() / expected.norm_l2();
        assert!(error < 1e-9, "{error:.1e}");
        // Without S it is another noise.
        let nominal_noise = own.then(&factors.m_t()).unwrap();
        let wrong = response(&factors.noise_of(&s, &nominal_noise).unwrap());
        assert!((&wrong - &expected).norm_l2() / expected.norm_l2() > 1e-3);
    }
}
