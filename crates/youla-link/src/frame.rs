//! One frame: header, body, checksum.

use crate::bytes::{Reader, Writer};
use core::fmt;
use youla_rt::Checksum;

/// Version of the wire format.
pub const VERSION: u8 = 2;

/// Bytes of the longest frame: it passes an Ethernet of 1500 bytes whole.
pub const LARGEST_FRAME: usize = 1400;

/// Bytes of the longest body.
pub const LARGEST_BODY: usize = LARGEST_FRAME - HEADER - CHECKSUM;

/// Bytes of the longest frame with the tag of a [`crate::Key`].
pub const LARGEST_SIGNED: usize = SIGNED.len() + LARGEST_FRAME + TAG;

const MAGIC: [u8; 2] = *b"YL";
/// Before a frame whose authentication tag is behind it.
pub(crate) const SIGNED: [u8; 2] = *b"YK";
pub(crate) const TAG: usize = 32;
const HEADER: usize = 20;
const CHECKSUM: usize = 4;
const SHORTEST: usize = HEADER + CHECKSUM;

/// What the body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// [`crate::RowBlock`], from the machine.
    Rows = 1,
    /// [`crate::Request`], from the host.
    Request = 2,
    /// [`crate::Reply`], from the machine.
    Reply = 3,
}

/// A frame whose checksum is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame<'a> {
    /// What the body is.
    pub kind: Kind,
    /// CRC-32 of the machine's description; 0 in requests of a host that does not know it yet.
    pub schema: u32,
    /// Counts the frames of a sender and kind.
    pub sequence: u32,
    /// Number of the host, drawn at random for each connection: whose request it is, or for whom the reply is; 0 in rows.
    pub host: u32,
    /// Drawn at random when the machine starts: a machine that starts again has another one. 0 in requests of a host that does not
    /// know it yet.
    pub life: u32,
    /// At most [`LARGEST_BODY`] bytes.
    pub body: &'a [u8],
}

/// Why bytes are no frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameError {
    /// Shorter than header and checksum, or longer than [`LARGEST_FRAME`].
    Length(usize),
    /// Another protocol.
    Foreign,
    /// The checksum is wrong: damaged on the way.
    Checksum,
    /// Another version of this format.
    Version(u8),
    /// A kind that this version does not know.
    Kind(u8),
    /// Not a whole COBS packet.
    Packet,
    /// Without an authentication tag, where a key is set.
    Unsigned,
    /// With the authentication tag of another key.
    Key,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FrameError::Length(bytes) => write!(f, "a frame has {SHORTEST} to {LARGEST_FRAME} bytes, not {bytes}"),
            FrameError::Foreign => f.write_str("the bytes do not begin with \"YL\": not a frame of youla"),
            FrameError::Checksum => f.write_str("the checksum of the frame is wrong: it was damaged on the way"),
            FrameError::Version(version) => {
                write!(
                    f,
                    "the frame has version {version} of the format, this program speaks version {VERSION}: update the older side"
                )
            }
            FrameError::Kind(kind) => write!(f, "frames of kind {kind} are not known"),
            FrameError::Packet => f.write_str("the bytes between two zeros are not a COBS packet"),
            FrameError::Unsigned => f.write_str("the frame has no authentication tag, and a key is set"),
            FrameError::Key => f.write_str("the authentication tag of the frame is not that of the key"),
        }
    }
}

impl core::error::Error for FrameError {}

/// Frame and tag of signed bytes.
pub(crate) fn parts(bytes: &[u8]) -> Option<(&[u8], &[u8; TAG])> {
    bytes.strip_prefix(&SIGNED)?.split_last_chunk()
}

impl<'a> Frame<'a> {
    /// Into the front of a buffer; returns the number of bytes.
    ///
    /// # Errors
    /// [`FrameError::Length`] for a body that is too long, or longer than the buffer.
    pub fn write(&self, buffer: &mut [u8]) -> Result<usize, FrameError> {
        let length = HEADER + self.body.len() + CHECKSUM;
        if length > LARGEST_FRAME || length > buffer.len() {
            return Err(FrameError::Length(length));
        }
        let mut writer = Writer::new(buffer);
        let mut checksum = Checksum::new();
        let version_and_kind = [VERSION, self.kind as u8];
        let numbers = [self.schema, self.sequence, self.host, self.life].map(u32::to_le_bytes);
        let pieces: [&[u8]; 4] = [&MAGIC, &version_and_kind, numbers.as_flattened(), self.body];
        for piece in pieces {
            checksum.append(piece);
            writer.put(piece).ok_or(FrameError::Length(length))?;
        }
        writer.put(&checksum.value().to_le_bytes()).ok_or(FrameError::Length(length))?;
        Ok(length)
    }

    /// From the bytes of one datagram or packet. Of a signed frame ([`crate::Key`]) the tag is not tested.
    ///
    /// # Errors
    /// [`FrameError`]; the checksum is tested before version and kind.
    pub fn read(bytes: &'a [u8]) -> Result<Self, FrameError> {
        let bytes = parts(bytes).map_or(bytes, |(frame, _)| frame);
        let length = FrameError::Length(bytes.len());
        if bytes.len() > LARGEST_FRAME {
            return Err(length);
        }
        let (content, sent) = bytes.split_last_chunk::<CHECKSUM>().ok_or(length)?;
        let mut reader = Reader(content);
        let magic = reader.array::<2>().ok_or(length)?;
        if magic != MAGIC {
            return Err(FrameError::Foreign);
        }
        let mut checksum = Checksum::new();
        checksum.append(content);
        if checksum.value() != u32::from_le_bytes(*sent) {
            return Err(FrameError::Checksum);
        }
        let version = reader.u8().ok_or(length)?;
        if version != VERSION {
            return Err(FrameError::Version(version));
        }
        let kind = reader.u8().ok_or(length)?;
        let mut number = || reader.u32().ok_or(length);
        let (schema, sequence, host, life) = (number()?, number()?, number()?, number()?);
        let kind = match kind {
            1 => Kind::Rows,
            2 => Kind::Request,
            3 => Kind::Reply,
            other => return Err(FrameError::Kind(other)),
        };
        Ok(Frame { kind, schema, sequence, host, life, body: reader.rest() })
    }
}
