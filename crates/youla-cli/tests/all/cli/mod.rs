//! The program as users run it: what it writes, what it prints, and what it says about input that it cannot use.

mod bad_output;
mod bad_problem;
mod bad_records;
mod bad_settings;
mod common;
mod compare;
mod contract;
mod excite;
mod export;
mod init;
mod plot;
mod schema;
mod subspace;
mod verbs;
