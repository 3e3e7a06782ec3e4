//! From variables to bytes, little endian.

use super::{HEADER, class, kind};
use crate::error::{Error, Result};
use crate::values::{Value, Variable};
use flate2::{Compression, write::ZlibEncoder};
use std::io::Write;
use std::path::Path;

/// Compression of the variables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Packing {
    /// Uncompressed, `save -v6`.
    Plain,
    /// Compressed, `save -v7`.
    #[default]
    Zlib,
}

/// Writes variables to a MATLAB file of version 5; the bytes depend on the values only.
///
/// # Errors
/// [`Error::WrongVariable`] for a value whose data do not fill its dimensions, that is too large (4 GiB) or of a class
/// that is not written, and for an empty name; [`Error::Io`].
///
/// ```no_run
/// use youla::linalg::eye;
/// use youla_io::{Packing, Value, Variable, write_mat};
/// let model = Value::structure([("a", Value::matrix(eye(2).as_ref())), ("ts", Value::scalar(2e-4))]);
/// write_mat("model.mat", &[Variable { name: "model".into(), value: model }], Packing::Zlib)?;
/// # Ok::<(), youla_io::Error>(())
/// ```
pub fn write_mat(path: impl AsRef<Path>, variables: &[Variable], packing: Packing) -> Result<()> {
    let path = path.as_ref();
    let out = bytes(path, variables, packing)?;
    std::fs::write(path, out).map_err(|source| Error::Io { path: path.to_owned(), source })
}

/// The bytes of such a file, nothing packed.
///
/// # Errors
/// Those of [`write_mat`] but for the operating system's.
pub(crate) fn mat_to_bytes(variables: &[Variable]) -> Result<Vec<u8>> {
    bytes(Path::new("the MATLAB file"), variables, Packing::Plain)
}

fn bytes(path: &Path, variables: &[Variable], packing: Packing) -> Result<Vec<u8>> {
    let mut out = header();
    for variable in variables {
        let wrong = |must| Error::WrongVariable {
            path: path.to_owned(),
            name: variable.name.clone(),
            found: variable.value.description(),
            must,
        };
        if variable.name.is_empty() {
            return Err(wrong("given a name"));
        }
        append(&mut out, variable, packing).map_err(wrong)?;
    }
    Ok(out)
}

/// What a value must be to be written.
type Unwritable = &'static str;

fn header() -> Vec<u8> {
    let mut out = b"MATLAB 5.0 MAT-file, written by youla".to_vec();
    out.resize(HEADER - 12, b' ');
    out.extend([0; 8]);
    out.extend([0, 1, b'I', b'M']);
    out
}

fn append(out: &mut Vec<u8>, variable: &Variable, packing: Packing) -> Result<(), Unwritable> {
    let Variable { name, value } = variable;
    if packing == Packing::Plain {
        return array(out, name, value);
    }
    let mut plain = Vec::new();
    array(&mut plain, name, value)?;
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let packed = encoder.write_all(&plain).and_then(|()| encoder.finish()).map_err(|_| "packed by zlib")?;
    tag(out, kind::COMPRESSED, packed.len())?;
    out.extend(packed);
    Ok(())
}

/// An array as an element, written in place: its size is filled in when it is known.
fn array(out: &mut Vec<u8>, name: &str, value: &Value) -> Result<(), Unwritable> {
    let at = out.len();
    tag(out, kind::MATRIX, 0)?;
    array_parts(out, name, value)?;
    let size = size_of_element(out.len() - at - 8)?;
    out[at + 4..at + 8].copy_from_slice(&size.to_le_bytes());
    Ok(())
}

fn array_parts(out: &mut Vec<u8>, name: &str, value: &Value) -> Result<(), Unwritable> {
    match value {
        Value::Real { dims, data } => {
            start(out, u32::from(class::DOUBLE), dims, name, data.len())?;
            doubles(out, data)
        }
        Value::Complex { dims, re, im } => {
            start(out, u32::from(class::DOUBLE) | class::COMPLEX, dims, name, re.len())?;
            full(re.len() == im.len())?;
            doubles(out, re)?;
            doubles(out, im)
        }
        Value::Text(rows) => text(out, name, rows),
        Value::Cell { dims, items } => {
            start(out, u32::from(class::CELL), dims, name, items.len())?;
            nested(out, items)
        }
        Value::Struct { dims, fields, items } => {
            let elements = items.len().checked_div(fields.len()).unwrap_or_else(|| dims.iter().product());
            start(out, u32::from(class::STRUCT), dims, name, elements)?;
            full(items.len() == elements * fields.len())?;
            field_names(out, fields)?;
            nested(out, items)
        }
        Value::Unsupported { .. } => Err("of a class that is written"),
    }
}

