//! Universal file format, dataset type 58: functions at nodal degrees of freedom, as analysers and modal programs write them.
//!
//! A dataset lies between two lines `    -1`; its type is on the next line, then eleven lines of header, then numbers:
//!
//! | line | content that is read |
//! |---|---|
//! | 6 | type of the function (4: frequency response, 6: coherence); entity, node and direction of the response, then of the reference |
//! | 7 | type of the ordinates (2, 4: real, 5, 6: complex), number of points, spacing (1: even), first abscissa, step |
//! | 8 | type of the abscissa (18: frequency) |
//!
//! Other datasets of the file are passed over. The binary form, 58b, is refused.
//!
//! Source: Structural Dynamics Research Laboratory, University of Cincinnati, Universal File Formats, dataset 58.

use crate::error::{CorruptAt, Error, Result};
use crate::open::open;
use std::io::Read;
use std::path::Path;
use youla::c64;

/// Largest file that is read, bytes.
const LARGEST: u64 = 256 << 20;
/// Lines of the header.
const HEADER: usize = 11;

/// What a function of a dataset 58 is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum UffKind {
    /// Frequency response function.
    Response,
    /// Coherence.
    Coherence,
    /// Any other, by its number in the format.
    Other(u32),
}

/// One function of a file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct UffFunction {
    /// What it is.
    pub(crate) kind: UffKind,
    /// Degree of freedom of the response, `node:direction` as in `12:+Z`, after the name of its entity where there is one.
    pub(crate) response: String,
    /// Degree of freedom of the reference.
    pub(crate) reference: String,
    /// Abscissa, for a response the frequency in Hz.
    pub(crate) abscissa: Vec<f64>,
    /// Ordinates.
    pub(crate) values: Vec<c64>,
}

/// Whether the first bytes of a file are those of a universal file.
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`].
pub(crate) fn is_uff(path: &Path) -> Result<bool> {
    let mut start = Vec::new();
    let read = open(path)?.take(8).read_to_end(&mut start);
    read.map_err(|source| Error::Io { path: path.to_owned(), source })?;
    Ok(start.starts_with(b"    -1"))
}

/// The functions of all datasets 58 of a file, in their order.
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`]; [`Error::Corrupt`] with the line; [`Error::FormatNotRead`] for binary data and files above
/// 256 MB; [`Error::NoData`] without a dataset 58.
pub(crate) fn read_uff58(path: &Path) -> Result<Vec<UffFunction>> {
    let bytes = crate::open::whole(path, LARGEST, "a universal file of more than 256 MB")?;
    let refused = |found, remedy| Err(Error::FormatNotRead { path: path.to_owned(), found, remedy });
    // labels may be in any encoding; numbers are not
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<&str> = text.lines().collect();
    let (mut found, mut at) = (Vec::new(), 0);
    while let Some(start) = (at..lines.len()).find(|k| lines[*k].trim() == "-1") {
        let Some(end) = (start + 1..lines.len()).find(|k| lines[*k].trim() == "-1") else {
            return Err(corrupt(path, lines.len(), "the line -1 that ends a dataset"));
        };
        match lines.get(start + 1).map_or("", |line| line.trim()) {
            "58" => found.push(function(&lines[..end], start + 2).map_err(|(line, what)| corrupt(path, line, what))?),
            kind if kind.starts_with("58b") || kind.starts_with("58B") => {
                return refused("dataset 58b of a universal file", "export it as ASCII, dataset 58");
            }
            _ => {}
        }
        at = end + 1;
    }
    if found.is_empty() {
        return Err(Error::NoData { path: path.to_owned(), problem: "no dataset of type 58 is in it" });
    }
    Ok(found)
}

fn corrupt(path: &Path, line: usize, expected: &str) -> Error {
    Error::Corrupt { path: path.to_owned(), at: CorruptAt::Line(line), expected: expected.to_owned() }
}

