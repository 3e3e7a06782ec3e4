//! The controller that ran while the records were taken.

use super::observer_controller;
use crate::linalg::{block, check_shape};
use crate::lti::{Discrete, StateSpace};
use crate::{Mat, MatRef, Result};

/// The controller that ran, positive feedback: a system `u = K (y - r) + d`, an observer with state feedback `u = F x^ + alpha`, or none.
///
/// ```
/// use youla::{Mat, control::RunningController, linalg::eye, lti::{Discrete, StateSpace}};
/// let (time, number) = (Discrete::new(1e-3)?, |v: f64| Mat::from_fn(1, 1, |_, _| v));
/// let nominal = StateSpace::new(number(1.1), eye(1), eye(1), number(0.0), time)?;
/// let running = RunningController::observer(&nominal, number(-0.6), number(-0.7))?;
/// assert_eq!(running.system().order(), 1);
/// # Ok::<(), youla::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RunningController {
    system: StateSpace<Discrete>,
    observer: Option<Observer>,
}

/// Gains of an observer-based controller, and the system from `[u; y]` to `F x^`.
#[derive(Debug, Clone, PartialEq)]
struct Observer {
    gains: [Mat<f64>; 2],
    law: StateSpace<Discrete>,
}

impl RunningController {
    /// `u = K y`, from p outputs to m inputs of the plant. A controller that is written for negative feedback, `u = -K y`, enters
    /// as [`StateSpace::negated`].
    pub fn new(k: StateSpace<Discrete>) -> Self {
        RunningController { system: k, observer: None }
    }

    /// `x^+ = A x^ + B u + L (C x^ + D u - y)`, `u = F x^ + alpha` with the matrices of a nominal model, F m x n and L n x p.
    ///
    /// # Errors
    /// [`crate::Error::Shape`] where a gain does not fit the nominal model.
    pub fn observer(nominal: &StateSpace<Discrete>, f: Mat<f64>, l: Mat<f64>) -> Result<Self> {
        check_shape("the state feedback F", f.as_ref(), (nominal.inputs(), nominal.order()))?;
        check_shape("the observer gain L", l.as_ref(), (nominal.order(), nominal.outputs()))?;
        let system = observer_controller(nominal, f.as_ref(), l.as_ref())?;
        let a = nominal.a() + &l * nominal.c();
        let b = block(&[&[(nominal.b() + &l * nominal.d()).as_ref(), (-&l).as_ref()]]);
        let law = StateSpace::new(a, b, f.clone(), Mat::zeros(f.nrows(), f.nrows() + l.ncols()), nominal.time())?;
        Ok(RunningController { system, observer: Some(Observer { gains: [f, l], law }) })
    }

    /// No feedback: an open loop of a plant with m inputs and p outputs.
    ///
    /// # Errors
    /// Never for a valid sample time.
    pub fn none(inputs: usize, outputs: usize, time: Discrete) -> Result<Self> {
        Ok(Self::new(StateSpace::gain(Mat::zeros(inputs, outputs), time)?))
    }

    /// K from y to u.
    pub fn system(&self) -> &StateSpace<Discrete> {
        &self.system
    }

    /// F and L of an observer-based controller.
    pub fn gains(&self) -> Option<[MatRef<'_, f64>; 2]> {
        self.observer.as_ref().map(|o| [o.gains[0].as_ref(), o.gains[1].as_ref()])
    }

    /// The observer from `[u; y]` to `F x^`: stable, whatever the plant.
    pub(crate) fn observer_law(&self) -> Option<&StateSpace<Discrete>> {
        self.observer.as_ref().map(|o| &o.law)
    }

    /// Whether there is no feedback.
    pub fn is_open_loop(&self) -> bool {
        self.system.is_zero()
    }
}
