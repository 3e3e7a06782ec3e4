//! A chunk of a column: pages, each with a header, levels that mark empty cells if the column is optional, and numbers.
//!
//! Source: Apache Parquet format 2, `PageHeader` in `parquet.thrift` and "Data Pages". Declared page sizes
//! above 64 MB + 1032 x compressed size are rejected.

use super::footer::{Column, Number};
use super::packing::unpack;
use super::thrift::Fields;
use super::{BASE, Fault, decode};
use crate::limits::declared_limit;

/// How the numbers of a page are stored.
struct Page<'a> {
    /// Those of the column that are not empty, for each cell.
    levels: Option<&'a [u8]>,
    numbers: &'a [u8],
    cells: usize,
    encoding: i64,
}

/// Chunks of one column as they are read.
pub(super) struct Cells<'a> {
    column: &'a Column,
    number: Number,
    dictionary: Option<Vec<u64>>,
    /// Timestamps count from the first.
    zero: Option<i64>,
    /// Rows up to the end of the chunk.
    end: usize,
    pub(super) data: Vec<f64>,
}

impl<'a> Cells<'a> {
    pub(super) fn new(column: &'a Column, number: Number, rows: usize) -> Self {
        Cells { column, number, dictionary: None, zero: None, end: 0, data: Vec::with_capacity(rows) }
    }

    /// Appends a chunk of so many rows.
    pub(super) fn take(&mut self, mut chunk: &[u8], packing: i64, rows: usize) -> Result<(), Fault> {
        self.dictionary = None;
        self.end += rows;
        while !chunk.is_empty() {
            let header = Fields::take(&mut chunk).ok_or("a page with a header")?;
            let size = |number| header.size::<usize>(number).ok_or("a page with its size");
            let (unpacked, packed) = (size(2)?, size(3)?);
            let (body, rest) = chunk.split_at_checked(packed).ok_or_else(|| format!("a page of {packed} bytes"))?;
            chunk = rest;
            if header.integer(4).is_some_and(|sum| sum as u32 != check_sum(body)) {
                return Err("a page that agrees with its check sum".into());
            }
            if unpacked as u64 > declared_limit(BASE, packed as u64) {
                return Err(format!("fewer than {unpacked} bytes packed in {packed}"));
            }
            match (header.integer(1), header.fields(5), header.fields(7), header.fields(8)) {
                (Some(0), Some(about), ..) => self.first_kind(about, &unpack(body, unpacked, packing)?)?,
                (Some(2), _, Some(about), _) => self.dictionary(about, &unpack(body, unpacked, packing)?)?,
                (Some(3), .., Some(about)) => self.second_kind(about, body, unpacked, packing)?,
                (Some(1), ..) => {}
                _ => return Err("a page of numbers".into()),
            }
        }
        if self.data.len() < self.end {
            return Err(format!("{} rows instead of {}", self.end, self.data.len()));
        }
        Ok(())
    }

    fn dictionary(&mut self, about: &Fields<'_>, page: &[u8]) -> Result<(), Fault> {
        let count = about.size(1).ok_or("a dictionary with its length")?;
        let mut words = Vec::new();
        decode::plain(page, count, self.number, &mut words).ok_or("a dictionary of its declared length")?;
        self.dictionary = Some(words);
        Ok(())
    }

    /// Levels, behind their length in four bytes, are packed with the numbers.
    fn first_kind(&mut self, about: &Fields<'_>, page: &[u8]) -> Result<(), Fault> {
        let (levels, numbers) = if self.column.optional {
            let cut = || {
                let (length, rest) = page.split_first_chunk()?;
                rest.split_at_checked(u32::from_le_bytes(*length) as usize)
            };
            let known = about.integer(3) == Some(3);
            let (levels, numbers) = cut().filter(|_| known).ok_or("levels, in runs, that are part of their page")?;
            (Some(levels), numbers)
        } else {
            (None, page)
        };
        let cells = about.size(1).ok_or("a page with its number of cells")?;
        self.page(&Page { levels, numbers, cells, encoding: about.integer(2).ok_or("a page with its encoding")? })
    }

