//! The compact protocol of Apache Thrift, in which footer and headers of pages are written.
//!
//! Source: Apache Thrift, "Compact protocol". A struct is a row of fields, each a byte of type and distance to the number of the
//! field before, and its value; whole numbers take seven bits of a byte, the low ones first, with their sign in the lowest bit.

/// Structs and lists inside of each other.
const MAX_DEPTH: usize = 16;

/// A struct: the numbers of its fields and their values.
pub(super) struct Fields<'a>(Vec<(i16, Field<'a>)>);

/// A value.
pub(super) enum Field<'a> {
    Integer(i64),
    Bool(bool),
    Bytes(&'a [u8]),
    List(Vec<Field<'a>>),
    Struct(Fields<'a>),
    /// Of a kind that is not needed.
    Other,
}

impl<'a> Fields<'a> {
    /// Takes a struct off the front of `bytes`; `None` where none is whole.
    pub(super) fn take(bytes: &mut &'a [u8]) -> Option<Self> {
        structure(bytes, 0)
    }

    pub(super) fn get(&self, number: i16) -> Option<&Field<'a>> {
        self.0.iter().find(|(n, _)| *n == number).map(|(_, field)| field)
    }

    pub(super) fn integer(&self, number: i16) -> Option<i64> {
        if let Field::Integer(value) = self.get(number)? { Some(*value) } else { None }
    }

    /// A whole number that is not negative, of any type that holds it.
    pub(super) fn size<T: TryFrom<i64>>(&self, number: i16) -> Option<T> {
        self.integer(number).filter(|value| *value >= 0).and_then(|value| T::try_from(value).ok())
    }

    pub(super) fn bool(&self, number: i16) -> Option<bool> {
        if let Field::Bool(value) = self.get(number)? { Some(*value) } else { None }
    }

    pub(super) fn bytes(&self, number: i16) -> Option<&'a [u8]> {
        if let Field::Bytes(value) = self.get(number)? { Some(value) } else { None }
    }

    pub(super) fn fields(&self, number: i16) -> Option<&Fields<'a>> {
        self.get(number)?.fields()
    }

    pub(super) fn list(&self, number: i16) -> Option<&[Field<'a>]> {
        if let Field::List(items) = self.get(number)? { Some(items) } else { None }
    }
}

impl<'a> Field<'a> {
    pub(super) fn fields(&self) -> Option<&Fields<'a>> {
        if let Field::Struct(fields) = self { Some(fields) } else { None }
    }
}

fn byte(bytes: &mut &[u8]) -> Option<u8> {
    let (first, rest) = bytes.split_first()?;
    *bytes = rest;
    Some(*first)
}

fn take<'a>(bytes: &mut &'a [u8], count: u64) -> Option<&'a [u8]> {
    let (first, rest) = bytes.split_at_checked(usize::try_from(count).ok()?)?;
    *bytes = rest;
    Some(first)
}

/// A whole number without sign, off the front of `bytes`.
pub(super) fn natural(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let next = byte(bytes)?;
        value |= u64::from(next & 0x7f) << shift;
        if next < 0x80 {
            return Some(value);
        }
    }
    None
}

/// A whole number with its sign in the lowest bit, off the front of `bytes`.
pub(super) fn signed(bytes: &mut &[u8]) -> Option<i64> {
    let value = natural(bytes)?;
    Some((value >> 1) as i64 ^ -((value & 1) as i64))
}

fn structure<'a>(bytes: &mut &'a [u8], depth: usize) -> Option<Fields<'a>> {
    let mut all = Vec::new();
    let mut number = 0_i16;
    loop {
        let head = byte(bytes)?;
        if head == 0 {
            return Some(Fields(all));
        }
        number = match head >> 4 {
            0 => i16::try_from(signed(bytes)?).ok()?,
            distance => number.checked_add(i16::from(distance))?,
        };
        let value = match head & 15 {
            kind @ (1 | 2) => Field::Bool(kind == 1),
            kind => value(bytes, kind, depth)?,
        };
        all.push((number, value));
    }
}

/// A value of a field or of a list, where a truth value takes a byte.
fn value<'a>(bytes: &mut &'a [u8], kind: u8, depth: usize) -> Option<Field<'a>> {
    match kind {
        1 | 2 => byte(bytes).map(|b| Field::Bool(b == 1)),
        3 => byte(bytes).map(|b| Field::Integer(i64::from(b as i8))),
        4..=6 => signed(bytes).map(Field::Integer),
        7 => take(bytes, 8).map(|_| Field::Other),
        8 => {
            let length = natural(bytes)?;
            take(bytes, length).map(Field::Bytes)
        }
        9 | 10 if depth < MAX_DEPTH => {
            let head = byte(bytes)?;
            let count = if head >> 4 == 15 { natural(bytes)? } else { u64::from(head >> 4) };
            // No capacity by a count that is only announced: each item takes a byte at least.
            let mut items = Vec::new();
            for _ in 0..count {
                items.push(value(bytes, head & 15, depth + 1)?);
            }
            Some(Field::List(items))
        }
        12 if depth < MAX_DEPTH => structure(bytes, depth + 1).map(Field::Struct),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_sign_and_end() {
        assert_eq!([0, 1, 2, 3].map(|b| signed(&mut &[b][..]).unwrap()), [0, -1, 1, -2]);
        assert_eq!(natural(&mut &[0x96, 0x01][..]), Some(150));
        assert_eq!(natural(&mut &[0xff; 11][..]), None);
    }

    #[test]
    fn structs_are_read_and_their_parts_are_not() {
        // 1: 5, 2: true, 4: [1, -1], 20: {1: "ab"}
        let whole = [0x15, 10, 0x11, 0x29, 0x25, 2, 1, 0x0c, 40, 0x18, 2, b'a', b'b', 0, 0];
        let mut bytes = &[&whole[..], b"rest"].concat()[..];
        let found = Fields::take(&mut bytes).unwrap();
        assert_eq!((found.integer(1), found.bool(2), bytes), (Some(5), Some(true), &b"rest"[..]));
        assert_eq!(found.fields(20).unwrap().bytes(1), Some(&b"ab"[..]));
        assert!(matches!(found.list(4).unwrap(), [Field::Integer(1), Field::Integer(-1)]));
        assert!((0..whole.len()).all(|end| Fields::take(&mut &whole[..end]).is_none()));
    }
}
