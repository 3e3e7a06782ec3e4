//! `[controller]` of run.toml: every form in which users have their controllers.

use super::cascade::Cascade;
use super::explain::forms;
use super::feedback::Feedback;
use super::models::{Domain, Polynomials, matrix, model_file, sized};
use super::pid::{Discretisation, IdealPid, ParallelPid};
use super::refuse;
use crate::Result;
use faer::Scale;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use youla::control::RunningController;
use youla::linalg::check_shape;
use youla::lti::{Continuous, Discrete, StateSpace};

/// How a controller in s was brought to the sample time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// Zero-order hold: the error is taken as constant between samples.
    Zoh,
    /// Tustin's rule, `s = 2/ts (z - 1)/(z + 1)`.
    Tustin,
}

/// The controller that ran while the data were logged, in one of its usual forms. The sign convention is mandatory in each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ControllerSettings {
    /// `denominator(z^-1) u = numerator(z^-1) e`, ascending powers of z^-1, entries `[row][column]`; a single
    /// denominator is common to all entries.
    DifferenceEquation {
        /// Sign in which the controller is written down; never guessed.
        feedback: Feedback,
        /// Numerator coefficients.
        numerator: Polynomials,
        /// Denominator coefficients.
        denominator: Polynomials,
        /// Dead time in whole samples, beyond what the controller itself delays.
        #[serde(default)]
        delay: usize,
        /// Numerator from the reference, where it is another than that from the output: `denominator u = reference_numerator r - numerator y`
        /// with negative feedback, `+ numerator y` with positive; the same where it is absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        reference_numerator: Option<Polynomials>,
    },
    /// `numerator / denominator` in descending powers of s or z; a single denominator is common to all entries.
    TransferFunction {
        /// Sign in which the controller is written down; never guessed.
        feedback: Feedback,
        /// The domain in which it is given.
        domain: Domain,
        /// How a controller in s was discretised; required with `domain = "continuous"`, and only there.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        hold: Option<Hold>,
        /// Numerator coefficients.
        numerator: Polynomials,
        /// Denominator coefficients.
        denominator: Polynomials,
        /// Dead time in whole samples, beyond what the controller itself delays.
        #[serde(default)]
        delay: usize,
    },
    /// Matrices, row by row.
    StateSpace {
        /// Sign in which the controller is written down; never guessed.
        feedback: Feedback,
        /// The domain in which it is given; discrete when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        domain: Option<Domain>,
        /// How a controller in s was discretised; required with `domain = "continuous"`, and only there.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        hold: Option<Hold>,
        /// A of the controller, row by row.
        a: Vec<Vec<f64>>,
        /// B of the controller.
        b: Vec<Vec<f64>>,
        /// C of the controller.
        c: Vec<Vec<f64>>,
        /// D of the controller.
        d: Vec<Vec<f64>>,
        /// Dead time in whole samples, beyond what the controller itself delays.
        #[serde(default)]
        delay: usize,
    },
    /// PID in its parallel form, `kp + ki/s + kd s/(1 + derivative_filter s)`, one or one for each loop.
    Pid(ParallelPid),
    /// PID in its ideal form, `kp (1 + 1/(ti s) + td s/(1 + derivative_filter s))`, one or one for each loop.
    IdealPid(IdealPid),
    /// A velocity loop inside a position loop with feedforward, as servo drives compute it; one input and one output.
    Cascade(Cascade),
    /// A discrete-time model from y to u in a file: `a`, `b`, `c`, `d` and the sample time `ts` in JSON, MATLAB (5 or 7.3) or NumPy
    /// form. A MATLAB file may lack `ts`.
    ModelFile {
        /// Sign in which the controller is written down; never guessed.
        feedback: Feedback,
        /// Path of the file, relative to run.toml.
        file: PathBuf,
    },
    /// State feedback and observer gain for the discrete-time nominal model in its own states.
    Observer {
        /// Sign in which the controller is written down; never guessed.
        feedback: Feedback,
        /// State feedback F, m x n, row by row.
        state_feedback: Vec<Vec<f64>>,
        /// Observer gain L, n x p, row by row.
        observer_gain: Vec<Vec<f64>>,
    },
}

