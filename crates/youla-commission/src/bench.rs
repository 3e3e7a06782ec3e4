//! What a point works with: the twin in lock-step, or a machine over its link.

use crate::Result;
use crate::campaign::{Campaign, OperatingPoint};
use crate::link::Link;
use crate::parameter::LoadedQ;
use std::path::Path;
use youla_link::{LARGEST_CHUNK, Request};
use youla_rt::{Checksum, Trip};
use youla_twin::rig::{BearingRig, Fidelity, RigParameters};
use youla_twin::{LockStep, LoggedValues, Q_STATES, RunningLoop, Target};

/// Samples of the ramp of an excitation.
pub(crate) const RAMP: u16 = 500;
/// Consecutive samples for which an input may be clipped, and equal values after which an output counts as stuck.
const CLIPPED: u16 = 50;
const STUCK: u16 = 50;

/// A machine with its controller.
pub(crate) enum Bench {
    /// The twin in this process.
    Twin(Box<LockStep>),
    /// Any machine that speaks youla-link.
    Link(Link),
}

impl Bench {
    /// Controller and machine at an operating point, at rest.
    ///
    /// # Errors
    /// [`crate::Error::Controller`].
    pub(crate) fn start(
        campaign: &Campaign,
        at: &OperatingPoint,
        running: &RunningLoop,
        image: Option<&Path>,
    ) -> Result<Self> {
        let limits = &campaign.limits;
        if let Some(address) = &campaign.machine {
            return Ok(Bench::Link(Link::connect(address, [limits.output, limits.input, limits.residual])?));
        }
        let mut parameters = RigParameters::shipped();
        parameters.rotation.cross_coupling.value = at.cross_coupling;
        let plant = BearingRig::new(&parameters, Fidelity::Rotating { rpm: at.rpm }, campaign.seed)?;
        let [y, beta, u, rate] = [limits.output, limits.residual, limits.input, 2.0 * limits.input];
        let of_guard = [y, y, beta, beta, u, u, rate, rate];
        let target = Target::start(image, &running.numbers(&of_guard, [CLIPPED, STUCK, RAMP]))?;
        Ok(Bench::Twin(Box::new(LockStep::new(target, plant)?)))
    }

    /// Runs so many samples, rounded up to whole frames.
    ///
    /// # Errors
    /// [`crate::Error::Controller`] for a controller that stops or sends what cannot be read; [`crate::Error::Refused`] where rows were lost on
    /// the way.
    pub(crate) fn run(&mut self, samples: usize) -> Result<()> {
        match self {
            Bench::Twin(twin) => Ok(twin.run(samples)?),
            Bench::Link(link) => link.run(samples, false),
        }
    }

    /// As [`Bench::run`], until the guard ends the excitation.
    pub(crate) fn excite(&mut self, samples: usize) -> Result<()> {
        match self {
            Bench::Twin(twin) => Ok(twin.excite(samples)?),
            Bench::Link(link) => link.run(samples, true),
        }
    }

    /// Sends a request and awaits its reply.
    ///
    /// # Errors
    /// [`crate::Error::Controller`] where it is refused.
    pub(crate) fn ask(&mut self, request: &Request<'_>) -> Result<()> {
        match self {
            Bench::Twin(twin) => Ok(twin.ask(request).map(drop)?),
            Bench::Link(link) => link.ask(request),
        }
    }

    /// Loads Q without switching to it.
    ///
    /// # Errors
    /// As [`Bench::ask`].
    pub(crate) fn load(&mut self, q: &LoadedQ) -> Result<()> {
        let states = match self {
            Bench::Twin(_) => Q_STATES,
            Bench::Link(link) => link.q_states(),
        };
        self.ask(&Request::BeginQ)?;
        let bytes: Vec<u8> = q.coefficients(states).iter().flat_map(|value| value.to_le_bytes()).collect();
        for (number, values) in bytes.chunks(4 * LARGEST_CHUNK).enumerate() {
            self.ask(&Request::WriteQ { place: (number * LARGEST_CHUNK) as u16, values })?;
        }
        let mut checksum = Checksum::new();
        checksum.append(&bytes);
        self.ask(&Request::CommitQ(checksum.value()))
    }

    /// The rows since the last call.
    pub(crate) fn take_rows(&mut self) -> Vec<LoggedValues> {
        match self {
            Bench::Twin(twin) => twin.take_rows(),
            Bench::Link(link) => link.take_rows(),
        }
    }

    /// What the guard found, while it has tripped.
    pub(crate) fn trip(&self) -> Option<Trip> {
        match self {
            Bench::Twin(twin) => twin.trip(),
            Bench::Link(link) => link.trip(),
        }
    }
}