/// The dataset whose header begins at a line, counted from 0; the error holds the last good line, counted from 1.
fn function(lines: &[&str], first: usize) -> std::result::Result<UffFunction, (usize, &'static str)> {
    if lines.len() < first + HEADER {
        return Err((lines.len(), "eleven lines of header of dataset 58"));
    }
    let (names, form) = (lines[first + 5], lines[first + 6]);
    let number = |line: &str, range| field(line, range).parse::<i64>().ok();
    let bad = |line: usize, what| (first + line - 1, what);
    let kind = number(names, (0, 5)).ok_or(bad(6, "the type of the function in columns 1 to 5"))?;
    let freedom = |entity, node, direction| {
        let (entity, node) = (field(names, entity), number(names, node)?);
        let direction = *DIRECTIONS.get(usize::try_from(number(names, direction)? + 6).ok()?)?;
        let place = if direction.is_empty() { node.to_string() } else { format!("{node}:{direction}") };
        Some(if entity.is_empty() || entity == "NONE" { place } else { format!("{entity}:{place}") })
    };
    let what = "entity, node and direction of response and reference in columns 32 to 80";
    let response = freedom((31, 41), (41, 51), (51, 55)).ok_or(bad(6, what))?;
    let reference = freedom((56, 66), (66, 76), (76, 80)).ok_or(bad(6, what))?;
    let what = "type of the ordinates (2, 4, 5 or 6), number of points, spacing, first abscissa and step";
    let ordinates = number(form, (0, 10)).filter(|kind| [2, 4, 5, 6].contains(kind)).ok_or(bad(7, what))?;
    let points = number(form, (10, 20)).and_then(|n| usize::try_from(n).ok()).ok_or(bad(7, what))?;
    let even = number(form, (20, 30)).ok_or(bad(7, what))? == 1;
    let real = |range| separated(&field(form, range)).first().copied().flatten();
    let (from, step) = (real((30, 43)).ok_or(bad(7, what))?, real((43, 56)).ok_or(bad(7, what))?);
    let per_point = if ordinates > 4 { 2 } else { 1 } + usize::from(!even);
    let mut values = Vec::new();
    for (k, line) in lines.iter().enumerate().skip(first + HEADER) {
        for value in separated(line) {
            values.push(value.ok_or((k, "numbers"))?);
        }
    }
    if values.len() != points.saturating_mul(per_point) {
        return Err((lines.len(), "as many numbers as the header of the dataset states"));
    }
    let point = |k: usize| &values[k * per_point..(k + 1) * per_point];
    let ordinate = |k: usize| {
        let own = &point(k)[usize::from(!even)..];
        c64::new(own[0], own.get(1).copied().unwrap_or(0.0))
    };
    Ok(UffFunction {
        kind: match kind {
            4 => UffKind::Response,
            6 => UffKind::Coherence,
            other => UffKind::Other(u32::try_from(other).unwrap_or(0)),
        },
        response,
        reference,
        abscissa: (0..points).map(|k| if even { from + step * k as f64 } else { point(k)[0] }).collect(),
        values: (0..points).map(ordinate).collect(),
    })
}

/// Directions -6 to 6.
const DIRECTIONS: [&str; 13] = ["-RZ", "-RY", "-RX", "-Z", "-Y", "-X", "", "+X", "+Y", "+Z", "+RX", "+RY", "+RZ"];

/// Columns of a line without the blanks around.
fn field(line: &str, (from, to): (usize, usize)) -> String {
    line.chars().skip(from).take(to - from).collect::<String>().trim().to_owned()
}

