//! The physical structures: the bearing of the paper in its loop, and measured machines.

mod demo;
mod drive;
mod emps;
mod hansen_pem;
mod templates;
