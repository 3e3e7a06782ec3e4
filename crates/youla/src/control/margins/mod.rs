//! Robustness margins of a loop with positive feedback `u = K y`: what its gains and phases may change by before it is
//! unstable, channel by channel and in all channels at once.
//!
//! Everything follows from the sensitivities, which are stable systems,
//!
//! ```text
//! S_u = (I - K G)^-1  (at the plant inputs)        S_y = (I - G K)^-1  (at the plant outputs)        T = S - I
//! ```
//!
//! With the other channels closed, channel i has the loop `L = 1 - 1 / S_ii`; the loop is critical where `L = 1`. Peaks are
//! those of [`crate::lti::hinf_norm`], crossings are eigenvalues that are polished; no margin rests on a grid. The test
//! `loops_are_stable_just_inside_and_unstable_just_outside` holds every margin against the poles of the loop that it speaks of.

mod channel;
mod disk;
mod linear;
mod structured;
#[cfg(test)]
mod tests;
mod worst;
mod zone;

pub use channel::{ChannelMargins, DelayLimit, GainLimit, PhaseLimit};
pub use disk::{DiskMargin, DiskMargins};
pub use linear::LinearMargins;
pub use worst::MARGIN_NAMES;
pub use zone::IsoZone;

use super::{closed_loop, with_input_port};
use crate::linalg::eye;
use crate::lti::{PeakGain, PeakOptions, StateSpace, TimeDomain, hinf_norm};
use crate::{Error, Result};
use faer::Scale;

/// Margins of a stable loop, m plant inputs and p plant outputs.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Margins {
    /// Each plant input by itself, the other loops closed; m entries.
    pub inputs: Vec<ChannelMargins>,
    /// Each plant output by itself, the other loops closed; p entries.
    pub outputs: Vec<ChannelMargins>,
    /// All plant inputs at once, each with its own change of gain and phase.
    pub input_disks: DiskMargins,
    /// All plant outputs at once, each with its own change of gain and phase.
    pub output_disks: DiskMargins,
    /// Peak of `(I - K G)^-1`.
    pub input_sensitivity: PeakGain,
    /// Peak of `(I - G K)^-1`.
    pub output_sensitivity: PeakGain,
    /// Peak of `K G (I - K G)^-1`.
    pub input_complementary: PeakGain,
    /// Peak of `G K (I - G K)^-1`.
    pub output_complementary: PeakGain,
    /// Normalised coprime margin b(G, K), 0 to 1, in the units of the channels; see [`super::coprime_margin`].
    pub coprime: f64,
}

impl Margins {
    /// The zone of ISO 14839-3 by the plant outputs, each by itself: the worst of them. `None` without outputs.
    pub fn zone(&self) -> Option<IsoZone> {
        self.outputs.iter().map(|channel| channel.zone).max()
    }

    /// The channel with the least room for more gain: its limit above 1. `None` where no gain is too high.
    pub fn highest_gain(&self) -> Option<GainLimit> {
        let limits = self.channels().filter_map(|channel| channel.highest_gain);
        limits.min_by(|x, y| x.factor.total_cmp(&y.factor))
    }

    /// The channel with the least room for less gain: its limit below 1. `None` where no gain is too low.
    pub fn lowest_gain(&self) -> Option<GainLimit> {
        let limits = self.channels().filter_map(|channel| channel.lowest_gain);
        limits.max_by(|x, y| x.factor.total_cmp(&y.factor))
    }

    /// The smallest phase margin of all channels. `None` where no loop has a gain of 1.
    pub fn phase(&self) -> Option<PhaseLimit> {
        self.channels().filter_map(|channel| channel.phase).min_by(|x, y| x.degrees.total_cmp(&y.degrees))
    }

    /// The smallest delay margin of all channels. `None` where no delay is too long.
    pub fn delay(&self) -> Option<DelayLimit> {
        self.channels().filter_map(|channel| channel.delay).min_by(|x, y| x.seconds.total_cmp(&y.seconds))
    }

    /// All plant inputs, then all plant outputs.
    pub(crate) fn channels(&self) -> impl Iterator<Item = &ChannelMargins> {
        self.inputs.iter().chain(&self.outputs)
    }
}

