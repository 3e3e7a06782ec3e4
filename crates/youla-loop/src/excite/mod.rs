//! Excitation for a machine that runs under its controller: a sequence for the port alpha of Fig. 3 (or for the plant input), the
//! predicted response of the nominal loop, and the predicted accuracy of the modes.
//!
//! ```text
//! u = F xh + alpha          the port alpha of J_K (22)
//! u = K y + alpha           the plant input
//! ```
//!
//! | file | content |
//! |---|---|
//! | `options` | the options |
//! | `sequence` | shape, notches, ramps |
//! | `energy` | where the energy lies |
//! | `guard` | the predicted u and y, against limits and for wrong models |
//! | `information` | the Cramér-Rao bound of natural frequencies and damping ratios |
//! | `summary` | the figures |
//! | `noise` | the noise of the outputs from a record without excitation |

#[cfg(test)]
mod bound;
mod energy;
mod guard;
mod information;
mod noise;
mod options;
mod pole;
mod sequence;
mod summary;
#[cfg(test)]
mod tests;

pub use guard::ModelErrorEffect;
pub use information::ModeAccuracy;
pub use noise::output_noise;
pub use options::{ExcitationNotch, ExciteOptions, InputOrder, Length, Shape};
pub use summary::{ExcitedInput, ExcitedSummary, NotchEnergy, PredictedPeak};

use crate::error::{Error, Result};
use energy::Energy;
use faer::Scale;
use options::spread;
use summary::{inputs, needed, notches, predicted};
use youla::Mat;
use youla::lti::{Discrete, Partitioned, StateSpace};
use youla::signal::Channel;

/// The loop that is to be excited.
#[derive(Debug, Clone, Copy)]
pub struct LoopToExcite<'a> {
    /// The nominal model, m inputs and p outputs.
    pub nominal: &'a StateSpace<Discrete>,
    /// The controller with its port, `(y, alpha)` to `(u, ..)`: `J_K`, or a controller from
    /// [`with_input_port`](youla::control::with_input_port).
    pub controller: &'a Partitioned<Discrete>,
    /// The inputs of the plant.
    pub inputs: &'a [Channel],
    /// The outputs of the plant.
    pub outputs: &'a [Channel],
}

/// An excitation and its predicted effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Excited {
    /// The sequence, samples x m.
    pub alpha: Mat<f64>,
    /// The clock.
    pub time: Discrete,
    /// Predicted input of the plant, samples x m, longer than the sequence by the time in which the loop comes to rest.
    pub u: Mat<f64>,
    /// Predicted output, samples x p, as long as `u`.
    pub y: Mat<f64>,
    /// The figures.
    pub summary: ExcitedSummary,
}

