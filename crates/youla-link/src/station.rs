//! The machine's end of the link: a loop in single precision, its excitation, its rows and its replies.

use crate::bytes::Reader;
use crate::peers::{Number, Peers};
use crate::{
    Frame, FrameError, Kind, LARGEST_BODY, LARGEST_CHUNK, Outcome, Reply, Request, RowBatch, SequenceOrigin, old,
};
use youla_rt::{Checksum, ExcitationSource, ExcitedLoop, LoopRefusal, PrbsSource, QRefusal, Row};

/// What a machine is, for its host.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Machine<'a, const M: usize> {
    /// Name, sample time, channels: TOML of at most [`LARGEST_BODY`] - 17 bytes.
    pub description: &'a str,
    /// The sequence of its own, for [`SequenceOrigin::Own`].
    pub table: &'a [[f32; M]],
    /// Rows of a frame.
    pub rows: u16,
    /// Drawn at random when the machine starts, so that its host sees a machine that has started again.
    pub life: u32,
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
    source: ExcitationSource<'a, f32, M, 0>,
    amplitude: f32,
    batch: RowBatch<M, P>,
    sequence: u32,
    replies: u32,
    peers: Peers,
    /// The host that armed. It alone may start, and its new requests alone are signs of life for the guard.
    owner: Option<u32>,
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
            source: ExcitationSource::Silent,
            amplitude: 0.0,
            batch: RowBatch::new(machine.rows),
            sequence: 0,
            replies: 0,
            peers: Peers::NONE,
            owner: None,
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
        let written = self.batch.take([self.schema, self.machine.life, self.sequence], buffer)?;
        self.sequence = self.sequence.wrapping_add(1);
        Some(written)
    }

    /// The loop.
    #[must_use]
    pub fn running(&self) -> &ExcitedLoop<f32, N, M, P, K> {
        &self.running
    }

    /// What it keeps of its hosts, for a search through its states.
    #[cfg(test)]
    pub(crate) fn books(&self) -> std::string::String {
        std::format!("{:?} {:?}", self.peers, self.owner)
    }

    /// CRC-32 of the description.
    #[must_use]
    pub fn schema(&self) -> u32 {
        self.schema
    }

    /// Number of its start.
    #[must_use]
    pub fn life(&self) -> u32 {
        self.machine.life
    }

    /// Ramps the excitation out, as a [`Request::Stop`] does.
    pub fn stop(&mut self) {
        self.running.stop();
    }

    /// Takes a frame of a host and writes the reply; `None` for a frame that is no request. A machine with a key asks [`crate::Key::verify`] before, and
    /// signs the reply: neither is computed here, so that both may wait for a moment without a sample.
    ///
    /// # Errors
    /// [`FrameError`] of the frame, or of a buffer that is too short for the reply.
    pub fn receive(&mut self, bytes: &[u8], buffer: &mut [u8]) -> Result<Option<usize>, FrameError> {
        self.take(bytes, true, buffer)
    }

    /// Takes a frame that [`crate::Key::verify`] refuses: a stop is executed, anything else is answered with [`Outcome::Key`]. It does not count
    /// among the requests of its host: forged numbers would make those of the host late, or old ones new. The reply is not to be signed: with a
    /// signature it could be presented to the host as the reply to another request of the same number.
    ///
    /// # Errors
    /// As [`Station::receive`].
    pub fn receive_unsigned(&mut self, bytes: &[u8], buffer: &mut [u8]) -> Result<Option<usize>, FrameError> {
        self.take(bytes, false, buffer)
    }

    fn take(&mut self, bytes: &[u8], verified: bool, buffer: &mut [u8]) -> Result<Option<usize>, FrameError> {
        let frame = match Frame::read(bytes) {
            Err(refused @ FrameError::Version(_)) => return self.receive_old(bytes, buffer).ok_or(refused)?.map(Some),
            read => read?,
        };
        if frame.kind != Kind::Request {
            return Ok(None);
        }
        let request = Request::read(frame.body);
        let outcome = match request {
            _ if verified => self.outcome(&frame, request),
            Some(Request::Stop) => {
                self.stop();
                Outcome::Done
            }
            _ => Outcome::Key,
        };
        self.reply(&frame, outcome, request.filter(|_| verified), buffer).map(Some)
    }

    /// A host of version 1: its stop is executed, everything else is not known.
    fn receive_old(&mut self, bytes: &[u8], buffer: &mut [u8]) -> Option<Result<usize, FrameError>> {
        let (sequence, body) = old::request(bytes)?;
        let outcome = match Request::read(body) {
            Some(Request::Stop) => {
                self.stop();
                Outcome::Done
            }
            _ => Outcome::NotUnderstood,
        };
        let mut reply = [0; 17];
        let length = self.reply_to(sequence, outcome, &[]).write(&mut reply)?;
        Some(old::write(Kind::Reply, [self.schema, self.replies], reply.get(..length)?, buffer))
    }

    fn outcome(&mut self, frame: &Frame<'_>, request: Option<Request<'_>>) -> Outcome {
        let (of_machine, of_life) = (frame.schema == self.schema, frame.life == self.machine.life);
        let Some(request) = request else { return Outcome::NotUnderstood };
        if request == Request::Stop {
            self.stop();
            // A start of this host that was sent before, and is still on its way, is late now.
            if of_life && self.peers.number(frame) == Number::New {
                self.peers.changed(frame, Outcome::Done, self.owner);
            }
            return Outcome::Done;
        }
        match request {
            Request::Describe => return Outcome::Done,
            _ if !of_machine => return Outcome::OtherSchema,
            _ if !of_life => return Outcome::OtherLife,
            _ => (),
        }
        let number = self.peers.number(frame);
        if number == Number::New && self.owner == Some(frame.host) {
            self.running.heard();
        }
        match number {
            _ if request.only_reads() => {
                self.peers.passed(frame, Outcome::Done);
                Outcome::Done
            }
            Number::Again(outcome) => outcome,
            Number::Late => Outcome::Stale,
            Number::New => {
                let outcome = self.execute(frame.host, &request);
                self.peers.changed(frame, outcome, self.owner);
                outcome
            }
        }
    }

    fn execute(&mut self, host: u32, request: &Request<'_>) -> Outcome {
        let done = match *request {
            Request::Describe | Request::Alive | Request::ReadQ { .. } => Ok(()),
            Request::Stop => {
                self.stop();
                Ok(())
            }
            Request::Arm => self.running.arm().inspect(|()| self.owner = Some(host)),
            Request::Start { .. } if self.owner != Some(host) => Err(LoopRefusal::NotArmed),
            Request::Start { source, amplitude } => return self.start(source, amplitude),
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

    fn start(&mut self, source: SequenceOrigin, amplitude: f32) -> Outcome {
        let chosen = match source {
            SequenceOrigin::Own => Some(ExcitationSource::Table(youla_rt::TableSource::new(self.machine.table))),
            SequenceOrigin::Prbs { order, hold } => prbs(order, hold),
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
        frame: &Frame<'_>,
        outcome: Outcome,
        asked: Option<Request<'_>>,
        buffer: &mut [u8],
    ) -> Result<usize, FrameError> {
        let mut coefficients = [0; 4 * LARGEST_CHUNK];
        let mut outcome = outcome;
        let above = self.peers.above(frame.host).map(u32::to_le_bytes);
        let data = match asked {
            Some(Request::Describe) => self.machine.description.as_bytes(),
            _ if outcome == Outcome::Stale => above.as_ref().map_or(&[][..], |above| above),
            Some(Request::ReadQ { place }) if outcome == Outcome::Done => match self.read_q(place, &mut coefficients) {
                Some(length) => coefficients.get(..length).unwrap_or_default(),
                None => {
                    outcome = Outcome::NoQ;
                    &[]
                }
            },
            _ => &[],
        };
        let reply = self.reply_to(frame.sequence, outcome, data);
        let mut body = [0; LARGEST_BODY];
        let length = reply.write(&mut body).ok_or(FrameError::Length(data.len()))?;
        let body = body.get(..length).unwrap_or_default();
        let (sequence, life) = (self.replies, self.machine.life);
        let reply = Frame { kind: Kind::Reply, schema: self.schema, sequence, host: frame.host, life, body };
        let written = reply.write(buffer)?;
        self.replies = self.replies.wrapping_add(1);
        Ok(written)
    }

    fn reply_to<'b>(&self, request: u32, outcome: Outcome, data: &'b [u8]) -> Reply<'b> {
        Reply { request, outcome, status: self.running.status(), sample: self.running.sample(), data }
    }

    fn read_q(&self, place: u16, buffer: &mut [u8]) -> Option<usize> {
        let values = self.running.running_q()?.values().skip(place.into());
        let pairs = buffer.chunks_exact_mut(4).zip(values);
        Some(pairs.map(|(bytes, value)| bytes.copy_from_slice(&value.to_le_bytes())).count() * 4)
    }
}

/// Whether the bytes of a frame ask for a stop: for a machine that keeps requests in a queue, where a stop must not wait.
#[must_use]
pub fn is_stop(bytes: &[u8]) -> bool {
    let body = match Frame::read(bytes) {
        Ok(frame) if frame.kind == Kind::Request => Some(frame.body),
        Err(FrameError::Version(_)) => old::request(bytes).map(|(_, body)| body),
        _ => None,
    };
    body.and_then(Request::read) == Some(Request::Stop)
}

/// Registers that differ from input to input: odd multiples within the period.
fn prbs<'a, const M: usize>(order: u8, hold: u16) -> Option<ExcitationSource<'a, f32, M, 0>> {
    let period = 1_u32.checked_shl(order.into()).filter(|_| order < 31)?.checked_sub(1)?;
    let mut starts = [1; M];
    for (start, number) in starts.iter_mut().zip(0_u32..) {
        *start = 1 + number.wrapping_mul(0x9e37_79b1).checked_rem(period)?;
    }
    PrbsSource::new(order.into(), hold, starts, [1.0; M]).map(ExcitationSource::Prbs)
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
