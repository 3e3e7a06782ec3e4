//! NumPy archives (`numpy.savez`, `numpy.savez_compressed`) and single arrays (`numpy.save`): real arrays of up to two dimensions.
//!
//! Source: NumPy, "NEP 1, A simple file format for NumPy arrays", versions 1 to 3. An archive is a zip file of `.npy`
//! entries, each a magic string, a Python dictionary of type, order and shape, and the numbers.

use crate::error::{CorruptAt, Error, Result};
use crate::open::open;
use crate::values::{Value, Variable, Variables};
use std::io::{BufReader, Cursor, Read, Seek};
use std::ops::Range;
use std::path::Path;
use zip::ZipArchive;

pub(super) const MAGIC: &[u8] = b"\x93NUMPY";
/// Name of the array of a file with one: `numpy.save` stores none.
const SINGLE: &str = "array";
/// The longest dictionary that is read; NumPy itself stops at 10000 bytes.
const LONGEST_HEADER: usize = 1 << 16;

/// Reads all arrays of a NumPy archive, or the single array of a `.npy` file, whose name is `array`: its second column is `array(:,2)`.
///
/// One-dimensional arrays become columns. Arrays of text, objects, complex numbers, half precision and of more than two
/// dimensions become [`Value::Unsupported`].
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`], [`Error::Corrupt`] with the position of the archive entry that is damaged.
///
/// ```no_run
/// use youla_io::{ChannelSpec, TimeSource, read_npz};
/// let record = read_npz("run.npz")?.record(&["u", "y"].map(ChannelSpec::named), &TimeSource::ts(1e-3))?;
/// # Ok::<(), youla_io::Error>(())
/// ```
pub fn read_npz(path: impl AsRef<Path>) -> Result<Variables> {
    let path = path.as_ref();
    variables(BufReader::new(open(path)?), path)
}

/// The arrays of a NumPy archive that is in memory; `path` is named in errors.
///
/// # Errors
/// Those of [`read_npz`] but for the operating system's.
pub fn npz_from_bytes(bytes: &[u8], path: impl AsRef<Path>) -> Result<Variables> {
    variables(Cursor::new(bytes), path.as_ref())
}

fn variables(mut file: impl Read + Seek, path: &Path) -> Result<Variables> {
    let corrupt = |offset, expected| Error::Corrupt { path: path.to_owned(), at: CorruptAt::Byte(offset), expected };
    let io = |source| Error::Io { path: path.to_owned(), source };
    let mut start = Vec::new();
    (&mut file).take(MAGIC.len() as u64).read_to_end(&mut start).map_err(io)?;
    file.rewind().map_err(io)?;
    if start == MAGIC {
        let value = array(&mut file).map_err(|expected| corrupt(0, expected))?;
        return Ok(Variables::new(path, vec![Variable { name: SINGLE.into(), value }]));
    }
    let mut archive = ZipArchive::new(file).map_err(|e| corrupt(0, format!("a NumPy archive: {e}")))?;
    if let Some((found, remedy)) = foreign(|name| archive.file_names().any(|n| n.ends_with(name))) {
        return Err(Error::FormatNotRead { path: path.to_owned(), found, remedy });
    }
    let mut variables = Vec::new();
    let mut taken: Vec<Range<u64>> = Vec::new();
    for k in 0..archive.len() {
        let mut entry = archive.by_index(k).map_err(|e| corrupt(0, format!("a readable entry {}: {e}", k + 1)))?;
        let name = entry.name().strip_suffix(".npy").unwrap_or(entry.name()).to_owned();
        let offset = entry.data_start();
        let place = offset..offset.saturating_add(entry.compressed_size());
        // A hundred entries that share their bytes would unpack to a hundred times as much.
        if taken.iter().any(|other| other.start < place.end && place.start < other.end) {
            return Err(corrupt(offset, format!("bytes that belong to the entry {name:?} only")));
        }
        taken.push(place);
        let value = array(&mut entry).map_err(|expected| corrupt(offset, format!("{expected} for {name:?}")))?;
        variables.push(Variable { name, value });
    }
    Ok(Variables::new(path, variables))
}

/// A zip archive of another program, by the names in it: what it is, and what to do.
fn foreign(holds: impl Fn(&str) -> bool) -> Option<(&'static str, &'static str)> {
    let sheet =
        "save the sheet with the log as CSV, or read it in Python with pandas.read_excel and give the data frame";
    if holds(".npy") {
        return None;
    }
    let kinds = [
        ("xl/workbook.xml", "an Excel workbook"),
        ("xl/workbook.bin", "an Excel workbook"),
        ("META-INF/manifest.xml", "an OpenDocument file"),
    ];
    let kind = kinds.into_iter().find(|(name, _)| holds(name)).map(|(_, found)| (found, sheet));
    Some(kind.unwrap_or(("a zip archive without NumPy arrays", "unpack it and give the file with the log")))
}

