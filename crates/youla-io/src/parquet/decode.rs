//! The encodings of numbers. All give words of 64 bits: whole numbers as they are, extended by their sign, others as `f64`.
//!
//! Source: Apache Parquet format 2, "Encodings". Each function appends exactly `count` words, or gives `None`.

use super::footer::Number;
use super::thrift::{natural, signed};

/// Largest block of numbers stored by their differences; writers use 128 to 4096.
const LARGEST_BLOCK: u64 = 1 << 16;

impl Number {
    /// Bytes of a number; 0 for truth values, which have one bit.
    fn width(self) -> usize {
        match self {
            Number::Bool => 0,
            Number::Int32 | Number::Unsigned32 | Number::Float => 4,
            Number::Int64 | Number::Unsigned64 | Number::Double | Number::Clock(_) => 8,
        }
    }

    /// The word of a number by its bytes, the low ones first.
    fn word(self, bytes: impl DoubleEndedIterator<Item = u8>) -> u64 {
        self.extended(bytes.rev().fold(0, |word, byte| word << 8 | u64::from(byte)))
    }

    fn extended(self, word: u64) -> u64 {
        match self {
            Number::Int32 => i64::from(word as u32 as i32) as u64,
            Number::Unsigned32 => u64::from(word as u32),
            Number::Float => f64::from(f32::from_bits(word as u32)).to_bits(),
            _ => word,
        }
    }

    /// The number of a word; timestamps count from `zero`.
    pub(super) fn value(self, word: u64, zero: i64) -> f64 {
        match self {
            Number::Float | Number::Double => f64::from_bits(word),
            Number::Int32 | Number::Int64 => word as i64 as f64,
            Number::Bool | Number::Unsigned32 | Number::Unsigned64 => word as f64,
            Number::Clock(seconds) => (word as i64).wrapping_sub(zero) as f64 * seconds,
        }
    }
}

/// One number after the other.
pub(super) fn plain(bytes: &[u8], count: usize, number: Number, out: &mut Vec<u64>) -> Option<()> {
    if number == Number::Bool {
        return packed(bytes, 1, count, &mut |bit| push(out, bit)).filter(|taken| *taken == count).map(drop);
    }
    let all = bytes.get(..count.checked_mul(number.width())?)?;
    out.extend(all.chunks_exact(number.width()).map(|bytes| number.word(bytes.iter().copied())));
    Some(())
}

/// The first bytes of all numbers, then the second ones and so on.
pub(super) fn split(bytes: &[u8], count: usize, number: Number, out: &mut Vec<u64>) -> Option<()> {
    let whole = number.width() > 0 && count.checked_mul(number.width())? == bytes.len();
    let word = |k: usize| number.word((0..number.width()).map(move |j| bytes[k + j * count]));
    whole.then(|| out.extend((0..count).map(word)))
}

/// Places in a dictionary: a byte that gives the bits of each, then runs.
pub(super) fn places(bytes: &[u8], count: usize, dictionary: &[u64], out: &mut Vec<u64>) -> Option<()> {
    let Some((width, rest)) = bytes.split_first() else { return (count == 0).then_some(()) };
    runs(rest, *width, count, &mut |place| push(out, *dictionary.get(usize::try_from(place).ok()?)?))
}

/// Truth values: their length in four bytes, then runs.
pub(super) fn truths(bytes: &[u8], count: usize, out: &mut Vec<u64>) -> Option<()> {
    runs(bytes.get(4..)?, 1, count, &mut |bit| push(out, bit))
}

fn push(out: &mut Vec<u64>, word: u64) -> Option<()> {
    out.push(word);
    Some(())
}

/// Runs of equal words of `width` bits, and groups of eight words packed one after the other.
pub(super) fn runs(mut bytes: &[u8], width: u8, count: usize, take: &mut impl FnMut(u64) -> Option<()>) -> Option<()> {
    let mut left = count;
    while left > 0 {
        let head = natural(&mut bytes)?;
        let length = usize::try_from(head >> 1).ok()?;
        if head & 1 == 0 {
            let (value, rest) = bytes.split_at_checked(usize::from(width.div_ceil(8)))?;
            let word = value.iter().rev().try_fold(0_u64, |word, b| Some(word.checked_mul(256)? | u64::from(*b)))?;
            (0..length.min(left)).try_for_each(|_| take(word))?;
            (left, bytes) = (left - length.min(left), rest);
        } else {
            // The last group may be cut off behind the last word.
            let size = length.checked_mul(usize::from(width))?.min(bytes.len());
            let (group, rest) = bytes.split_at(size);
            let taken = packed(group, width, length.checked_mul(8)?.min(left), take)?;
            if taken == 0 {
                return None;
            }
            (left, bytes) = (left - taken, rest);
        }
    }
    Some(())
}