fn full(filled: bool) -> Result<(), Unwritable> {
    if filled { Ok(()) } else { Err("filled with as many values as its dimensions state") }
}

/// Flags, dimensions and name.
fn start(out: &mut Vec<u8>, flags: u32, dims: &[usize], name: &str, count: usize) -> Result<(), Unwritable> {
    let product = dims.iter().try_fold(1_usize, |product, &size| product.checked_mul(size));
    full(dims.len() >= 2 && product == Some(count))?;
    let [low, high] = [flags, 0].map(u32::to_le_bytes);
    element(out, kind::UINT32, &[low, high].concat())?;
    let sizes = dims.iter().map(|&size| i32::try_from(size).map(i32::to_le_bytes)).collect::<Result<Vec<_>, _>>();
    element(out, kind::INT32, &sizes.map_err(|_| "smaller in each direction than 2^31")?.concat())?;
    element(out, kind::INT8, name.as_bytes())
}

fn doubles(out: &mut Vec<u8>, data: &[f64]) -> Result<(), Unwritable> {
    tag(out, kind::DOUBLE, 8 * data.len())?;
    out.reserve(8 * data.len());
    data.iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    Ok(())
}

/// Rows of equal length, filled with blanks, by column. Octave and SciPy read UTF-8 best; a column between the halves
/// of a surrogate pair has none.
fn text(out: &mut Vec<u8>, name: &str, rows: &[String]) -> Result<(), Unwritable> {
    let rows: Vec<Vec<u16>> = rows.iter().map(|row| row.encode_utf16().collect()).collect();
    let width = rows.iter().map(Vec::len).max().unwrap_or(0);
    start(out, u32::from(class::CHAR), &[rows.len(), width], name, rows.len() * width)?;
    let column = |k: usize| rows.iter().map(move |row| row.get(k).copied().unwrap_or(u16::from(b' ')));
    let units: Vec<u16> = (0..width).flat_map(column).collect();
    match String::from_utf16(&units) {
        Ok(text) => element(out, kind::UTF8, text.as_bytes()),
        Err(_) => element(out, kind::UINT16, &units.into_iter().flat_map(u16::to_le_bytes).collect::<Vec<_>>()),
    }
}

fn field_names(out: &mut Vec<u8>, fields: &[String]) -> Result<(), Unwritable> {
    const LONGEST: usize = 63;
    let longest = fields.iter().map(String::len).max().unwrap_or(0);
    if longest > LONGEST || fields.iter().any(String::is_empty) {
        return Err("a struct whose field names have 1 to 63 bytes");
    }
    let width = longest + 1;
    element(out, kind::INT32, &(width as i32).to_le_bytes())?;
    let mut names = vec![0; width * fields.len()];
    for (place, field) in names.chunks_mut(width).zip(fields) {
        place[..field.len()].copy_from_slice(field.as_bytes());
    }
    element(out, kind::INT8, &names)
}

fn nested(out: &mut Vec<u8>, items: &[Value]) -> Result<(), Unwritable> {
    items.iter().try_for_each(|item| array(out, "", item))
}

/// Tag, data and padding to eight bytes; up to four bytes share the tag.
fn element(out: &mut Vec<u8>, code: u32, data: &[u8]) -> Result<(), Unwritable> {
    if (1..=4).contains(&data.len()) {
        let size = data.len() as u32;
        out.extend((code | (size << 16)).to_le_bytes());
        out.extend(data);
        out.resize(out.len() + 4 - data.len(), 0);
        return Ok(());
    }
    tag(out, code, data.len())?;
    out.extend(data);
    out.resize(out.len().next_multiple_of(8), 0);
    Ok(())
}

fn tag(out: &mut Vec<u8>, code: u32, size: usize) -> Result<(), Unwritable> {
    out.extend(code.to_le_bytes());
    out.extend(size_of_element(size)?.to_le_bytes());
    Ok(())
}

fn size_of_element(bytes: usize) -> Result<u32, Unwritable> {
    u32::try_from(bytes).map_err(|_| "smaller than 4 GiB")
}
