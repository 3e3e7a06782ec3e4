//! `youla paper`: stopped and continued, in parts, on any number of threads, with input that it cannot use.

mod bad_input;
mod resume;
mod shards;
mod small;
mod whole;
