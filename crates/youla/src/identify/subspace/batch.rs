//! Records in batches: samples of one or more experiments in a buffer of fixed size, in time order, one batch read while the
//! one before is worked on.
//!
//! Where batches begin depends on the lengths of the experiments and the number of channels alone, never on where the samples
//! come from or on the threads: records in memory and in a file give the same numbers to the last bit.

use crate::record::SampleStream;
use crate::{Error, MatRef, Result};
use faer::MatMut;
use std::ops::Range;

/// Numbers in a batch, 4 MB.
const VALUES: usize = 1 << 19;
/// A batch holds at least so many times the samples that two consecutive batches share.
const SHARES: usize = 16;

/// Consecutive samples of one experiment.
pub(super) struct Segment {
    /// Which experiment, counted from 0.
    pub(super) experiment: usize,
    /// Time of the first sample.
    pub(super) start: usize,
    /// Whether it holds the first and the last sample of the experiment.
    pub(super) begins: bool,
    pub(super) ends: bool,
    /// Samples at its start that the batch before held already.
    pub(super) repeated: usize,
    /// Its samples in the batch.
    at: Range<usize>,
}

impl Segment {
    /// Number of samples, with those of the batch before.
    pub(super) fn samples(&self) -> usize {
        self.at.len()
    }
}

/// Segments of different experiments; all channels `[u; y]` of a sample stand together.
#[derive(Default)]
pub(super) struct Batch {
    pub(super) segments: Vec<Segment>,
    pub(super) channels: usize,
    values: Vec<f64>,
}

impl Batch {
    /// The samples of a segment, `z(t)` at `t q .. (t + 1) q`.
    pub(super) fn values(&self, segment: &Segment) -> &[f64] {
        &self.values[segment.at.start * self.channels..segment.at.end * self.channels]
    }

    /// The same as a matrix, samples x channels.
    pub(super) fn rows(&self, segment: &Segment) -> MatRef<'_, f64> {
        MatRef::from_row_major_slice(self.values(segment), segment.samples(), self.channels)
    }
}

/// How a pass reads the stream.
pub(super) struct Pass<'a> {
    /// Samples of a batch that the next one holds again.
    pub(super) overlap: usize,
    /// The channels are divided by these.
    pub(super) scale: Option<&'a [f64]>,
    /// Lengths of the experiments from an earlier pass.
    pub(super) lengths: Option<&'a [usize]>,
}

/// Rewinds the stream and calls `work` with every batch; returns the length of each experiment.
pub(super) fn each_batch(
    stream: &mut dyn SampleStream,
    pass: &Pass<'_>,
    mut work: impl FnMut(&Batch) -> Result<()> + Send,
) -> Result<Vec<usize>> {
    let mut reader = Reader::new(stream, pass)?;
    let (mut now, mut next) = (Batch::default(), Batch::default());
    let mut more = reader.fill(&mut now)?;
    while more {
        let (done, read) = rayon::join(|| work(&now), || reader.fill(&mut next));
        done?;
        more = read?;
        std::mem::swap(&mut now, &mut next);
    }
    match pass.lengths {
        Some(before) if before != reader.lengths => Err(Error::RecordChanged),
        _ => Ok(reader.lengths),
    }
}

/// Where in the stream the next batch begins.
#[derive(PartialEq, Eq)]
enum Position {
    NewExperiment,
    Inside,
    End,
}

struct Reader<'a> {
    stream: &'a mut dyn SampleStream,
    pass: &'a Pass<'a>,
    channels: usize,
    capacity: usize,
    position: Position,
    /// Samples read of the current experiment, and of those before it.
    read: usize,
    lengths: Vec<usize>,
    /// The last samples read, scaled, which the next batch holds again.
    tail: Vec<f64>,
}

impl<'a> Reader<'a> {
    fn new(stream: &'a mut dyn SampleStream, pass: &'a Pass<'a>) -> Result<Self> {
        stream.rewind()?;
        let channels = stream.inputs() + stream.outputs();
        let capacity = (VALUES / channels.max(1)).max(SHARES * (pass.overlap + 1));
        let position = Position::NewExperiment;
        Ok(Reader { stream, pass, channels, capacity, position, read: 0, lengths: Vec::new(), tail: Vec::new() })
    }

    /// Fills a batch with as many experiments as have room; false at the end.
    fn fill(&mut self, batch: &mut Batch) -> Result<bool> {
        batch.segments.clear();
        batch.values.clear();
        batch.channels = self.channels;
        while self.position != Position::End {
            let used = batch.values.len() / self.channels.max(1);
            let room = self.capacity - used;
            if !batch.segments.is_empty() && (self.position == Position::Inside || room <= 2 * self.pass.overlap) {
                break;
            }
            let segment = self.segment(used, room, &mut batch.values)?;
            batch.segments.push(segment);
        }
        Ok(!batch.segments.is_empty())
    }

    fn segment(&mut self, used: usize, room: usize, values: &mut Vec<f64>) -> Result<Segment> {
        let (q, begins) = (self.channels, self.position == Position::NewExperiment);
        let repeated = self.tail.len() / q.max(1);
        let wanted = room - repeated;
        values.extend_from_slice(&self.tail);
        let first = values.len();
        values.resize(first + wanted * q, 0.0);
        let rows = MatMut::from_row_major_slice_mut(&mut values[first..], wanted, q);
        let found = self.stream.read(rows)?.min(wanted);
        values.truncate(first + found * q);
        if let Some(scale) = self.pass.scale {
            values[first..].chunks_exact_mut(q).for_each(|z| z.iter_mut().zip(scale).for_each(|(z, s)| *z /= s));
        }
        let ends = found < wanted;
        let at = used..used + repeated + found;
        let start = self.read - repeated;
        let segment = Segment { experiment: self.lengths.len(), start, begins, ends, repeated, at };
        self.read += found;
        self.tail.clear();
        if ends {
            self.lengths.push(self.read);
            self.read = 0;
            self.position = if self.stream.next_experiment()? { Position::NewExperiment } else { Position::End };
        } else {
            self.tail.extend_from_slice(&values[values.len() - self.pass.overlap * q..]);
            self.position = Position::Inside;
        }
        Ok(segment)
    }
}
