//! The controller of Fig. 3 in two phases, command and observation.

use crate::matrices::{minus, plus};
use crate::{Matrices, NotFinite, Real};

/// `J_K` of (21), (22) for an observer-based controller: immutable, shared by any number of [`State`]s.
///
/// N states, M plant inputs, P plant outputs; positive feedback.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller<T, const N: usize, const M: usize, const P: usize> {
    matrices: Matrices<T, N, M, P>,
}

/// The moving part of a controller: xh, the prediction of the state of the nominal model, N values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State<T, const N: usize> {
    xh: [T; N],
}

/// What one step gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output<T, const M: usize, const P: usize> {
    /// The plant input `u = F xh + alpha`.
    pub u: [T; M],
    /// The residual `beta = y - C xh - D u = Mt y - Nt u` (28).
    pub beta: [T; P],
}

impl<T: Real, const N: usize> State<T, N> {
    /// The state 0.
    pub fn at_rest() -> Self {
        State { xh: [T::ZERO; N] }
    }

    /// A given prediction, for example that of a controller which ran before.
    pub fn new(xh: [T; N]) -> Self {
        State { xh }
    }

    /// The prediction xh.
    pub fn xh(&self) -> &[T; N] {
        &self.xh
    }

    /// Whether the state is made of numbers. One measurement that is not finite spoils it for good: test it before the
    /// command is applied, and start again from [`State::at_rest`].
    pub fn is_finite(&self) -> bool {
        self.xh.iter().all(|x| x.is_finite())
    }
}

impl<T: Real, const N: usize> Default for State<T, N> {
    fn default() -> Self {
        Self::at_rest()
    }
}

impl<T: Real, const N: usize, const M: usize, const P: usize> Controller<T, N, M, P> {
    /// A controller from the nominal model and its gains. Whether A + B F and A + L C are stable is a matter of the
    /// design and not checked here.
    ///
    /// # Errors
    /// [`NotFinite`] names the first entry that is not finite.
    ///
    /// ```
    /// use youla_rt::{Controller, Matrices, NotFinite};
    /// let l = [[f64::NAN]];
    /// let bad = Controller::new(Matrices { a: [[0.5]], b: [[1.0]], c: [[1.0]], d: [[0.0]], f: [[-0.1]], l });
    /// assert_eq!(bad, Err(NotFinite { matrix: 'L', row: 1, column: 1 }));
    /// ```
    pub fn new(matrices: Matrices<T, N, M, P>) -> Result<Self, NotFinite> {
        matrices.check_finite()?;
        Ok(Controller { matrices })
    }

    /// The nominal model and the gains.
    pub fn matrices(&self) -> &Matrices<T, N, M, P> {
        &self.matrices
    }

    /// First phase: the command `u = F xh + alpha`, which needs no measurement of this sample.
    #[inline]
    #[must_use]
    pub fn command(&self, state: &State<T, N>, alpha: &[T; M]) -> [T; M] {
        plus(*alpha, &self.matrices.f, &state.xh)
    }

    /// Second phase: takes the measurement `y` and the input `u` that the actuators applied, the command or what
    /// saturation left of it; returns `beta = y - C xh - D u` and advances to `xh+ = A xh + B u - L beta`.
    #[inline]
    pub fn observe(&self, state: &mut State<T, N>, y: &[T; P], u: &[T; M]) -> [T; P] {
        let beta = self.residual(state, y, u);
        self.advance(state, u, &beta);
        beta
    }

    /// The first half of [`Controller::observe`]: `beta = y - C xh - D u`.
    #[inline]
    #[must_use]
    pub fn residual(&self, state: &State<T, N>, y: &[T; P], u: &[T; M]) -> [T; P] {
        minus(minus(*y, &self.matrices.c, &state.xh), &self.matrices.d, u)
    }

    /// The second half of [`Controller::observe`]: `xh+ = A xh + B u - L beta`. A residual of 0 makes it predict without the
    /// measurement.
    #[inline]
    pub fn advance(&self, state: &mut State<T, N>, u: &[T; M], beta: &[T; P]) {
        let predicted = plus(plus([T::ZERO; N], &self.matrices.a, &state.xh), &self.matrices.b, u);
        state.xh = minus(predicted, &self.matrices.l, beta);
    }