impl ControllerSettings {
    /// Reads a JSON file that holds what `[controller]` of run.toml holds, `{"pid": {"feedback": "negative", ..}}`; `None` for a model, and
    /// for a file of another kind.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] for text that is no JSON, for a table that is neither, and for one of the forms whose keys are wrong;
    /// [`youla_io::Error::Io`].
    pub fn from_json(path: &Path) -> Result<Option<Self>> {
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("json")) {
            return Ok(None);
        }
        let text = youla_io::read_text(path)?;
        let problem = |problem| Err(youla_io::Error::Settings { path: path.to_owned(), at: None, problem }.into());
        let table = match serde_json::from_str::<serde_json::Value>(&text) {
            Ok(serde_json::Value::Object(table)) => table,
            Ok(_) => return problem("this JSON holds no table".into()),
            Err(error) => return problem(format!("this is no JSON: {error}")),
        };
        let known = forms::<Self>();
        match table.keys().next() {
            Some(form) if table.len() == 1 && known.split(", ").any(|known| known == form) => {}
            _ if table.contains_key("a") => return Ok(None),
            _ => {
                return problem(format!(
                    "this is neither a model (ts, a, b, c, d) nor a form of controller by its name, such as {{\"pid\": {{\"kp\": 2.0, ..}}}}; \
                     the forms are {known}"
                ));
            }
        }
        let parsed = serde_json::from_str::<Self>(&text);
        match parsed {
            Err(error) => problem(error.to_string()),
            Ok(controller) => controller.problem().map_or(Ok(Some(controller)), problem),
        }
    }

    /// The controller that ran, at the sample time of the data, in positive feedback; `nominal` is the model of an observer, paths are relative
    /// to `folder`.
    ///
    /// # Errors
    /// Whatever is wrong with the values or the file.
    pub fn realise(
        &self,
        time: Discrete,
        nominal: Option<&StateSpace<Discrete>>,
        folder: &Path,
    ) -> Result<RunningController> {
        self.controller(time, nominal, folder).map_err(|e| e.within("[controller]"))
    }

    /// Dead time in whole samples that is stated beside the controller.
    pub(crate) fn delay(&self) -> usize {
        self.clone().stated_delay().map_or(0, |delay| *delay)
    }

    /// What the machine computes: the controller without that dead time.
    pub(crate) fn without_delay(&self) -> Self {
        let mut computed = self.clone();
        computed.stated_delay().into_iter().for_each(|delay| *delay = 0);
        computed
    }

    fn stated_delay(&mut self) -> Option<&mut usize> {
        match self {
            Self::DifferenceEquation { delay, .. }
            | Self::TransferFunction { delay, .. }
            | Self::StateSpace { delay, .. } => Some(delay),
            Self::Pid(pid) => Some(&mut pid.delay),
            Self::IdealPid(pid) => Some(&mut pid.delay),
            Self::Cascade(cascade) => Some(&mut cascade.delay),
            Self::ModelFile { .. } | Self::Observer { .. } => None,
        }
    }

    /// The rule of a PID; that of one without a derivative does not follow from its response.
    pub(crate) fn discretisation(&self) -> Option<Discretisation> {
        match self {
            Self::Pid(pid) => Some(pid.discretisation),
            Self::IdealPid(pid) => Some(pid.discretisation),
            _ => None,
        }
    }

    /// From the references to u, where that is another path than that from the outputs.
    pub(crate) fn reference_path(&self, time: Discrete) -> Result<Option<StateSpace<Discrete>>> {
        let Self::DifferenceEquation { denominator, delay, reference_numerator: Some(path), .. } = self else {
            return Ok(None);
        };
        let (p, m) = path.shape();
        let (numerator, denominator) = (path.spread(p, m), denominator.spread(p, m));
        let system = StateSpace::difference_equation(&numerator, &denominator, time)?;
        Ok(Some(delayed(system, *delay)?))
    }

    /// Whether a path from the reference is stated, which must be an excitation of the inputs before records are read.
    pub(super) fn has_reference_path(&self) -> bool {
        matches!(self, Self::DifferenceEquation { reference_numerator: Some(_), .. })
    }

    /// The number of loops of PIDs.
    pub(super) fn pid_loops(&self) -> Option<usize> {
        match self {
            Self::Pid(pid) => Some(pid.parts().count()),
            Self::IdealPid(pid) => Some(pid.parts().count()),
            _ => None,
        }
    }

    /// What the types allow and no controller is, in one sentence.
    pub(super) fn problem(&self) -> Option<String> {
        match self {
            Self::TransferFunction { domain, hold, .. } => hold_problem(Some(*domain), *hold),
            Self::StateSpace { domain, hold, .. } => hold_problem(*domain, *hold),
            Self::Pid(pid) => pid.parts().problem(),
            Self::IdealPid(pid) => pid.parts().problem(),
            Self::Cascade(cascade) => cascade.problem(),
            Self::DifferenceEquation { .. } | Self::ModelFile { .. } | Self::Observer { .. } => None,
        }
    }

    fn controller(
        &self,
        time: Discrete,
        nominal: Option<&StateSpace<Discrete>>,
        folder: &Path,
    ) -> Result<RunningController> {
        refuse(self.problem(), Path::new("run.toml"))?;
        let (feedback, delay, system) = match self {
            Self::DifferenceEquation { feedback, numerator, denominator, delay, .. } => {
                let (p, m) = numerator.shape();
                let (numerator, denominator) = (numerator.spread(p, m), denominator.spread(p, m));
                (feedback, *delay, StateSpace::difference_equation(&numerator, &denominator, time)?)
            }
            Self::TransferFunction { feedback, hold, numerator, denominator, delay, .. } => {
                let (p, m) = numerator.shape();
                let (numerator, denominator) = (numerator.spread(p, m), denominator.spread(p, m));
                let system = match hold {
                    None => StateSpace::transfer_matrix(&numerator, &denominator, time)?,
                    Some(hold) => {
                        held(&StateSpace::transfer_matrix(&numerator, &denominator, Continuous)?, *hold, time)?
                    }
                };
                (feedback, *delay, system)
            }
            Self::StateSpace { feedback, hold, a, b, c, d, delay, .. } => {
                let [a, b, c, d] = sized([matrix("A", a)?, matrix("B", b)?, matrix("C", c)?, matrix("D", d)?]);
                let system = match hold {
                    None => StateSpace::new(a, b, c, d, time)?,
                    Some(hold) => held(&StateSpace::new(a, b, c, d, Continuous)?, *hold, time)?,
                };
                (feedback, *delay, system)
            }
            Self::Pid(pid) => (&pid.feedback, pid.delay, pid.parts().system(time)?),
            Self::IdealPid(pid) => (&pid.feedback, pid.delay, pid.parts().system(time)?),
            Self::Cascade(cascade) => return cascade_path(cascade, time.ts(), false).controller(time, nominal, folder),
            Self::ModelFile { feedback, file } => {
                (feedback, 0, model_file(&folder.join(file), Domain::Discrete, time)?)
            }
            Self::Observer { feedback, state_feedback, observer_gain } => {
                let Some(nominal) = nominal else {
                    let (what, instead) = ("an observer without [nominal]", "add the model whose states it observes");
                    return Err(youla::Error::Unsupported { what, instead }.into());
                };
                let sign = Scale(feedback.sign());
                let f = sign * matrix("state_feedback", state_feedback)?;
                let l = sign * matrix("observer_gain", observer_gain)?;
                check_shape("state_feedback", f.as_ref(), (nominal.inputs(), nominal.order()))?;
                check_shape("observer_gain", l.as_ref(), (nominal.order(), nominal.outputs()))?;
                return Ok(RunningController::observer(nominal, f, l)?);
            }
        };
        let system = if *feedback == Feedback::Negative { system.negated() } else { system };
        // States in excess, as those of a transfer matrix that was realised entry by entry, are poles of every loop.
        Ok(RunningController::new(delayed(system.minimal()?, delay)?))
    }
}

