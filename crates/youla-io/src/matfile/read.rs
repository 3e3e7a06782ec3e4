//! From bytes to variables.

use super::bytes::{Bytes, Element, Fault};
use super::{HEADER, class, kind};
use crate::error::{CorruptAt, Error, Result};
use crate::hdf::hdf_from_bytes;
use crate::values::{Value, Variable, Variables};
use flate2::read::ZlibDecoder;
use std::io::Read;
use std::path::Path;

/// Largest nesting of structs and cells.
const MAX_DEPTH: usize = 32;
/// Longest name of a variable or field, in bytes; MATLAB has 63. Paths repeat them.
const LONGEST_NAME: usize = 1024;

/// Reads all variables of a MATLAB file of version 5 or 7.3.
///
/// Of version 7.3 (HDF5) cells, complex arrays and arrays of structs are not read either. An HDF5 file of another program is read
/// by row.
///
/// Sparse matrices, objects and function handles become [`Value::Unsupported`]; the unnamed element in which MATLAB
/// keeps the inside of objects is not a variable and is left out.
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`], [`Error::NoData`] for an empty file, [`Error::FormatNotRead`] for version 4,
/// [`Error::Corrupt`] with the position (0 in version 7.3) for a damaged or cut file.
pub fn read_mat(path: impl AsRef<Path>) -> Result<Variables> {
    let path = path.as_ref();
    mat_from_bytes(&crate::open::record_bytes(path)?, path)
}

/// The variables of a MATLAB file of version 5 or 7.3 that is in memory; `path` is named in errors.
///
/// # Errors
/// Those of [`read_mat`] but for the operating system's.
pub fn mat_from_bytes(bytes: &[u8], path: impl AsRef<Path>) -> Result<Variables> {
    let path = path.as_ref();
    if is_hdf(bytes) {
        return hdf_from_bytes(bytes, path);
    }
    let big_endian = check_format(path, bytes)?;
    let body = Bytes { data: &bytes[HEADER..], offset: HEADER, big_endian };
    match variables(body) {
        Ok(variables) => Ok(Variables::new(path, variables)),
        Err(fault) => Err(corrupt(path, fault)),
    }
}

/// Whether the bytes begin as those of an HDF5 file, with or without the 512 bytes of MATLAB before them.
fn is_hdf(bytes: &[u8]) -> bool {
    const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";
    bytes.starts_with(MAGIC) || bytes.get(512..).is_some_and(|rest| rest.starts_with(MAGIC))
}

fn corrupt(path: &Path, fault: Fault) -> Error {
    Error::Corrupt { path: path.to_owned(), at: CorruptAt::Byte(fault.offset as u64), expected: fault.expected }
}

/// Whether the file is big endian, if it is of version 5 at all.
fn check_format(path: &Path, bytes: &[u8]) -> Result<bool> {
    let not_read = |found, remedy| Err(Error::FormatNotRead { path: path.to_owned(), found, remedy });
    if bytes.is_empty() {
        return Err(Error::NoData { path: path.to_owned(), problem: "the file is empty (0 bytes)" });
    }
    match bytes.get(124..HEADER) {
        Some([0, 1, b'I', b'M']) => Ok(false),
        Some([1, 0, b'M', b'I']) => Ok(true),
        _ if bytes.len() >= 20 && bytes[..4].contains(&0) => {
            not_read("a MATLAB file of version 4, or another binary file,", "save it with the option -v7")
        }
        _ => Err(corrupt(
            path,
            Fault { offset: bytes.len().min(124), expected: "a MATLAB header of 128 bytes, version 5".into() },
        )),
    }
}

fn variables(mut rest: Bytes) -> Result<Vec<Variable>, Fault> {
    let mut out = Vec::new();
    while !rest.data.is_empty() {
        let start = rest;
        let element = rest.element("a variable")?;
        let variable = match element.kind {
            kind::MATRIX => array(element.body, 0)?,
            kind::COMPRESSED => compressed(element.body)?,
            other => return start.fault(format!("a variable, not an element of type {other}")),
        };
        if !variable.name.is_empty() {
            out.push(variable);
        }
    }
    Ok(out)
}

/// A variable compressed by zlib. Errors state the position in the file and in the decompressed variable.
fn compressed(body: Bytes) -> Result<Variable, Fault> {
    let data = inflate(body)?;
    let inner = Bytes { data: &data, offset: 0, ..body };
    array(inner, 0).map_err(|fault| Fault {
        offset: body.offset,
        expected: format!("{} (byte {} of the compressed variable)", fault.expected, fault.offset),
    })
}

/// Decompresses the size that the inner tag declares; memory grows with the decompressed bytes only.
fn inflate(body: Bytes) -> Result<Vec<u8>, Fault> {
    let mut decoder = ZlibDecoder::new(body.data);
    let mut tag = [0; 8];
    let Ok(()) = decoder.read_exact(&mut tag) else { return body.fault("a variable packed by zlib") };
    let tag = Bytes { data: &tag, ..body };
    if tag.word(0) != kind::MATRIX {
        return body.fault(format!("a packed variable, not a packed element of type {}", tag.word(0)));
    }
    let size = tag.word(4);
    let mut data = Vec::new();
    match decoder.by_ref().take(u64::from(size)).read_to_end(&mut data) {
        Err(e) => body.fault(format!("{size} bytes packed by zlib, but after {} of them: {e}", data.len())),
        Ok(unpacked) if unpacked != size as usize => {
            body.fault(format!("{size} bytes packed by zlib, but only {unpacked} were decompressed"))
        }
        Ok(_) => match decoder.read(&mut [0]) {
            Ok(0) => Ok(data),
            Ok(_) => body.fault(format!("the end of the packed variable after {size} bytes")),
            Err(e) => body.fault(format!("a packed variable with the right checksum: {e}")),
        },
    }
}

/// An array of any class: flags, dimensions, name, contents.
fn array(mut rest: Bytes, depth: usize) -> Result<Variable, Fault> {
    if rest.data.is_empty() {
        return Ok(Variable { name: String::new(), value: Value::Real { dims: vec![0, 0], data: Vec::new() } });
    }
    if depth > MAX_DEPTH {
        return rest.fault(format!("at most {MAX_DEPTH} levels of structs and cells"));
    }
    let flags = rest.element("array flags")?;
    if flags.kind != kind::UINT32 || flags.body.data.len() != 8 {
        return flags.body.fault("array flags of 8 bytes");
    }
    let flags = flags.body.word(0);
    let class = flags as u8;
    if class == class::OPAQUE {
        let name = name(rest.element("the name of an object")?.body)?;
        return Ok(Variable { name, value: unsupported(class) });
    }
    let dims = dimensions(rest.element("dimensions")?)?;
    let name = name(rest.element("an array name")?.body)?;
    let value = match class {
        class::CELL => {
            let count = count(&dims, rest)?;
            Value::Cell { items: items(&mut rest, count, depth)?, dims }
        }
        class::STRUCT => structure(rest, dims, depth)?,
        class::CHAR => characters(rest, &dims)?,
        class::DOUBLE..=class::UINT64 => numeric(rest, dims, flags & class::COMPLEX != 0)?,
        other => unsupported(other),
    };
    Ok(Variable { name, value })
}

fn unsupported(class: u8) -> Value {
    let class = match class {
        class::SPARSE => "sparse matrix".to_owned(),
        class::OBJECT | class::OPAQUE => "object".to_owned(),
        class::FUNCTION => "function handle".to_owned(),
        other => format!("array of class {other}"),
    };
    Value::Unsupported { class }
}

fn dimensions(element: Element) -> Result<Vec<usize>, Fault> {
    let sizes = element.numbers(element.body.data.len() / 4, "dimensions")?;
    if element.kind != kind::INT32 || sizes.len() < 2 || sizes.iter().any(|&size| size < 0.0) {
        return element.body.fault("two or more dimensions that are not negative");
    }
    Ok(sizes.into_iter().map(|size| size as usize).collect())
}

/// Number of entries of an array, refused where it cannot be counted.
fn count(dims: &[usize], at: Bytes) -> Result<usize, Fault> {
    match dims.iter().try_fold(1_usize, |product, &size| product.checked_mul(size)) {
        Some(count) => Ok(count),
        None => at.fault("dimensions whose product fits into memory"),
    }
}

/// Consecutive arrays; each has at least the eight bytes of its tag.
fn items(rest: &mut Bytes, count: usize, depth: usize) -> Result<Vec<Value>, Fault> {
    if count > rest.data.len() / 8 {
        return rest.fault(format!("{count} arrays, but only {} bytes are left", rest.data.len()));
    }
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let element = rest.element("an array inside of a struct or cell")?;
        if element.kind != kind::MATRIX {
            return element.body.fault(format!("an array, not an element of type {}", element.kind));
        }
        out.push(array(element.body, depth + 1)?.value);
    }
    Ok(out)
}

fn structure(mut rest: Bytes, dims: Vec<usize>, depth: usize) -> Result<Value, Fault> {
    let length = rest.element("the length of field names")?;
    let width = length.numbers(1, "the length of field names")?[0] as usize;
    let names = rest.element("field names")?.body;
    if width > LONGEST_NAME {
        return names.fault(format!("field names of at most {LONGEST_NAME} bytes each, not {width}"));
    }
    if names.data.len() % width.max(1) != 0 || (width == 0 && !names.data.is_empty()) {
        return names.fault(format!("field names of {width} bytes each"));
    }
    let fields: Vec<String> = names.data.chunks(width.max(1)).map(|data| text(Bytes { data, ..names })).collect();
    match count(&dims, rest)?.checked_mul(fields.len()) {
        Some(count) => Ok(Value::Struct { items: items(&mut rest, count, depth)?, dims, fields }),
        None => rest.fault("a struct array that fits into memory"),
    }
}

fn characters(mut rest: Bytes, dims: &[usize]) -> Result<Value, Fault> {
    let (rows, count) = (dims[0], count(dims, rest)?);
    if count == 0 {
        return Ok(Value::Text(Vec::new()));
    }
    let element = rest.element("text")?;
    let Some(units) = element.characters() else {
        return Ok(Value::Unsupported { class: format!("text of type {}", element.kind) });
    };
    if rows == 1 {
        return Ok(Value::Text(vec![String::from_utf16_lossy(&units)]));
    }
    if units.len() != count {
        return element.body.fault(format!("{count} characters, not {}", units.len()));
    }
    let row = |r: usize| units.iter().skip(r).step_by(rows).copied().collect::<Vec<_>>();
    Ok(Value::Text((0..rows).map(|r| String::from_utf16_lossy(&row(r))).collect()))
}

fn numeric(mut rest: Bytes, dims: Vec<usize>, complex: bool) -> Result<Value, Fault> {
    let count = count(&dims, rest)?;
    if count == 0 {
        return Ok(Value::Real { dims, data: Vec::new() });
    }
    let data = rest.element("numbers")?.numbers(count, "an array")?;
    if !complex {
        return Ok(Value::Real { dims, data });
    }
    let im = rest.element("imaginary parts")?.numbers(count, "imaginary parts")?;
    Ok(Value::Complex { dims, re: data, im })
}

/// The name of a variable.
fn name(bytes: Bytes) -> Result<String, Fault> {
    if bytes.data.len() > LONGEST_NAME {
        return bytes.fault(format!("a name of at most {LONGEST_NAME} bytes, not {}", bytes.data.len()));
    }
    Ok(text(bytes))
}

/// A name, which may end with a zero byte before the end of its place.
fn text(bytes: Bytes) -> String {
    let name = bytes.data.split(|&b| b == 0).next().unwrap_or_default();
    String::from_utf8_lossy(name).into_owned()
}
