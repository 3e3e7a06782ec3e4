//! Signal-to-noise ratio of each output with respect to the excitation.
//!
//! With the coherence `gamma^2` between the excitation (the input, where the loop is open) and an output, estimated over K windows
//! and freed of its bias m / K,
//! ```text
//! SNR = sum gamma^2 S_y / sum (1 - gamma^2) S_y
//! ```
//! over all frequencies but zero. Noise, disturbances and nonlinearities count as noise alike.
//!
//! Source: G. C. Carter, C. H. Knapp, A. H. Nuttall, IEEE Trans. Audio Electroacoust. 21 (1973), 337, for the bias.

use super::finding::{Finding, Severity, Test, few};
use crate::error::Result;
use std::f64::consts::TAU;
use youla::MatRef;
use youla::lti::Discrete;
use youla::signal::Channel;
use youla::signal::{Welch, explained_power};

/// Signal and noise in one output.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Power that the excitation explains over the power that it does not.
    pub ratio: f64,
    /// Share of the frequencies at which it explains half of the power or more.
    pub seen: f64,
    /// Lowest and highest of these frequencies, Hz; absent where there are none.
    pub band: Option<[f64; 2]>,
}

/// Windows in a record, about.
/// The bias of the coherence, 1/16 for independent signals, is subtracted. Chosen, not measured.
const WINDOWS: usize = 16;
/// Samples of a window, at most and at least.
const WINDOW: [usize; 2] = [32, 2048];

/// Signal-to-noise ratio of every output with respect to an excitation (samples x m). `None` where the record is too short
/// or the excitation has no power at some frequency.
///
/// # Errors
/// Shapes; [`youla::Error::NotFinite`].
///
/// ```
/// use youla::{Mat, lti::Discrete};
/// use youla_loop::check::noise;
/// let hash = |k: usize| ((k * k * 31 + 7 * k) % 8191) as f64 / 8191.0 - 0.5;
/// let u = Mat::from_fn(8000, 1, |k, _| hash(k));
/// let y = Mat::from_fn(8000, 1, |k, _| hash(k) + 0.1 * hash(3 * k + 1));
/// let found = noise(u.as_ref(), y.as_ref(), Discrete::new(0.01)?)?.unwrap();
/// assert!((50.0..200.0).contains(&found[0].ratio));
/// # Ok::<(), youla_loop::Error>(())
/// ```
pub fn noise(excitation: MatRef<'_, f64>, y: MatRef<'_, f64>, time: Discrete) -> Result<Option<Vec<Noise>>> {
    let Some(mut found) = with_windows(excitation, y, time, WINDOWS)? else { return Ok(None) };
    if let Some(longer) = with_windows(excitation, y, time, FEW)? {
        for (short, long) in found.iter_mut().zip(longer) {
            if long.ratio > short.ratio.max(CLEAR) {
                *short = long;
            }
        }
    }
    Ok(Some(found))
}

/// Windows of the second estimate: slow references and lightly damped modes last longer than a sixteenth of a record, and a memory
/// longer than the window looks like noise. Chosen, not measured.
const FEW: usize = 6;
/// Ratio from which the second estimate, whose bias is larger, is taken. Chosen, not measured.
const CLEAR: f64 = 0.3;

fn with_windows(
    excitation: MatRef<'_, f64>,
    y: MatRef<'_, f64>,
    time: Discrete,
    windows: usize,
) -> Result<Option<Vec<Noise>>> {
    let window = if windows == WINDOWS { (y.nrows() / windows).min(WINDOW[1]) } else { smooth(y.nrows() / windows) };
    if window < WINDOW[0] {
        return Ok(None);
    }
    let welch = Welch { window, ..Welch::default() };
    let found = match explained_power(excitation, y, time, &welch) {
        Ok(found) => found,
        Err(youla::Error::Singular { .. }) => return Ok(None),
        Err(e) => return Err(e.into()),
    };
    let bias = excitation.ncols() as f64 / found.segments as f64;
    if bias > 0.3 {
        return Ok(None);
    }
    let of_output = |i: usize| {
        let (mut signal, mut rest, mut seen) = (0.0, 0.0, Vec::new());
        for (k, omega) in found.omega.iter().enumerate() {
            let coherence = ((found.coherence[(k, i)] - bias) / (1.0 - bias)).clamp(0.0, 1.0);
            signal += coherence * found.power[(k, i)];
            rest += (1.0 - coherence) * found.power[(k, i)];
            if coherence >= 0.5 {
                seen.push(omega / TAU);
            }
        }
        let band = seen.first().zip(seen.last()).map(|(from, to)| [*from, *to]);
        let ratio = if rest > 0.0 { signal / rest } else { f64::INFINITY };
        Noise { ratio, seen: seen.len() as f64 / found.omega.len() as f64, band }
    };
    Ok(Some((0..y.ncols()).map(of_output).collect()))
}

/// The largest number up to this one whose only prime factors are 2, 3 and 5: its Fourier transform is fast.
fn smooth(most: usize) -> usize {
    let without = |mut n: usize, prime: usize| {
        while n.is_multiple_of(prime) {
            n /= prime;
        }
        n
    };
    (1..=most).rev().find(|n| [2, 3, 5].into_iter().fold(*n, without) == 1).unwrap_or(0)
}

/// Share of the frequencies, and signal-to-noise ratio, below which a caution is reported.
/// Two of 100 frequencies, and -13 dB. Chosen, not measured.
const UNSEEN: [f64; 2] = [0.02, 0.05];

impl Noise {
    pub(super) fn finding(&self, record: &str, channel: &Channel) -> Finding {
        let decibel = 10.0 * self.ratio.log10();
        let band = self.band.map_or("at no frequency".to_owned(), |[from, to]| {
            format!("at {} % of the frequencies, from {} Hz to {} Hz", few(100.0 * self.seen), few(from), few(to))
        });
        let what = format!(
            "its signal-to-noise ratio is {decibel:.1} dB; the excitation explains at least half of its power {band}"
        );
        let (severity, advice) = if self.seen < UNSEEN[0] && self.ratio < UNSEEN[1] {
            (Severity::Caution, "Increase the amplitude or the length of the excitation")
        } else {
            (Severity::Note, "")
        };
        Finding::new(Test::Noise, severity, record, what)
            .channel(&channel.name)
            .number("snr_db", decibel)
            .number("seen", self.seen)
            .advice(advice)
    }
}
