//! Frames on a serial line: COBS packets, each after and before a zero byte.

use crate::{FrameError, LARGEST_SIGNED};

/// Bytes of the longest packet, with its zeros.
pub const LARGEST_PACKET: usize = LARGEST_SIGNED + LARGEST_SIGNED / 254 + 3;

/// The bytes of a frame as a packet into the front of a buffer; returns their number. The zero at the front ends whatever the line
/// held before.
///
/// # Errors
/// [`FrameError::Length`] where the buffer is too short; [`LARGEST_PACKET`] bytes are enough for each frame.
pub fn write_packet(frame: &[u8], buffer: &mut [u8]) -> Result<usize, FrameError> {
    let too_long = FrameError::Length(frame.len());
    // COBS adds a byte and one more for each 254.
    let encoded = frame.len() + 1 + frame.len() / 254;
    if frame.len() > LARGEST_SIGNED || buffer.len() < encoded + 2 {
        return Err(too_long);
    }
    let (first, rest) = buffer.split_first_mut().ok_or(too_long)?;
    *first = 0;
    let length = cobs::try_encode(frame, rest).map_err(|_| too_long)?;
    *rest.get_mut(length).ok_or(too_long)? = 0;
    Ok(length + 2)
}

/// Finds packets in a stream of bytes.
#[derive(Debug, Clone)]
pub struct PacketReader {
    buffer: [u8; LARGEST_PACKET],
    length: usize,
    /// More bytes than a packet has: skipped to the next zero.
    overlong: bool,
}

impl PacketReader {
    /// At the start of a stream, or somewhere inside.
    #[must_use]
    pub const fn new() -> Self {
        PacketReader { buffer: [0; LARGEST_PACKET], length: 0, overlong: false }
    }

    /// Takes the next byte; a zero that ends a packet gives the bytes of its frame.
    ///
    /// # Errors
    /// [`FrameError::Packet`] for bytes between two zeros that are no packet.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], FrameError>> {
        if byte != 0 {
            match self.buffer.get_mut(self.length) {
                Some(place) => {
                    *place = byte;
                    self.length += 1;
                }
                None => self.overlong = true,
            }
            return None;
        }
        let (length, overlong) = (self.length, self.overlong);
        (self.length, self.overlong) = (0, false);
        if length == 0 {
            return None;
        }
        let packet = self.buffer.get_mut(..length).filter(|_| !overlong);
        let frame = packet.and_then(|packet| {
            let decoded = cobs::decode_in_place(packet).ok()?;
            packet.get(..decoded)
        });
        Some(frame.ok_or(FrameError::Packet))
    }
}

impl Default for PacketReader {
    fn default() -> Self {
        Self::new()
    }
}
