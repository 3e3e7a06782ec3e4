//! The numbers of the machine and its hardware: adapt both to yours.

use youla_link::{Machine, Station};
use youla_rig::{LinearPlant, Plant, random_number};
use youla_rt::{Controller, ExcitedLoop, Limits, Matrices};

/// Order of the model, inputs, outputs, order of Q.
pub(crate) type Rig<'a> = Station<'a, 2, 1, 1, 4>;

/// A lightly damped mode and a controller for one that is more damped; `OBSERVER` of 8-redesign/controller.rs in its place.
const OBSERVER: Matrices<f64, 2, 1, 1> = Matrices {
    a: [[0.998, 0.025], [-0.025, 0.998]],
    b: [[0.0], [0.05]],
    c: [[1.0, 0.0]],
    d: [[0.0]],
    f: [[0.0, -0.4]],
    l: [[-0.1], [0.0]],
};

static SQUARE: [[f32; 1]; 4] = [[1.0], [1.0], [-1.0], [-1.0]];

/// What the host copies into the run.toml of a log.
pub(crate) fn description(sample_time: f64) -> String {
    format!(
        r#"name = "mode"
sample_time = {sample_time:?}
q_order = 4
inputs = [{{ name = "u", unit = "V" }}]
outputs = [{{ name = "y", unit = "um" }}]

[nominal.state_space]
domain = "discrete"
a = [[0.998, 0.025], [-0.025, 0.998]]
b = [[0], [0.05]]
c = [[1, 0]]
d = [[0]]

[controller.observer]
feedback = "positive"
state_feedback = [[0, -0.4]]
observer_gain = [[-0.1], [0]]
"#
    )
}

/// At rest; a host that is silent for a second ends an excitation.
pub(crate) fn station(description: &str, rate: u32) -> Result<Rig<'_>, Box<dyn std::error::Error>> {
    let limits =
        Limits { y: [20.0], beta: [1.0], u: [10.0], rate: [8.0], clipped: 20, stuck: 4, host: rate, duration: 0 };
    let running = ExcitedLoop::new(Controller::new(OBSERVER)?.to_f32()?, limits, 400)?;
    // A frame each 20 ms, or as many rows as a frame holds.
    let rows = u16::try_from(rate / 50).unwrap_or(u16::MAX);
    Ok(Station::new(running, Machine { description, table: &SQUARE, rows, life: random_number() }))
}

/// The hardware. Here a plant that is computed; a machine has a type of its own, with its converters (IIO, SPI, EtherCAT, comedi) in `measure` and
/// `apply`, both without waiting for more than the conversion.
pub(crate) fn plant() -> impl Plant<1, 1> {
    LinearPlant::new([[0.9993, 0.0262], [-0.0262, 0.9993]], [[0.0], [0.05]], [[1.0, 0.0]], [1e-3, 1e-2], 1)
}
