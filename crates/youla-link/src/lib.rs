//! The wire format between a controller with the ports alpha and beta and its host. No standard library, no allocation, no panic.
//!
//! A [`Frame`] is a datagram on UDP, or a packet between zero bytes on a serial line ([`write_packet`], [`PacketReader`]):
//!
//! | bytes | content |
//! |---|---|
//! | 0, 1 | `YL` |
//! | 2 | version, [`VERSION`] |
//! | 3 | [`Kind`] |
//! | 4 to 7 | schema: CRC-32 of the machine's description |
//! | 8 to 11 | sequence number of the sender |
//! | 12 to 15 | number of the host |
//! | 16 to 19 | life: number of the start of the machine |
//! | 20 .. n - 4 | body |
//! | last 4 | CRC-32 (ISO-HDLC) of all bytes before |
//!
//! The machine counts the requests of each host apart, and executes a [`Request::Stop`] of any host always. With a [`Key`] that machine and hosts
//! share, each frame is signed, and a machine executes nothing but a stop from anybody without it.
//!
//! All numbers are little-endian. The bodies are [`RowBlock`]s from the machine, [`Request`]s from the host, and a [`Reply`] to each
//! request. [`Tracker`] finds what was lost, doubled or reordered on the way. [`Station`] is the machine's end: a
//! [`youla_rt::ExcitedLoop`] in `f32` with its frames.

#![no_std]
#![forbid(unsafe_code)]

// The machine of the firmware names this crate.
#[cfg(test)]
extern crate self as youla_link;
#[cfg(test)]
extern crate std;

mod bytes;
mod frame;
mod key;
mod old;
mod peers;
mod request;
mod rows;
mod serial;
mod station;
mod tracker;

pub use frame::{Frame, FrameError, Kind, LARGEST_BODY, LARGEST_FRAME, LARGEST_SIGNED, VERSION};
pub use key::Key;
pub use old::{OLD_VERSION, write_old_describe};
pub use request::{LARGEST_CHUNK, Outcome, Reply, Request, SequenceOrigin};
pub use rows::{RowBatch, RowBlock, RowShape, RowView};
pub use serial::{LARGEST_PACKET, PacketReader, write_packet};
pub use station::{Machine, Station, is_stop};
pub use tracker::{Arrival, Tracker};

#[cfg(test)]
mod tests;
