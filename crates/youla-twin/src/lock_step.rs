//! Controller and twin in lock-step, and the log of the rows that the controller sends.

use crate::error::failed;
use crate::rig::{BearingRig, SimulatedRig};
use crate::target::Target;
use crate::{Error, Result};
use youla_link::{Frame, Kind, LARGEST_CHUNK, LARGEST_FRAME, Outcome, Reply, Request, RowBlock, RowShape};
use youla_rt::{Phase, Status, Trip};

const SHAPE: RowShape = RowShape { inputs: 2, outputs: 2 };

/// A row: y, u, alpha, beta.
pub type LoggedValues = [f64; 8];

/// The controller with the twin.
pub struct LockStep {
    target: Target,
    plant: BearingRig,
    schema: u32,
    life: u32,
    sequence: u32,
    reply: Option<(Outcome, Status)>,
    /// Rows since the last [`LockStep::take_rows`].
    rows: Vec<LoggedValues>,
    status: Option<Status>,
    frame: Vec<u8>,
    next: u64,
}

impl LockStep {
    /// At rest.
    ///
    /// # Errors
    /// As [`LockStep::ask`].
    pub fn new(target: Target, plant: BearingRig) -> Result<Self> {
        let mut bench = LockStep {
            target,
            plant,
            schema: 0,
            life: 0,
            sequence: 0,
            reply: None,
            rows: Vec::new(),
            status: None,
            frame: Vec::new(),
            next: 0,
        };
        bench.ask(&Request::Describe)?;
        Ok(bench)
    }

    /// One sample.
    fn sample(&mut self, request: &[u8]) -> Result<()> {
        let mut frame = std::mem::take(&mut self.frame);
        frame.clear();
        let u = self.target.receive(&mut frame)?;
        let taken = self.take(&frame);
        self.frame = frame;
        taken?;
        let y = self.plant.measure().map(|y| y as f32);
        self.target.send(&y, request)?;
        self.plant.actuate(u.map(f64::from));
        Ok(())
    }

    fn take(&mut self, bytes: &[u8]) -> Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        let damaged = || failed("sent a frame that cannot be read");
        let frame = Frame::read(bytes).map_err(|_| damaged())?;
        (self.schema, self.life) = (frame.schema, frame.life);
        if frame.kind == Kind::Reply {
            let reply = Reply::read(frame.body).ok_or_else(damaged)?;
            self.reply = Some((reply.outcome, reply.status));
            return Ok(());
        }
        let block = RowBlock::read(frame.body, SHAPE).ok_or_else(damaged)?;
        for row in block.rows() {
            if row.sample != self.next {
                return Err(failed("left rows out of its log"));
            }
            self.next += 1;
            self.status = Some(row.status);
            let mut values = [0.0; 8];
            values.iter_mut().zip(row.values()).for_each(|(place, value)| *place = value.into());
            self.rows.push(values);
        }
        Ok(())
    }

    /// Runs so many samples, rounded up to whole frames.
    ///
    /// # Errors
    /// [`Error::Controller`] for a controller that stops or sends what cannot be read.
    pub fn run(&mut self, samples: usize) -> Result<()> {
        let until = self.rows.len() + samples;
        while self.rows.len() < until {
            self.sample(&[])?;
        }
        Ok(())
    }

    /// As [`LockStep::run`], until the guard ends the excitation.
    pub fn excite(&mut self, samples: usize) -> Result<()> {
        let until = self.rows.len() + samples;
        while self.rows.len() < until && self.trip().is_none() {
            self.sample(&[])?;
        }
        Ok(())
    }

    /// Sends a request and awaits its reply. The bench is behind a frame of rows before and after it.
    ///
    /// # Errors
    /// [`Error::Controller`] where it is refused.
    pub fn ask(&mut self, request: &Request<'_>) -> Result<Status> {
        self.sequence += 1;
        let mut body = [0; 4 * LARGEST_CHUNK + 8];
        let too_long = || failed("takes no request of this length");
        let length = request.write(&mut body).ok_or_else(too_long)?;
        let body = body.get(..length).unwrap_or_default();
        let mut bytes = [0; LARGEST_FRAME];
        let frame =
            Frame { kind: Kind::Request, schema: self.schema, sequence: self.sequence, host: 1, life: self.life, body };
        let length = frame.write(&mut bytes).map_err(|_| too_long())?;
        self.reply = None;
        self.sample(bytes.get(..length).unwrap_or_default())?;
        self.run(1)?;
        match self.reply.take() {
            Some((Outcome::Done, status)) => Ok(status),
            Some((outcome, _)) => Err(Error::Controller { problem: format!("refused a request: {outcome:?}") }),
            None => Err(failed("does not answer")),
        }
    }

    /// The rows since the last call.
    pub fn take_rows(&mut self) -> Vec<LoggedValues> {
        std::mem::take(&mut self.rows)
    }

    /// What the guard found, while it has tripped.
    pub fn trip(&self) -> Option<Trip> {
        self.status.filter(|status| status.phase() == Phase::Tripped)?.trip()
    }
}