/// Generates an excitation; predicts the response of the nominal loop and the accuracy of the modes.
///
/// # Errors
/// [`Error::BeyondLimit`] where a limit is exceeded and `scale_to_limit` is off; [`youla::Error::NotStabilising`] with the pole of a nominal loop
/// that is not stable; [`youla::Error::OutOfRange`] and [`youla::Error::Ports`] for options outside of their range.
///
/// ```
/// use youla::control::with_input_port;
/// use youla_loop::excite::{LoopToExcite, ExciteOptions, Length, excite};
/// use youla::{Mat, linalg::eye, lti::{Discrete, StateSpace}, signal::Channel};
/// let time = Discrete::new(1e-3)?;
/// let nominal = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), time)?;
/// let controller = with_input_port(&StateSpace::gain(Mat::from_fn(1, 1, |_, _| -0.1), time)?)?;
/// let (inputs, outputs) = ([Channel::new("u", "V")], [Channel::new("y", "um")]);
/// let on = LoopToExcite { nominal: &nominal, controller: &controller, inputs: &inputs, outputs: &outputs };
/// let options = ExciteOptions {
///     amplitude: vec![1.0],
///     band: [5.0, 50.0],
///     length: Length::Seconds(2.0),
///     limit_output: vec![3.0],
///     scale_to_limit: true,
///     ..ExciteOptions::default()
/// };
/// let found = excite(&on, &options)?;
/// assert!((found.summary.predicted[1].peak - 3.0).abs() < 1e-9);
/// # Ok::<(), youla_loop::Error>(())
/// ```
pub fn excite(on: &LoopToExcite, options: &ExciteOptions) -> Result<Excited> {
    let (time, m, p) = (on.nominal.time(), on.nominal.inputs(), on.nominal.outputs());
    for (what, expected, found) in [("input", m, on.inputs.len()), ("output", p, on.outputs.len())] {
        if expected != found {
            return Err(Error::Method(youla::Error::Ports {
                what: format!("the number of {what} channels"),
                expected,
                found,
            }));
        }
    }
    let mut sequence = sequence::sequence(options, m, time)?;
    let limits = limits(options, m, p)?;
    let noise = match &options.noise[..] {
        [] => Vec::new(),
        given => spread("noise levels", given, p, f64::MIN_POSITIVE)?,
    };
    let closed = guard::loop_of(on.nominal, on)?;
    let mut response = guard::respond(&closed, sequence.alpha.as_ref(), guard::tail(&closed, sequence.alpha.nrows())?)?;
    let factor = keep(on, options, &response.peaks(), &limits)?;
    if let Some(factor) = factor {
        sequence.alpha = Scale(factor) * &sequence.alpha;
        response = response.scaled(factor);
    }
    let model_error = guard::model_error(on, sequence.alpha.as_ref(), options)?;
    let duration = sequence.alpha.nrows() as f64 * time.ts();
    let mut modes = match &noise[..] {
        [] => Vec::new(),
        noise => information::accuracy(on.nominal, response.u.as_ref(), noise)?,
    };
    let needed = needed(&mut modes, options.damping_deviation, duration);
    let energies: Vec<Energy> = (0..m).map(|j| Energy::of(sequence.alpha.as_ref(), j, time)).collect();
    let summary = ExcitedSummary {
        shape: sequence.shape,
        independence: sequence.independence,
        seed: options.seed,
        samples: sequence.alpha.nrows(),
        sample_time: time.ts(),
        duration,
        band: options.band,
        inputs: inputs(on, &sequence.alpha, &energies, options),
        filter: sequence.filter,
        notches: notches(&energies, options),
        predicted: predicted(on, &response, &limits, &model_error),
        model_error,
        scaled_by: factor,
        noise,
        modes,
        damping_deviation: options.damping_deviation,
        needed,
    };
    Ok(Excited { alpha: sequence.alpha, time, u: response.u, y: response.y, summary })
}

/// The limits of inputs and outputs.
fn limits(options: &ExciteOptions, m: usize, p: usize) -> Result<[Option<Vec<f64>>; 2]> {
    let one = |what: &str, given: &[f64], channels: usize| match given {
        [] => Ok(None),
        given => spread(what, given, channels, f64::MIN_POSITIVE).map(Some),
    };
    Ok([one("limits of the inputs", &options.limit_input, m)?, one("limits of the outputs", &options.limit_output, p)?])
}

/// The largest factor that keeps all limits, if one is exceeded.
fn keep(
    on: &LoopToExcite,
    options: &ExciteOptions,
    peaks: &[Vec<f64>; 2],
    limits: &[Option<Vec<f64>>; 2],
) -> Result<Option<f64>> {
    let mut worst: Option<(f64, &Channel, f64, f64)> = None;
    for ((channels, peaks), limits) in [on.inputs, on.outputs].into_iter().zip(peaks).zip(limits) {
        let Some(limits) = limits else { continue };
        for ((channel, peak), limit) in channels.iter().zip(peaks).zip(limits) {
            let factor = limit / peak;
            if *peak > *limit && worst.is_none_or(|(least, ..)| factor < least) {
                worst = Some((factor, channel, *peak, *limit));
            }
        }
    }
    match worst {
        None => Ok(None),
        Some((factor, ..)) if options.scale_to_limit => Ok(Some(factor)),
        Some((factor, channel, predicted, limit)) => {
            let unit = if channel.unit.is_empty() { String::new() } else { format!(" {}", channel.unit) };
            let amplitudes = spread("amplitudes", &options.amplitude, on.inputs.len(), 0.0)?;
            let permitted = amplitudes.iter().map(|a| factor * a).collect();
            Err(Error::BeyondLimit { channel: channel.name.clone(), predicted, limit, unit, permitted })
        }
    }
}
