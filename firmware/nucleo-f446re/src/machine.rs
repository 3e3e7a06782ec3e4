//! The numbers of the machine: adapt all of them to yours.
//!
//! As they stand, the plant is a resistor of 20 kOhm from PA4 to PA0 and a capacitor of 100 nF from PA0 to ground: nothing can break, and
//! its time constant of 2 ms is 10 samples.

use youla_link::{Machine, Station};
use youla_rt::{Controller, ExcitedLoop, Limits, Matrices};

/// Order of the model, inputs, outputs, order of Q.
pub(crate) type Rig = Station<'static, 1, 1, 1, 4>;

/// Samples per second.
pub(crate) const RATE: u32 = 5000;

/// Rows of a frame. The sample that completes a frame also takes its checksum, so more rows make this sample longer.
const ROWS: u16 = 16;

/// Bytes of the longest frame between the interrupt and the serial port: rows, or the reply with the description.
pub(crate) const ROOM: usize = 768;

/// The key that hosts have as well, the 32 bytes of a file of `youla rig key`; without it whoever reaches the serial port commands the machine.
pub(crate) const KEY: Option<[u8; 32]> = None;

/// The host copies it into the run.toml of a log, so model and gains must be those below.
const DESCRIPTION: &str = r#"name = "low-pass"
sample_time = 2e-4
q_order = 4
inputs = [{ name = "u", unit = "V" }]
outputs = [{ name = "y", unit = "V" }]

[nominal.state_space]
domain = "discrete"
a = [[0.905]]
b = [[0.095]]
c = [[1]]
d = [[0]]

[controller.observer]
feedback = "positive"
state_feedback = [[-1.1]]
observer_gain = [[-0.2]]
"#;

/// `x+ = exp(-1/10) x + (1 - exp(-1/10)) u`; A + B F = 0.80, A + L C = 0.705. Your controller: `OBSERVER` of 8-redesign/controller.rs.
const OBSERVER: Matrices<f64, 1, 1, 1> =
    Matrices { a: [[0.905]], b: [[0.095]], c: [[1.0]], d: [[0.0]], f: [[-1.1]], l: [[-0.2]] };

/// In the units of the description; counts in samples.
const LIMITS: Limits<f32, 1, 1> = Limits {
    y: [1.5],
    beta: [0.3],
    u: [1.5],
    rate: [3.0],
    clipped: 20,
    // A converter of 12 bits repeats its value on a quiet signal: 20 ms.
    stuck: 100,
    host: RATE,
    duration: 60 * RATE,
};

/// Excitation of the machine's own, at an amplitude of 1: a square wave of 125 Hz.
static TABLE: [[f32; 1]; 40] = {
    let mut table = [[1.0]; 40];
    let mut row = 20;
    while row < 40 {
        table[row] = [-1.0];
        row += 1;
    }
    table
};

/// At rest; `life` is drawn at each start. `None` where a number is not finite or a limit is not above 0.
pub(crate) fn rig(life: u32) -> Option<Rig> {
    let controller = Controller::new(OBSERVER).and_then(|exact| exact.to_f32()).ok()?;
    let running = ExcitedLoop::new(controller, LIMITS, 500).ok()?;
    Some(Station::new(running, Machine { description: DESCRIPTION, table: &TABLE, rows: ROWS, life }))
}

/// Code of the converters at 0 V of the description: half of their range, 1.65 V at the pin.
pub(crate) const MIDDLE: u16 = 2048;

/// Volts for each code.
const STEP: f32 = 3.3 / 4096.0;

/// The code nearest to an input, within the range of the converter.
pub(crate) fn code(u: f32) -> u16 {
    // A conversion from float saturates, and NaN becomes 0.
    ((u / STEP + f32::from(MIDDLE) + 0.5) as u16).min(4095)
}

/// What a code means.
pub(crate) fn volts(code: u16) -> f32 {
    (f32::from(code) - f32::from(MIDDLE)) * STEP
}
