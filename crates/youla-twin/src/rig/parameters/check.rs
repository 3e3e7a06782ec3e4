//! Ranges in which the parameters have a meaning.

use super::{RigParameters, Rotation, Safety};
use crate::{Error, Result};

impl RigParameters {
    /// Fails for the first value without meaning. Parameters from a file have been checked; those that were changed
    /// afterwards are checked again where they are used.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] naming the key.
    pub fn check(&self) -> Result<()> {
        self.check_bearing()?;
        self.check_timing()?;
        self.check_sensor()?;
        self.check_actuator()?;
        check_rotation(&self.rotation)?;
        self.safety.check()
    }

    fn check_bearing(&self) -> Result<()> {
        let b = &self.bearing;
        finite("bearing.damping", b.damping.value.as_flattened())?;
        finite("bearing.stiffness", b.stiffness.value.as_flattened())?;
        finite("bearing.actuator_gain", b.actuator_gain.value.as_flattened())?;
        positive("bearing.actuator_pole", &b.actuator_pole.value)
    }

    fn check_timing(&self) -> Result<()> {
        positive("timing.sample_time", &[self.timing.sample_time.value])?;
        let substeps = self.timing.substeps.value;
        within("timing.substeps", substeps as f64, 1.0, 1000.0, "a number from 1 to 1000")?;
        within("timing.delay", self.timing.delay.value as f64, 0.0, 1000.0, "a number from 0 to 1000")
    }

    fn check_sensor(&self) -> Result<()> {
        not_negative("sensor.noise", &[self.sensor.noise.value])?;
        if let Some(adc) = &self.sensor.adc {
            within("sensor.adc.bits", adc.bits.value.into(), 2.0, 32.0, "a number from 2 to 32")?;
            positive("sensor.adc.range", &[adc.range.value])?;
            positive("sensor.adc.gain", &[adc.gain.value])?;
        }
        if let Some(filter) = &self.sensor.low_pass {
            positive("sensor.low_pass.frequency", &[filter.frequency.value])?;
            positive("sensor.low_pass.damping", &[filter.damping.value])?;
        }
        Ok(())
    }

    fn check_actuator(&self) -> Result<()> {
        let a = &self.actuator;
        let (low, high) = (a.command_min.value, a.command_max.value);
        finite("actuator.command_min", &[low])?;
        finite("actuator.command_max", &[high])?;
        let inside = a.bias.value > low && a.bias.value < high;
        require("actuator.bias", a.bias.value, inside, "a voltage between command_min and command_max")?;
        if let Some(h) = &a.hysteresis {
            let operators = h.operators.value as f64;
            within("actuator.hysteresis.operators", operators, 1.0, 64.0, "a number from 1 to 64")?;
            within("actuator.hysteresis.width", h.width.value, 0.0, 0.4, "a share from 0 to 0.4")?;
            positive("actuator.hysteresis.unit_gain_amplitude", &[h.unit_gain_amplitude.value])?;
        }
        Ok(())
    }
}

impl Safety {
    /// Fails for the first limit without meaning.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] naming the key.
    pub fn check(&self) -> Result<()> {
        positive("safety.displacement_limit", &[self.displacement_limit.value])?;
        not_negative("safety.ramp_time", &[self.ramp_time.value])?;
        positive("safety.clearance", &[self.clearance.value])?;
        positive("safety.excitation_limit", &[self.excitation_limit.value])
    }
}

fn check_rotation(r: &Rotation) -> Result<()> {
    positive("rotation.max_speed", &[r.max_speed.value])?;
    not_negative("rotation.whirl_ratio", &[r.whirl_ratio.value])?;
    finite("rotation.cross_coupling", &[r.cross_coupling.value])?;
    finite("rotation.gyroscopic", &[r.gyroscopic.value])?;
    finite("rotation.stiffness_growth", &[r.stiffness_growth.value])?;
    positive("rotation.damping_half_speed", &[r.damping_half_speed.value])?;
    not_negative("rotation.eccentricity", &[r.eccentricity.value])?;
    not_negative("rotation.run_out_amplitude", &r.run_out_amplitude.value)?;
    finite("rotation.run_out_angle", &r.run_out_angle.value)?;
    if let Some(mode) = &r.flexible_mode {
        positive("rotation.flexible_mode.frequency", &[mode.frequency.value])?;
        positive("rotation.flexible_mode.damping", &[mode.damping.value])?;
        finite("rotation.flexible_mode.residue", &[mode.residue.value])?;
    }
    Ok(())
}

fn finite(key: &str, values: &[f64]) -> Result<()> {
    values.iter().try_for_each(|&v| require(key, v, v.is_finite(), "a finite number"))
}

fn positive(key: &str, values: &[f64]) -> Result<()> {
    values.iter().try_for_each(|&v| require(key, v, v > 0.0 && v.is_finite(), "a positive number"))
}

fn not_negative(key: &str, values: &[f64]) -> Result<()> {
    values.iter().try_for_each(|&v| require(key, v, v >= 0.0 && v.is_finite(), "a number that is not negative"))
}

fn within(key: &str, value: f64, low: f64, high: f64, must: &'static str) -> Result<()> {
    require(key, value, (low..=high).contains(&value), must)
}

/// Fails unless the condition holds, naming the key.
fn require(key: &str, value: f64, holds: bool, must: &'static str) -> Result<()> {
    if holds { Ok(()) } else { Err(Error::Method(youla::Error::OutOfRange { what: key.to_owned(), value, must })) }
}
