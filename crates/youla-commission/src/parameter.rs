//! A new controller as a Q around the running one: each controller that stabilises the nominal model is K(Q) of a stable Q.

use crate::{Error, Result};
use youla::Mat;
use youla::lti::{Discrete, StateSpace};
use youla_twin::{RunningLoop, padded};

/// Q as the firmware runs it.
#[derive(Debug, Clone)]
pub(crate) struct LoadedQ {
    /// Its coefficients, rounded to single precision.
    pub(crate) system: StateSpace<Discrete>,
}

impl LoadedQ {
    /// A, B, C by rows for a bank of so many states, filled up with zeros.
    pub(crate) fn coefficients(&self, states: usize) -> Vec<f32> {
        let q = &self.system;
        [padded(q.a(), states, states), padded(q.b(), states, q.inputs()), padded(q.c(), q.outputs(), states)].concat()
    }
}

/// A new controller with its Q.
pub(crate) struct NewLoop {
    /// `u = K y`, positive feedback.
    pub(crate) controller: StateSpace<Discrete>,
    pub(crate) q: LoadedQ,
    /// Models within the region of S that it stabilises, all of them.
    pub(crate) models: usize,
    /// Largest magnitude of a closed-loop pole over them.
    pub(crate) worst_pole: f64,
    /// Standard deviation of its least damping by the region of the model.
    pub(crate) damping_deviation: f64,
}

/// Q from beta to alpha with K(Q) = `controller`, `J_G` closed with it; its order is the sum of both.
///
/// # Errors
/// [`Error::Controller`] where the firmware cannot run it: too many states, a feedthrough, or unstable, as it is where the controller does
/// not stabilise the nominal model.
pub(crate) fn parameter_of(running: &RunningLoop, controller: &StateSpace<Discrete>) -> Result<LoadedQ> {
    loaded(&running.factors.j_g()?.lower_lft(controller)?, running.q_states)
}

/// Q for a bank of so many states, in single precision.
///
/// # Errors
/// As [`parameter_of`].
pub(crate) fn loaded(q: &StateSpace<Discrete>, most: usize) -> Result<LoadedQ> {
    let q = q.balanced()?;
    let refuse = |problem: String| Err(Error::Controller { problem });
    if q.order() > most {
        return refuse(format!("takes a Q of at most {most} states; this one has {}", q.order()));
    }
    if q.d().norm_max() > 1e-9 {
        return refuse("takes no Q with a feedthrough, which needs the measurement before the command".into());
    }
    let single = |m: youla::MatRef<'_, f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| f64::from(m[(i, j)] as f32));
    let system = StateSpace::new(single(q.a()), single(q.b()), single(q.c()), Mat::zeros(2, 2), q.time())?;
    if !system.is_stable()? {
        return refuse("takes no unstable Q; the new controller does not stabilise the nominal model".into());
    }
    Ok(LoadedQ { system })
}

/// What an excitation of K(Q) is at the plant input: the inputs that it causes while the outputs are zero.
pub(crate) fn at_plant_input(running: &RunningLoop, q: Option<&LoadedQ>, alpha: &Mat<f64>) -> Result<Mat<f64>> {
    use youla::control::{closed_loop, with_input_port};
    let ports = running.factors.j_k()?;
    let excited = match q {
        None => alpha.clone(),
        Some(q) => {
            let of_alpha = closed_loop(&ports.part(1, 1), &with_input_port(&q.system)?)?.part(0..2, 0..2);
            youla::lti::simulate(&of_alpha, alpha.as_ref(), &vec![0.0; of_alpha.order()])?
        }
    };
    let to_input = ports.part(0, 1);
    Ok(youla::lti::simulate(&to_input, excited.as_ref(), &vec![0.0; to_input.order()])?)
}
