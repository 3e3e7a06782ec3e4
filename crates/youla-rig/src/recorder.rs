//! A log in which every row is there or reported missing.

use crate::sink::{CsvLog, LogRow, RowSink};
use crate::{Description, Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use youla_link::{Arrival, Frame, Kind, RowBlock, RowShape, Tracker};
use youla_rt::{Status, Trip};

/// What became of the rows of a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LogReport {
    /// Rows in the log.
    pub rows: u64,
    /// Samples between the first row and the end of the recording that are not in the log.
    pub missing: u64,
    /// Where rows are missing: first sample and number.
    pub gaps: Vec<(u64, u64)>,
    /// Frames taken, lost, doubled, reordered, stale.
    pub frames: Tracker,
    /// Datagrams that are no frames: damaged on the way, or of another program.
    pub damaged: u64,
    /// Frames with another description of the machine, with rows that do not fit it, or not signed where there is a key.
    pub foreign: u64,
    /// Frames of another life of the machine, or far from the rows before, that no neighbour confirmed: they are not in the log.
    pub implausible: u64,
    /// Parts of the log, each in its own file: the machine has started again, or its rows went back, in between.
    pub parts: Vec<LogPart>,
    /// Trips of the guard: sample and cause.
    pub trips: Vec<(u64, Trip)>,
}

/// Rows that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogPart {
    /// The first sample.
    pub first: u64,
    /// Number of rows.
    pub rows: u64,
    /// Life of the machine.
    pub life: u32,
}

/// Where a frame stands in the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    life: u32,
    sequence: u32,
    first: u64,
}

/// Rows of one frame that wait for those before them.
struct Block {
    /// Row after row.
    values: Vec<f32>,
    status: Vec<Status>,
}

impl Block {
    fn rows(&self) -> u64 {
        self.status.len() as u64
    }
}

/// Frames that wait for an earlier one: the window of [`Tracker`].
const WAITING: usize = 64;

/// Writes the rows of frames to a file, in the order of their samples.
pub struct Recorder {
    sinks: Vec<Box<dyn RowSink>>,
    path: PathBuf,
    largest: Vec<f32>,
    shape: RowShape,
    schema: u32,
    sample_time: f64,
    waiting: BTreeMap<u64, Block>,
    next: Option<u64>,
    /// Place of the newest frame of this part.
    newest: Option<Place>,
    /// A frame far from it: the next one like it confirms it.
    strange: Option<(Place, Block)>,
    /// Frames far behind it, one after the other.
    behind: usize,
    /// Rows of the longest frame.
    of_frame: u64,
    trip: Option<Trip>,
    /// Each frame is signed: one of this life that is behind was sent again by a stranger.
    pub(crate) signed: bool,
    report: LogReport,
}

