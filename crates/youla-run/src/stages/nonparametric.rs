//! The plant without a model, at the lines of a periodic excitation with noise and distortion told apart, or in windows of other ones.

use crate::stages::context::RunContext;
use crate::stages::responses::is_constant;
use crate::{Error, Result};
use youla::signal::LoopRecord;
use youla::signal::{LineResponse, PeriodicExperiment, detect_period, line_response, local_response};
use youla::{Error as Method, Mat, MatRef};

/// The loop and its plant without a model.
#[derive(Debug, Clone)]
pub struct LinesOfRun {
    /// From the excitation to u and y.
    pub closed: LineResponse,
    /// G.
    pub plant: LineResponse,
    /// Whether the excitation is periodic; else the lines are the middles of windows of local polynomials.
    pub periodic: bool,
}

/// Most windows of a response by local polynomials: more of them are closer than the points of a figure.
const WINDOWS: usize = 400;

/// What a known excitation shows without a model: at its lines where it is periodic, else by local polynomials. `None` where no
/// excitation is known, or none that reaches all inputs.
///
/// The error is the reason why a periodic excitation shows nothing, for example inputs that are not excited independently.
pub(crate) fn lines(run: RunContext<'_>) -> Option<Result<LinesOfRun>> {
    let records = &run.records.estimation;
    let excitations: Vec<MatRef<'_, f64>> = records.iter().map(excitation).collect::<Option<_>>()?;
    let signals: Vec<Mat<f64>> = records.iter().map(inputs_and_outputs).collect();
    let both = excitations.iter().zip(&signals);
    let experiments: Vec<_> = both.map(|(d, z)| PeriodicExperiment { d: d.as_ref(), z: z.as_ref() }).collect();
    let periodic = !matches!(detect_period(excitations.first()?.as_ref()), Err(Method::NotPeriodic { .. }));
    let time = run.records.time;
    let closed = match periodic {
        true => line_response(&experiments, time),
        false => {
            let longest = records.iter().map(LoopRecord::samples).max()?;
            local_response(&experiments, time, longest.div_ceil(2 * WINDOWS))
        }
    };
    let found = closed.and_then(|closed| Ok(LinesOfRun { plant: closed.plant()?, closed, periodic }));
    (periodic || found.is_ok()).then(|| found.map_err(Error::from))
}

/// The one signal that moves the loop, with a channel for each input.
fn excitation(record: &LoopRecord) -> Option<MatRef<'_, f64>> {
    let known = [record.input_excitation(), record.alpha(), record.reference()];
    let moving: Vec<MatRef<'_, f64>> = known.into_iter().flatten().filter(|d| !is_constant(*d)).collect();
    match moving[..] {
        [d] if d.ncols() == record.inputs() => Some(d),
        _ => None,
    }
}

fn inputs_and_outputs(record: &LoopRecord) -> Mat<f64> {
    let m = record.inputs();
    let value = |t: usize, k: usize| if k < m { record.u()[(t, k)] } else { record.y()[(t, k - m)] };
    Mat::from_fn(record.samples(), m + record.outputs(), value)
}
