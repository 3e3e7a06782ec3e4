//! Version 1 of the format, as far as its hosts and machines are told that there is a later one. Its header has no host and no life.

use crate::bytes::{Reader, Writer};
use crate::{FrameError, Kind, LARGEST_FRAME, Request};
use youla_rt::Checksum;

/// The version before [`crate::VERSION`].
pub const OLD_VERSION: u8 = 1;

/// Number and body of a request of version 1 whose checksum [`crate::Frame::read`] has tested.
pub(crate) fn request(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (content, _) = bytes.split_last_chunk::<4>()?;
    let mut reader = Reader(content);
    let head = reader.array::<4>()?;
    let (_, sequence) = (reader.u32()?, reader.u32()?);
    (head == [b'Y', b'L', OLD_VERSION, Kind::Request as u8]).then_some((sequence, reader.rest()))
}

pub(crate) fn write(
    kind: Kind,
    [schema, sequence]: [u32; 2],
    body: &[u8],
    buffer: &mut [u8],
) -> Result<usize, FrameError> {
    let length = FrameError::Length(body.len() + 16);
    if body.len() + 16 > LARGEST_FRAME {
        return Err(length);
    }
    let (head, numbers) = ([b'Y', b'L', OLD_VERSION, kind as u8], [schema, sequence].map(u32::to_le_bytes));
    let mut checksum = Checksum::new();
    let mut writer = Writer::new(buffer);
    for piece in [head.as_slice(), numbers.as_flattened(), body] {
        checksum.append(piece);
        writer.put(piece).ok_or(length)?;
    }
    writer.put(&checksum.value().to_le_bytes()).ok_or(length)?;
    Ok(writer.length())
}

/// The request of version 1 for the description: a machine that answers it, and no other, is of that version.
///
/// # Errors
/// [`FrameError::Length`] where the buffer is too short.
pub fn write_old_describe(buffer: &mut [u8]) -> Result<usize, FrameError> {
    let mut body = [0; 1];
    let _ = Request::Describe.write(&mut body);
    write(Kind::Request, [0, 1], &body, buffer)
}
