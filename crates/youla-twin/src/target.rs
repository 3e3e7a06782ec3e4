//! The controller of a campaign: the loop of the firmware, one sample at a time.

use crate::Result;
use crate::error::failed;
use crate::qemu::Qemu;
use crate::station::{CampaignStation, station};
use std::path::Path;
use youla_link::LARGEST_FRAME;

/// Where the loop of the firmware runs.
pub struct Target(Place);

enum Place {
    /// In this process.
    Host { station: Box<CampaignStation>, u: [f32; 2], frame: Vec<u8> },
    /// On a Cortex-M4 in QEMU.
    Qemu(Qemu),
}

impl Target {
    /// Where the loop will run, in words: `image` is that of the firmware for QEMU.
    pub fn place(image: Option<&Path>) -> &'static str {
        match image {
            Some(image) if image.is_file() && Qemu::is_there() => "qemu cortex-m4",
            _ => "host",
        }
    }

    /// The loop of these numbers ([`crate::RunningLoop::numbers`]), there.
    ///
    /// # Errors
    /// [`crate::Error::Controller`] for numbers that are not valid, or an image that does not start.
    pub fn start(image: Option<&Path>, numbers: &[f32]) -> Result<Self> {
        match image {
            Some(path) if Self::place(image) != "host" => Ok(Target(Place::Qemu(Qemu::start(path, numbers)?))),
            _ => Self::host(numbers),
        }
    }

    /// The host's build of the loop.
    ///
    /// # Errors
    /// [`crate::Error::Controller`] for numbers that are not valid.
    fn host(numbers: &[f32]) -> Result<Self> {
        let station = station(numbers).ok_or_else(|| failed("does not accept its matrices and limits"))?;
        Ok(Target(Place::Host { station: Box::new(station), u: [0.0; 2], frame: Vec::new() }))
    }

    /// The input of this sample, and the frame that was complete before it, empty for none.
    pub(crate) fn receive(&mut self, frame: &mut Vec<u8>) -> Result<[f32; 2]> {
        match &mut self.0 {
            Place::Host { station, u, frame: ready } => {
                *u = station.command();
                std::mem::swap(frame, ready);
                ready.clear();
                Ok(*u)
            }
            Place::Qemu(qemu) => qemu.receive(frame),
        }
    }

    /// The outputs of this sample, and a request, empty for none. A reply replaces the rows that are complete in the same sample.
    pub(crate) fn send(&mut self, y: &[f32; 2], request: &[u8]) -> Result<()> {
        match &mut self.0 {
            Place::Host { station, u, frame } => {
                let u = *u;
                let _ = station.observe(y, &u);
                let mut bytes = [0; LARGEST_FRAME];
                let too_long = |_| failed("has a frame that is too long");
                let mut length = station.frame(&mut bytes).transpose().map_err(too_long)?.unwrap_or(0);
                if !request.is_empty() {
                    let refused = |_| failed("does not understand a request");
                    length = station.receive(request, &mut bytes).map_err(refused)?.unwrap_or(0);
                }
                frame.clear();
                frame.extend_from_slice(bytes.get(..length).unwrap_or_default());
                Ok(())
            }
            Place::Qemu(qemu) => qemu.send(y, request),
        }
    }
}
