//! Unpacking a page, whose size is known, so that nothing grows beyond it.

use super::Fault;
use flate2::read::MultiGzDecoder;
use ruzstd::decoding::StreamingDecoder;
use std::io::Read;

/// The `size` bytes that are packed in `packed`, in the way of this number.
pub(super) fn unpack(packed: &[u8], size: usize, packing: i64) -> Result<Vec<u8>, Fault> {
    let unpacked = match packing {
        0 => Some(packed.to_vec()),
        1 => snappy(packed, size),
        2 => stream(MultiGzDecoder::new(packed), size),
        6 => StreamingDecoder::new(packed).ok().and_then(|decoder| stream(decoder, size)),
        7 => filled(size, |out| lz4_flex::block::decompress_into(packed, out).ok()),
        other => {
            let name = [(3, "LZO"), (4, "brotli"), (5, "the old LZ4")].into_iter().find(|(number, _)| *number == other);
            let name = name.map_or("an unknown way", |(_, name)| name);
            return Err(format!("columns packed by snappy, gzip, zstd, LZ4_RAW or not at all instead of {name}"));
        }
    };
    unpacked.filter(|bytes| bytes.len() == size).ok_or_else(|| format!("a page that unpacks to {size} bytes"))
}

fn snappy(packed: &[u8], size: usize) -> Option<Vec<u8>> {
    let announced = snap::raw::decompress_len(packed).ok()?;
    (announced == size).then(|| filled(size, |out| snap::raw::Decoder::new().decompress(packed, out).ok()))?
}

fn filled(size: usize, fill: impl FnOnce(&mut [u8]) -> Option<usize>) -> Option<Vec<u8>> {
    let mut out = vec![0; size];
    let filled = fill(&mut out)?;
    (filled == size).then_some(out)
}

/// All of a stream, of which no more than one byte too many is taken.
fn stream(stream: impl Read, size: usize) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(size + 1);
    stream.take(size as u64 + 1).read_to_end(&mut out).ok()?;
    Some(out)
}
