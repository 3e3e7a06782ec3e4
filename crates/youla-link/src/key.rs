//! A key that a machine shares with its hosts.
//!
//! | bytes of a signed frame | content |
//! |---|---|
//! | 0, 1 | `YK` |
//! | 2 .. n - 32 | the [`Frame`] |
//! | last 32 | authentication tag: HMAC-SHA-256 of the frame (RFC 2104) |
//!
//! A signature says who has made a frame, not when. A request that somebody else sends again is refused by its number, its host and its life; a
//! reply by its number and host. What is not signed goes to [`crate::Station::receive_unsigned`], and its reply goes out unsigned.

use crate::frame::{SIGNED, TAG, parts};
use crate::{Frame, FrameError, LARGEST_FRAME};
use core::fmt;
use hmac_sha256::HMAC;

/// A key, as the state of HMAC that depends on it alone. It shows nothing of itself in `Debug`.
#[derive(Clone)]
pub struct Key(HMAC);

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key")
    }
}

impl Key {
    /// From 32 random bytes.
    #[must_use]
    pub fn new(bytes: &[u8; 32]) -> Self {
        Key(HMAC::new(bytes))
    }

    /// Signs the frame in the front of a buffer; returns the number of bytes.
    ///
    /// # Errors
    /// [`FrameError::Length`] where the buffer is too short; [`crate::LARGEST_SIGNED`] bytes are enough.
    pub fn sign(&self, buffer: &mut [u8], length: usize) -> Result<usize, FrameError> {
        let too_long = FrameError::Length(length);
        let end = length.saturating_add(SIGNED.len());
        if length > LARGEST_FRAME || end + TAG > buffer.len() {
            return Err(too_long);
        }
        buffer.copy_within(..length, SIGNED.len());
        let (front, rest) = buffer.split_at_mut_checked(end).ok_or(too_long)?;
        let (mark, frame) = front.split_first_chunk_mut::<2>().ok_or(too_long)?;
        *mark = SIGNED;
        let mut tag = self.0.clone();
        tag.update(frame);
        rest.iter_mut().zip(tag.finalize()).for_each(|(to, from)| *to = from);
        Ok(end + TAG)
    }

    /// The frame of bytes that somebody with this key has signed. The tag is compared in constant time.
    ///
    /// # Errors
    /// [`FrameError::Unsigned`], [`FrameError::Key`]; before them those of [`Frame::read`], so that damage is not taken for forgery.
    pub fn verify<'a>(&self, bytes: &'a [u8]) -> Result<Frame<'a>, FrameError> {
        let frame = Frame::read(bytes)?;
        let (content, tag) = parts(bytes).ok_or(FrameError::Unsigned)?;
        let mut own = self.0.clone();
        own.update(content);
        own.finalize_verify(tag).then_some(frame).ok_or(FrameError::Key)
    }
}
