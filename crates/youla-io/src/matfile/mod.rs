//! MATLAB files of version 5 (`save -v6` and `save -v7`): reader and writer.
//!
//! Source: The MathWorks, "MAT-File Format", the chapter on level 5. A file is a header of 128 bytes and a sequence of
//! data elements, each a tag (type, size) and its bytes; a variable is an element of elements; with `-v7` each variable
//! is packed by zlib. Sizes are accepted only if the remaining bytes can fill them.

mod bytes;
mod read;
mod write;

pub use read::{mat_from_bytes, read_mat};
pub(crate) use write::mat_to_bytes;
pub use write::{Packing, write_mat};

/// Class of an array, as the flags element states it.
mod class {
    pub(super) const CELL: u8 = 1;
    pub(super) const STRUCT: u8 = 2;
    pub(super) const OBJECT: u8 = 3;
    pub(super) const CHAR: u8 = 4;
    pub(super) const SPARSE: u8 = 5;
    pub(super) const DOUBLE: u8 = 6;
    pub(super) const UINT64: u8 = 15;
    pub(super) const FUNCTION: u8 = 16;
    pub(super) const OPAQUE: u8 = 17;
    pub(super) const COMPLEX: u32 = 0x0800;
}

/// Type of a data element, as its tag states it.
mod kind {
    pub(super) const INT8: u32 = 1;
    pub(super) const UINT8: u32 = 2;
    pub(super) const INT16: u32 = 3;
    pub(super) const UINT16: u32 = 4;
    pub(super) const INT32: u32 = 5;
    pub(super) const UINT32: u32 = 6;
    pub(super) const SINGLE: u32 = 7;
    pub(super) const DOUBLE: u32 = 9;
    pub(super) const INT64: u32 = 12;
    pub(super) const UINT64: u32 = 13;
    pub(super) const MATRIX: u32 = 14;
    pub(super) const COMPRESSED: u32 = 15;
    pub(super) const UTF8: u32 = 16;
    pub(super) const UTF16: u32 = 17;
}

const HEADER: usize = 128;

#[cfg(test)]
mod tests;