/// Computes the margins of a plant (m inputs, p outputs) under a controller `u = K y`, in either time domain.
///
/// # Errors
/// [`Error::NotStabilising`] with the pole where the loop is unstable; ports, sample times and [`Error::AlgebraicLoop`] of
/// [`closed_loop`], also where opening one channel leaves a loop that is not well posed.
///
/// ```
/// use youla::{Mat, control::{IsoZone, margins}, linalg::eye, lti::{Discrete, StateSpace}};
/// let time = Discrete::new(1e-3)?;
/// let integrator = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), time)?;
/// let gain = StateSpace::gain(Mat::from_fn(1, 1, |_, _| -0.5), time)?;
/// let found = margins(&integrator, &gain)?;
/// // z = 1 - 0.5 k leaves the unit circle at k = 0 and k = 4.
/// assert!((found.highest_gain().unwrap().factor - 4.0).abs() < 1e-9);
/// assert!(found.lowest_gain().unwrap().factor.abs() < 1e-9);
/// assert_eq!(found.zone(), Some(IsoZone::A));
/// # Ok::<(), youla::Error>(())
/// ```
pub fn margins<T: TimeDomain>(plant: &StateSpace<T>, controller: &StateSpace<T>) -> Result<Margins> {
    let closed = Loop::new(plant, controller)?;
    let (input, output) = (closed.input_sensitivity(), closed.output_sensitivity());
    Ok(Margins {
        inputs: channel::each(&input)?,
        outputs: channel::each(&output)?,
        input_disks: disk::all_channels(&input)?,
        output_disks: disk::all_channels(&output)?,
        input_sensitivity: closed.peak(&Loop::input_sensitivity)?,
        output_sensitivity: closed.peak(&Loop::output_sensitivity)?,
        input_complementary: peak_of(&shifted(&input, -1.0)?)?,
        output_complementary: peak_of(&shifted(&output, -1.0)?)?,
        coprime: closed.coprime_margin()?,
    })
}

/// A stable loop, (v1, n) to (u, y): an excitation at the plant input and noise at the plant output.
pub(super) struct Loop<T: TimeDomain> {
    closed: StateSpace<T>,
    inputs: usize,
    outputs: usize,
}

impl<T: TimeDomain> Loop<T> {
    pub(super) fn new(plant: &StateSpace<T>, controller: &StateSpace<T>) -> Result<Self> {
        let closed = closed_loop(plant, &with_input_port(controller)?)?.balanced()?;
        closed.require_stable("the plant").map_err(|e| match e {
            Error::Unstable { what: model, pole } => Error::NotStabilising { model, pole },
            other => other,
        })?;
        Ok(Loop { closed, inputs: plant.inputs(), outputs: plant.outputs() })
    }

    /// `(I - K G)^-1`.
    pub(super) fn input_sensitivity(&self) -> StateSpace<T> {
        self.closed.part(0..self.inputs, 0..self.inputs)
    }

    /// `(I - G K)^-1`.
    pub(super) fn output_sensitivity(&self) -> StateSpace<T> {
        let outputs = self.inputs..self.inputs + self.outputs;
        self.closed.part(outputs.clone(), outputs)
    }

    pub(super) fn peak(&self, part: &dyn Fn(&Self) -> StateSpace<T>) -> Result<PeakGain> {
        peak_of(&part(self))
    }

    /// `1 / || [I; K] (I - G K)^-1 [I, G] ||`.
    pub(super) fn coprime_margin(&self) -> Result<f64> {
        let peak = self.coprime_peak()?;
        Ok(if peak.upper > 0.0 { 1.0 / peak.upper } else { 0.0 })
    }

    /// Peak of `[I; K] (I - G K)^-1 [I, G]`: from (v1, n) to (u - v1, y).
    fn coprime_peak(&self) -> Result<PeakGain> {
        let s = &self.closed;
        let mut d = s.d().to_owned();
        (0..self.inputs).for_each(|i| d[(i, i)] -= 1.0);
        let gang = StateSpace::new(s.a().to_owned(), s.b().to_owned(), s.c().to_owned(), d, s.time())?;
        peak_of(&gang)
    }
}

fn peak_of<T: TimeDomain>(system: &StateSpace<T>) -> Result<PeakGain> {
    hinf_norm(system, &PeakOptions::default())
}

/// A square system plus a multiple of the identity.
fn shifted<T: TimeDomain>(system: &StateSpace<T>, by: f64) -> Result<StateSpace<T>> {
    let d = system.d() + Scale(by) * eye(system.inputs());
    StateSpace::new(system.a().to_owned(), system.b().to_owned(), system.c().to_owned(), d, system.time())
}
