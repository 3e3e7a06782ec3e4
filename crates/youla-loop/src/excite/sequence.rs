//! The sequence: shape, notches, ramps.
//!
//! A multisine leaves out the lines in the bands and those nearer to them than two lines are wide. The other shapes pass a filter
//! without phase, by the Fourier transform of the whole sequence: 0 within a band, 1 from half its width beyond its edges on, a
//! raised cosine between. The filter looks ahead, which a sequence that is made before the experiment may; a binary sequence is no
//! longer binary behind it, and is scaled so that its greatest absolute value is the amplitude again.

use super::options::{ExcitationNotch, ExciteOptions, InputOrder, Shape, check, spread};
use crate::error::Result;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rustfft::FftPlanner;
use std::f64::consts::{PI, TAU};
use youla::lti::Discrete;
use youla::signal::{Chirp, Excitation, Multisine, Prbs, SquareWaves, fade};
use youla::{Mat, c64};

/// Most bits of a register, [`Prbs::order`].
/// A period of 1048575 samples; longer ones exceed usual experiments. Chosen, not measured.
const LONGEST_REGISTER: usize = 20;

/// A sequence and its description.
pub(super) struct Sequence {
    /// samples x m.
    pub(super) alpha: Mat<f64>,
    /// The shape with its parameters, in words.
    pub(super) shape: String,
    /// How the inputs are made independent.
    pub(super) independence: String,
    /// How the notches were made.
    pub(super) filter: Option<String>,
}

pub(super) fn sequence(options: &ExciteOptions, m: usize, time: Discrete) -> Result<Sequence> {
    options.check(time.ts())?;
    let samples = options.samples(time.ts())?;
    let amplitude = spread("amplitudes", &options.amplitude, m, 0.0)?;
    let largest = amplitude.iter().copied().fold(0.0, f64::max);
    check("the largest amplitude", largest, largest > 0.0, "positive")?;
    let in_turn = m > 1 && (options.inputs == InputOrder::OneAtATime || options.shape == Shape::Chirp);
    let (parts, per_part) = if in_turn { (m, 1) } else { (1, m) };
    let length = samples / parts;
    let (excitation, shape) = excitation(options, length, time)?;
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let ramp = options.ramp / time.ts();
    let fits = options.ramp >= 0.0 && 2.0 * ramp <= length as f64 * (1.0 + 1e-12);
    check(
        "the ramp in seconds",
        options.ramp,
        fits,
        "at least 0 and at most half of the sequence, or of the part of one input",
    )?;
    let filter = options.notch.as_ref().filter(|_| options.shape != Shape::Multisine);
    let mut alpha = Mat::zeros(samples, m);
    for part in 0..parts {
        let mut signal = excitation.generate(length, per_part, time, &mut rng)?;
        if let Some(notch) = filter {
            without_bands(&mut signal, notch, time);
        }
        fade(&mut signal, ramp);
        for (j, column) in signal.col_iter().enumerate() {
            let input = part + j;
            column.iter().enumerate().for_each(|(k, x)| alpha[(part * length + k, input)] = amplitude[input] * x);
        }
    }
    let filter = options.notch.as_ref().map(|_| match filter {
        Some(_) => "filtered without phase, over the whole sequence, then scaled to the amplitude".to_owned(),
        None => "lines left out".to_owned(),
    });
    Ok(Sequence { alpha, shape, independence: independence(options.shape, m, in_turn), filter })
}

