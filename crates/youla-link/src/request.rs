//! Requests of the host, and the reply to each.

use crate::bytes::{Reader, Writer};
use youla_rt::Status;

/// Largest number of coefficients of Q in one request.
pub const LARGEST_CHUNK: usize = 32;

/// Where an excitation comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SequenceOrigin {
    /// The sequence that the machine holds, for example the table of `youla excite`.
    Own,
    /// A pseudo-random binary sequence, independent for each input.
    Prbs {
        /// Bits of the shift register.
        order: u8,
        /// Samples of each value.
        hold: u16,
    },
}

/// What the host asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Request<'a> {
    /// The machine's description.
    Describe,
    /// A sign of life, and the status in the reply.
    Alive,
    /// Allows a start.
    Arm,
    /// Starts the excitation.
    Start {
        /// Where it comes from.
        source: SequenceOrigin,
        /// Factor of the machine's own sequence, amplitude of the others.
        amplitude: f32,
    },
    /// Ramps the excitation out. Executed always: from any host, whatever its numbers.
    Stop,
    /// Begins to load Q.
    BeginQ,
    /// Coefficients of Q, at most [`LARGEST_CHUNK`], little-endian: `place` of the first one.
    WriteQ {
        /// Number of the first coefficient, from 0.
        place: u16,
        /// Four bytes each.
        values: &'a [u8],
    },
    /// Q is complete and has this checksum.
    CommitQ(u32),
    /// Connects the Q that was loaded last.
    SwitchQ,
    /// Q = 0.
    ReleaseQ,
    /// The coefficients of the Q that runs, from `place` on.
    ReadQ {
        /// Number of the first coefficient, from 0.
        place: u16,
    },
}

impl<'a> Request<'a> {
    /// Whether it changes nothing, so that it may come late or twice.
    #[must_use]
    pub fn only_reads(&self) -> bool {
        matches!(self, Request::Describe | Request::Alive | Request::ReadQ { .. })
    }

    /// From the body of a frame.
    #[must_use]
    pub fn read(body: &'a [u8]) -> Option<Self> {
        let mut reader = Reader(body);
        let request = match reader.u8()? {
            0 => Request::Describe,
            1 => Request::Alive,
            2 => Request::Arm,
            3 => {
                let source = match (reader.u8()?, reader.u8()?, reader.u16()?) {
                    (0, 0, 0) => SequenceOrigin::Own,
                    (1, order, hold) => SequenceOrigin::Prbs { order, hold },
                    _ => return None,
                };
                Request::Start { source, amplitude: reader.f32()? }
            }
            4 => Request::Stop,
            5 => Request::BeginQ,
            6 => {
                let place = reader.u16()?;
                let values = core::mem::take(&mut reader.0);
                let fits = !values.is_empty() && values.len() % 4 == 0 && values.len() <= 4 * LARGEST_CHUNK;
                return fits.then_some(Request::WriteQ { place, values });
            }
            7 => Request::CommitQ(reader.u32()?),
            8 => Request::SwitchQ,
            9 => Request::ReleaseQ,
            10 => Request::ReadQ { place: reader.u16()? },
            _ => return None,
        };
        reader.rest().is_empty().then_some(request)
    }

    /// Into the body of a frame; returns its length, `None` where the buffer is too short.
    pub fn write(&self, buffer: &mut [u8]) -> Option<usize> {
        let mut writer = Writer::new(buffer);
        match *self {
            Request::Describe => writer.put(&[0])?,
            Request::Alive => writer.put(&[1])?,
            Request::Arm => writer.put(&[2])?,
            Request::Start { source, amplitude } => {
                let (kind, order, hold) = match source {
                    SequenceOrigin::Own => (0, 0, 0),
                    SequenceOrigin::Prbs { order, hold } => (1, order, hold),
                };
                writer.put(&[3, kind, order])?;
                writer.put(&hold.to_le_bytes())?;
                writer.put(&amplitude.to_le_bytes())?;
            }
            Request::Stop => writer.put(&[4])?,
            Request::BeginQ => writer.put(&[5])?,
            Request::WriteQ { place, values } => {
                writer.put(&[6])?;
                writer.put(&place.to_le_bytes())?;
                writer.put(values)?;
            }
            Request::CommitQ(checksum) => {
                writer.put(&[7])?;
                writer.put(&checksum.to_le_bytes())?;
            }
            Request::SwitchQ => writer.put(&[8])?,
            Request::ReleaseQ => writer.put(&[9])?,
            Request::ReadQ { place } => {
                writer.put(&[10])?;
                writer.put(&place.to_le_bytes())?;
            }
        }
        Some(writer.length())
    }
}

/// What became of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Outcome {
    /// Done.
    Done = 0,
    /// The request is not known, or not whole.
    NotUnderstood = 1,
    /// The host has another description of the machine: ask for it again.
    OtherSchema = 2,
    /// A start without arm.
    NotArmed = 3,
    /// An excitation runs.
    Exciting = 4,
    /// An output is not finite or stuck.
    Sensor = 5,
    /// The guard has tripped; arm again.
    Tripped = 6,
    /// The bank of Q still fades out.
    Fading = 7,
    /// A coefficient is not finite.
    NotFinite = 8,
    /// Another number of coefficients.
    Count = 9,
    /// Another checksum.
    Checksum = 10,
    /// No Q is loaded, or none runs.
    NoQ = 11,
    /// The excitation that was asked for is not possible.
    Source = 12,
    /// Older than the last request of its host: late on the way, not executed. To a host without a place, the data are the number (`u32`) above
    /// which it begins.
    Stale = 13,
    /// Made for the machine before it started again.
    OtherLife = 14,
    /// Not signed with the key of the machine.
    Key = 15,
}

impl Outcome {
    const ALL: [Outcome; 16] = [
        Outcome::Done,
        Outcome::NotUnderstood,
        Outcome::OtherSchema,
        Outcome::NotArmed,
        Outcome::Exciting,
        Outcome::Sensor,
        Outcome::Tripped,
        Outcome::Fading,
        Outcome::NotFinite,
        Outcome::Count,
        Outcome::Checksum,
        Outcome::NoQ,
        Outcome::Source,
        Outcome::Stale,
        Outcome::OtherLife,
        Outcome::Key,
    ];
}

/// The reply to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reply<'a> {
    /// Sequence number of the request.
    pub request: u32,
    /// What became of it.
    pub outcome: Outcome,
    /// The status after it.
    pub status: Status,
    /// Number of the sample that comes next.
    pub sample: u64,
    /// The description (text), coefficients of Q, or a number ([`Outcome::Stale`]).
    pub data: &'a [u8],
}

impl<'a> Reply<'a> {
    /// From the body of a frame.
    #[must_use]
    pub fn read(body: &'a [u8]) -> Option<Self> {
        let mut reader = Reader(body);
        let request = reader.u32()?;
        let code = reader.u8()?;
        let outcome = Outcome::ALL.into_iter().find(|outcome| *outcome as u8 == code)?;
        let status = Status::from_bits(reader.u32()?);
        let sample = reader.u64()?;
        Some(Reply { request, outcome, status, sample, data: reader.rest() })
    }

    /// Into the body of a frame; returns its length, `None` where the buffer is too short.
    pub fn write(&self, buffer: &mut [u8]) -> Option<usize> {
        let mut writer = Writer::new(buffer);
        writer.put(&self.request.to_le_bytes())?;
        writer.put(&[self.outcome as u8])?;
        writer.put(&self.status.bits().to_le_bytes())?;
        writer.put(&self.sample.to_le_bytes())?;
        writer.put(self.data)?;
        Some(writer.length())
    }
}
