//! Integration tests of the physical structures: the bearing of the paper in its loop, and measured machines.
#![allow(missing_docs)]

mod common;
mod demo;
mod drive;
mod emps;
mod hansen_pem;
mod templates;
