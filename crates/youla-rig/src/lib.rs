//! The host's end of a rig that speaks `youla-link`: [`Rig`] asks and receives, [`Recorder`] writes a log in which every row is there or
//! reported missing, and [`settings`] the run.toml beside it. [`serve`] plays a machine over UDP: the loop of the firmware with any
//! [`Plant`], a [`LinearPlant`] for example, in real time or in lock-step. Where both have a key ([`read_key`]), each frame is signed.

mod description;
mod error;
mod key;
mod plant;
mod recorder;
mod rig;
mod settings;
mod sink;
mod twin;
mod way;

pub use description::{Description, RigChannel};
pub use error::{Error, Result};
pub use key::{read_key, write_key};
pub use plant::{LinearPlant, Plant, PlantFault};
pub use recorder::{LogPart, LogReport, Recorder};
pub use rig::{Answer, Rig, random_number};
pub use settings::settings;
pub use sink::{CsvLog, LogRow, PlotStream, RowSink};
pub use twin::{Pace, Port, RotorStation, Twin, rotor, serve};
pub use youla_link::{Outcome, Request, SequenceOrigin};
pub use youla_rt::{Cause, Phase, Status, Trip};

#[cfg(test)]
mod tests;