impl Recorder {
    /// Begins a log of a machine whose frames have this schema, as CSV.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn create(path: &Path, machine: &Description, schema: u32) -> Result<Self> {
        let file = CsvLog::create(path, machine).map_err(|source| Error::File { path: path.to_owned(), source })?;
        Ok(Self::with(vec![Box::new(file)], path, machine, schema))
    }

    /// Begins a log that goes to these sinks; errors name `path`.
    pub fn with(sinks: Vec<Box<dyn RowSink>>, path: &Path, machine: &Description, schema: u32) -> Self {
        let shape = machine.shape();
        Recorder {
            sinks,
            path: path.to_owned(),
            largest: vec![0.0; 2 * (shape.inputs + shape.outputs)],
            shape,
            schema,
            sample_time: machine.sample_time,
            waiting: BTreeMap::new(),
            next: None,
            newest: None,
            strange: None,
            behind: 0,
            of_frame: 0,
            trip: None,
            signed: false,
            report: LogReport::default(),
        }
    }

    /// Largest magnitudes of y, u, alpha and beta since the last call.
    pub fn take_largest(&mut self) -> Vec<f32> {
        let zeros = vec![0.0; self.largest.len()];
        std::mem::replace(&mut self.largest, zeros)
    }

    /// Frames whose signature is missing or not that of the key.
    pub(crate) fn refuse(&mut self, frames: u64) {
        self.report.foreign += frames;
    }

    /// Takes the bytes of a datagram or packet.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn take(&mut self, bytes: &[u8]) -> Result<()> {
        let Ok(frame) = Frame::read(bytes) else {
            self.report.damaged += 1;
            return Ok(());
        };
        if frame.kind != Kind::Rows {
            return Ok(());
        }
        let block = RowBlock::read(frame.body, self.shape).filter(|_| frame.schema == self.schema);
        let Some(block) = block else {
            self.report.foreign += 1;
            return Ok(());
        };
        let place = Place { life: frame.life, sequence: frame.sequence, first: block.first };
        let mut rows = Block { values: Vec::new(), status: Vec::new() };
        for row in block.rows() {
            rows.values.extend(row.values());
            rows.status.push(row.status);
        }
        self.of_frame = self.of_frame.max(rows.rows());
        if self.newest.is_some_and(|newest| self.are_near(newest, place)) {
            self.report.implausible += u64::from(self.strange.take().is_some());
            self.behind = 0;
            return self.take_block(place, rows);
        }
        match self.strange.take() {
            Some((before, block)) if before != place && self.are_near(before, place) => {
                self.go_on([(before, block), (place, rows)])
            }
            Some(same) if same.0 == place => {
                self.report.frames.doubled += 1;
                self.strange = Some(same);
                Ok(())
            }
            other => {
                self.report.implausible += u64::from(other.is_some());
                self.strange = Some((place, rows));
                Ok(())
            }
        }
    }

    /// Two frames that confirm each other, far from those before: a gap, or another part.
    fn go_on(&mut self, [(before, block), (place, rows)]: [(Place, Block); 2]) -> Result<()> {
        let newest = self.newest.filter(|newest| newest.life == place.life);
        let onward = newest.is_some_and(|newest| before.first > newest.first);
        if newest.is_some() && !onward && (self.signed || self.behind < WAITING) {
            // A few that are very late; if nothing else comes, what was taken before was forged.
            self.behind += 1;
            self.report.frames.stale += 1;
            self.strange = Some((place, rows));
            return Ok(());
        }
        if self.newest.is_some() && !onward {
            self.begin_part()?;
        }
        if newest.is_none_or(|newest| before.sequence.wrapping_sub(newest.sequence).cast_signed() <= 0) {
            self.report.frames.restart();
        }
        (self.newest, self.behind) = (None, 0);
        self.take_block(before, block)?;
        self.take_block(place, rows)
    }

    /// Whether two frames can be neighbours on a way that loses and swaps some: one that was forged or damaged far ahead is not near.
    fn are_near(&self, a: Place, b: Place) -> bool {
        let frames = b.sequence.wrapping_sub(a.sequence).cast_signed();
        let samples = i128::from(b.first) - i128::from(a.first);
        let most = WAITING as u128 * u128::from(self.of_frame.max(1));
        a.life == b.life
            && frames.unsigned_abs() <= WAITING as u32
            && i128::from(frames.signum()) == samples.signum()
            && samples.unsigned_abs() <= most
    }

    fn take_block(&mut self, place: Place, rows: Block) -> Result<()> {
        if self.newest.is_none_or(|newest| place.first > newest.first) {
            self.newest = Some(place);
        }
        if matches!(self.report.frames.receive(place.sequence), Arrival::Doubled | Arrival::Stale) {
            return Ok(());
        }
        // Two frames of the same samples: one is not of this machine.
        self.report.foreign += u64::from(self.waiting.insert(place.first, rows).is_some());
        self.write_in_order()
    }

    /// Writes what waits, and begins a new part with the frame that is taken next.
    fn begin_part(&mut self) -> Result<()> {
        while !self.waiting.is_empty() {
            self.write_first()?;
        }
        (self.next, self.trip) = (None, None);
        let number = self.report.parts.len() + 1;
        let begun = self.sinks.iter_mut().try_for_each(|sink| sink.part(number));
        begun.map_err(|source| Error::File { path: self.path.clone(), source })?;
        Ok(())
    }

    fn write_in_order(&mut self) -> Result<()> {
        while let Some(first) = self.waiting.keys().next().copied() {
            // What comes next, and before the very first row nothing is known.
            let follows = self.next.map_or(self.waiting.len() > 1, |next| first <= next);
            if !follows && self.waiting.len() <= WAITING {
                return Ok(());
            }
            self.write_first()?;
        }
        Ok(())
    }

    fn write_first(&mut self) -> Result<()> {
        let Some((first, block)) = self.waiting.pop_first() else { return Ok(()) };
        let next = self.next.unwrap_or(first);
        if first < next {
            // Behind rows that are written already.
            self.report.foreign += 1;
            return Ok(());
        }
        if self.next.is_none() {
            let life = self.newest.map_or(0, |newest| newest.life);
            self.report.parts.push(LogPart { first, rows: 0, life });
        }
        self.miss(next, first - next);
        self.next = Some(first + block.rows());
        let rows = block.values.chunks_exact(self.largest.len().max(1)).zip(&block.status);
        for (sample, (values, status)) in (first..).zip(rows) {
            let row = LogRow { time: sample as f64 * self.sample_time, values, status: *status };
            let written = self.sinks.iter_mut().try_for_each(|sink| sink.take(&row));
            written.map_err(|source| Error::File { path: self.path.clone(), source })?;
            self.report.rows += 1;
            if let Some(part) = self.report.parts.last_mut() {
                part.rows += 1;
            }
            self.largest.iter_mut().zip(values).for_each(|(most, value)| *most = most.max(value.abs()));
            let trip = status.trip();
            if self.trip != trip {
                self.trip = trip;
                self.report.trips.extend(trip.map(|trip| (sample, trip)));
            }
        }
        Ok(())
    }

    fn miss(&mut self, first: u64, rows: u64) {
        if rows > 0 {
            self.report.missing += rows;
            self.report.gaps.push((first, rows));
        }
    }

    /// The log up to now.
    pub fn report(&self) -> &LogReport {
        &self.report
    }

    /// The sample after the last one that should have come when the machine was at `sample`: rows are sent in whole frames, and the
    /// last one is still in its hands.
    pub fn end(&self, sample: u64) -> u64 {
        let waiting = self.waiting.last_key_value().map_or(0, |(first, block)| first + block.rows());
        let reached = waiting.max(self.next.unwrap_or(0));
        let frames = sample.saturating_sub(reached) / self.of_frame.max(1);
        reached + frames * self.of_frame
    }

    /// Writes what still waits. Samples before `end` that have not come are missing.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn finish(mut self, end: u64) -> Result<LogReport> {
        if let Some((place, rows)) = self.strange.take() {
            match self.newest {
                None => self.take_block(place, rows)?,
                Some(_) => self.report.implausible += 1,
            }
        }
        while !self.waiting.is_empty() {
            self.write_first()?;
        }
        if let Some(next) = self.next {
            self.miss(next, end.saturating_sub(next));
        }
        let finished = self.sinks.iter_mut().try_for_each(|sink| sink.finish());
        finished.map_err(|source| Error::File { path: self.path.clone(), source })?;
        Ok(self.report)
    }
}
