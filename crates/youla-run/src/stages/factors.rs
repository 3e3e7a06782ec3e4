//! From nominal model and controller of a run to its coprime factors, with balanced states.

use crate::records::RunRecords;
use crate::settings::{FactorSettings, RunSettings};
use crate::{Error, Result};
use std::path::Path;
use youla::MatRef;
use youla::control::{ChannelScales, RunningController, closed_loop, with_input_port};
use youla::factor::{CoprimeFactors, loop_factors};
use youla::linalg::eye;
use youla::lti::{Discrete, StateSpace};
use youla_loop::check::{Declared, GainPart, Reading};

/// Nominal model and controller as run.toml declares them.
#[derive(Debug, Clone)]
pub struct DeclaredLoop {
    /// The nominal model in its own states, where one is given.
    pub nominal: Option<StateSpace<Discrete>>,
    /// The controller that ran.
    pub running: RunningController,
    /// What its numbers may mean where the log contradicts it.
    readings: Vec<Reading>,
    /// Its parts with a gain each.
    parts: Vec<GainPart>,
}

impl DeclaredLoop {
    /// Realises both; paths are relative to `folder`.
    pub(crate) fn new(settings: &RunSettings, folder: &Path, time: Discrete) -> Result<Self> {
        let nominal = settings.nominal.as_ref().map(|nominal| nominal.realise(folder, time)).transpose()?;
        let running = settings.controller.realise(time, nominal.as_ref(), folder)?;
        let readings = settings.controller.readings(time, nominal.as_ref(), folder);
        let parts = settings.controller.gain_parts(time, folder);
        Ok(DeclaredLoop { nominal, running, readings, parts })
    }

    /// The controller as the check of the data takes it.
    pub(crate) fn stated(&self) -> Declared<'_> {
        Declared { controller: self.controller(), readings: &self.readings, parts: &self.parts }
    }

    /// The controller that ran, `u = K y` (positive feedback).
    pub fn controller(&self) -> &StateSpace<Discrete> {
        self.running.system()
    }

    /// The nominal model, for what rests on it.
    ///
    /// # Errors
    /// [`youla::Error::Unsupported`] where none is given.
    pub(crate) fn required_nominal(&self) -> Result<&StateSpace<Discrete>> {
        self.nominal.as_ref().ok_or(Error::Method(NO_NOMINAL))
    }
}

/// What is missing where something rests on a nominal model.
pub(crate) const NO_NOMINAL: youla::Error = youla::Error::Unsupported {
    what: "a factorisation or a prediction without a nominal model",
    instead: "add [nominal] to run.toml, a model of the plant, which may be rough",
};

/// The factors of a loop.
#[derive(Debug, Clone)]
pub struct LoopFactors {
    /// The eight factors.
    pub factors: CoprimeFactors<Discrete>,
    /// Largest relative residual of the Bezout identity (15) up to Nyquist.
    pub bezout_residual: f64,
}

/// Nominal model and controller that the settings of a run describe; paths in them are relative to `folder`.
///
/// # Errors
/// Whatever is wrong with the given model or controller; [`youla::Error::Ports`] where they do not fit the records.
pub fn declared_loop(settings: &RunSettings, records: &RunRecords, folder: &Path) -> Result<DeclaredLoop> {
    let declared = DeclaredLoop::new(settings, folder, records.time)?;
    let (m, p) = (records.inputs.len(), records.outputs.len());
    let nominal = declared.nominal.as_ref().map(|nominal| ("the nominal model", nominal, (m, p)));
    for (name, system, ports) in nominal.into_iter().chain([("the controller", declared.controller(), (p, m))]) {
        for (side, expected, found) in [("inputs", ports.0, system.inputs()), ("outputs", ports.1, system.outputs())] {
            if expected != found {
                let what = format!("the number of {side} of {name}");
                return Err(Error::Method(youla::Error::Ports { what, expected, found }));
            }
        }
    }
    Ok(declared)
}

/// Builds the factors that the settings of a run describe; paths in them are relative to `folder`.
///
/// # Errors
/// As [`loop_factors`], with the likely cause where the controller does not stabilise the nominal model, and whatever is wrong with the
/// given model or controller; a nominal model that is not given.
pub fn factorise_run(settings: &RunSettings, records: &RunRecords, folder: &Path) -> Result<LoopFactors> {
    let declared = declared_loop(settings, records, folder)?;
    factorise((declared.required_nominal()?, &declared.running), records.sizes(), &settings.factors)
}

