//! Requests to a machine, and its rows.

use crate::way::Way;
use crate::{Description, Error, Recorder, Result};
use std::collections::VecDeque;
use std::hash::{BuildHasher, RandomState};
use std::time::{Duration, Instant};
use youla_link::{Frame, FrameError, Kind, LARGEST_CHUNK, LARGEST_FRAME, Outcome, Reply, Request, write_old_describe};
use youla_rt::{Checksum, Status};

/// The reply to a request.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// What became of it.
    pub outcome: Outcome,
    /// Status of the loop after it.
    pub status: Status,
    /// Number of the sample that came next.
    pub sample: u64,
    /// The description, or coefficients of Q.
    pub data: Vec<u8>,
    /// Number of the start of the machine.
    pub life: u32,
}

/// A connection to a machine.
pub struct Rig {
    way: Way,
    address: String,
    description: Description,
    schema: u32,
    sequence: u32,
    /// Number of this host, drawn for each connection.
    host: u32,
    /// Of the machine, at the last description.
    life: u32,
    /// Another version of the format in which frames come.
    version: Option<u8>,
    /// Frames that came while a reply was awaited.
    inbox: VecDeque<Vec<u8>>,
}

const PATIENCE: Duration = Duration::from_millis(200);
const ATTEMPTS: usize = 10;
/// Attempt at which a machine that does not answer is asked in the version before.
const ASK_OLD: usize = 2;

impl Rig {
    /// Connects to `udp://HOST:PORT` or `serial:DEVICE[@BAUD]` and asks for the description.
    ///
    /// # Errors
    /// [`Error::Address`], [`Error::Silent`], [`Error::Version`], [`Error::Description`].
    pub fn connect(address: &str) -> Result<Self> {
        Self::over(Way::open(address)?, address)
    }

    /// Stops the excitation, whatever the machine is, then asks for the description.
    ///
    /// # Errors
    /// As [`Rig::connect`].
    pub fn stop(address: &str) -> Result<(Self, Answer)> {
        let mut rig = Self::unknown(Way::open(address)?, address);
        let answer = rig.ask(&Request::Stop)?;
        rig.describe()?;
        Ok((rig, answer))
    }

    pub(crate) fn over(way: Way, address: &str) -> Result<Self> {
        let mut rig = Self::unknown(way, address);
        rig.describe()?;
        Ok(rig)
    }

    fn unknown(way: Way, address: &str) -> Self {
        Rig {
            way,
            address: address.to_owned(),
            description: Description::default(),
            schema: 0,
            sequence: 0,
            host: random_number(),
            life: 0,
            version: None,
            inbox: VecDeque::new(),
        }
    }

    fn describe(&mut self) -> Result<()> {
        let answer = self.ask(&Request::Describe)?;
        let mut schema = Checksum::new();
        schema.append(&answer.data);
        (self.schema, self.life) = (schema.value(), answer.life);
        self.description = Description::parse(&answer.data)?;
        Ok(())
    }

    /// What the machine says of itself.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// CRC-32 of the description, which all frames carry.
    pub fn schema(&self) -> u32 {
        self.schema
    }

