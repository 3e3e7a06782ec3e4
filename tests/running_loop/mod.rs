//! The running loop: redesigned controllers on the simulated rig, and the controller that runs in real time.

mod real_time;
mod redesign;
