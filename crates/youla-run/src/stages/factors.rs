//! From nominal model and controller of a run to its coprime factors, with balanced states.

use crate::records::RunRecords;
use crate::settings::{FactorSettings, RealisedController, RunSettings};
use crate::{Error, Result};
use std::path::Path;
use youla::Mat;
use youla::control::{LqrWeights, closed_loop, lqr, observer_controller, with_input_port};
use youla::factor::CoprimeFactors;
use youla::linalg::eye;
use youla::lti::{Discrete, StateSpace};

/// Nominal model and controller as run.toml declares them.
#[derive(Debug, Clone)]
pub struct DeclaredLoop {
    /// The nominal model in its own states.
    pub nominal: StateSpace<Discrete>,
    /// The controller that ran, `u = K y` (positive feedback).
    pub controller: StateSpace<Discrete>,
    /// State feedback F, m x n, and observer gain L, n x p, where the controller is given by them.
    pub gains: Option<[Mat<f64>; 2]>,
}

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
    let nominal = settings.nominal.realise(folder, records.time)?;
    for (what, expected, found) in [
        ("the number of inputs of the nominal model", records.inputs.len(), nominal.inputs()),
        ("the number of outputs of the nominal model", records.outputs.len(), nominal.outputs()),
    ] {
        if expected != found {
            return Err(Error::Method(youla::Error::Ports { what: what.into(), expected, found }));
        }
    }
    let (controller, gains) = declared_controller(settings, folder, records.time)?;
    for (what, expected, found) in [
        ("the number of inputs of the controller", records.outputs.len(), controller.inputs()),
        ("the number of outputs of the controller", records.inputs.len(), controller.outputs()),
    ] {
        if expected != found {
            return Err(Error::Method(youla::Error::Ports { what: what.into(), expected, found }));
        }
    }
    Ok(DeclaredLoop { nominal, controller, gains })
}

/// A controller, and its gains F and L where it is given by them.
type WithGains = (StateSpace<Discrete>, Option<[Mat<f64>; 2]>);

/// The declared controller `u = K y` (positive feedback).
pub(crate) fn declared_controller(settings: &RunSettings, folder: &Path, time: Discrete) -> Result<WithGains> {
    match settings.controller.realise(folder, time)? {
        RealisedController::System(k) => Ok((k, None)),
        RealisedController::Observer { f, l } => {
            let nominal = settings.nominal.realise(folder, time)?;
            check_gains(&nominal, &f, &l)?;
            let k = observer_controller(&nominal, f.as_ref(), l.as_ref()).map_err(|e| e.within("[controller]"))?;
            Ok((k, Some([f, l])))
        }
    }
}

/// Builds the factors that the settings of a run describe; paths in them are relative to `folder`.
///
/// # Errors
/// As [`factorise`], and whatever is wrong with the given model or controller.
pub fn factorise_run(settings: &RunSettings, records: &RunRecords, folder: &Path) -> Result<LoopFactors> {
    let nominal = settings.nominal.realise(folder, records.time)?;
    let controller = settings.controller.realise(folder, records.time)?;
    factorise(&nominal, &controller, records, &settings.factors)
}

fn check_gains(nominal: &StateSpace<Discrete>, f: &Mat<f64>, l: &Mat<f64>) -> Result<()> {
    youla::linalg::check_shape("[controller] state_feedback", f.as_ref(), (nominal.inputs(), nominal.order()))?;
    Ok(youla::linalg::check_shape("[controller] observer_gain", l.as_ref(), (nominal.order(), nominal.outputs()))?)
}