    /// Asks until there is a reply; rows that come in between are kept.
    ///
    /// # Errors
    /// [`Error::Silent`], [`Error::Version`], [`Error::Refused`], [`Error::Connection`].
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Answer> {
        self.sequence = self.sequence.wrapping_add(1);
        let mut body = [0; 4 * LARGEST_CHUNK + 8];
        let too_long = || Error::Description("a request is longer than a frame".into());
        let length = request.write(&mut body).ok_or_else(too_long)?;
        let mut bytes = [0; LARGEST_FRAME];
        let body = body.get(..length).unwrap_or_default();
        let Rig { schema, sequence, host, life, .. } = *self;
        let frame = Frame { kind: Kind::Request, schema, sequence, host, life, body };
        let length = frame.write(&mut bytes).map_err(|_| too_long())?;
        for attempt in 0..ATTEMPTS {
            self.way.send(bytes.get(..length).unwrap_or_default());
            if attempt == ASK_OLD && self.schema == 0 {
                let mut old = [0; 32];
                let length = write_old_describe(&mut old).map_err(|_| too_long())?;
                self.way.send(old.get(..length).unwrap_or_default());
            }
            if let Some(answer) = self.await_answer()? {
                return match answer.outcome {
                    Outcome::Done => Ok(answer),
                    outcome => Err(Error::Refused { request: name(request), outcome }),
                };
            }
            if self.schema == 0 && self.version.is_some() {
                break;
            }
        }
        let address = self.address.clone();
        Err(self
            .version
            .map_or(Error::Silent { address: address.clone() }, |version| Error::Version { address, version }))
    }

    fn await_answer(&mut self) -> Result<Option<Answer>> {
        let until = Instant::now() + PATIENCE;
        while let Some(left) = until.checked_duration_since(Instant::now()) {
            let Some(bytes) = self.way.receive(left)? else { continue };
            if let Err(FrameError::Version(version)) = Frame::read(&bytes) {
                self.version = Some(version);
            }
            match answer_to([self.host, self.sequence], &bytes) {
                Some(answer) => return Ok(Some(answer)),
                None => self.inbox.push_back(bytes),
            }
        }
        Ok(None)
    }

    /// Hands the rows that come within a time to a recorder, at least those that have come already.
    ///
    /// # Errors
    /// [`Error::Connection`], [`Error::File`].
    pub fn record(&mut self, recorder: &mut Recorder, within: Duration) -> Result<()> {
        let until = Instant::now() + within;
        loop {
            while let Some(bytes) = self.inbox.pop_front() {
                recorder.take(&bytes)?;
            }
            let Some(left) = until.checked_duration_since(Instant::now()) else { return Ok(()) };
            self.inbox.extend(self.way.receive(left)?);
        }
    }

    /// Loads Q, coefficients A, B, C by rows, without switching to it.
    ///
    /// # Errors
    /// As [`Rig::ask`].
    pub fn load_q(&mut self, coefficients: &[f32]) -> Result<Answer> {
        self.ask(&Request::BeginQ)?;
        let bytes: Vec<u8> = coefficients.iter().flat_map(|value| value.to_le_bytes()).collect();
        for (number, values) in bytes.chunks(4 * LARGEST_CHUNK).enumerate() {
            let place = u16::try_from(number * LARGEST_CHUNK).unwrap_or(u16::MAX);
            self.ask(&Request::WriteQ { place, values })?;
        }
        let mut checksum = Checksum::new();
        checksum.append(&bytes);
        self.ask(&Request::CommitQ(checksum.value()))
    }
}

/// From the keys that the standard library draws for its maps.
pub fn random_number() -> u32 {
    RandomState::new().hash_one(0) as u32
}

fn answer_to([host, sequence]: [u32; 2], bytes: &[u8]) -> Option<Answer> {
    let frame = Frame::read(bytes).ok().filter(|frame| frame.kind == Kind::Reply && frame.host == host)?;
    let reply = Reply::read(frame.body).filter(|reply| reply.request == sequence)?;
    let Reply { outcome, status, sample, data, .. } = reply;
    Some(Answer { outcome, status, sample, data: data.to_vec(), life: frame.life })
}

fn name(request: &Request<'_>) -> &'static str {
    match request {
        Request::Describe => "describe",
        Request::Alive => "alive",
        Request::Arm => "arm",
        Request::Start { .. } => "start the excitation",
        Request::Stop => "stop the excitation",
        Request::BeginQ | Request::WriteQ { .. } => "load Q",
        Request::CommitQ(_) => "complete Q",
        Request::SwitchQ => "switch to Q",
        Request::ReleaseQ => "release Q",
        Request::ReadQ { .. } => "read Q back",
    }
}