    /// Both phases, for actuators that apply every command as it is: `J_K: (y, alpha) -> (u, beta)`.
    ///
    /// Equal to `J_K` of the library in closed loop over 1e6 samples to 1e-12 in `f64`, and to 1e-5 in `f32`, relative to
    /// the largest value of each signal (`tests/running_loop/real_time.rs`).
    ///
    /// ```
    /// use youla_rt::{Controller, Matrices, State};
    /// let matrices = Matrices { a: [[0.5]], b: [[1.0]], c: [[2.0]], d: [[0.0]], f: [[-0.25]], l: [[-0.125]] };
    /// let controller = Controller::new(matrices)?;
    /// let mut state = State::new([4.0]);
    /// let output = controller.step(&mut state, &[16.0], &[3.0]);
    /// assert_eq!((output.u, output.beta, state.xh()), ([2.0], [8.0], &[5.0]));
    /// # Ok::<(), youla_rt::NotFinite>(())
    /// ```
    #[inline]
    pub fn step(&self, state: &mut State<T, N>, y: &[T; P], alpha: &[T; M]) -> Output<T, M, P> {
        let u = self.command(state, alpha);
        let beta = self.observe(state, y, &u);
        Output { u, beta }
    }
}

impl<const N: usize, const M: usize, const P: usize> Controller<f64, N, M, P> {
    /// The same controller in `f32`, every entry rounded.
    ///
    /// # Errors
    /// [`NotFinite`] for an entry beyond the range of `f32`.
    pub fn to_f32(&self) -> Result<Controller<f32, N, M, P>, NotFinite> {
        Controller::new(self.matrices.to_f32())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrices() -> Matrices<f64, 2, 1, 3> {
        Matrices {
            a: [[0.5, 1.0], [0.0, 0.25]],
            b: [[1.0], [2.0]],
            c: [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]],
            d: [[0.5], [0.0], [-1.0]],
            f: [[-0.25, 0.5]],
            l: [[0.5, 0.0, 0.25], [0.0, -0.5, 0.0]],
        }
    }

    #[test]
    fn equations_by_hand() {
        let controller = Controller::new(matrices()).unwrap();
        let mut state = State::new([4.0, 2.0]);
        assert_eq!(controller.command(&state, &[3.0]), [3.0]);
        // Applied: 2 instead of 3.
        assert_eq!(controller.observe(&mut state, &[7.0, 6.0, 4.0], &[2.0]), [2.0, 4.0, 0.0]);
        assert_eq!(state.xh(), &[5.0, 6.5]);
    }

    #[test]
    fn every_matrix_is_checked() {
        type Spoil = fn(&mut Matrices<f64, 2, 1, 3>);
        let cases: [(Spoil, char, usize, usize); 6] = [
            (|m| m.a[1][0] = f64::NAN, 'A', 2, 1),
            (|m| m.b[1][0] = f64::INFINITY, 'B', 2, 1),
            (|m| m.c[2][1] = f64::NAN, 'C', 3, 2),
            (|m| m.d[2][0] = f64::NAN, 'D', 3, 1),
            (|m| m.f[0][1] = f64::NEG_INFINITY, 'F', 1, 2),
            (|m| m.l[1][2] = f64::NAN, 'L', 2, 3),
        ];
        for (spoil, matrix, row, column) in cases {
            let mut m = matrices();
            spoil(&mut m);
            assert_eq!(Controller::new(m), Err(NotFinite { matrix, row, column }));
        }
    }

    #[test]
    fn beyond_the_range_of_f32() {
        let mut m = matrices();
        m.d[1][0] = 1e39;
        let controller = Controller::new(m).unwrap();
        assert_eq!(controller.to_f32(), Err(NotFinite { matrix: 'D', row: 2, column: 1 }));
    }

    #[test]
    fn bad_measurement_shows_in_the_state() {
        let controller = Controller::new(matrices()).unwrap();
        let mut state = State::default();
        controller.step(&mut state, &[1.0, 2.0, 3.0], &[4.0]);
        assert!(state.is_finite());
        controller.step(&mut state, &[f64::NAN, 2.0, 3.0], &[4.0]);
        assert!(!state.is_finite());
    }
}
