//! What every estimator of this crate takes: the structure, the records, and what is simulated around the plant.

use crate::closure::{Closure, LoopOutput};
use crate::structure::Structure;
use crate::{Error, Result};
use youla::identify::subspace::Experiment;
use youla::lti::{Discrete, Partitioned};

/// A structure and the experiments that determine its parameters.
///
/// The inputs of the experiments are the measured u, samples x m, or the external signals w of a simulated loop
/// ([`Problem::in_loop`]).
///
/// ```
/// use youla::Mat;
/// use youla::identify::subspace::Experiment;
/// use youla::lti::Discrete;
/// use youla_greybox::{DeclaredStructure, Problem, Template};
/// let structure = DeclaredStructure::new(&Template::MassSpringDamper.declaration()?)?;
/// let (u, y) = (Mat::zeros(100, 1), Mat::zeros(100, 1));
/// let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
/// let problem = Problem::new(&structure, &experiments, Discrete::new(5e-3)?);
/// assert_eq!(problem.experiments().len(), 1);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    pub(super) structure: &'a dyn Structure,
    pub(super) experiments: &'a [Experiment<'a>],
    pub(super) time: Discrete,
    pub(super) closure: Option<Closure<'a>>,
}

impl<'a> Problem<'a> {
    /// The plant alone, driven by the measured inputs, sampled at `time`.
    pub fn new(structure: &'a dyn Structure, experiments: &'a [Experiment<'a>], time: Discrete) -> Self {
        Problem { structure, experiments, time, closure: None }
    }

    /// The closed loop of the model and the controller that ran, driven by the external signal w alone; `output` (y or beta)
    /// is compared. Needs no stable plant, only a stable loop at the start; a trial point with an unstable loop that diverges
    /// is rejected.
    ///
    /// `controller` is `J_K` from `(y, w)` to `(u, beta)`, for example [`youla::factor::CoprimeFactors::j_k`] with
    /// `w = alpha`, or a plain controller [`youla::control::with_input_port`]. Initial states are those of the plant, then those
    /// of the controller; [`crate::GreyBoxModel::fit`] is that of the simulated loop.
    ///
    /// White output noise is filtered by the loop, so that the residuals are coloured. The estimate is consistent for any noise,
    /// because w does not depend on it, but [`crate::GreyBoxModel::covariance`] assumes white residuals;
    /// [`crate::greybox_intervals`] counts the colour. For a stable plant the simulation of the plant alone is efficient.
    pub fn in_loop(self, controller: &'a Partitioned<Discrete>, output: LoopOutput) -> Self {
        Problem { closure: Some(Closure::new(controller, output)), ..self }
    }

    /// Refuses a simulated loop: the method needs the measured u.
    pub(super) fn require_measured_inputs(&self, method: &'static str) -> Result<()> {
        if self.closure.is_some() { Err(Error::MeasuredInputs { method }) } else { Ok(()) }
    }

    /// The structure.
    pub fn structure(&self) -> &'a dyn Structure {
        self.structure
    }

    /// The experiments.
    pub fn experiments(&self) -> &'a [Experiment<'a>] {
        self.experiments
    }

    /// The sample time.
    pub fn time(&self) -> Discrete {
        self.time
    }
}
