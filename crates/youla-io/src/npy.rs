//! A NumPy array file of any length, `numpy.save` of samples x channels.
//!
//! Source: NumPy, "NEP 1, A simple file format for NumPy arrays", versions 1 to 3.

use crate::choose::ChannelRef;
use crate::error::{CorruptAt, Error, Result};
use crate::npz::{Header, MAGIC, decode, element_size, header};
use crate::open::open;
use faer::MatMut;
use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use youla::signal::SampleStream;

/// Bytes read at a time.
const BUFFER: usize = 1 << 18;

/// One experiment in a `.npy` file that need not fit into memory: a real array, samples x channels, in C or Fortran order. The
/// columns are chosen by number, `#1` is the first.
#[derive(Debug)]
pub struct NpyStream {
    path: PathBuf,
    file: File,
    descr: String,
    /// Bytes of one number.
    size: usize,
    by_row: bool,
    samples: usize,
    width: usize,
    /// Where the numbers begin.
    start: u64,
    /// Columns of the inputs, then of the outputs.
    columns: Vec<usize>,
    inputs: usize,
    next: usize,
    buffer: Vec<u8>,
}

impl NpyStream {
    /// Opens a file and chooses its columns.
    ///
    /// # Errors
    /// [`Error::MissingFile`], [`Error::Io`], [`Error::Corrupt`] for a damaged header or a length that does not fit it,
    /// [`Error::WrongVariable`] for an array that is not real or not of one or two dimensions, [`Error::NoData`],
    /// [`youla::Error::UnknownChannel`], [`youla::Error::DuplicateChannel`].
    pub fn open(path: impl AsRef<Path>, inputs: &[ChannelRef], outputs: &[ChannelRef]) -> Result<Self> {
        let path = path.as_ref().to_owned();
        let mut file = open(&path)?;
        let corrupt = |offset, expected| Error::Corrupt { path: path.clone(), at: CorruptAt::Byte(offset), expected };
        let io = |source| Error::Io { path: path.clone(), source };
        let Header { descr, fortran_order, shape } = header(&mut file).map_err(|expected| corrupt(0, expected))?;
        let start = file.stream_position().map_err(io)?;
        let (Some(size), [samples, rest @ ..]) = (element_size(&descr), &shape[..]) else {
            return Err(wrong(&path, &shape, &descr));
        };
        let width = match rest {
            [] => 1,
            [width] => *width,
            _ => return Err(wrong(&path, &shape, &descr)),
        };
        if *samples == 0 || width == 0 {
            return Err(Error::NoData { path, problem: "the array is empty" });
        }
        let bytes = samples.checked_mul(width).and_then(|n| n.checked_mul(size)).map(|n| n as u64 + start);
        let length = file.metadata().map_err(io)?.len();
        if bytes != Some(length) {
            let expected = format!("the end of an array of {samples} x {width} numbers of {size} bytes");
            return Err(corrupt(length, expected));
        }
        let columns = columns(&path, width, [inputs, outputs].concat())?;
        Ok(NpyStream {
            descr,
            size,
            by_row: !fortran_order,
            samples: *samples,
            width,
            start,
            columns,
            inputs: inputs.len(),
            next: 0,
            buffer: Vec::new(),
            file,
            path,
        })
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Rows that hold all channels of a sample.
    fn read_rows(&mut self, mut rows: MatMut<'_, f64>) -> Result<()> {
        let bytes = self.width * self.size;
        let at_once = (BUFFER / bytes).max(1);
        self.seek(self.next * bytes)?;
        for first in (0..rows.nrows()).step_by(at_once) {
            let count = at_once.min(rows.nrows() - first);
            self.take(count * bytes)?;
            for (k, row) in self.buffer.chunks_exact(bytes).enumerate() {
                for (j, column) in self.columns.iter().enumerate() {
                    rows[(first + k, j)] = self.number(&row[column * self.size..(column + 1) * self.size]);
                }
            }
        }
        Ok(())
    }

    /// Columns that hold all samples of a channel.
    fn read_columns(&mut self, mut rows: MatMut<'_, f64>) -> Result<()> {
        let at_once = BUFFER / self.size;
        for j in 0..self.columns.len() {
            self.seek((self.columns[j] * self.samples + self.next) * self.size)?;
            for first in (0..rows.nrows()).step_by(at_once) {
                let count = at_once.min(rows.nrows() - first);
                self.take(count * self.size)?;
                for (k, bytes) in self.buffer.chunks_exact(self.size).enumerate() {
                    rows[(first + k, j)] = self.number(bytes);
                }
            }
        }
        Ok(())
    }

    fn number(&self, bytes: &[u8]) -> f64 {
        match (&self.descr[..], bytes) {
            ("<f8", [a, b, c, d, e, f, g, h]) => f64::from_le_bytes([*a, *b, *c, *d, *e, *f, *g, *h]),
            ("<f4", [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            _ => decode(&self.descr, bytes),
        }
    }

    fn seek(&mut self, offset: usize) -> Result<()> {
        let sought = self.file.seek(SeekFrom::Start(self.start + offset as u64));
        sought.map(drop).map_err(|source| Error::Io { path: self.path.clone(), source })
    }

    /// Fills the buffer with so many bytes.
    fn take(&mut self, bytes: usize) -> Result<()> {
        self.buffer.resize(bytes, 0);
        self.file.read_exact(&mut self.buffer).map_err(|source| match source.kind() {
            ErrorKind::UnexpectedEof => Error::Method(youla::Error::RecordChanged),
            _ => Error::Io { path: self.path.clone(), source },
        })
    }
}

/// Whether a file begins as NumPy arrays do.
pub fn is_npy(path: &Path) -> Result<bool> {
    let mut start = Vec::new();
    let read = open(path)?.take(MAGIC.len() as u64).read_to_end(&mut start);
    read.map_err(|source| Error::Io { path: path.to_owned(), source })?;
    Ok(start == MAGIC)
}

fn wrong(path: &Path, shape: &[usize], descr: &str) -> Error {
    Error::WrongVariable {
        path: path.to_owned(),
        name: "the array".into(),
        found: format!("of {} dimensions of {descr}", shape.len()),
        must: "samples x channels of real numbers",
    }
}

fn columns(path: &Path, width: usize, chosen: Vec<ChannelRef>) -> Result<Vec<usize>> {
    let what = path.display().to_string();
    let names: Vec<String> = (1..=width).map(|j| format!("#{j}")).collect();
    let columns = chosen.iter().map(|c| c.index(&what, &names)).collect::<Result<Vec<_>>>()?;
    match (1..columns.len()).find(|&k| columns[..k].contains(&columns[k])) {
        Some(k) => Err(Error::Method(youla::Error::DuplicateChannel { what, name: names[columns[k]].clone() })),
        None => Ok(columns),
    }
}

impl SampleStream for NpyStream {
    fn inputs(&self) -> usize {
        self.inputs
    }

    fn outputs(&self) -> usize {
        self.columns.len() - self.inputs
    }

    fn rewind(&mut self) -> youla::Result<()> {
        self.next = 0;
        Ok(())
    }

    fn read(&mut self, rows: MatMut<'_, f64>) -> youla::Result<usize> {
        let count = rows.nrows().min(self.samples - self.next);
        let mut rows = rows.subrows_mut(0, count);
        if self.by_row {
            self.read_rows(rows.as_mut())?
        } else {
            self.read_columns(rows.as_mut())?
        }
        for k in 0..count {
            if let Some(j) = (0..rows.ncols()).find(|&j| !rows[(k, j)].is_finite()) {
                let (what, channel) = (self.path.display().to_string(), format!("#{}", self.columns[j] + 1));
                return Err(youla::Error::NotFiniteSample { what, channel, row: self.next + k + 1 });
            }
        }
        self.next += count;
        Ok(count)
    }

    fn next_experiment(&mut self) -> youla::Result<bool> {
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::scratch;
    use youla::Mat;

    /// A file in the layout of `numpy.save`.
    fn npy(version: u8, descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
        let order = if fortran { "True" } else { "False" };
        let header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let length = (header.len() as u32).to_le_bytes();
        let length = if version == 1 { &length[..2] } else { &length[..] };
        [b"\x93NUMPY", &[version, 0][..], length, header.as_bytes(), data].concat()
    }

    fn value(k: usize, j: usize) -> f64 {
        0.5 * k as f64 - 1e5 * j as f64
    }

    /// 1000 x 3 numbers.
    fn data(fortran: bool, encode: impl Fn(f64) -> Vec<u8>) -> Vec<u8> {
        let place = |i: usize| if fortran { (i % 1000, i / 1000) } else { (i / 3, i % 3) };
        (0..3000).flat_map(|i| encode(value(place(i).0, place(i).1))).collect()
    }

    fn open(bytes: &[u8], inputs: &[usize], outputs: &[usize]) -> Result<Mat<f64>> {
        let file = scratch("npy");
        std::fs::write(file.path(), bytes).unwrap();
        let chosen = |numbers: &[usize]| numbers.iter().map(|n| ChannelRef::Column(*n)).collect::<Vec<_>>();
        let mut stream = NpyStream::open(file.path(), &chosen(inputs), &chosen(outputs))?;
        let mut all = Mat::zeros(1003, inputs.len() + outputs.len());
        for _pass in 0..2 {
            stream.rewind()?;
            let (first, rest) = all.as_mut().split_at_row_mut(300);
            let counts = [stream.read(first)?, stream.read(rest)?];
            assert_eq!(counts, [300, stream.samples() - 300]);
        }
        Ok(all)
    }

    #[test]
    fn all_layouts_give_the_same_samples() {
        let expected = Mat::from_fn(1003, 2, |k, j| if k < 1000 { value(k, [2, 0][j]) } else { 0.0 });
        for fortran in [false, true] {
            let double = data(fortran, |v| v.to_le_bytes().to_vec());
            let single = data(fortran, |v| (v as f32).to_le_bytes().to_vec());
            let swapped = data(fortran, |v| v.to_be_bytes().to_vec());
            for version in 1..=3 {
                for (descr, bytes) in [("<f8", &double), ("<f4", &single), (">f8", &swapped)] {
                    let found = open(&npy(version, descr, fortran, "(1000, 3)", bytes), &[3], &[1]).unwrap();
                    assert_eq!(found, expected);
                }
            }
        }
    }

    #[test]
    fn bad_files_are_refused() {
        let good = data(false, |v| v.to_le_bytes().to_vec());
        let bad = data(false, |v| if v == value(617, 2) { f64::NAN } else { v }.to_le_bytes().to_vec());
        let run = |bytes: &[u8], y: usize| open(bytes, &[1], &[y]).unwrap_err();
        let error = run(&npy(1, "<f8", false, "(1000, 3)", &bad), 3);
        assert!(
            matches!(error, Error::Method(youla::Error::NotFiniteSample { row: 618, ref channel, .. }) if channel == "#3"),
            "{error}"
        );
        let cut = npy(1, "<f8", false, "(1000, 3)", &good[..good.len() - 8]);
        assert!(
            matches!(run(&cut, 2), Error::Corrupt { at: CorruptAt::Byte(offset), .. } if offset == cut.len() as u64)
        );
        assert!(matches!(run(&npy(1, "<f8", false, "(1000, 2)", &good), 2), Error::Corrupt { .. }));
        assert!(matches!(
            run(&npy(1, "<f8", false, "(1000, 3)", &good), 4),
            Error::Method(youla::Error::UnknownChannel { .. })
        ));
        assert!(matches!(
            run(&npy(1, "<f8", false, "(1000, 3)", &good), 1),
            Error::Method(youla::Error::DuplicateChannel { .. })
        ));
        assert!(matches!(run(&npy(1, "<f8", false, "(10, 10, 30)", &good), 2), Error::WrongVariable { .. }));
        assert!(matches!(run(&npy(1, "<c16", false, "(500, 3)", &good), 2), Error::WrongVariable { .. }));
        assert!(matches!(run(&npy(4, "<f8", false, "(1000, 3)", &good), 2), Error::Corrupt { .. }));
        assert!(matches!(run(&npy(1, "<f8", false, "(0, 3)", &[]), 2), Error::NoData { .. }));
        assert!(matches!(run(b"t,u,y\n1,2,3\n", 2), Error::Corrupt { at: CorruptAt::Byte(0), .. }));
    }
}