    /// Levels precede the compressed part, and may be present in a column without empty cells.
    fn second_kind(&mut self, about: &Fields<'_>, body: &[u8], unpacked: usize, packing: i64) -> Result<(), Fault> {
        let inside = |(definition, repetition): (usize, usize)| {
            let length = definition.checked_add(repetition)?;
            (length <= body.len().min(unpacked)).then_some((definition, length))
        };
        let sizes = about.size(5).zip(about.size(6)).and_then(inside);
        let (definition, length) = sizes.ok_or("levels that are part of their page")?;
        let (levels, rest) = body.split_at(length);
        let packing = if about.bool(7) == Some(false) { 0 } else { packing };
        // A page of empty cells has no bytes at all, which some ways of packing would not give.
        let size = unpacked - length;
        let numbers = if size == 0 { Vec::new() } else { unpack(rest, size, packing)? };
        let levels = self.column.optional.then(|| &levels[length - definition..]);
        let cells = about.size(1).ok_or("a page with its number of cells")?;
        let encoding = about.integer(4).ok_or("a page with its encoding")?;
        self.page(&Page { levels, numbers: &numbers, cells, encoding })
    }

    fn page(&mut self, page: &Page<'_>) -> Result<(), Fault> {
        if page.cells > self.end - self.data.len() {
            return Err("no more rows than announced".into());
        }
        let mut full = Vec::new();
        if let Some(levels) = page.levels {
            full.reserve(page.cells);
            let mut take = |level| {
                full.push(level == 1);
                Some(())
            };
            decode::runs(levels, 1, page.cells, &mut take).ok_or("a level for each cell")?;
        }
        let count = if page.levels.is_some() { full.iter().filter(|full| **full).count() } else { page.cells };
        let words = self.words(page, count)?;
        self.zero = self.zero.or(words.first().map(|word| *word as i64));
        let zero = self.zero.unwrap_or_default();
        let mut numbers = words.iter().map(|word| self.number.value(*word, zero));
        match page.levels {
            None => self.data.extend(numbers),
            Some(_) => {
                let cell = |full: &bool| if *full { numbers.next() } else { None };
                self.data.extend(full.iter().map(cell).map(|number| number.unwrap_or(f64::NAN)));
            }
        }
        Ok(())
    }

    fn words(&self, page: &Page<'_>, count: usize) -> Result<Vec<u64>, Fault> {
        let mut words = Vec::new();
        if count == 0 {
            return Ok(words);
        }
        let (number, out) = (self.number, &mut words);
        let decoded = match page.encoding {
            0 => decode::plain(page.numbers, count, number, out),
            2 | 8 => {
                let dictionary = self.dictionary.as_ref().ok_or("a dictionary before its values")?;
                decode::places(page.numbers, count, dictionary, out)
            }
            3 if number == Number::Bool => decode::truths(page.numbers, count, out),
            5 => decode::differences(page.numbers, count, number, out),
            9 => decode::split(page.numbers, count, number, out),
            other => return Err(format!("numbers in an encoding that is read instead of number {other}")),
        };
        decoded.map(|()| words).ok_or_else(|| format!("a page of {count} numbers"))
    }
}

