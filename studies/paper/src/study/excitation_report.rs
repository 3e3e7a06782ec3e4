//! What an excitation offers to identification: its size, where its power lies, and its order of persistency.
//!
//! The spectrum is that of [`cross_spectrum`] of a channel with itself. The rule for persistency is the rank of the
//! block-Hankel matrix, see [`persistency`]: order s is reached when the matrix with s block rows has rank s times the
//! channels. A subspace method with past and future horizon s needs order 2 s.

use crate::Result;
use faer::MatRef;
use serde::{Deserialize, Serialize};
use youla::lti::Discrete;
use youla::signal::{Persistency, Welch, cross_spectrum, persistency, persistency_order};

/// Part of the power that may lie below the band of a channel, and above it.
const OUTSIDE: f64 = 0.05;

/// What is asked of an excitation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExcitationReportOptions {
    /// Order of persistency that is needed.
    pub wanted_order: usize,
    /// Largest order that is looked for.
    pub highest_order: usize,
    /// How the spectrum is estimated.
    pub welch: Welch,
}

impl Default for ExcitationReportOptions {
    /// The order that [`youla::identify::subspace::SubspaceOptions`] needs by default, and half as much above it.
    fn default() -> Self {
        let welch = Welch { remove_mean: false, ..Welch::default() };
        ExcitationReportOptions { wanted_order: 40, highest_order: 60, welch }
    }
}

/// What [`describe_excitation`] finds.
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitationReport {
    /// Each channel alone.
    pub channels: Vec<ExcitedChannel>,
    /// Angular frequencies of the spectra, rad/s.
    pub omega: Vec<f64>,
    /// The block-Hankel matrix of all channels with the wanted order; [`Persistency::require`] refuses what is too poor.
    pub persistency: Persistency,
    /// Largest order of persistency of all channels together, at most the highest one that was looked for.
    pub order: usize,
}

/// One channel of an excitation.
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitedChannel {
    /// Root mean square, of the signal with its mean.
    pub rms: f64,
    /// Crest factor: greatest absolute value over root mean square.
    pub crest: f64,
    /// Power spectrum, one-sided density per Hz, one value for each frequency of the report.
    pub density: Vec<f64>,
    /// The band that holds 90 % of the power.
    pub band: PowerBand,
    /// Largest order of persistency of this channel alone, at most the highest one that was looked for.
    pub order: usize,
}

/// A band with 5 % of the power of the spectrum below it and 5 % above, to a line of the spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerBand {
    /// Angular frequency of its first line, rad/s.
    pub omega_min: f64,
    /// Angular frequency of its last line, rad/s.
    pub omega_max: f64,
}

/// Describes an excitation, samples x channels.
///
/// A signal that is too poor is described, not refused; see [`Persistency::require`].
///
/// # Errors
/// [`youla::Error::OutOfRange`] for a channel without power, for a window longer than the signal and for more block rows
/// than samples; [`youla::Error::NotFinite`]; [`youla::Error::NoConvergence`] of the singular values.
///
/// ```
/// use rand::SeedableRng;
/// use youla::{lti::Discrete, signal::{Excitation, Prbs}};
/// use youla_paper::study::{ExcitationReportOptions, describe_excitation};
/// let time = Discrete::new(2e-4)?;
/// let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
/// let alpha = Excitation::Prbs(Prbs::default()).generate(8000, 2, time, &mut rng)?;
/// let report = describe_excitation(alpha.as_ref(), time, &ExcitationReportOptions::default())?;
/// report.persistency.require("alpha")?;
/// assert_eq!((report.order, report.channels[0].crest), (60, 1.0));
/// // Bits of 4 samples have a clock of 1250 Hz; the lobes above it hold a tenth of the power.
/// assert!(report.channels[0].band.omega_max > 2.0 * std::f64::consts::PI * 1250.0);
/// # Ok::<(), youla_paper::Error>(())
/// ```
pub fn describe_excitation(
    signal: MatRef<f64>,
    time: Discrete,
    options: &ExcitationReportOptions,
) -> Result<ExcitationReport> {
    let persistency = persistency(signal, options.wanted_order)?;
    let order = persistency_order(signal, options.highest_order)?;
    let mut omega = Vec::new();
    let mut channels = Vec::new();
    for j in 0..signal.ncols() {
        let channel = signal.subcols(j, 1);
        let rms = channel.norm_l2() / (channel.nrows() as f64).sqrt();
        if rms.is_nan() || rms <= 0.0 {
            let what = format!("the root mean square of channel {} of an excitation", j + 1);
            return Err(youla::Error::OutOfRange { what, value: rms, must: "positive" }.into());
        }
        let spectrum = cross_spectrum(channel, channel, time, &options.welch)?.density;
        let density: Vec<f64> = spectrum.entry(0, 0).iter().map(|s| s.re).collect();
        omega = spectrum.omega;
        let band = power_band(&omega, &density);
        let order = persistency_order(channel, options.highest_order)?;
        channels.push(ExcitedChannel { rms, crest: channel.norm_max() / rms, density, band, order });
    }
    Ok(ExcitationReport { channels, omega, persistency, order })
}

/// The first lines up to which the share [`OUTSIDE`] and all but that share of the power lie.
fn power_band(omega: &[f64], density: &[f64]) -> PowerBand {
    let total: f64 = density.iter().sum();
    let line = |share: f64| {
        let mut power = 0.0;
        let reached = density.iter().position(|d| {
            power += d;
            power >= share * total
        });
        omega[reached.unwrap_or(omega.len() - 1)]
    };
    PowerBand { omega_min: line(OUTSIDE), omega_max: line(1.0 - OUTSIDE) }
}