/// The generator at unit amplitude, and what it does in words.
fn excitation(options: &ExciteOptions, length: usize, time: Discrete) -> Result<(Excitation, String)> {
    let ([low, high], ts) = (options.band, time.ts());
    Ok(match options.shape {
        Shape::Square => {
            let half = |hz: f64| (0.5 / (hz * ts)).round().max(1.0) as usize;
            let (hold_min, hold_max) = (half(high), half(low));
            let text = format!("square waves, half periods of {hold_min} to {hold_max} samples");
            (Excitation::SquareWaves(SquareWaves { hold_min, hold_max, amplitude: 1.0 }), text)
        }
        Shape::Prbs => {
            // The power of bits of length T has fallen to half at 0.44 / T; a period shorter than the record has few lines.
            let hold = ((0.44 / (high * ts)) as usize).max(1);
            let bits = |seconds: f64| ((seconds / (ts * hold as f64) + 1.0).log2().ceil() as usize).max(2);
            let order = bits(1.0 / low).max(bits((length / options.periods) as f64 * ts).min(LONGEST_REGISTER));
            let period = hold as f64 * ((order as f64).exp2() - 1.0) * ts;
            let text = format!("PRBS, bits of {hold} samples, register of {order} bits, period {period:.4} s");
            (Excitation::Prbs(Prbs { order, hold, amplitude: 1.0 }), text)
        }
        Shape::Multisine => {
            let period = length / options.periods;
            // Twice the resolution of the record beyond the edges: so wide is a line.
            let guard = 2.0 / (length as f64 * ts);
            let wider = |[low, high]: [f64; 2]| [TAU * (low - guard), TAU * (high + guard)];
            let omitted = options.notch.iter().flat_map(ExcitationNotch::bands).map(wider).collect();
            let sines =
                Multisine { period, omega_min: TAU * low, omega_max: Some(TAU * high), omitted, amplitude: 1.0 };
            let spacing = 1.0 / (period as f64 * ts);
            (Excitation::Multisine(sines), format!("multisine, period {period} samples, lines every {spacing:.4} Hz"))
        }
        Shape::Chirp => {
            let chirp = Chirp { omega_start: TAU * low, omega_end: TAU * high, amplitude: 1.0 };
            (Excitation::Chirp(chirp), format!("chirp, {low} to {high} Hz in {:.4} s", length as f64 * ts))
        }
    })
}

fn independence(shape: Shape, m: usize, in_turn: bool) -> String {
    match (m, in_turn, shape) {
        (1, ..) => "one input",
        (_, true, _) => "one input at a time, each in an equal part of the length",
        (_, _, Shape::Multisine) => "orthogonal: lines of their own in turn",
        (_, _, Shape::Prbs) => "one sequence, shifted by equal parts of its period",
        (_, _, Shape::Square | Shape::Chirp) => "drawn independently from one seeded generator",
    }
    .to_owned()
}

/// Takes the bands out of every channel and scales it to a greatest absolute value of 1.
fn without_bands(signal: &mut Mat<f64>, notch: &ExcitationNotch, time: Discrete) {
    let n = signal.nrows();
    let mut planner = FftPlanner::new();
    let (forward, back) = (planner.plan_fft_forward(n), planner.plan_fft_inverse(n));
    for j in 0..signal.ncols() {
        let mut buffer: Vec<c64> = signal.col(j).iter().map(|x| c64::new(*x, 0.0)).collect();
        forward.process(&mut buffer);
        for (k, x) in buffer.iter_mut().enumerate() {
            *x *= gain(notch, k.min(n - k) as f64 / (n as f64 * time.ts()));
        }
        back.process(&mut buffer);
        let peak = buffer.iter().map(|x| x.re.abs()).fold(0.0, f64::max);
        // What lies in the bands altogether stays as it was; the remaining energy says so.
        if peak > 1e-9 * n as f64 {
            signal.col_mut(j).iter_mut().zip(&buffer).for_each(|(x, filtered)| *x = filtered.re / peak);
        }
    }
}

/// The filter at a frequency in Hz.
fn gain(notch: &ExcitationNotch, hz: f64) -> f64 {
    let one = |harmonic: &u32| {
        let beyond = ((hz - f64::from(*harmonic) * notch.hz).abs() - notch.width / 2.0) / (notch.width / 2.0);
        0.5 - 0.5 * (PI * beyond.clamp(0.0, 1.0)).cos()
    };
    notch.harmonics.iter().map(one).product()
}
