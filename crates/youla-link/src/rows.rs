//! Rows of the log: `y, u, alpha, beta` as `f32`, then the status as a whole number.

use crate::bytes::Reader;
use crate::{Frame, FrameError, Kind, LARGEST_BODY};
use youla_rt::{Row, Status};

/// Numbers of plant inputs and outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowShape {
    /// u and alpha.
    pub inputs: usize,
    /// y and beta.
    pub outputs: usize,
}

impl RowShape {
    /// Numbers of a row, without the status.
    #[must_use]
    pub const fn values(self) -> usize {
        2 * (self.inputs + self.outputs)
    }

    /// Bytes of a row.
    #[must_use]
    pub const fn bytes(self) -> usize {
        4 * self.values() + 4
    }
}

/// Rows of consecutive samples: the body of a frame of [`Kind::Rows`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowBlock<'a> {
    /// Number of the first sample.
    pub first: u64,
    shape: RowShape,
    rows: &'a [u8],
}

/// One row of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowView<'a> {
    /// Number of the sample.
    pub sample: u64,
    /// Phase, banks of Q, causes.
    pub status: Status,
    values: &'a [u8],
}

impl<'a> RowBlock<'a> {
    /// From a body; `None` where it does not hold whole rows of this shape, at least one.
    #[must_use]
    pub fn read(body: &'a [u8], shape: RowShape) -> Option<Self> {
        let mut reader = Reader(body);
        let first = reader.u64()?;
        let rows = reader.rest();
        let whole = !rows.is_empty() && rows.len() % shape.bytes() == 0;
        let last = first.checked_add((rows.len() / shape.bytes()) as u64);
        (whole && last.is_some()).then_some(RowBlock { first, shape, rows })
    }

    /// Its rows.
    pub fn rows(&self) -> impl Iterator<Item = RowView<'a>> + use<'a> {
        let values = 4 * self.shape.values();
        (self.first..).zip(self.rows.chunks_exact(self.shape.bytes())).filter_map(move |(sample, row)| {
            let (values, status) = row.split_at_checked(values)?;
            Some(RowView { sample, status: Status::from_bits(Reader(status).u32()?), values })
        })
    }
}

impl<'a> RowView<'a> {
    /// y, u, alpha, beta.
    pub fn values(&self) -> impl Iterator<Item = f32> + use<'a> {
        self.values.chunks_exact(4).filter_map(|bytes| Reader(bytes).f32())
    }
}

/// Collects rows of a loop with M inputs and P outputs for one frame.
#[derive(Debug, Clone)]
pub struct RowBatch<const M: usize, const P: usize> {
    body: [u8; LARGEST_BODY],
    length: usize,
    rows: u16,
    most: u16,
    next: u64,
}

const FIRST: usize = 8;

impl<const M: usize, const P: usize> RowBatch<M, P> {
    const SHAPE: RowShape = RowShape { inputs: M, outputs: P };

    /// Of at most so many rows, at least 1, and not more than a frame holds.
    #[must_use]
    pub fn new(most: u16) -> Self {
        let room = ((LARGEST_BODY - FIRST) / Self::SHAPE.bytes()).min(u16::MAX.into()) as u16;
        RowBatch { body: [0; LARGEST_BODY], length: FIRST, rows: 0, most: most.clamp(1, room.max(1)), next: 0 }
    }

    /// Whether the frame must be sent before the next row.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.rows >= self.most
    }

    /// A further row. One that does not follow the last one, or finds the batch full, begins a new batch: send it first.
    pub fn push(&mut self, row: &Row<f32, M, P>) {
        if self.rows == 0 || row.sample != self.next || self.is_full() {
            (self.length, self.rows) = (FIRST, 0);
            if let Some(first) = self.body.first_chunk_mut() {
                *first = row.sample.to_le_bytes();
            }
        }
        let end = self.length + Self::SHAPE.bytes();
        let Some(space) = self.body.get_mut(self.length..end) else { return };
        let values = row.y.iter().chain(&row.u).chain(&row.alpha).chain(&row.beta).map(|value| value.to_le_bytes());
        let words = values.chain(core::iter::once(row.status.bits().to_le_bytes()));
        for (place, word) in space.chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&word);
        }
        (self.length, self.rows, self.next) = (end, self.rows + 1, row.sample.wrapping_add(1));
    }

    /// Writes the frame with these numbers of its header and begins a new batch; `None` where there is no row.
    ///
    /// # Errors
    /// [`FrameError::Length`] where the buffer is too short.
    pub fn take(&mut self, [schema, life, sequence]: [u32; 3], buffer: &mut [u8]) -> Option<Result<usize, FrameError>> {
        let body = self.body.get(..self.length).filter(|_| self.rows > 0)?;
        let written = Frame { kind: Kind::Rows, schema, sequence, host: 0, life, body }.write(buffer);
        self.rows = 0;
        Some(written)
    }
}