/// Builds the factors of the nominal model and the controller. States are scaled by powers of two first: entries of
/// physical models span 1e6, which would cost three to six digits of (15).
///
/// # Errors
/// [`youla::Error::NotStabilising`] with the pole when the controller does not stabilise the nominal model, shapes, and
/// the conditions of the Riccati equations.
pub fn factorise(
    nominal: &StateSpace<Discrete>,
    controller: &RealisedController,
    records: &RunRecords,
    settings: &FactorSettings,
) -> Result<LoopFactors> {
    let scale = nominal.state_scales()?;
    let balanced = nominal.with_scaled_states(&scale);
    let factors = match controller {
        RealisedController::Observer { f, l } => {
            check_gains(nominal, f, l)?;
            let f = Mat::from_fn(f.nrows(), f.ncols(), |i, j| f[(i, j)] * scale[j]);
            let l = Mat::from_fn(l.nrows(), l.ncols(), |i, j| l[(i, j)] / scale[i]);
            let made = CoprimeFactors::observer(&balanced, f.as_ref(), l.as_ref());
            made.map_err(|e| wrong_gain(e, &balanced, &f, &l))?
        }
        RealisedController::System(k) => {
            let f = state_feedback(&balanced, records, settings.input_weight)?;
            let made = CoprimeFactors::stacked(&balanced, k, f.as_ref(), controller_feedback(k)?.as_ref());
            made.map_err(|e| likely_cause(e, &balanced, k))?
        }
    };
    let bezout_residual = factors.bezout_residual(&grid_to_nyquist(nominal.time(), 200))?;
    Ok(LoopFactors { factors, bezout_residual })
}

/// The closed-loop poles of an observer-based controller are those of A + B F and A + L C: which of the gains is wrong, and whether its
/// sign is.
fn wrong_gain(error: youla::Error, nominal: &StateSpace<Discrete>, f: &Mat<f64>, l: &Mat<f64>) -> Error {
    let youla::Error::Unstable { pole, .. } = error else { return error.into() };
    let largest = |matrix: Mat<f64>| {
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
    let cause = format!("it comes from {gain} in [controller.observer]; {remedy}");
    Error::NotStabilised { pole: youla::error::Pole(pole).to_string(), cause }
}

/// The refusal of a nominal model that the controller does not stabilise, with the change of the controller's gain that would make it
/// stabilise: the sign, then the size, the nearest first, with either sign.
fn likely_cause(error: youla::Error, nominal: &StateSpace<Discrete>, k: &StateSpace<Discrete>) -> Error {
    let youla::Error::NotStabilising { pole, .. } = error else { return error.into() };
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
    let cause = match found {
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
    };
    let pole = youla::error::Pole(pole).to_string();
    Error::NotStabilised { pole, cause }
}

/// Steps of a quarter of a decade in which a gain is tried, up to a million: units differ by no more. Chosen, not measured.
const STEPS: i32 = 24;

/// Angular frequencies, logarithmic over four decades below Nyquist.
fn grid_to_nyquist(time: Discrete, count: usize) -> Vec<f64> {
    let nyquist = std::f64::consts::PI / time.ts();
    (0..count).map(|k| nyquist * 10f64.powf(-4.0 + 4.0 * k as f64 / count as f64)).collect()
}

/// LQR with weights `1 / rms(y)^2` on the outputs and `input_weight / rms(u)^2` on the inputs, rms on the estimation records.
fn state_feedback(plant: &StateSpace<Discrete>, records: &RunRecords, input_weight: f64) -> Result<Mat<f64>> {
    let (u, y) = records.sizes();
    let outputs = diagonal(y.iter().map(|s| 1.0 / (s * s)));
    let inputs = diagonal(u.iter().map(|s| input_weight / (s * s)));
    let gain = || Ok(lqr(plant, &LqrWeights::on_outputs(plant, outputs.as_ref(), inputs.as_ref())?)?.f);
    gain().map_err(|e: Error| e.within("state feedback F of the nominal model"))
}

fn diagonal(values: impl Iterator<Item = f64>) -> Mat<f64> {
    let values: Vec<f64> = values.collect();
    Mat::from_fn(values.len(), values.len(), |i, j| if i == j { values[i] } else { 0.0 })
}

/// Feedback of the controller's right factors: zero for a stable controller (U = K, V = I), else an LQR of its own.
fn controller_feedback(k: &StateSpace<Discrete>) -> Result<Mat<f64>> {
    if k.is_stable()? {
        return Ok(Mat::zeros(k.inputs(), k.order()));
    }
    let weights = LqrWeights { q: eye(k.order()), r: eye(k.inputs()), s: None };
    Ok(lqr(k, &weights).map_err(|e| e.within("state feedback of the controller's factors"))?.f)
}
