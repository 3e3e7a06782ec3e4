//! The machine's end of the link: a loop in single precision, its excitation, its rows and its replies.

use crate::bytes::Reader;
use crate::{Frame, FrameError, Kind, LARGEST_BODY, LARGEST_CHUNK, Outcome, Reply, Request, RowBatch, Source};
use youla_rt::{Checksum, Excitation, ExcitedLoop, LoopRefusal, Prbs, QRefusal, Row};

/// What a machine is, for its host.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Machine<'a, const M: usize> {
    /// Name, sample time, channels: TOML of at most [`LARGEST_BODY`] - 17 bytes.
    pub description: &'a str,
    /// The sequence of its own, for [`Source::Own`].
    pub table: &'a [[f32; M]],
    /// Rows of a frame.
    pub rows: u16,
}

/// A loop with its host. N states, M inputs, P outputs, Q of order K.
///
/// Each sample: [`Station::command`], apply, [`Station::observe`], send [`Station::frame`] if there is one. A frame of the host goes to
/// [`Station::receive`] between two samples.
#[derive(Debug, Clone)]
pub struct Station<'a, const N: usize, const M: usize, const P: usize, const K: usize> {
    running: ExcitedLoop<f32, N, M, P, K>,
    machine: Machine<'a, M>,
    schema: u32,
    source: Excitation<'a, f32, M, 0>,
    amplitude: f32,
    batch: RowBatch<M, P>,
    sequence: u32,
    replies: u32,
    /// The last request with its outcome: a request that comes again is answered, not executed, again.
    last: Option<(u32, Outcome)>,
    place: u16,
}

impl<'a, const N: usize, const M: usize, const P: usize, const K: usize> Station<'a, N, M, P, K> {
    /// At rest.
    #[must_use]
    pub fn new(running: ExcitedLoop<f32, N, M, P, K>, machine: Machine<'a, M>) -> Self {
        let mut schema = Checksum::new();
        schema.append(machine.description.as_bytes());
        Station {
            running,
            machine,
            schema: schema.value(),
            source: Excitation::Silent,
            amplitude: 0.0,
            batch: RowBatch::new(machine.rows),
            sequence: 0,
            replies: 0,
            last: None,
            place: 0,
        }
    }

    /// The input to apply.
    #[inline]
    #[must_use]
    pub fn command(&mut self) -> [f32; M] {
        let wanted = if self.running.is_excited() { self.source.advance() } else { [0.0; M] };
        self.running.command(&wanted.map(|value| value * self.amplitude))
    }

    /// Takes the measurement and the input that was applied.
    #[inline]
    pub fn observe(&mut self, y: &[f32; P], applied: &[f32; M]) -> Row<f32, M, P> {
        let row = self.running.observe(y, applied);
        self.batch.push(&row);
        row
    }

    /// The frame to send, once its rows are complete.
    ///
    /// # Errors
    /// [`FrameError::Length`] where the buffer is too short; [`crate::LARGEST_FRAME`] bytes are enough.
    pub fn frame(&mut self, buffer: &mut [u8]) -> Option<Result<usize, FrameError>> {
        if !self.batch.is_full() {
            return None;
        }
        self.flush(buffer)
    }

    /// The frame of the rows up to now.
    ///
    /// # Errors
    /// As [`Station::frame`].
    pub fn flush(&mut self, buffer: &mut [u8]) -> Option<Result<usize, FrameError>> {
        let written = self.batch.take(self.schema, self.sequence, buffer)?;
        self.sequence = self.sequence.wrapping_add(1);
        Some(written)
    }

    /// The loop.
    #[must_use]
    pub fn running(&self) -> &ExcitedLoop<f32, N, M, P, K> {
        &self.running
    }

    /// CRC-32 of the description.
    #[must_use]
    pub fn schema(&self) -> u32 {
        self.schema
    }

    /// Takes a frame of the host and writes the reply; `None` for a frame that is no request.
    ///
    /// # Errors
    /// [`FrameError`] of the frame, or of a buffer that is too short for the reply.
    pub fn receive(&mut self, bytes: &[u8], buffer: &mut [u8]) -> Result<Option<usize>, FrameError> {
        let frame = Frame::read(bytes)?;
        if frame.kind != Kind::Request {
            return Ok(None);
        }
        let request = Request::read(frame.body);
        let known = matches!(request, Some(Request::Describe)) || frame.schema == self.schema;
        if known {
            self.running.heard();
        }
        let behind = self.last.map_or(u32::MAX, |(last, _)| last.wrapping_sub(frame.sequence));
        let outcome = match (self.last, request) {
            (_, Some(Request::Describe)) => Outcome::Done,
            (Some((_, outcome)), _) if behind == 0 => outcome,
            (Some(_), _) if behind <= u32::MAX / 2 => Outcome::Stale,
            (_, None) => Outcome::NotUnderstood,
            (_, Some(_)) if !known => Outcome::OtherSchema,
            (_, Some(request)) => self.execute(&request),
        };
        if outcome != Outcome::Stale {
            self.last = Some((frame.sequence, outcome));
        }
        self.reply(frame.sequence, outcome, request, buffer).map(Some)
    }

