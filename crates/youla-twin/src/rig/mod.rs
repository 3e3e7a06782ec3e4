//! Simulated machines: the gas bearing of the paper, as its linear model and as a digital twin with sensors, actuators and
//! rotation, and experiments on it.

mod bearing;
mod drive;
mod experiment;
mod motion;
mod parameters;
mod piezo;
mod sensor;
mod speed;
mod structure;
#[cfg(test)]
mod tests;
mod twin;

pub use bearing::{Bearing, degraded};
pub use drive::Actuation;
pub use experiment::{ExperimentRecord, LoopController, ObserverLoop, OpenLoop, run_experiment};
pub use parameters::{
    AccelerationPerVolt, Actuator, Adc, Basis, BearingParameters, Bits, Count, FlexibleMode, Hertz, Hysteresis,
    LowPass, Micrometres, One, PerSecond, PerSecondSquared, Quantity, Radians, RigParameters, Rotation, Rpm, Safety,
    Samples, Seconds, Sensor, Timing, Unit, Volts, VoltsPerMicrometre,
};
pub use piezo::Piezo;
pub use speed::bearing_at_speed;
pub use structure::BearingStructure;
pub use twin::{BearingRig, Fidelity, SimulatedRig};
