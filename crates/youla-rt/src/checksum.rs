//! CRC-32 (ISO-HDLC, the one of Ethernet and zip files), four bits at a time.

/// The checksum of bytes that come in pieces: polynomial 0x04C11DB7, reflected, start and final inversion.
///
/// ```
/// let mut checksum = youla_rt::Checksum::new();
/// checksum.append(b"12345");
/// checksum.append(b"6789");
/// assert_eq!(checksum.value(), 0xcbf4_3926);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Checksum {
    register: u32,
}

const NIBBLES: [u32; 16] = table();

const fn table() -> [u32; 16] {
    let mut table = [0; 16];
    let mut nibble = 0;
    while nibble < 16 {
        let mut x = nibble as u32;
        let mut bit = 0;
        while bit < 4 {
            x = if x & 1 == 1 { x >> 1 ^ 0xedb8_8320 } else { x >> 1 };
            bit += 1;
        }
        table[nibble] = x;
        nibble += 1;
    }
    table
}

impl Checksum {
    /// Of no bytes yet.
    #[must_use]
    pub const fn new() -> Self {
        Checksum { register: u32::MAX }
    }

    /// With further bytes.
    #[inline]
    pub fn append(&mut self, bytes: &[u8]) {
        for byte in bytes {
            let mut x = self.register ^ u32::from(*byte);
            x = x >> 4 ^ NIBBLES[(x & 15) as usize];
            self.register = x >> 4 ^ NIBBLES[(x & 15) as usize];
        }
    }

    /// The checksum of all bytes so far.
    #[must_use]
    pub const fn value(self) -> u32 {
        !self.register
    }
}

impl Default for Checksum {
    fn default() -> Self {
        Self::new()
    }
}
