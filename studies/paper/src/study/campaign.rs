//! Many independent items on all cores: rows stream to a file in the order of the items, and a file that was cut off is
//! continued.

use super::item::Evaluated;
use super::row::StudyRow;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// A part of a campaign: number `index` of `count`, counted from 1; `2/4` as text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// The whole.
    pub const WHOLE: Shard = Shard { index: 1, count: 1 };

    /// Part `index` of `count`.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] unless `1 <= index <= count`.
    pub fn new(index: usize, count: usize) -> Result<Self> {
        if index == 0 || index > count {
            let what = format!("the number of a shard of {count}");
            return Err(Error::Method(youla::Error::OutOfRange {
                what,
                value: index as f64,
                must: "from 1 to the number of shards",
            }));
        }
        Ok(Shard { index, count })
    }

    /// Number of this part, from 1.
    pub fn index(self) -> usize {
        self.index
    }

    /// Number of parts.
    pub fn count(self) -> usize {
        self.count
    }

    /// Whether it is all there is.
    pub fn is_whole(self) -> bool {
        self.count == 1
    }

    /// Its items: neighbours, and as many as in the other parts up to one.
    pub fn items(self, total: usize) -> Range<usize> {
        (self.index - 1) * total / self.count..self.index * total / self.count
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> String {
        shard.to_string()
    }
}

impl TryFrom<String> for Shard {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl FromStr for Shard {
    type Err = Error;

    /// # Errors
    /// [`youla::Error::OutOfRange`] and [`Error::BadShard`].
    fn from_str(text: &str) -> Result<Self> {
        let bad = || Error::BadShard { text: text.to_owned() };
        let (index, count) = text.split_once('/').ok_or_else(bad)?;
        Shard::new(index.trim().parse().map_err(|_| bad())?, count.trim().parse().map_err(|_| bad())?)
    }
}

/// Items whose rows go to one file.
#[derive(Debug, Clone)]
pub struct StudyCampaign {
    /// The results file: [`StudyRow::HEADER`], then the rows of item after item.
    pub path: PathBuf,
    /// The items.
    pub items: Range<usize>,
    /// Rows per item.
    pub rows_per_item: usize,
}

/// What a campaign found.
#[derive(Debug, Clone)]
pub struct CampaignOutcome {
    /// All rows, those of an earlier call included.
    pub rows: Vec<StudyRow>,
    /// Items that were computed in this call, without those that had no loop.
    pub computed: usize,
    /// Time per part of an item, summed over the items of this call; see [`Evaluated::durations`].
    pub durations: Vec<Duration>,
}

impl StudyCampaign {
    /// Computes the items that the file lacks, on all threads of rayon's pool, and adds their rows to it.
    ///
    /// The file is a prefix of the result at any time: an item is written as soon as all items before it are. Its contents do
    /// not depend on the number of threads nor on interruptions, as long as `evaluate` depends on the item alone. Rows from the
    /// first damaged one on are computed again. `continued` receives how many items the file holds and how many rows behind them are
    /// computed again, `progress` how many items are done.
    ///
    /// # Errors
    /// Of the item with the lowest number that fails; rows before it stay. [`Error::NotResults`] where the file is something
    /// else, [`Error::InUse`] where another process writes to it, [`youla_io::Error::Io`].
    pub fn run(
        &self,
        evaluate: impl Fn(usize) -> Result<Evaluated> + Sync,
        continued: &dyn Fn(usize, usize),
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<CampaignOutcome> {
        let io = |source| Error::File(youla_io::Error::Io { path: self.path.clone(), source });
        let mut file = OpenOptions::new().create(true).read(true).append(true).open(&self.path).map_err(io)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(Error::InUse { path: self.path.clone() }),
            Err(TryLockError::Error(source)) => return Err(io(source)),
        }
        let found = Found::read(&self.path, self.items.clone(), self.rows_per_item)?;
        file.set_len(found.bytes as u64).map_err(io)?;
        if found.bytes == 0 {
            writeln!(file, "{}", StudyRow::HEADER).map_err(io)?;
        }
        let done = found.rows.len() / self.rows_per_item;
        continued(done, found.damaged);
        progress(done);
        let start = self.items.start + done;
        let outcome = CampaignOutcome { rows: found.rows, computed: 0, durations: Vec::new() };
        let writer = Mutex::new(Writer { file, next: start, waiting: BTreeMap::new(), outcome, failure: None });
        let (next, stop) = (AtomicUsize::new(start), AtomicBool::new(false));
        rayon::broadcast(|_| {
            while !stop.load(Ordering::Relaxed) {
                let item = next.fetch_add(1, Ordering::Relaxed);
                if item >= self.items.end {
                    break;
                }
                let evaluated = evaluate(item);
                let mut writer = writer.lock().unwrap_or_else(PoisonError::into_inner);
                writer.take(item, evaluated, &self.path);
                stop.fetch_or(writer.failure.is_some(), Ordering::Relaxed);
                progress(writer.next - self.items.start);
            }
        });
        let writer = writer.into_inner().unwrap_or_else(PoisonError::into_inner);
        writer.failure.map_or(Ok(writer.outcome), Err)
    }
}

/// The end of the file and what waits for its turn.
struct Writer {
    file: File,
    /// The item that is written next.
    next: usize,
    waiting: BTreeMap<usize, Result<Evaluated>>,
    outcome: CampaignOutcome,
    failure: Option<Error>,
}

impl Writer {
    fn take(&mut self, item: usize, evaluated: Result<Evaluated>, path: &Path) {
        self.waiting.insert(item, evaluated);
        while self.failure.is_none()
            && let Some(evaluated) = self.waiting.remove(&self.next)
        {
            match evaluated.and_then(|evaluated| self.write(evaluated, path)) {
                Ok(()) => self.next += 1,
                Err(error) => self.failure = Some(error),
            }
        }
    }

