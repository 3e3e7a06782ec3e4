//! Zero-order hold: the discrete system whose output equals the sampled output of the continuous one while the input is
//! held between samples,
//! ```text
//! [Ad Bd; 0 I] = exp([A B; 0 0] ts),   Cd = C,   Dd = D,
//! ```
//! and its inverse by the principal logarithm (C. F. Van Loan, Computing integrals involving the matrix exponential, IEEE
//! Trans. Autom. Control 23 (1978), 395).

use super::{Continuous, Discrete, StateSpace, TimeDomain};
use crate::Result;
use crate::linalg::{block, expm, eye, logm, solve_in_any_units};
use faer::prelude::*;
use faer::{Mat, MatRef};

impl StateSpace<Continuous> {
    /// Discretises with a zero-order hold.
    ///
    /// The states are balanced before the exponential and scaled back after it, so that entries that span many decades
    /// (1e6 in the bearing) keep their digits: 1e-12 of `||A||` in balanced coordinates, held by
    /// `two_half_steps_make_one_step`.
    ///
    /// # Errors
    /// [`crate::Error::NotFinite`] where the exponential overflows.
    ///
    /// ```
    /// use youla::{Mat, linalg::eye, lti::{Continuous, Discrete, StateSpace}};
    /// let integrator = StateSpace::new(Mat::zeros(1, 1), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
    /// let sampled = integrator.zoh(Discrete::new(0.5)?)?;
    /// assert_eq!((sampled.a()[(0, 0)], sampled.b()[(0, 0)]), (1.0, 0.5));
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn zoh(&self, time: Discrete) -> Result<StateSpace<Discrete>> {
        let (n, m) = (self.order(), self.inputs());
        let scaled = Scaled::new(self)?;
        let zeros = Mat::zeros(m, n + m);
        let generator = block(&[&[scaled.a.as_ref(), scaled.b.as_ref()], &[zeros.as_ref()]]);
        let step = expm("the state matrix times the sample time", (Scale(time.ts()) * generator).as_ref())?;
        let (a, b) = scaled.restore(step.as_ref());
        StateSpace::new(a, b, self.c().to_owned(), self.d().to_owned(), time)
    }

    /// Discretises by Tustin's rule, `G(2/ts (z - 1)/(z + 1))`: with `W = (I - A ts/2)^-1`,
    /// ```text
    /// Ad = W (I + A ts/2),   Bd = W B ts,   Cd = C W,   Dd = D + C W B ts/2.
    /// ```
    ///
    /// # Errors
    /// [`crate::Error::Singular`] where A has an eigenvalue at `2/ts`, which the rule maps to infinity.
    ///
    /// ```
    /// use youla::{Mat, linalg::eye, lti::{Continuous, Discrete, StateSpace}};
    /// let integrator = StateSpace::new(Mat::zeros(1, 1), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
    /// let sampled = integrator.tustin(Discrete::new(0.5)?)?;
    /// assert_eq!((sampled.b()[(0, 0)], sampled.d()[(0, 0)]), (0.5, 0.25));
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn tustin(&self, time: Discrete) -> Result<StateSpace<Discrete>> {
        let (n, m, half) = (self.order(), self.inputs(), 0.5 * time.ts());
        if n == 0 {
            return StateSpace::gain(self.d().to_owned(), time);
        }
        let step = eye(n) - Scale(half) * self.a();
        let right = block(&[&[(eye(n) + Scale(half) * self.a()).as_ref(), self.b()]]);
        let what = "I - A ts/2 of Tustin's rule";
        let solved = solve_in_any_units(what, step.as_ref(), right.as_ref())?;
        let (a, wb) = (solved.subcols(0, n).to_owned(), solved.subcols(n, m));
        let c = solve_in_any_units(what, step.transpose(), self.c().transpose())?;
        StateSpace::new(
            a,
            Scale(time.ts()) * wb,
            c.transpose().to_owned(),
            self.d() + Scale(half) * (self.c() * wb),
            time,
        )
    }
}

impl StateSpace<Discrete> {
    /// The continuous system of which this one is the zero-order-hold discretisation, all its modes below the Nyquist
    /// frequency.
    ///
    /// `zoh` undoes it to 1e-12 relative (held on the bearing at 5 kHz by `bearing_survives_the_round_trip`).
    ///
    /// # Errors
    /// [`crate::Error::NoLogarithm`] where a pole is zero or real and negative.
    ///
    /// ```
    /// use youla::{Mat, linalg::eye, lti::{Discrete, StateSpace}};
    /// let lag = StateSpace::new(eye(1) * faer::Scale(0.5), eye(1), eye(1), Mat::zeros(1, 1), Discrete::new(1e-3)?)?;
    /// assert!((lag.inverse_zoh()?.a()[(0, 0)] + 1e3 * 2f64.ln()).abs() < 1e-10);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn inverse_zoh(&self) -> Result<StateSpace<Continuous>> {
        let (n, m) = (self.order(), self.inputs());
        let scaled = Scaled::new(self)?;
        let (zeros, identity) = (Mat::zeros(m, n), eye(m));
        let step = block(&[&[scaled.a.as_ref(), scaled.b.as_ref()], &[zeros.as_ref(), identity.as_ref()]]);
        let generator = Scale(1.0 / self.time().ts()) * logm("the one-step matrix", step.as_ref())?;
        let (a, b) = scaled.restore(generator.as_ref());
        StateSpace::new(a, b, self.c().to_owned(), self.d().to_owned(), Continuous)
    }
}

