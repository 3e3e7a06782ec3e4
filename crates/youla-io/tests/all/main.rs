//! Integration tests of the files: readers, exports, and the examples on measured data.
#![allow(missing_docs)]

mod common;
mod exports;
mod readers;
mod real_data;
