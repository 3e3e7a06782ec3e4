//! The state of an excited loop in one number of 24 bits, which `f32` holds exactly.

use crate::{Cause, Trip};

/// Where an excited loop stands. The controller runs in all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// No excitation, or one that runs out after a stop.
    Idle = 0,
    /// An excitation may start.
    Armed = 1,
    /// Excited, the ramps included.
    Exciting = 2,
    /// The guard has ended the excitation.
    Tripped = 3,
}

/// Bits 0 and 1: phase; 2 and 3: connected bank of Q, 0 for none; 4: a Q fades out; 5: an input was clipped; 8 to 11: cause of the trip;
/// 12 to 15: its channel, counted from 1; 16 to 23: outputs that are not used because they are not finite or stuck (the first eight).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Status(u32);

impl Status {
    /// From its bits.
    #[must_use]
    pub const fn from_bits(bits: u32) -> Self {
        Status(bits & 0x00ff_ffff)
    }

    /// Its bits, below 2^24.
    #[must_use]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// The phase.
    #[must_use]
    pub const fn phase(self) -> Phase {
        match self.0 & 3 {
            0 => Phase::Idle,
            1 => Phase::Armed,
            2 => Phase::Exciting,
            _ => Phase::Tripped,
        }
    }

    /// The connected bank of Q, 1 or 2; 0 where Q = 0.
    #[must_use]
    pub const fn bank(self) -> u32 {
        self.0 >> 2 & 3
    }

    /// Whether a Q that was disconnected fades out.
    #[must_use]
    pub const fn is_fading(self) -> bool {
        self.0 & 1 << 4 != 0
    }

    /// Whether an input was clipped.
    #[must_use]
    pub const fn is_clipped(self) -> bool {
        self.0 & 1 << 5 != 0
    }

    /// Why the guard has ended the excitation.
    #[must_use]
    pub fn trip(self) -> Option<Trip> {
        let cause = Cause::from_code(self.0 >> 8 & 15)?;
        Some(Trip { cause, channel: (self.0 >> 12 & 15) as u8 })
    }

    /// Whether an output, counted from 1, is not used.
    #[must_use]
    pub const fn is_masked(self, output: u32) -> bool {
        1 <= output && output <= 8 && self.0 >> (15 + output) & 1 == 1
    }

    pub(crate) fn new(phase: Phase, trip: Option<Trip>) -> Self {
        let of_trip = trip.map_or(0, |trip| (trip.cause as u32) << 8 | u32::from(trip.channel.min(15)) << 12);
        Status(phase as u32 | of_trip)
    }

    pub(crate) fn with(self, bits: u32) -> Self {
        Status::from_bits(self.0 | bits)
    }
}