    /// One call of the system per item, so that a process that is killed leaves at most one incomplete item.
    fn write(&mut self, evaluated: Evaluated, path: &Path) -> Result<()> {
        let text: String = evaluated.rows.iter().map(|row| row.line() + "\n").collect();
        self.file
            .write_all(text.as_bytes())
            .map_err(|source| Error::File(youla_io::Error::Io { path: path.to_owned(), source }))?;
        let parts = self.outcome.durations.len().max(evaluated.durations.len());
        self.outcome.durations.resize(parts, Duration::ZERO);
        self.outcome.durations.iter_mut().zip(&evaluated.durations).for_each(|(sum, lap)| *sum += *lap);
        self.outcome.computed += usize::from(!evaluated.durations.is_empty());
        self.outcome.rows.extend(evaluated.rows);
        Ok(())
    }
}

/// The rows of the complete items at the beginning of a results file.
///
/// # Errors
/// [`Error::NotResults`], [`youla_io::Error::Io`].
pub fn read_results(path: &Path, items: Range<usize>, rows_per_item: usize) -> Result<Vec<StudyRow>> {
    Ok(Found::read(path, items, rows_per_item)?.rows)
}

/// The usable beginning of a results file.
struct Found {
    rows: Vec<StudyRow>,
    /// Its length.
    bytes: usize,
    /// Lines behind it.
    damaged: usize,
}

impl Found {
    /// Reads the complete items at the beginning of a file.
    fn read(path: &Path, items: Range<usize>, rows_per_item: usize) -> Result<Self> {
        let text = youla_io::read_bytes(path)?;
        let mut lines = text.split_inclusive(|byte| *byte == b'\n');
        let header = lines.next().unwrap_or_default();
        let expected = format!("{}\n", StudyRow::HEADER);
        if header != expected.as_bytes() {
            // A header that was cut off belongs to a process that was killed at once.
            return match expected.as_bytes().starts_with(header) {
                true => Ok(Found { rows: Vec::new(), bytes: 0, damaged: 0 }),
                false => Err(Error::NotResults { path: path.to_owned() }),
            };
        }
        let (mut rows, mut bytes, mut length) = (Vec::new(), header.len(), header.len());
        for line in lines {
            let item = items.start + rows.len() / rows_per_item;
            match complete(line).filter(|row: &StudyRow| row.item == item && item < items.end) {
                Some(row) => rows.push(row),
                None => break,
            }
            length += line.len();
            if rows.len() % rows_per_item == 0 {
                bytes = length;
            }
        }
        rows.truncate(rows.len() / rows_per_item * rows_per_item);
        let damaged = text[bytes..].split_inclusive(|byte| *byte == b'\n').count();
        Ok(Found { rows, bytes, damaged })
    }
}

fn complete(line: &[u8]) -> Option<StudyRow> {
    StudyRow::parse(std::str::from_utf8(line).ok()?.strip_suffix('\n')?)
}
