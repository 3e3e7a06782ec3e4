//! The most memory that a file may request.

/// Largest size in bytes that a file, or a part of one, of `stored` bytes may declare for its numbers: declared sizes above
/// `base` + 1032 x `stored` are rejected.
///
/// 1032 is the largest ratio of deflate (zlib FAQ, "maximum compression factor"). Other compressions exceed it for repeated
/// values, hence the `base` of each format.
pub(crate) fn declared_limit(base: u64, stored: u64) -> u64 {
    const DEFLATE_RATIO: u64 = 1032;
    base.saturating_add(DEFLATE_RATIO.saturating_mul(stored))
}