/// Numbers of fixed width, whose signs may touch the number before; `None` for what is no finite number.
fn separated(line: &str) -> Vec<Option<f64>> {
    let mut text = String::with_capacity(line.len() + 8);
    let mut before = ' ';
    for c in line.chars() {
        if matches!(c, '-' | '+') && !matches!(before, 'E' | 'e' | 'D' | 'd' | ' ') {
            text.push(' ');
        }
        text.push(if matches!(c, 'D' | 'd') { 'E' } else { c });
        before = c;
    }
    text.split_whitespace().map(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::scratch;
    use std::fs;

    /// Two datasets: one of another type, one of the type with these lines 6, 7 and data.
    fn text(names: &str, form: &str, data: &str) -> String {
        let header = format!("title\nNONE\n01-Jan-26\nNONE\nNONE\n{names}\n{form}\n");
        let rest = "        18    0    0    0 Frequency            Hz\n".repeat(4);
        format!("    -1\n    15\nnodes\n    -1\n    -1\n    58\n{header}{rest}{data}    -1\n")
    }

    const NAMES: &str = "    4         0    0         0 NONE              12   3 NONE               7  -1";

    fn read(text: &str) -> Result<Vec<UffFunction>> {
        let file = scratch("uff");
        fs::write(file.path(), text).unwrap();
        read_uff58(file.path())
    }

    #[test]
    fn even_and_uneven_functions_are_read() {
        let even = "         5         3         1  1.00000E+00  5.00000E-01  0.00000E+00";
        let data = "  1.00000E+00-2.00000E+00  3.00000E+00  4.00000E+00 -5.00000E+00-6.00000D-01\n";
        let found = read(&text(NAMES, even, data)).unwrap();
        assert_eq!(found.len(), 1);
        let one = &found[0];
        assert_eq!((one.kind, &*one.response, &*one.reference), (UffKind::Response, "12:+Z", "7:-X"));
        assert_eq!(one.abscissa, [1.0, 1.5, 2.0]);
        assert_eq!(one.values, [c64::new(1.0, -2.0), c64::new(3.0, 4.0), c64::new(-5.0, -0.6)]);
        let uneven = "         4         2         0  0.00000E+00  0.00000E+00  0.00000E+00";
        let named = NAMES.replace("NONE              12   3", "ROTOR             12   0");
        let found =
            read(&text(&named, uneven, "  2.00000E+00  1.50000000000E+00  7.00000E+00 -1.50000000000E+00\n")).unwrap();
        assert_eq!((&*found[0].response, &found[0].abscissa[..]), ("ROTOR:12", &[2.0, 7.0][..]));
        assert_eq!(found[0].values, [c64::new(1.5, 0.0), c64::new(-1.5, 0.0)]);
    }

    /// Two thousand files with some characters replaced, doubled or cut: each is read or refused.
    #[test]
    fn damaged_files_are_read_or_refused() {
        let form = "         5         3         1  1.00000E+00  5.00000E-01  0.00000E+00";
        let whole = text(NAMES, form, "  1.00000E+00-2.00000E+00  3.00000E+00  4.00000E+00 -5.00000E+00-6.00000D-01\n");
        let mut state = 7u64;
        let mut random = |below: usize| {
            // Knuth, MMIX.
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as usize % below
        };
        let mut refused = 0;
        for _ in 0..2000 {
            let mut bytes = whole.clone().into_bytes();
            for _ in 0..=random(3) {
                let at = random(bytes.len());
                match random(3) {
                    0 => bytes[at] = b"0123456789+-.Ee \n"[random(17)],
                    1 => bytes.insert(at, bytes[at]),
                    _ => bytes.truncate(at + 1),
                }
            }
            refused += usize::from(read(&String::from_utf8(bytes).unwrap()).is_err());
        }
        assert!((500..2000).contains(&refused), "{refused}");
    }

    #[test]
    fn damage_is_named_with_its_line() {
        let form = "         5         2         1  1.00000E+00  5.00000E-01  0.00000E+00";
        let says = |text: &str, part: &str| {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        };
        says(
            &text(NAMES, form, "  1.0E+00  1.0E+00  1.0E+00\n"),
            "as many numbers as the header of the dataset states",
        );
        says(&text(NAMES, form, "  1.0E+00  1.0E+00  x  1.0E+00\n"), "after line 17: expected numbers");
        says(&text(NAMES, &form.replace("    5  ", "    3  "), ""), "after line 12: expected type of the ordinates");
        says(&text(&NAMES[..40], form, ""), "after line 11: expected entity, node and direction");
        says("    -1\n    58\n1\n2\n", "the line -1 that ends a dataset");
        says("    -1\n    58b     1     2\n    -1\n", "export it as ASCII");
        says("    -1\n    15\n    -1\n", "no dataset of type 58");
    }
}
