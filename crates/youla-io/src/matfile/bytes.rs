//! Bytes of a file with their position, and the data elements in them.

use super::kind;

/// Position and content of an expected part that is missing.
#[derive(Debug)]
pub(super) struct Fault {
    /// Position in the file, counted from 0.
    pub(super) offset: usize,
    pub(super) expected: String,
}

/// Bytes that are still to be read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bytes<'a> {
    pub(super) data: &'a [u8],
    /// Position of the first of them.
    pub(super) offset: usize,
    pub(super) big_endian: bool,
}

/// A data element: its type and its bytes without padding.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element<'a> {
    pub(super) kind: u32,
    pub(super) body: Bytes<'a>,
}

impl<'a> Bytes<'a> {
    pub(super) fn fault<T>(&self, expected: impl Into<String>) -> Result<T, Fault> {
        Err(Fault { offset: self.offset, expected: expected.into() })
    }

    /// The next `count` bytes.
    pub(super) fn take(&mut self, count: usize, what: &str) -> Result<Bytes<'a>, Fault> {
        match self.data.split_at_checked(count) {
            Some((taken, rest)) => {
                let out = Bytes { data: taken, ..*self };
                *self = Bytes { data: rest, offset: self.offset + count, ..*self };
                Ok(out)
            }
            None => self.fault(format!("{count} bytes of {what}, but only {} are left", self.data.len())),
        }
    }

    /// The next data element with the padding behind it; a size of up to four bytes may share the tag with its data.
    pub(super) fn element(&mut self, what: &str) -> Result<Element<'a>, Fault> {
        let tag = self.take(8, &format!("the tag of {what}"))?;
        let [word, size] = [0, 4].map(|at| tag.word(at));
        if word >> 16 != 0 {
            let size = (word >> 16) as usize;
            if size > 4 {
                return tag.fault(format!("a tag of {what} with at most 4 bytes, not {size}"));
            }
            let body = Bytes { data: &tag.data[4..4 + size], offset: tag.offset + 4, ..tag };
            return Ok(Element { kind: word & 0xffff, body });
        }
        let body = self.take(size as usize, what)?;
        if word != kind::COMPRESSED {
            self.take((size.wrapping_neg() as usize % 8).min(self.data.len()), "padding")?;
        }
        Ok(Element { kind: word, body })
    }

    /// The unsigned integer of 32 bits at a position that is known to be there.
    pub(super) fn word(&self, at: usize) -> u32 {
        let mut four = [0; 4];
        four.copy_from_slice(&self.data[at..at + 4]);
        if self.big_endian { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) }
    }

    /// All bytes as numbers of N bytes.
    fn each<const N: usize, T>(&self, from_little_endian: impl Fn([u8; N]) -> T) -> Vec<T> {
        let convert = |chunk: &[u8; N]| {
            let mut chunk = *chunk;
            if self.big_endian {
                chunk.reverse();
            }
            from_little_endian(chunk)
        };
        self.data.as_chunks::<N>().0.iter().map(convert).collect()
    }
}

impl Element<'_> {
    /// The numbers of the element, whatever they are stored as; there must be `count` of them.
    pub(super) fn numbers(&self, count: usize, what: &str) -> Result<Vec<f64>, Fault> {
        let size = match self.kind {
            kind::INT8 | kind::UINT8 => 1,
            kind::INT16 | kind::UINT16 => 2,
            kind::INT32 | kind::UINT32 | kind::SINGLE => 4,
            kind::DOUBLE | kind::INT64 | kind::UINT64 => 8,
            other => return self.body.fault(format!("{what} of a numeric type, not of type {other}")),
        };
        if count.checked_mul(size) != Some(self.body.data.len()) {
            let stored = self.body.data.len();
            return self.body.fault(format!("{count} numbers of {size} bytes for {what}, not {stored} bytes"));
        }
        let body = &self.body;
        Ok(match self.kind {
            kind::INT8 => body.each(|b| f64::from(i8::from_le_bytes(b))),
            kind::UINT8 => body.each(|b| f64::from(u8::from_le_bytes(b))),
            kind::INT16 => body.each(|b| f64::from(i16::from_le_bytes(b))),
            kind::UINT16 => body.each(|b| f64::from(u16::from_le_bytes(b))),
            kind::INT32 => body.each(|b| f64::from(i32::from_le_bytes(b))),
            kind::UINT32 => body.each(|b| f64::from(u32::from_le_bytes(b))),
            kind::SINGLE => body.each(|b| f64::from(f32::from_le_bytes(b))),
            kind::INT64 => body.each(|b| i64::from_le_bytes(b) as f64),
            kind::UINT64 => body.each(|b| u64::from_le_bytes(b) as f64),
            _ => body.each(f64::from_le_bytes),
        })
    }

    /// The characters of the element as UTF-16 code units; `None` where they are of another kind.
    pub(super) fn characters(&self) -> Option<Vec<u16>> {
        match self.kind {
            kind::UINT16 | kind::UTF16 => Some(self.body.each(u16::from_le_bytes)),
            kind::INT8 | kind::UINT8 => Some(self.body.data.iter().map(|&b| u16::from(b)).collect()),
            kind::UTF8 => Some(String::from_utf8_lossy(self.body.data).encode_utf16().collect()),
            _ => None,
        }
    }
}
