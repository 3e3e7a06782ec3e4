//! One sample, in the interrupt of the timer.
//!
//! It never waits for the serial port: frames and requests pass through two channels, and what finds no place is lost, which the log states
//! as a gap. At most one frame is written per sample, so its time is bounded.

use crate::machine::{ROOM, Rig, code, volts};
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, SampleTime};
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::gpio::Output;
use embassy_stm32::mode::Blocking;
use embassy_stm32::peripherals::{ADC1, PA0, TIM2};
use embassy_stm32::timer::low_level::Timer;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::zerocopy_channel::{Channel, Receiver, Sender};

/// A frame on its way between the interrupt and the serial port.
#[derive(Clone, Copy)]
pub(crate) struct Slot {
    bytes: [u8; ROOM],
    length: usize,
    /// Of a request: its signature is that of the key, or there is none; of a frame to the host: it is signed where there is a key.
    pub(crate) signed: bool,
}

impl Slot {
    pub(crate) const EMPTY: Slot = Slot { bytes: [0; ROOM], length: 0, signed: false };

    pub(crate) fn frame(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// Whether the frame fits.
    pub(crate) fn put(&mut self, frame: &[u8]) -> bool {
        let place = self.bytes.get_mut(..frame.len());
        self.length = frame.len();
        place.map(|place| place.copy_from_slice(frame)).is_some()
    }
}

pub(crate) type Frames = Channel<'static, CriticalSectionRawMutex, Slot>;
pub(crate) type Sending = Sender<'static, CriticalSectionRawMutex, Slot>;
pub(crate) type Receiving = Receiver<'static, CriticalSectionRawMutex, Slot>;

/// A stop has come: for the next sample, whatever waits in the channels.
pub(crate) static STOP: AtomicBool = AtomicBool::new(false);

/// Everything that the interrupt owns.
pub(crate) struct Control {
    pub(crate) rig: Rig,
    pub(crate) timer: Timer<'static, TIM2>,
    pub(crate) dac: DacChannel<'static, Blocking>,
    pub(crate) adc: Adc<'static, ADC1>,
    pub(crate) input: Peri<'static, PA0>,
    /// Lit for good once a sample took longer than its period.
    pub(crate) late: Output<'static>,
    pub(crate) frames: Sending,
    pub(crate) requests: Receiving,
    /// The command of this sample, from the end of the one before: no computation delays it.
    pub(crate) u: [f32; 1],
}

impl Control {
    /// `command -> DAC, ADC -> observe`, then at most one frame.
    pub(crate) fn sample(&mut self) {
        self.timer.clear_update_interrupt();
        if STOP.swap(false, Ordering::Relaxed) {
            self.rig.stop();
        }
        let codes = self.u.map(code);
        self.dac.set(Value::Bit12Right(codes[0]));
        // 15 + 12 cycles at 20 MHz, and 3 us for the start of the converter.
        let y = [volts(self.adc.blocking_read(&mut self.input, SampleTime::CYCLES15))];
        // The observer takes what the converter applied, rounding included.
        let _ = self.rig.observe(&y, &codes.map(volts));
        self.exchange();
        self.u = self.rig.command();
        if self.timer.regs_core().sr().read().uif() {
            self.late.set_high();
        }
    }

    /// Rows if a frame of them is complete, else the reply to a request if there is one.
    fn exchange(&mut self) {
        let Some(slot) = self.frames.try_send() else { return };
        slot.signed = true;
        let written = match self.rig.frame(&mut slot.bytes) {
            Some(written) => written.ok(),
            None => {
                let Some(request) = self.requests.try_receive() else { return };
                slot.signed = request.signed;
                let written = match request.signed {
                    true => self.rig.receive(request.frame(), &mut slot.bytes),
                    false => self.rig.receive_unsigned(request.frame(), &mut slot.bytes),
                };
                self.requests.receive_done();
                written.ok().flatten()
            }
        };
        if let Some(length) = written {
            slot.length = length;
            self.frames.send_done();
        }
    }
}
