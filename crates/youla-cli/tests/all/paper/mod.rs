//! `youla paper` as users run it: stopped and gone on with, in parts, on any number of threads, with input that it cannot
//! use.

mod bad_input;
#[path = "../cli/common.rs"]
#[allow(dead_code)]
mod common;
mod resume;
mod shards;
mod small;
mod starts;
mod whole;
