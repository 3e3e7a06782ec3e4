//! Any further linear system that runs beside the controller: Q of (23), or a controller without ports.

use crate::matrices::{check_finite, plus, to_f32};
use crate::{NotFinite, Real, State};

/// `x+ = A x + B v, w = C x + D v` with N states, I inputs and O outputs.
///
/// As the parameter Q of Youla, Jabr, Bongiorno and Kucera it closes `alpha = Q beta` around the ports of a
/// [`crate::Controller`], which changes the loop without touching F, L or the observer. Such a Q must not pass beta through at
/// once (D = 0), because the command comes before the measurement:
///
/// ```
/// use youla_rt::{Controller, Filter, Matrices, State};
/// let controller = Controller::new(Matrices {
///     a: [[1.1]], b: [[1.0]], c: [[1.0]], d: [[0.0]], f: [[-0.6]], l: [[-0.7]],
/// })?;
/// let q = Filter::new([[0.5]], [[0.2]], [[-0.3]], [[0.0]])?;
/// let (mut state, mut of_q) = (State::at_rest(), State::at_rest());
/// let alpha = q.output(&of_q, &[0.0]);                       // from what was known before
/// let u = controller.command(&state, &alpha);
/// let beta = controller.observe(&mut state, &[2.0], &u);
/// q.step(&mut of_q, &beta);
/// assert_eq!((u, beta, of_q.xh()), ([0.0], [2.0], &[0.4]));
/// # Ok::<(), youla_rt::NotFinite>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Filter<T, const N: usize, const I: usize, const O: usize> {
    a: [[T; N]; N],
    b: [[T; I]; N],
    c: [[T; N]; O],
    d: [[T; I]; O],
}

impl<T: Real, const N: usize, const I: usize, const O: usize> Filter<T, N, I, O> {
    /// A system from its matrices, by rows.
    ///
    /// # Errors
    /// [`NotFinite`] names the first entry that is not finite.
    pub fn new(a: [[T; N]; N], b: [[T; I]; N], c: [[T; N]; O], d: [[T; I]; O]) -> Result<Self, NotFinite> {
        check_finite('A', &a)?;
        check_finite('B', &b)?;
        check_finite('C', &c)?;
        check_finite('D', &d)?;
        Ok(Filter { a, b, c, d })
    }

    /// `w = C x + D v`.
    #[inline]
    #[must_use]
    pub fn output(&self, state: &State<T, N>, v: &[T; I]) -> [T; O] {
        plus(plus([T::ZERO; O], &self.c, state.xh()), &self.d, v)
    }

    /// The output, then the state moves on to `x+ = A x + B v`.
    #[inline]
    pub fn step(&self, state: &mut State<T, N>, v: &[T; I]) -> [T; O] {
        let w = self.output(state, v);
        *state = State::new(plus(plus([T::ZERO; N], &self.a, state.xh()), &self.b, v));
        w
    }
}

impl<const N: usize, const I: usize, const O: usize> Filter<f64, N, I, O> {
    /// The same system in `f32`, every entry rounded.
    ///
    /// # Errors
    /// [`NotFinite`] for an entry beyond the range of `f32`.
    pub fn to_f32(&self) -> Result<Filter<f32, N, I, O>, NotFinite> {
        Filter::new(to_f32(&self.a), to_f32(&self.b), to_f32(&self.c), to_f32(&self.d))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_by_hand() {
        let filter = Filter::new([[0.5, 1.0], [0.0, 0.25]], [[1.0], [2.0]], [[2.0, 0.0]], [[0.5]]).unwrap();
        let mut state = State::new([4.0, 2.0]);
        assert_eq!(filter.step(&mut state, &[2.0]), [9.0]);
        assert_eq!(state.xh(), &[6.0, 4.5]);
        let bad = Filter::new([[0.5]], [[f64::NAN]], [[1.0]], [[0.0]]);
        assert_eq!(bad, Err(NotFinite { matrix: 'B', row: 1, column: 1 }));
        assert!(Filter::new([[1e39]], [[1.0]], [[1.0]], [[0.0]]).unwrap().to_f32().is_err());
    }
}