/// CRC-32 of a page as it is packed, which a header may state.
fn check_sum(page: &[u8]) -> u32 {
    let mut sum = flate2::Crc::new();
    sum.update(page);
    sum.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A whole number as a field that follows the one before, as Thrift writes it.
    fn field(value: u64) -> Vec<u8> {
        let mut out = vec![0x15];
        let mut rest = 2 * value;
        while rest >= 0x80 {
            out.push(rest as u8 | 0x80);
            rest >>= 7;
        }
        out.push(rest as u8);
        out
    }

    fn fields(values: &[u64]) -> Vec<u8> {
        values.iter().flat_map(|value| field(*value)).collect()
    }

    /// A page of a type, the sizes that it announces, the distance to and the fields of what it says of its values.
    fn page(kind: u64, unpacked: u64, body: &[u8], distance: u8, about: &[u64]) -> Vec<u8> {
        let head = fields(&[kind, unpacked, body.len() as u64]);
        [&head[..], &[distance << 4 | 12], &fields(about), &[0, 0], body].concat()
    }

    /// The rows of a chunk of two.
    fn read(number: Number, optional: bool, packing: i64, chunk: &[u8]) -> Result<Vec<f64>, Fault> {
        let column = Column { name: "x".into(), optional, content: Ok(number) };
        let mut cells = Cells::new(&column, number, 2);
        cells.take(chunk, packing, 2).map(|()| cells.data)
    }

    fn refused(number: Number, optional: bool, chunk: &[u8], words: &str) {
        let fault = read(number, optional, 0, chunk).unwrap_err();
        assert!(fault.contains(words), "{fault}");
    }

    #[test]
    fn pages_of_an_index_are_passed_over_and_clocks_start_at_the_first_cell() {
        let index = page(1, 4, &[0; 4], 3, &[]);
        let empty = page(3, 2, &[2, 0], 5, &[1, 1, 1, 0, 2, 0]);
        let second = page(3, 10, &[&[2, 1][..], &[9; 8]].concat(), 5, &[1, 0, 1, 0, 2, 0]);
        let found = read(Number::Clock(1e-3), true, 0, &[index, empty, second].concat()).unwrap();
        assert!(found[0].is_nan() && found[1] == 0.0, "{found:?}");
    }

    #[test]
    fn pages_that_hold_less_than_they_say_are_refused() {
        let double = Number::Double;
        let whole = page(0, 16, &[7; 16], 2, &[2, 0, 3, 3]);
        assert_eq!(read(double, false, 0, &whole).unwrap().len(), 2);
        refused(double, false, &[], "2 rows instead of 0");
        refused(double, false, &[&whole[..], &whole].concat(), "no more rows");
        refused(double, false, &whole[..whole.len() - 1], "a page of 16");
        refused(double, false, &whole[..5], "header");
        refused(double, false, &page(0, 1 << 31, &[0; 16], 2, &[2, 0, 3, 3]), "packed in 16");
        refused(double, false, &page(0, 16, &[0; 15], 2, &[2, 0, 3, 3]), "unpacks to 16");
        refused(double, false, &page(0, 16, &[0; 16], 2, &[2, 8, 3, 3]), "dictionary before");
        refused(double, false, &page(0, 16, &[0; 16], 2, &[2, 77, 3, 3]), "number 77");
        refused(double, false, &page(2, 16, &[0; 16], 4, &[1 << 31, 0]), "dictionary of its declared length");
        refused(double, false, &page(3, 16, &[0; 16], 5, &[2, 0, 2, 0, 17, 0]), "part of their page");
        refused(double, true, &page(0, 16, &[0xff; 16], 2, &[2, 0, 3, 3]), "part of their page");
        refused(double, true, &page(0, 16, &[0; 16], 2, &[2, 0, 4, 3]), "in runs");
        refused(double, true, &page(3, 16, &[0; 16], 5, &[2, 0, 2, 0, 0, 0]), "a level for each");
    }

    #[test]
    fn a_page_that_disagrees_with_its_check_sum_is_refused() {
        let of = |sum: u32| {
            let head = fields(&[0, 16, 16, u64::from(sum)]);
            [&head[..], &[0x1c], &fields(&[2, 0, 3, 3]), &[0, 0], &[7; 16]].concat()
        };
        let sum = check_sum(&[7; 16]);
        assert_eq!(read(Number::Double, false, 0, &of(sum)).unwrap().len(), 2);
        refused(Number::Double, false, &of(sum ^ 1), "check sum");
    }

    #[test]
    fn what_is_packed_must_unpack_to_the_announced_size() {
        for packing in [1, 2, 6, 7] {
            let fault = read(Number::Double, false, packing, &page(0, 16, &[0x50; 9], 2, &[2, 0, 3, 3])).unwrap_err();
            assert!(fault.contains("unpacks to 16"), "{packing}: {fault}");
        }
    }
}
