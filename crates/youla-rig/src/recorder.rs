//! A log in which every row is there or reported missing.

use crate::{Description, Error, Result};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use youla_link::{Arrival, Frame, Kind, RowBlock, RowShape, Tracker};
use youla_rt::Trip;

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
    /// Frames with another description of the machine, or with rows that do not fit it.
    pub foreign: u64,
    /// Trips of the guard: sample and cause.
    pub trips: Vec<(u64, Trip)>,
}

/// Rows of one frame that wait for those before them.
struct Block {
    text: String,
    rows: u64,
    trips: Vec<(u64, Option<Trip>)>,
}

/// Frames that wait for an earlier one: the window of [`Tracker`].
const WAITING: usize = 64;

/// Writes the rows of frames to a CSV file, in the order of their samples.
pub struct Recorder {
    file: BufWriter<File>,
    path: PathBuf,
    shape: RowShape,
    schema: u32,
    sample_time: f64,
    waiting: BTreeMap<u64, Block>,
    next: Option<u64>,
    /// Rows of the longest frame.
    of_frame: u64,
    trip: Option<Trip>,
    report: LogReport,
}

impl Recorder {
    /// Begins a log of a machine whose frames have this schema.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn create(path: &Path, machine: &Description, schema: u32) -> Result<Self> {
        let failed = |source| Error::File { path: path.to_owned(), source };
        let mut file = BufWriter::new(File::create(path).map_err(failed)?);
        writeln!(file, "{}", machine.columns().join(",")).map_err(failed)?;
        Ok(Recorder {
            file,
            path: path.to_owned(),
            shape: machine.shape(),
            schema,
            sample_time: machine.sample_time,
            waiting: BTreeMap::new(),
            next: None,
            of_frame: 0,
            trip: None,
            report: LogReport::default(),
        })
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
        if matches!(self.report.frames.receive(frame.sequence), Arrival::Doubled | Arrival::Stale) {
            return Ok(());
        }
        let text = self.text(&block);
        self.of_frame = self.of_frame.max(text.rows);
        // Two frames of the same samples: the machine has started again.
        self.report.foreign += u64::from(self.waiting.insert(block.first, text).is_some());
        self.write_in_order()
    }

    fn text(&self, block: &RowBlock<'_>) -> Block {
        let mut text = Block { text: String::new(), rows: 0, trips: Vec::new() };
        for row in block.rows() {
            // Writing to a string cannot fail.
            let _ = write!(text.text, "{:?}", row.sample as f64 * self.sample_time);
            for value in row.values() {
                let _ = write!(text.text, ",{value:?}");
            }
            let _ = writeln!(text.text, ",{}", row.status.bits());
            text.trips.push((row.sample, row.status.trip()));
            text.rows += 1;
        }
        text
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
            // Behind rows that are written already: the machine has started again.
            self.report.foreign += 1;
            return Ok(());
        }
        self.miss(next, first - next);
        self.file.write_all(block.text.as_bytes()).map_err(|source| self.failed(source))?;
        self.next = Some(first + block.rows);
        self.report.rows += block.rows;
        for (sample, trip) in block.trips {
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

    /// Rows in the log up to now.
    pub fn rows(&self) -> u64 {
        self.report.rows
    }

    /// The sample after the last one that should have come when the machine was at `sample`: rows are sent in whole frames, and the
    /// last one is still in its hands.
    pub fn end(&self, sample: u64) -> u64 {
        let waiting = self.waiting.last_key_value().map_or(0, |(first, block)| first + block.rows);
        let reached = waiting.max(self.next.unwrap_or(0));
        let frames = sample.saturating_sub(reached) / self.of_frame.max(1);
        reached + frames * self.of_frame
    }

    /// Writes what still waits. Samples before `end` that have not come are missing.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn finish(mut self, end: u64) -> Result<LogReport> {
        while !self.waiting.is_empty() {
            self.write_first()?;
        }
        if let Some(next) = self.next {
            self.miss(next, end.saturating_sub(next));
        }
        self.file.flush().map_err(|source| self.failed(source))?;
        Ok(self.report)
    }

    fn failed(&self, source: std::io::Error) -> Error {
        Error::File { path: self.path.clone(), source }
    }
}