/// Type, order and shape of an array.
#[derive(Debug, PartialEq)]
pub(super) struct Header {
    pub(super) descr: String,
    pub(super) fortran_order: bool,
    pub(super) shape: Vec<usize>,
}

/// Reads an array; the error says what was expected.
fn array(reader: &mut impl Read) -> Result<Value, String> {
    let header = header(reader)?;
    let size = element_size(&header.descr);
    let (Some(size), 0..=2) = (size, header.shape.len()) else {
        return Ok(Value::Unsupported {
            class: format!("array of {} dimensions of {}", header.shape.len(), header.descr),
        });
    };
    let [rows, columns] = match header.shape[..] {
        [rows, columns] => [rows, columns],
        [rows] => [rows, 1],
        _ => [1, 1],
    };
    let bytes = rows.checked_mul(columns).and_then(|n| n.checked_mul(size)).ok_or("a shape that fits into memory")?;
    let stored = body(reader, bytes)?;
    if stored.is_empty() {
        // Without rows there may be any number of columns to walk over.
        return Ok(Value::Real { dims: vec![rows, columns], data: Vec::new() });
    }
    let by_row = !header.fortran_order;
    let number = |k: usize| decode(&header.descr, &stored[k * size..(k + 1) * size]);
    let at = |i: usize, j: usize| if by_row { i * columns + j } else { j * rows + i };
    let data = (0..columns).flat_map(|j| (0..rows).map(move |i| (i, j))).map(|(i, j)| number(at(i, j))).collect();
    Ok(Value::Real { dims: vec![rows, columns], data })
}

/// Reads the header before the numbers; the error states what was expected.
pub(super) fn header(reader: &mut impl Read) -> Result<Header, String> {
    let magic = body_part(reader, MAGIC.len() + 2)?;
    if !magic.starts_with(MAGIC) {
        return Err("the first bytes of a NumPy array".to_owned());
    }
    let length = match magic[MAGIC.len()] {
        1 => body_part(reader, 2)?,
        2 | 3 => body_part(reader, 4)?,
        other => return Err(format!("version 1 to 3 of the NumPy format, not {other}")),
    };
    let length = length.iter().rev().fold(0, |value, &byte| value << 8 | usize::from(byte));
    if length > LONGEST_HEADER {
        return Err(format!("a header of at most {LONGEST_HEADER} bytes, not {length}"));
    }
    let text = String::from_utf8_lossy(&body_part(reader, length)?).into_owned();
    parse_header(&text).ok_or_else(|| "a dictionary with type, order and shape".to_owned())
}

fn parse_header(text: &str) -> Option<Header> {
    let value = |key: &str| Some(text.split_once(&format!("'{key}':"))?.1.trim_start());
    let descr = value("descr")?;
    let descr = match descr.strip_prefix('\'') {
        Some(quoted) => quoted.split_once('\'')?.0.to_owned(),
        None => "a structured type".to_owned(),
    };
    let fortran_order = value("fortran_order")?.starts_with("True");
    let shape = value("shape")?.strip_prefix('(')?.split_once(')')?.0;
    let shape = shape.split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.parse().ok());
    Some(Header { descr, fortran_order, shape: shape.collect::<Option<_>>()? })
}

/// Bytes of one number; `None` for a type that is not read.
pub(super) fn element_size(descr: &str) -> Option<usize> {
    match descr.get(1..)? {
        "i1" | "u1" | "b1" => Some(1),
        "i2" | "u2" => Some(2),
        "i4" | "u4" | "f4" => Some(4),
        "i8" | "u8" | "f8" => Some(8),
        _ => None,
    }
}

/// One number of at most eight bytes.
pub(super) fn decode(descr: &str, bytes: &[u8]) -> f64 {
    let mut padded = [0; 8];
    padded[..bytes.len()].copy_from_slice(bytes);
    if descr.starts_with('>') {
        padded[..bytes.len()].reverse();
    }
    let word = u64::from_le_bytes(padded);
    let unused = 64 - 8 * bytes.len() as u32;
    match &descr[1..] {
        "f8" => f64::from_bits(word),
        "f4" => f64::from(f32::from_bits(word as u32)),
        signed if signed.starts_with('i') => ((word << unused) as i64 >> unused) as f64,
        _ => word as f64,
    }
}

/// Exactly `count` bytes and the end of the entry behind them; memory grows with what is really there.
fn body(reader: &mut impl Read, count: usize) -> Result<Vec<u8>, String> {
    let out = body_part(reader, count)?;
    match reader.read(&mut [0]) {
        Ok(0) => Ok(out),
        Ok(_) => Err(format!("the end of the array after {count} bytes")),
        Err(e) => Err(format!("an undamaged array ({e})")),
    }
}

