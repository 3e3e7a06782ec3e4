//! From a design to the controller that runs sample by sample.

use crate::linalg::check_shape;
use crate::lti::{Discrete, StateSpace};
use crate::{Error, MatRef, Result};
use youla_rt::{Controller, Matrices, NotFinite};

/// The controller of Fig. 3, `J_K: (y, alpha) -> (u, beta)`, in the form that firmware and rigs step through: N states,
/// M inputs and P outputs of the nominal model, `f` is m x n, `l` n x p.
///
/// The same system as `j_k()` of [`crate::factor::CoprimeFactors::observer`], which also shows that the gains are stable.
/// Both agree in closed loop over 1e6 samples to 1e-12 relative (`tests/real_time.rs`).
///
/// # Errors
/// [`Error::Shape`] when model or gains are not of the sizes N, M, P; [`Error::NotFinite`] for a bad entry of a gain.
///
/// ```
/// use youla::{Mat, control::real_time_controller, linalg::eye, lti::{Discrete, StateSpace}};
/// let nominal = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), Discrete::new(1e-3)?)?;
/// let gain = Mat::from_fn(1, 1, |_, _| -0.5);
/// let controller = real_time_controller::<1, 1, 1>(&nominal, gain.as_ref(), gain.as_ref())?;
/// let mut state = youla_rt::State::at_rest();
/// let output = controller.step(&mut state, &[2.0], &[1.0]);
/// assert_eq!((output.u, output.beta, state.xh()), ([1.0], [2.0], &[2.0]));
/// # Ok::<(), youla::Error>(())
/// ```
pub fn real_time_controller<const N: usize, const M: usize, const P: usize>(
    nominal: &StateSpace<Discrete>,
    f: MatRef<'_, f64>,
    l: MatRef<'_, f64>,
) -> Result<Controller<f64, N, M, P>> {
    let matrices = Matrices {
        a: array("the state matrix A of the nominal model", nominal.a())?,
        b: array("the input matrix B of the nominal model", nominal.b())?,
        c: array("the output matrix C of the nominal model", nominal.c())?,
        d: array("the feedthrough D of the nominal model", nominal.d())?,
        f: array("the state feedback F", f)?,
        l: array("the observer gain L", l)?,
    };
    Controller::new(matrices).map_err(|NotFinite { matrix, row, column }| Error::NotFinite {
        what: format!("the matrix {matrix}"),
        row,
        column,
    })
}

fn array<const R: usize, const K: usize>(what: &str, x: MatRef<'_, f64>) -> Result<[[f64; K]; R]> {
    check_shape(what, x, (R, K))?;
    Ok(std::array::from_fn(|i| std::array::from_fn(|j| x[(i, j)])))
}
