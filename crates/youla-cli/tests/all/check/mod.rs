//! `youla check` on measured records: it finds what is planted in copies of them and reports only known findings on the records
//! themselves.

mod clean;
mod planted;
mod program;
mod records;
