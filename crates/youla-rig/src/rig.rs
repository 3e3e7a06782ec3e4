//! Requests to a machine, and its rows.

use crate::key::read_key;
use crate::way::Way;
use crate::{Description, Error, Recorder, Result};
use std::collections::VecDeque;
use std::hash::{BuildHasher, RandomState};
use std::path::Path;
use std::time::{Duration, Instant};
use youla_link::{
    Frame, FrameError, Key, Kind, LARGEST_CHUNK, LARGEST_SIGNED, Outcome, Reply, Request, write_old_describe,
};
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
    key: Option<Key>,
    /// Frames that are not signed with the key, and what the machine itself may have replied among them.
    refused: u64,
    unsigned: Option<Answer>,
}

const PATIENCE: Duration = Duration::from_millis(200);
const ATTEMPTS: usize = 10;
/// Attempt at which a machine that does not answer is asked in the version before.
const ASK_OLD: usize = 2;

impl Rig {
    /// Connects to `udp://HOST:PORT` or `serial:DEVICE[@BAUD]`, with `,key=FILE` behind it for a machine with a key, and asks for the description.
    ///
    /// # Errors
    /// [`Error::Address`], [`Error::Key`], [`Error::Silent`], [`Error::Unsigned`], [`Error::Version`], [`Error::Description`].
    pub fn connect(address: &str) -> Result<Self> {
        Self::open(address)?.described()
    }

    /// Stops the excitation, whatever the machine is, then asks for the description. A machine with a key stops for a host without it too, but does
    /// not describe itself; its address stands for its name then.
    ///
    /// # Errors
    /// As [`Rig::connect`].
    pub fn stop(address: &str) -> Result<(Self, Answer)> {
        let mut rig = Self::open(address)?;
        let answer = rig.ask(&Request::Stop)?;
        match rig.describe() {
            Err(Error::Refused { outcome: Outcome::Key, .. }) => rig.description.name.clone_from(&rig.address),
            described => described?,
        }
        Ok((rig, answer))
    }

    fn open(address: &str) -> Result<Self> {
        let (place, key) = match address.rsplit_once(",key=") {
            Some((place, file)) => (place, Some(read_key(Path::new(file))?)),
            None => (address, None),
        };
        Ok(Rig { key, ..Self::unknown(Way::open(place)?, place) })
    }

    pub(crate) fn described(mut self) -> Result<Self> {
        self.describe()?;
        Ok(self)
    }

    pub(crate) fn unknown(way: Way, address: &str) -> Self {
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
            key: None,
            refused: 0,
            unsigned: None,
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
    /// [`Error::Silent`], [`Error::Unsigned`], [`Error::Version`], [`Error::Refused`], [`Error::Connection`].
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Answer> {
        let mut answer = self.answer(request)?;
        if let (Outcome::Stale, Ok(above)) = (answer.outcome, answer.data.as_slice().try_into()) {
            // The machine does not know this host: its numbers begin above those of the hosts that are forgotten.
            self.sequence = u32::from_le_bytes(above);
            answer = self.answer(request)?;
        }
        match answer.outcome {
            Outcome::Done => Ok(answer),
            outcome => Err(Error::Refused { request: name(request), outcome }),
        }
    }

    fn answer(&mut self, request: &Request<'_>) -> Result<Answer> {
        self.unsigned = None;
        self.sequence = self.sequence.wrapping_add(1);
        let mut body = [0; 4 * LARGEST_CHUNK + 8];
        let too_long = || Error::Description("a request is longer than a frame".into());
        let length = request.write(&mut body).ok_or_else(too_long)?;
        let mut bytes = [0; LARGEST_SIGNED];
        let body = body.get(..length).unwrap_or_default();
        let Rig { schema, sequence, host, life, .. } = *self;
        let frame = Frame { kind: Kind::Request, schema, sequence, host, life, body };
        let length = frame.write(&mut bytes).map_err(|_| too_long())?;
        let length =
            self.key.as_ref().map_or(Ok(length), |key| key.sign(&mut bytes, length)).map_err(|_| too_long())?;
        for attempt in 0..ATTEMPTS {
            self.way.send(bytes.get(..length).unwrap_or_default());
            if attempt == ASK_OLD && self.schema == 0 {
                let mut old = [0; 32];
                let length = write_old_describe(&mut old).map_err(|_| too_long())?;
                self.way.send(old.get(..length).unwrap_or_default());
            }
            if let Some(answer) = self.await_answer()? {
                return Ok(answer);
            }
            if self.schema == 0 && self.version.is_some() {
                break;
            }
        }
        let address = self.address.clone();
        Err(match (self.version, &self.unsigned) {
            (_, Some(Answer { outcome: Outcome::Key, .. })) => {
                Error::Refused { request: name(request), outcome: Outcome::Key }
            }
            (_, Some(_)) => Error::Unsigned { address },
            (Some(version), None) => Error::Version { address, version },
            (None, None) => Error::Silent { address },
        })
    }

    /// Bytes that this host may take, within a time: where there is a key, frames that are signed with it, and damaged ones.
    fn receive(&mut self, within: Duration) -> Result<Option<Vec<u8>>> {
        let received = self.way.receive(within)?;
        let (Some(key), Some(bytes)) = (&self.key, &received) else { return Ok(received) };
        if matches!(key.verify(bytes), Err(FrameError::Unsigned | FrameError::Key)) {
            self.refused += 1;
            self.unsigned = answer_to([self.host, self.sequence], bytes).or(self.unsigned.take());
            return Ok(None);
        }
        Ok(received)
    }

    fn await_answer(&mut self) -> Result<Option<Answer>> {
        let until = Instant::now() + PATIENCE;
        while let Some(left) = until.checked_duration_since(Instant::now()) {
            let Some(bytes) = self.receive(left)? else { continue };
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
        recorder.signed = self.key.is_some();
        loop {
            recorder.refuse(std::mem::take(&mut self.refused));
            while let Some(bytes) = self.inbox.pop_front() {
                recorder.take(&bytes)?;
            }
            let Some(left) = until.checked_duration_since(Instant::now()) else { return Ok(()) };
            let received = self.receive(left)?;
            self.inbox.extend(received);
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
