//! What a point works with: the twin in lock-step, or a machine over its link.

use crate::Result;
use crate::link::Link;
use crate::parameter::LoadedQ;
use youla_link::{LARGEST_CHUNK, Request};
use youla_rt::{Checksum, Trip};
use youla_twin::{LockStep, LogRow, Q_STATES};

/// A machine with its controller.
pub(crate) enum Bench {
    /// The twin in this process.
    Twin(Box<LockStep>),
    /// Any machine that speaks youla-link.
    Link(Link),
}

impl Bench {
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
    pub(crate) fn take_rows(&mut self) -> Vec<LogRow> {
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
