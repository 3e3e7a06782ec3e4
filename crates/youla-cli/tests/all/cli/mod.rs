//! What the program writes, what it prints, and what it says about input that it cannot use.

mod bad_output;
mod bad_problem;
mod bad_records;
mod bad_settings;
mod commission;
mod compare;
mod computed;
mod excite;
mod export;
mod init;
mod limits;
mod lines;
mod mistakes;
mod notes;
mod pid;
mod plot;
mod response;
mod rig;
mod synchronise;
mod verbs;