/// The factors of a model and its controller, whose channels have these sizes.
pub(crate) fn factorise(
    (nominal, running): (&StateSpace<Discrete>, &RunningController),
    (inputs, outputs): (Vec<f64>, Vec<f64>),
    settings: &FactorSettings,
) -> Result<LoopFactors> {
    let weight = settings.input_weight.sqrt();
    let sizes = ChannelScales::new(inputs.iter().map(|size| size / weight).collect(), outputs)?;
    let factors = loop_factors(nominal, running, &sizes).map_err(|e| match (e, running.gains()) {
        (youla::Error::Unstable { pole, .. }, Some(gains)) => not_stabilised(pole, wrong_gain(nominal, gains)),
        (youla::Error::NotStabilising { pole, .. }, _) => not_stabilised(pole, likely_cause(nominal, running.system())),
        (other, _) => other.into(),
    })?;
    let bezout_residual = factors.bezout_residual(&grid_to_nyquist(nominal.time(), 200))?;
    Ok(LoopFactors { factors, bezout_residual })
}

fn not_stabilised(pole: youla::c64, cause: String) -> Error {
    Error::NotStabilised { model: "nominal", pole: youla::error::Pole(pole).to_string(), cause }
}

/// The closed-loop poles of an observer-based controller are those of A + B F and A + L C: which of the gains is wrong, and whether its
/// sign is.
fn wrong_gain(nominal: &StateSpace<Discrete>, [f, l]: [MatRef<'_, f64>; 2]) -> String {
    let largest = |matrix: youla::Mat<f64>| {
        let poles = youla::linalg::eigenvalues("A with a gain", matrix.as_ref()).unwrap_or_default();
        poles.iter().map(|p| p.norm()).fold(0.0, f64::max)
    };
    let with_f = |sign: f64| largest(nominal.a() + faer::Scale(sign) * (nominal.b() * f));
    let with_l = |sign: f64| largest(nominal.a() + faer::Scale(sign) * (l * nominal.c()));
    let (gain, flipped) = match with_f(1.0) >= 1.0 {
        true => ("state_feedback", with_f(-1.0)),
        false => ("observer_gain", with_l(-1.0)),
    };
    let remedy = match flipped < 1.0 {
        true => format!("with the opposite sign it would be {flipped:.4}: check the sign and `feedback`"),
        false => "the opposite sign does not help: check that the gain is in the states and at the sample time of the discrete-time \
                  nominal model"
            .to_owned(),
    };
    format!("it comes from {gain} in [controller.observer]; {remedy}")
}

/// Why the controller does not stabilise the nominal model: the change of the controller's gain that would make it
/// stabilise: the sign, then the size, the nearest first, with either sign.
fn likely_cause(nominal: &StateSpace<Discrete>, k: &StateSpace<Discrete>) -> String {
    let stabilises = |factor: f64| {
        let scaled = k.map_output(&(eye(k.outputs()) * faer::Scale(factor)));
        with_input_port(&scaled)
            .and_then(|ports| closed_loop(nominal, &ports))
            .and_then(|closed| closed.is_stable())
            .unwrap_or(false)
    };
    let sizes = (1..=STEPS).flat_map(|k| {
        let size = 10f64.powf(0.25 * f64::from(k));
        [1.0 / size, size, -1.0 / size, -size]
    });
    let found = std::iter::once(-1.0).chain(sizes).find(|factor| stabilises(*factor));
    match found {
        Some(-1.0) => "with the opposite sign it would: check the sign, `feedback` in [controller]".to_owned(),
        Some(factor) if factor < 0.0 => format!(
            "{factor:.3e} times the controller would stabilise it: check the sign, `feedback` in [controller], the units of the \
             channels and the gains"
        ),
        Some(factor) => format!(
            "{factor:.3e} times the controller would stabilise it: check the units of the channels, the gains in [controller] and the \
             gain of [nominal]"
        ),
        None => "no other sign or gain of the controller would: check the dynamics in [nominal], its domain, and the sample time"
            .to_owned(),
    }
}

/// Steps of a quarter of a decade in which a gain is tried, up to a million: units differ by no more. Chosen, not measured.
const STEPS: i32 = 24;

/// Angular frequencies, logarithmic over four decades below Nyquist.
fn grid_to_nyquist(time: Discrete, count: usize) -> Vec<f64> {
    let nyquist = std::f64::consts::PI / time.ts();
    (0..count).map(|k| nyquist * 10f64.powf(-4.0 + 4.0 * k as f64 / count as f64)).collect()
}
