//! Files: readers of every crate, exports, and the examples on measured data.

mod exports;
mod readers;
mod real_data;