fn body_part(reader: &mut impl Read, count: usize) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    match reader.take(count as u64).read_to_end(&mut out) {
        Ok(read) if read == count => Ok(out),
        Ok(read) => Err(format!("{count} bytes, but only {read} are there,")),
        Err(e) => Err(format!("{count} undamaged bytes ({e})")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::scratch;
    use proptest::prelude::*;
    use std::io::Write;
    use std::sync::LazyLock;
    use zip::write::SimpleFileOptions;

    fn npy(descr: &str, order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let mut out = [MAGIC, &[1, 0], &(header.len() as u16).to_le_bytes(), header.as_bytes()].concat();
        out.extend(data);
        out
    }

    fn archive(entries: &[(&str, Vec<u8>)], method: zip::CompressionMethod) -> Vec<u8> {
        let mut writer = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (name, bytes) in entries {
            writer.start_file(*name, SimpleFileOptions::default().compression_method(method)).unwrap();
            writer.write_all(bytes).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    fn read_bytes(bytes: &[u8]) -> Result<Variables> {
        let file = scratch("npz");
        std::fs::write(file.path(), bytes).unwrap();
        read_npz(file.path())
    }

    fn sample() -> Vec<u8> {
        let doubles = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0_f64].map(f64::to_le_bytes).concat();
        let entries = [
            ("rows.npy", npy("<f8", "False", "(3, 2)", &doubles)),
            ("columns.npy", npy("<f8", "True", "(3, 2)", &doubles)),
            ("i.npy", npy(">i2", "False", "(2,)", &[0xff, 0xfe, 1, 0])),
            ("f.npy", npy("<f4", "False", "()", &1.5_f32.to_le_bytes())),
            ("text.npy", npy("<U1", "False", "(1,)", &[65, 0, 0, 0])),
        ];
        archive(&entries, zip::CompressionMethod::Deflated)
    }

    #[test]
    fn both_orders_and_all_sizes() {
        let file = read_bytes(&sample()).unwrap();
        assert_eq!(file.column("rows(:,2)").unwrap(), [2.0, 4.0, 6.0]);
        assert_eq!(file.column("columns(:,2)").unwrap(), [4.0, 5.0, 6.0]);
        assert_eq!(file.column("i").unwrap(), [-2.0, 256.0]);
        assert_eq!(file.scalar("f").unwrap(), 1.5);
        assert!(file.column("text").unwrap_err().to_string().contains("<U1 (not read)"));
    }

    #[test]
    fn a_single_array_has_no_name() {
        let doubles = [1.0, 2.0, 3.0, 4.0].map(f64::to_le_bytes).concat();
        let file = read_bytes(&npy("<f8", "False", "(2, 2)", &doubles)).unwrap();
        assert_eq!(file.column("array(:,2)").unwrap(), [2.0, 4.0]);
        assert!(matches!(read_bytes(&npy("<f8", "False", "(3, 2)", &doubles)), Err(Error::Corrupt { .. })));
    }

    #[test]
    fn a_shape_beyond_the_file_is_refused() {
        for shape in ["(99999999999,)", "(9999999999999, 9999999999999)", "(2,)", "(0,)", "(-1,)"] {
            let bytes = archive(&[("x.npy", npy("<f8", "False", shape, &[0; 8]))], zip::CompressionMethod::Stored);
            assert!(matches!(read_bytes(&bytes), Err(Error::Corrupt { .. })), "{shape}");
        }
        assert!(matches!(read_bytes(b"no archive"), Err(Error::Corrupt { at: CorruptAt::Byte(0), .. })));
    }

    #[test]
    fn archives_of_other_programs_are_named() {
        for (name, found, remedy) in [
            ("xl/workbook.xml", "an Excel workbook", "as CSV"),
            ("META-INF/manifest.xml", "an OpenDocument file", "as CSV"),
            ("log.csv", "a zip archive without NumPy arrays", "unpack it"),
        ] {
            let bytes = archive(&[("first", vec![0; 9]), (name, vec![0; 9])], zip::CompressionMethod::Stored);
            let said = read_bytes(&bytes).unwrap_err().to_string();
            assert!(said.contains(&format!("{found} cannot be read; ")) && said.contains(remedy), "{said}");
        }
    }

    static SAMPLE: LazyLock<Vec<u8>> = LazyLock::new(sample);

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, rng_seed: proptest::test_runner::RngSeed::Fixed(2), ..ProptestConfig::default() })]

        #[test]
        fn damaged_archives_do_not_panic(
            changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
            cut in proptest::option::of(any::<prop::sample::Index>()),
        ) {
            let mut bytes = SAMPLE.clone();
            changes.iter().for_each(|(at, byte)| bytes[at.index(SAMPLE.len())] = *byte);
            if let Some(cut) = cut {
                bytes.truncate(cut.index(bytes.len()));
            }
            if let Ok(file) = read_bytes(&bytes) {
                file.leaves().iter().for_each(|path| drop(file.column(path)));
            }
        }
    }
}
