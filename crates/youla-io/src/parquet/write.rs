//! Writes columns of numbers as a Parquet file, group of rows by group of rows: plain encoding, not compressed, no empty cells.
//!
//! Source: as for reading; the numbers of fields and types are those of `parquet.thrift`.

use super::MAGIC;
use super::thrift_writer::Writer;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Values of a column within a group of rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColumnValues<'a> {
    /// Double precision.
    Double(&'a [f64]),
    /// Single precision.
    Float(&'a [f32]),
    /// 32 bits with a sign.
    Integer(&'a [i32]),
}

impl ColumnValues<'_> {
    /// Number of the type in `parquet.thrift`.
    fn kind(&self) -> i64 {
        match self {
            ColumnValues::Integer(_) => 1,
            ColumnValues::Float(_) => 4,
            ColumnValues::Double(_) => 5,
        }
    }

    fn len(&self) -> usize {
        match self {
            ColumnValues::Double(values) => values.len(),
            ColumnValues::Float(values) => values.len(),
            ColumnValues::Integer(values) => values.len(),
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            ColumnValues::Double(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            ColumnValues::Float(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            ColumnValues::Integer(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        }
    }
}

/// A column of a group that is written: where its page is, and its length.
struct Chunk {
    start: u64,
    length: u64,
}

/// A Parquet file that grows. Without [`ParquetWriter::finish`] it has no footer, and no reader takes it.
///
/// ```
/// use youla_io::{ColumnValues, ParquetWriter, read_parquet};
/// let path = std::env::temp_dir().join(format!("youla-doc-{}.parquet", std::process::id()));
/// let mut file = ParquetWriter::create(&path, &["t", "y"])?;
/// file.group(&[ColumnValues::Double(&[0.0, 0.1]), ColumnValues::Float(&[1.5, -2.0])])?;
/// file.finish()?;
/// assert_eq!(read_parquet(&path)?.column("y")?, [1.5, -2.0]);
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ParquetWriter {
    file: BufWriter<File>,
    path: PathBuf,
    names: Vec<String>,
    kinds: Vec<i64>,
    groups: Vec<(u64, Vec<Chunk>)>,
    position: u64,
}

impl ParquetWriter {
    /// Begins a file with columns of these names.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(path: &Path, names: &[impl AsRef<str>]) -> Result<Self> {
        let failed = |source| Error::Io { path: path.to_owned(), source };
        let mut file = BufWriter::new(File::create(path).map_err(failed)?);
        file.write_all(MAGIC).map_err(failed)?;
        Ok(ParquetWriter {
            file,
            path: path.to_owned(),
            names: names.iter().map(|name| name.as_ref().to_owned()).collect(),
            kinds: Vec::new(),
            groups: Vec::new(),
            position: MAGIC.len() as u64,
        })
    }

    /// Writes a group of rows, the same number of values for each column. The first group decides the types.
    ///
    /// # Errors
    /// [`Error::Io`], also for columns that do not fit those before.
    pub fn group(&mut self, columns: &[ColumnValues<'_>]) -> Result<()> {
        let rows = columns.first().map_or(0, ColumnValues::len);
        let kinds: Vec<i64> = columns.iter().map(ColumnValues::kind).collect();
        let alike = columns.len() == self.names.len() && columns.iter().all(|column| column.len() == rows);
        if !alike || !(self.kinds.is_empty() || self.kinds == kinds) {
            return Err(self.failed(std::io::ErrorKind::InvalidInput.into()));
        }
        self.kinds = kinds;
        let chunks = columns.iter().map(|column| self.page(column)).collect::<Result<_>>()?;
        self.groups.push((rows as u64, chunks));
        Ok(())
    }

    fn page(&mut self, column: &ColumnValues<'_>) -> Result<Chunk> {
        let values = column.bytes();
        let mut header = Writer::new();
        // DATA_PAGE, both sizes, then the number of values in plain encoding; levels by runs, of which there are none.
        header.integer32(1, 0);
        header.integer32(2, values.len() as i64);
        header.integer32(3, values.len() as i64);
        header.structure(5, |page| {
            page.integer32(1, column.len() as i64);
            page.integer32(2, 0);
            page.integer32(3, 3);
            page.integer32(4, 3);
        });
        let header = header.end();
        let start = self.position;
        self.write(&header)?;
        self.write(&values)?;
        Ok(Chunk { start, length: self.position - start })
    }

    /// Writes the footer.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<()> {
        let footer = self.footer();
        self.write(&footer)?;
        self.write(&(footer.len() as u32).to_le_bytes())?;
        self.write(MAGIC)?;
        self.file.flush().map_err(|source| self.failed(source))
    }

    fn footer(&self) -> Vec<u8> {
        let rows: u64 = self.groups.iter().map(|(rows, _)| rows).sum();
        let mut file = Writer::new();
        file.integer32(1, 1);
        file.list(2, self.names.len() + 1, |k, element| match k.checked_sub(1) {
            None => {
                element.bytes(4, b"schema");
                element.integer32(5, self.names.len() as i64);
            }
            Some(column) => {
                // A file without rows has no types; single precision does no harm.
                element.integer32(1, self.kinds.get(column).copied().unwrap_or(4));
                element.integer32(3, 0);
                element.bytes(4, self.names[column].as_bytes());
            }
        });
        file.integer64(3, rows as i64);
        file.list(4, self.groups.len(), |k, group| {
            let (rows, chunks) = &self.groups[k];
            group.list(1, chunks.len(), |column, chunk| self.chunk(column, *rows, &chunks[column], chunk));
            group.integer64(2, chunks.iter().map(|chunk| chunk.length).sum::<u64>() as i64);
            group.integer64(3, *rows as i64);
        });
        file.bytes(6, concat!("youla ", env!("CARGO_PKG_VERSION")).as_bytes());
        file.end()
    }

    fn chunk(&self, column: usize, rows: u64, at: &Chunk, chunk: &mut Writer) {
        chunk.integer64(2, at.start as i64);
        chunk.structure(3, |about| {
            about.integer32(1, self.kinds[column]);
            about.integers(2, &[0, 3]);
            about.names(3, &[self.names[column].as_bytes()]);
            about.integer32(4, 0);
            about.integer64(5, rows as i64);
            about.integer64(6, at.length as i64);
            about.integer64(7, at.length as i64);
            about.integer64(9, at.start as i64);
        });
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.write_all(bytes).map_err(|source| Error::Io { path: self.path.clone(), source })?;
        self.position += bytes.len() as u64;
        Ok(())
    }

    fn failed(&self, source: std::io::Error) -> Error {
        Error::Io { path: self.path.clone(), source }
    }
}