/// State and input matrix after scaling states and inputs by powers of two, which rounds nothing.
struct Scaled {
    a: Mat<f64>,
    b: Mat<f64>,
    states: Vec<f64>,
    inputs: Vec<f64>,
}

impl Scaled {
    fn new<T: TimeDomain>(system: &StateSpace<T>) -> Result<Self> {
        let states = system.state_scales()?;
        let system = system.with_scaled_states(&states);
        let (a, mut b) = (system.a().to_owned(), system.b().to_owned());
        let size = a.norm_max();
        let inputs: Vec<f64> = b.col_iter().map(|column| power_of_two(size, column.norm_max())).collect();
        for (column, scale) in b.col_iter_mut().zip(&inputs) {
            column.iter_mut().for_each(|value| *value *= scale);
        }
        Ok(Scaled { a, b, states, inputs })
    }

    /// The first n rows of the function of `[A B; . .]`, in the coordinates of the user.
    fn restore(&self, f: MatRef<'_, f64>) -> (Mat<f64>, Mat<f64>) {
        let (n, m) = (self.states.len(), self.inputs.len());
        let a = Mat::from_fn(n, n, |i, j| f[(i, j)] * self.states[i] / self.states[j]);
        let b = Mat::from_fn(n, m, |i, j| f[(i, n + j)] * self.states[i] / self.inputs[j]);
        (a, b)
    }
}

/// The power of two nearest to `size / value`, 1 where that ratio is zero or not finite.
pub(super) fn power_of_two(size: f64, value: f64) -> f64 {
    let exponent = (size / value).log2().round();
    if exponent.is_finite() { exponent.exp2() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::fixtures::bearing;
    use crate::linalg::balance;

    /// Largest difference between entries in the state coordinates that balance the second system.
    fn scaled_error<T: TimeDomain>(found: &StateSpace<T>, exact: &StateSpace<T>, scale: &[f64]) -> f64 {
        let n = exact.order();
        let balanced = |m: MatRef<'_, f64>| Mat::from_fn(n, n, |i, j| m[(i, j)] * scale[j] / scale[i]);
        let input = |m: MatRef<'_, f64>| Mat::from_fn(n, m.ncols(), |i, j| m[(i, j)] / scale[i]);
        let a = (balanced(found.a()) - balanced(exact.a())).norm_max() / balanced(exact.a()).norm_max();
        let b = (input(found.b()) - input(exact.b())).norm_max() / input(exact.b()).norm_max();
        a.max(b)
    }

    fn scales(system: &StateSpace<Continuous>) -> Vec<f64> {
        balance("A", system.a()).unwrap().scale
    }

    #[test]
    fn two_half_steps_make_one_step() {
        let plant = bearing();
        for ts in [1e-6, 2e-4, 1e-2] {
            let whole = plant.zoh(Discrete::new(ts).unwrap()).unwrap();
            let half = plant.zoh(Discrete::new(0.5 * ts).unwrap()).unwrap();
            let a = half.a() * half.a();
            let b = half.b() + half.a() * half.b();
            let twice = StateSpace::new(a, b, half.c().to_owned(), half.d().to_owned(), whole.time()).unwrap();
            let error = scaled_error(&twice, &whole, &scales(&plant));
            assert!(error < 1e-12, "{ts}: {error}");
        }
    }

    #[test]
    fn double_integrator_has_its_closed_form() {
        let a = Mat::from_fn(2, 2, |i, j| if i < j { 1e6 } else { 0.0 });
        let b = Mat::from_fn(2, 1, |i, _| i as f64);
        let plant = StateSpace::new(a, b, eye(2), Mat::zeros(2, 1), Continuous).unwrap();
        let sampled = plant.zoh(Discrete::new(0.1).unwrap()).unwrap();
        assert!((sampled.a()[(0, 1)] / 1e5 - 1.0).abs() < 1e-15);
        assert!((sampled.b()[(0, 0)] / 5e3 - 1.0).abs() < 1e-15);
    }

    #[test]
    fn sampling_keeps_the_static_gain() {
        let plant = bearing();
        let sampled = plant.zoh(Discrete::new(2e-4).unwrap()).unwrap();
        let still = eye(6) - sampled.a();
        let dc = sampled.c() * still.partial_piv_lu().solve(sampled.b());
        let exact = Scale(-1.0) * plant.c() * plant.a().partial_piv_lu().solve(plant.b());
        assert!((&dc - &exact).norm_max() / exact.norm_max() < 1e-11);
    }

    #[test]
    fn bearing_survives_the_round_trip() {
        let plant = bearing();
        let sampled = plant.zoh(Discrete::new(2e-4).unwrap()).unwrap();
        let error = scaled_error(&sampled.inverse_zoh().unwrap(), &plant, &scales(&plant));
        assert!(error < 1e-12, "{error}");
    }

    #[test]
    fn a_negative_pole_has_no_continuous_counterpart() {
        let a = Mat::from_fn(1, 1, |_, _| -0.5);
        let system = StateSpace::new(a, eye(1), eye(1), Mat::zeros(1, 1), Discrete::new(1.0).unwrap()).unwrap();
        match system.inverse_zoh() {
            Err(Error::NoLogarithm { pole }) => assert_eq!(pole.re, -0.5),
            other => panic!("{other:?}"),
        }
    }
}
