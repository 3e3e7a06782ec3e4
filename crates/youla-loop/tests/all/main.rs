//! Integration tests of the running loop: redesigned controllers on the simulated rig, and the controller that runs in real time.
#![allow(missing_docs)]

mod common;
mod real_time;
mod redesign;