/// A cascade as the difference equation that it is, with or without the path from the reference.
pub(super) fn cascade_path(cascade: &Cascade, ts: f64, with_reference: bool) -> ControllerSettings {
    let [denominator, numerator, reference] = cascade.polynomials(ts).map(Polynomials::Single);
    ControllerSettings::DifferenceEquation {
        feedback: cascade.feedback,
        numerator,
        denominator,
        delay: cascade.delay,
        reference_numerator: with_reference.then_some(reference),
    }
}

fn hold_problem(domain: Option<Domain>, hold: Option<Hold>) -> Option<String> {
    match (domain, hold) {
        (Some(Domain::Continuous), None) => Some(
            "[controller] is in s, but does not say how it was discretised: add hold = \"tustin\" or hold = \"zoh\""
                .into(),
        ),
        (None | Some(Domain::Discrete), Some(_)) => Some(
            "[controller] has a `hold`, which belongs to domain = \"continuous\"; add that, or leave `hold` out".into(),
        ),
        _ => None,
    }
}

fn held(system: &StateSpace<Continuous>, hold: Hold, time: Discrete) -> Result<StateSpace<Discrete>> {
    let system = match hold {
        Hold::Zoh => system.zoh(time)?,
        Hold::Tustin => system.tustin(time)?,
    };
    // Coefficients in s give states that differ by powers of the sample rate; nobody knows these states.
    Ok(system.balanced()?)
}

/// Longest dead time: each sample is a state per input. Chosen, not measured.
const LONGEST: usize = 1000;

/// `z^-delay K`, with m states for each sample.
fn delayed(system: StateSpace<Discrete>, delay: usize) -> Result<StateSpace<Discrete>> {
    if delay > LONGEST {
        let what = "[controller] delay".into();
        return Err(youla::Error::OutOfRange { what, value: delay as f64, must: "at most 1000 samples" }.into());
    }
    Ok(system.delayed(delay)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A law of two channels over one denominator with an integrator has it four times; where its response has it twice, so has the controller, and
    /// no pole of a loop lies on the unit circle.
    #[test]
    fn states_in_excess_of_a_stated_law_are_left_out() {
        let text = "[transfer_function]\ndomain = \"discrete\"\nfeedback = \"negative\"\n\
            numerator = [[[1.0, -0.9], [0.3]], [[0.2], [2.0, -1.8]]]\n\
            denominator = [[[1.0, -1.0], [1.0, -1.0]], [[1.0, -1.0], [1.0, -1.0, 0.0]]]\n";
        let settings: ControllerSettings = toml::from_str(text).unwrap();
        let found = settings.controller(Discrete::new(0.1).unwrap(), None, Path::new(".")).unwrap();
        let poles = found.system().poles().unwrap();
        assert_eq!(poles.iter().filter(|p| (*p - 1.0).norm() < 1e-6).count(), 2, "{poles:?}");
    }
}
