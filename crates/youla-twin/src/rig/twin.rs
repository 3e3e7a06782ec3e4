//! The digital twin: plant, valves and sensors, sample by sample, at three levels of fidelity.

use super::drive::{Actuation, Drive};
use super::motion::{FineMotion, LinearMotion, linear_part};
use super::parameters::RigParameters;
use super::sensor::Sensors;
use super::speed::bearing_at_speed;
use crate::Result;
use serde::{Deserialize, Serialize};
use youla::Mat;
use youla::linalg::eye;
use youla::lti::{Continuous, Discrete, StateSpace};

/// How much of a real rig is simulated; each level includes the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(tag = "level", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Fidelity {
    /// The paper's model: linear, 0 rpm, white noise on the outputs.
    #[default]
    Linear,
    /// With bandwidth and converter of the sensors, limits and hysteresis of the valves, and the delay.
    Instrumented,
    /// With what a turning shaft adds.
    Rotating {
        /// Speed in revolutions per minute.
        rpm: f64,
    },
}

/// A machine under a sampled controller. Every sample: measure, compute, actuate.
pub trait SimulatedRig {
    /// The clock.
    fn time(&self) -> Discrete;

    /// What the sensors say now, um. Called once per sample: each call draws new noise.
    fn measure(&mut self) -> [f64; 2];

    /// Sends the command u, V, and lets one sample pass.
    fn actuate(&mut self, u: [f64; 2]) -> Actuation;
}

/// The gas bearing of [`RigParameters`] as a [`SimulatedRig`], at rest at first.
///
/// The same parameters, level, seed and commands give the same bits. Nothing is allocated per sample. The linear level is
/// the exact zero-order-hold discretisation (held to 1e-12 by `the_linear_level_is_the_closed_loop`); above it the plant
/// moves in substeps, 20 us with the parameters that ship.
///
/// ```
/// use youla_twin::rig::{BearingRig, Fidelity, SimulatedRig, RigParameters};
/// let mut rig = BearingRig::new(&RigParameters::shipped(), Fidelity::Rotating { rpm: 2500.0 }, 1)?;
/// let y = rig.measure();
/// let step = rig.actuate([-0.1 * y[0], 7.0]);
/// assert_eq!((step.applied[1], step.saturated), (5.0, [false, true]));
/// # Ok::<(), youla_twin::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct BearingRig {
    time: Discrete,
    /// The linear part from u to y, without the delay.
    plant: StateSpace<Continuous>,
    delay: usize,
    machine: Machine,
    sensors: Sensors,
    displacement: [f64; 2],
}

#[derive(Debug, Clone)]
enum Machine {
    Linear(LinearMotion),
    Real { drive: Drive, motion: Box<FineMotion> },
}

impl BearingRig {
    /// A rig; `seed` is that of the sensor noise, which has random streams of its own.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] for a parameter or a speed without meaning.
    pub fn new(parameters: &RigParameters, fidelity: Fidelity, seed: u64) -> Result<Self> {
        parameters.check()?;
        match fidelity {
            Fidelity::Linear => Self::linear(parameters, seed),
            Fidelity::Instrumented => Self::real(parameters, None, seed),
            Fidelity::Rotating { rpm } => Self::real(parameters, Some(rpm), seed),
        }
    }

    fn linear(parameters: &RigParameters, seed: u64) -> Result<Self> {
        let time = Discrete::new(parameters.timing.sample_time.value)?;
        let plant = parameters.bearing.model().plant()?;
        let machine = Machine::Linear(LinearMotion::new(&plant, time)?);
        let sensors = Sensors::ideal(parameters, seed);
        Ok(BearingRig { time, plant, delay: 0, machine, sensors, displacement: [0.0; 2] })
    }

    fn real(parameters: &RigParameters, rpm: Option<f64>, seed: u64) -> Result<Self> {
        let flexible = rpm.and(parameters.rotation.flexible_mode.as_ref());
        let rpm_or_still = rpm.unwrap_or(0.0);
        let bearing = match rpm {
            Some(rpm) => bearing_at_speed(parameters, rpm)?,
            None => parameters.bearing.model(),
        };
        let linear = linear_part(&bearing, flexible, parameters.sensor.low_pass.as_ref())?;
        let motion = Box::new(FineMotion::new(parameters, &linear, rpm_or_still)?);
        let sensors = match rpm {
            Some(_) => Sensors::of_turning_shaft(parameters, seed),
            None => Sensors::converted(parameters, seed),
        };
        Ok(BearingRig {
            time: Discrete::new(parameters.timing.sample_time.value)?,
            plant: linear.part(0..2, 0..2),
            delay: parameters.timing.delay.value,
            machine: Machine::Real { drive: Drive::new(parameters), motion },
            sensors,
            displacement: [0.0; 2],
        })
    }

    /// The linear part from u to y with sensors and delay: what an identified model should come near. Exact at the linear
    /// level; above it hysteresis counts with gain 1, and limits and disturbances are left out.
    ///
    /// # Errors
    /// Those of [`StateSpace::zoh`].
    pub fn true_plant(&self) -> Result<StateSpace<Discrete>> {
        let one_sample = StateSpace::new(Mat::zeros(2, 2), eye(2), eye(2), Mat::zeros(2, 2), self.time)?;
        let sampled = self.plant.zoh(self.time)?;
        Ok((0..self.delay).try_fold(sampled, |plant, _| one_sample.then(&plant))?)
    }
}

impl SimulatedRig for BearingRig {
    fn time(&self) -> Discrete {
        self.time
    }

    #[inline]
    fn measure(&mut self) -> [f64; 2] {
        let angle = match &self.machine {
            Machine::Linear(_) => 0.0,
            Machine::Real { motion, .. } => motion.angle(),
        };
        self.sensors.read(self.displacement, angle)
    }

    #[inline]
    fn actuate(&mut self, u: [f64; 2]) -> Actuation {
        match &mut self.machine {
            Machine::Linear(motion) => {
                self.displacement = motion.advance(u);
                Actuation { applied: u, saturated: [false; 2] }
            }
            Machine::Real { drive, motion } => {
                let actuation = drive.limit(u);
                self.displacement = motion.advance(drive.delayed(actuation.applied));
                actuation
            }
        }
    }
}
