//! Records in batches: samples of one or more experiments in a buffer of fixed size, in time order, one batch read while the
//! one before is worked on.
//!
//! Where batches begin depends on the lengths of the experiments and the number of channels alone, never on the threads.

use super::view::View;
use crate::signal::SampleStream;
use crate::{Error, Mat, Result};
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

/// Segments of different experiments, one contiguous column per channel.
pub(super) struct Batch {
    pub(super) segments: Vec<Segment>,
    inputs: usize,
    values: Mat<f64>,
}

impl Batch {
    /// The samples of a segment.
    pub(super) fn view(&self, segment: &Segment) -> View<'_> {
        let (u, y) = self.values.subrows(segment.at.start, segment.at.len()).split_at_col(self.inputs);
        View::of(u, y)
    }

    /// Those that the batch before did not hold.
    pub(super) fn fresh(&self, segment: &Segment) -> View<'_> {
        self.view(segment).part(segment.repeated, segment.at.len() - segment.repeated)
    }
}

/// How a pass reads the stream.
pub(super) struct Pass<'a> {
    /// Samples of a batch that the next one holds again.
    pub(super) overlap: usize,
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
    let (mut now, mut next) = (reader.batch(), reader.batch());
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
    /// The last samples read, which the next batch holds again.
    tail: Mat<f64>,
}

impl<'a> Reader<'a> {
    fn new(stream: &'a mut dyn SampleStream, pass: &'a Pass<'a>) -> Result<Self> {
        stream.rewind()?;
        let channels = stream.inputs() + stream.outputs();
        let capacity = (VALUES / channels.max(1)).max(SHARES * (pass.overlap + 1));
        let position = Position::NewExperiment;
        Ok(Reader {
            stream,
            pass,
            channels,
            capacity,
            position,
            read: 0,
            lengths: Vec::new(),
            tail: Mat::zeros(0, channels),
        })
    }

    fn batch(&self) -> Batch {
        Batch { segments: Vec::new(), inputs: self.stream.inputs(), values: Mat::zeros(self.capacity, self.channels) }
    }

    /// Fills a batch with as many experiments as have room; false at the end.
    fn fill(&mut self, batch: &mut Batch) -> Result<bool> {
        batch.segments.clear();
        let mut used = 0;
        while self.position != Position::End {
            let room = self.capacity - used;
            if !batch.segments.is_empty() && (self.position == Position::Inside || room <= 2 * self.pass.overlap) {
                break;
            }
            let segment = self.segment(used, &mut batch.values)?;
            used = segment.at.end;
            batch.segments.push(segment);
        }
        Ok(!batch.segments.is_empty())
    }

    fn segment(&mut self, used: usize, values: &mut Mat<f64>) -> Result<Segment> {
        let (begins, repeated) = (self.position == Position::NewExperiment, self.tail.nrows());
        let (first, wanted) = (used + repeated, self.capacity - used - repeated);
        values.as_mut().subrows_mut(used, repeated).copy_from(&self.tail);
        let found = self.stream.read(values.as_mut().subrows_mut(first, wanted))?.min(wanted);
        let ends = found < wanted;
        let at = used..first + found;
        let start = self.read - repeated;
        self.read += found;
        self.tail = Mat::zeros(0, self.channels);
        let segment = Segment { experiment: self.lengths.len(), start, begins, ends, repeated, at };
        if ends {
            self.lengths.push(self.read);
            self.read = 0;
            self.position = if self.stream.next_experiment()? { Position::NewExperiment } else { Position::End };
        } else {
            self.tail = values.subrows(self.capacity - self.pass.overlap, self.pass.overlap).to_owned();
            self.position = Position::Inside;
        }
        Ok(segment)
    }
}