    fn execute(&mut self, request: &Request<'_>) -> Outcome {
        let done = match *request {
            Request::Describe | Request::Alive | Request::ReadQ { .. } => Ok(()),
            Request::Arm => self.running.arm(),
            Request::Start { source, amplitude } => return self.start(source, amplitude),
            Request::Stop => {
                self.running.stop();
                Ok(())
            }
            Request::BeginQ => {
                self.place = 0;
                self.running.begin_q()
            }
            Request::WriteQ { place, values } => self.write_q(place, values),
            Request::CommitQ(checksum) => self.running.commit_q(checksum),
            Request::SwitchQ => self.running.switch_q(),
            Request::ReleaseQ => {
                self.running.release_q();
                Ok(())
            }
        };
        done.map_or_else(outcome_of, |()| Outcome::Done)
    }

    fn start(&mut self, source: Source, amplitude: f32) -> Outcome {
        let chosen = match source {
            Source::Own => Some(Excitation::Table(youla_rt::Table::new(self.machine.table))),
            Source::Prbs { order, hold } => prbs(order, hold),
        };
        let (Some(chosen), true) = (chosen, amplitude.is_finite() && amplitude >= 0.0) else {
            return Outcome::Source;
        };
        match self.running.start() {
            Ok(()) => {
                (self.source, self.amplitude) = (chosen, amplitude);
                Outcome::Done
            }
            Err(refusal) => outcome_of(refusal),
        }
    }

    fn write_q(&mut self, place: u16, values: &[u8]) -> Result<(), LoopRefusal> {
        if place != self.place {
            return Err(LoopRefusal::Q(QRefusal::Count));
        }
        let mut reader = Reader(values);
        while let Some(value) = reader.f32() {
            self.running.write_q(value)?;
            self.place = self.place.saturating_add(1);
        }
        Ok(())
    }

    fn reply(
        &mut self,
        request: u32,
        outcome: Outcome,
        asked: Option<Request<'_>>,
        buffer: &mut [u8],
    ) -> Result<usize, FrameError> {
        let mut coefficients = [0; 4 * LARGEST_CHUNK];
        let mut outcome = outcome;
        let data = match asked {
            Some(Request::Describe) => self.machine.description.as_bytes(),
            Some(Request::ReadQ { place }) => match self.read_q(place, &mut coefficients) {
                Some(length) => coefficients.get(..length).unwrap_or_default(),
                None => {
                    outcome = Outcome::NoQ;
                    &[]
                }
            },
            _ => &[],
        };
        let reply = Reply { request, outcome, status: self.running.status(), sample: self.running.sample(), data };
        let mut body = [0; LARGEST_BODY];
        let length = reply.write(&mut body).ok_or(FrameError::Length(data.len()))?;
        let body = body.get(..length).unwrap_or_default();
        let written = Frame { kind: Kind::Reply, schema: self.schema, sequence: self.replies, body }.write(buffer)?;
        self.replies = self.replies.wrapping_add(1);
        Ok(written)
    }

    fn read_q(&self, place: u16, buffer: &mut [u8]) -> Option<usize> {
        let values = self.running.running_q()?.values().skip(place.into());
        let pairs = buffer.chunks_exact_mut(4).zip(values);
        Some(pairs.map(|(bytes, value)| bytes.copy_from_slice(&value.to_le_bytes())).count() * 4)
    }
}

/// Registers that differ from input to input: odd multiples within the period.
fn prbs<'a, const M: usize>(order: u8, hold: u16) -> Option<Excitation<'a, f32, M, 0>> {
    let period = 1_u32.checked_shl(order.into()).filter(|_| order < 31)?.checked_sub(1)?;
    let mut starts = [1; M];
    for (start, number) in starts.iter_mut().zip(0_u32..) {
        *start = 1 + number.wrapping_mul(0x9e37_79b1).checked_rem(period)?;
    }
    Prbs::new(order.into(), hold, starts, [1.0; M]).map(Excitation::Prbs)
}

fn outcome_of(refusal: LoopRefusal) -> Outcome {
    match refusal {
        LoopRefusal::NotArmed | LoopRefusal::Limits => Outcome::NotArmed,
        LoopRefusal::Exciting => Outcome::Exciting,
        LoopRefusal::Sensor => Outcome::Sensor,
        LoopRefusal::Tripped => Outcome::Tripped,
        LoopRefusal::Q(QRefusal::Fading) => Outcome::Fading,
        LoopRefusal::Q(QRefusal::NotFinite) => Outcome::NotFinite,
        LoopRefusal::Q(QRefusal::Count) => Outcome::Count,
        LoopRefusal::Q(QRefusal::Checksum) => Outcome::Checksum,
        LoopRefusal::Q(QRefusal::NotLoaded) => Outcome::NoQ,
    }
}