/// Up to `count` words of `width` bits, the low bits first; gives how many there are.
fn packed(bytes: &[u8], width: u8, count: usize, take: &mut impl FnMut(u64) -> Option<()>) -> Option<usize> {
    if width > 64 {
        return None;
    }
    let count = if width == 0 { count } else { count.min(bytes.len().checked_mul(8)? / usize::from(width)) };
    let mask = (1_u128 << width) - 1;
    let (mut window, mut bits, mut bytes) = (0_u128, 0, bytes.iter());
    for _ in 0..count {
        while bits < width {
            window |= u128::from(*bytes.next()?) << bits;
            bits += 8;
        }
        take((window & mask) as u64)?;
        window >>= width;
        bits -= width;
    }
    Some(count)
}

/// Whole numbers by their differences, in blocks with the least difference and parts with the bits of what exceeds it.
pub(super) fn differences(mut bytes: &[u8], count: usize, number: Number, out: &mut Vec<u64>) -> Option<()> {
    let whole =
        matches!(number, Number::Int32 | Number::Int64 | Number::Unsigned32 | Number::Unsigned64 | Number::Clock(_));
    let (block, parts, numbers) = (natural(&mut bytes)?, natural(&mut bytes)?, natural(&mut bytes)?);
    let mut value = signed(&mut bytes)? as u64;
    let even = (1..=LARGEST_BLOCK).contains(&block) && (1..=block).contains(&parts) && block.is_multiple_of(32 * parts);
    if !whole || !even || numbers != count as u64 {
        return None;
    }
    let length = (block / parts) as usize;
    let mut left = count;
    if left > 0 {
        out.push(number.extended(value));
        left -= 1;
    }
    while left > 0 {
        let least = signed(&mut bytes)? as u64;
        let (widths, rest) = bytes.split_at_checked(parts as usize)?;
        bytes = rest;
        for width in widths {
            let size = (length / 8 * usize::from(*width)).min(bytes.len());
            let (part, rest) = bytes.split_at(size);
            bytes = rest;
            let mut next = |difference: u64| {
                value = value.wrapping_add(least).wrapping_add(difference);
                push(out, number.extended(value))
            };
            let wanted = length.min(left);
            if packed(part, *width, wanted, &mut next)? != wanted {
                return None;
            }
            left -= wanted;
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Groups of three bits, by the example of the format: the numbers 0 to 7 are 88 c6 fa.
    #[test]
    fn words_are_packed_from_the_low_bits_on() {
        let mut out = Vec::new();
        runs(&[3, 0x88, 0xc6, 0xfa, 10, 2], 3, 12, &mut |word| push(&mut out, word)).unwrap();
        assert_eq!(out, [0, 1, 2, 3, 4, 5, 6, 7, 2, 2, 2, 2]);
    }

    /// By the examples of the format: 1 to 5 have differences of one, and 7, 5, 3, 1, 2, 3, 4, 5 those of -2 and 1.
    #[test]
    fn differences_are_summed() {
        let mut out = Vec::new();
        differences(&[128, 1, 4, 5, 2, 2, 0, 0, 0, 0], 5, Number::Int32, &mut out).unwrap();
        assert_eq!(out, [1, 2, 3, 4, 5]);
        out.clear();
        let packed = [0xc0, 0x3f, 0, 0, 0, 0, 0, 0];
        let bytes = [&[128, 1, 4, 8, 14, 3, 2, 0, 0, 0][..], &packed].concat();
        differences(&bytes, 8, Number::Int64, &mut out).unwrap();
        assert_eq!(out, [7, 5, 3, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn what_is_not_whole_gives_nothing() {
        let out = &mut Vec::new();
        assert!(plain(&[0; 15], 2, Number::Double, out).is_none());
        assert!(plain(&[0; 1], 9, Number::Bool, out).is_none());
        assert!(split(&[0; 15], 2, Number::Double, out).is_none());
        assert!(split(&[], 0, Number::Bool, out).is_none());
        assert!(places(&[1, 4, 1], 2, &[5], out).is_none(), "a place beyond the dictionary");
        assert!(places(&[], 1, &[5], out).is_none());
        assert!(runs(&[0xff; 20], 1, 1, &mut |_| Some(())).is_none(), "a length of more than 64 bits");
        assert!(runs(&[3; 20], 0, 1, &mut |_| Some(())).is_some() && runs(&[3], 65, 8, &mut |_| Some(())).is_none());
        assert!(differences(&[128, 1, 4, 0, 2], 5, Number::Int32, out).is_none(), "fewer numbers than values");
        assert!(differences(&[0, 0, 5, 2, 2, 0, 0, 0, 0], 5, Number::Int32, out).is_none(), "a block of nothing");
        assert!(differences(&[128, 1, 4, 5, 2, 2, 0, 0, 0, 0], 5, Number::Double, out).is_none());
    }
}
