//! The gains of a PID as the parameters of flight controllers and drives, with the scale factors of their firmware.
//!
//! | firmware | what it computes | its units |
//! |---|---|---|
//! | Betaflight 4.3 to 4.5 | `0.032029 p e + 0.244381 i int(e) + 0.000529 d de/dt` (`pid.h`) | e in deg/s; axisP + axisI + axisD of the blackbox |
//! | PX4, multicopter rate controller | `K (P e + I int(e) + D de/dt)` | e in rad/s; `vehicle_torque_setpoint`, -1 to 1 |
//! | ArduPilot, Copter rate controller | `P e + I int(e) + D de/dt`, D behind a first-order filter of FLTD Hz (`AC_PID.cpp`) | e in rad/s; the motors' roll input, -1 to 1 |
//! | ODrive 0.5 and later, velocity controller | `vel_gain e + vel_integrator_gain int(e)` | e in turn/s; Nm |

use super::pid::PidExport;
use super::second_order::{SecondOrder, second_order};
use super::text::number;
use crate::error::{Error, Result};
use std::fmt::Write;
use std::path::PathBuf;

/// Firmware with parameters for a PID.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Firmware {
    /// `set` lines of the command line.
    Betaflight,
    /// `param set` lines of the shell.
    Px4,
    /// A parameter file.
    ArduPilot,
    /// Assignments of odrivetool.
    Odrive,
}

/// Scale of P, I and D in Betaflight, and its largest gain (`pid.h`).
const BETAFLIGHT: ([f64; 3], f64) = ([0.032029, 0.244381, 0.000529], 250.0);

/// Largest peak sensitivity with PX4's filter, in that of the design.
const MOST_PEAK: f64 = 1.1;

impl Firmware {
    /// The word of `youla export --to`.
    pub(super) fn key(self) -> &'static str {
        match self {
            Firmware::Betaflight => "betaflight",
            Firmware::Px4 => "px4",
            Firmware::ArduPilot => "ardupilot",
            Firmware::Odrive => "odrive",
        }
    }

    /// Units of y and u in which its parameters are stated.
    fn units(self) -> [&'static str; 2] {
        match self {
            Firmware::Betaflight => ["deg/s", "axisP + axisI + axisD of the blackbox"],
            Firmware::Px4 => ["rad/s", "vehicle_torque_setpoint (-1 to 1)"],
            Firmware::ArduPilot => ["rad/s", "the motors' input of the axis (-1 to 1)"],
            Firmware::Odrive => ["turn/s", "Nm"],
        }
    }

    /// What its derivative is filtered by, for a first-order filter of `hz`.
    fn filter(self, pid: &PidExport, hz: f64) -> Result<Vec<String>> {
        Ok(match self {
            Firmware::Betaflight => {
                vec!["set dterm_lpf1_type = PT1".into(), format!("set dterm_lpf1_static_hz = {}", hz.round())]
            }
            Firmware::Px4 => return cutoff_of_px4(pid, hz),
            Firmware::ArduPilot => vec![format!("ATC_RAT_RLL_FLTD,{}", number(hz))],
            Firmware::Odrive => Vec::new(),
        })
    }

    fn gains(self, [p, i, d]: [f64; 3]) -> Vec<String> {
        let n = number;
        match self {
            Firmware::Betaflight => {
                let gain = |(name, (gain, scale)): (&str, (f64, f64))| {
                    let exact = gain / scale;
                    format!(
                        "set {name}_roll = {}    # exactly {exact:.3}; {} is {} times {scale}",
                        exact.round(),
                        n(gain),
                        n(exact)
                    )
                };
                ["p", "i", "d"].into_iter().zip([p, i, d].into_iter().zip(BETAFLIGHT.0)).map(gain).collect()
            }
            Firmware::Px4 => [("P", p), ("I", i), ("D", d), ("K", 1.0)]
                .into_iter()
                .map(|(name, gain)| format!("param set MC_ROLLRATE_{name} {}", n(gain)))
                .collect(),
            Firmware::ArduPilot => [("P", p), ("I", i), ("D", d), ("FLTE", 0.0)]
                .into_iter()
                .map(|(name, gain)| format!("ATC_RAT_RLL_{name},{}", n(gain)))
                .collect(),
            Firmware::Odrive => [("vel_gain", p), ("vel_integrator_gain", i)]
                .into_iter()
                .map(|(name, gain)| format!("odrv0.axis0.controller.config.{name} = {}", n(gain)))
                .collect(),
        }
    }

    /// Least and largest gain in the descriptions of its parameters, which ground stations show and the firmware does not enforce: PX4 1.14
    /// (`mc_rate_control_params.c`), ArduCopter 4.5 (`AC_AttitudeControl_Multi.cpp`).
    fn described(self) -> Option<[[f64; 2]; 3]> {
        match self {
            Firmware::Px4 => Some([[0.01, 0.5], [0.0, f64::INFINITY], [0.0, 0.01]]),
            Firmware::ArduPilot => Some([[0.01, 0.5], [0.01, 2.0], [0.0, 0.05]]),
            Firmware::Betaflight | Firmware::Odrive => None,
        }
    }

    /// What its descriptions say of gains beyond their ranges.
    fn beyond(self, gains: [f64; 3]) -> Vec<String> {
        let all = ["P", "I", "D"].into_iter().zip(gains).zip(self.described().into_iter().flatten());
        let beyond = all.filter(|((_, gain), [least, most])| *gain != 0.0 && !(*least..=*most).contains(gain));
        let word = |((name, gain), [least, most]): ((&str, f64), [f64; 2])| {
            let range = if most.is_finite() { format!("{least} to {most}") } else { format!("from {least}") };
            format!(
                "# caution: {name} is {}, its description says {range}: check the units of y and u before it is flown",
                number(gain)
            )
        };
        beyond.map(word).collect()
    }

    /// Why it cannot hold these gains.
    fn problem(self, pid: &PidExport) -> Option<String> {
        let gains = [("kp", pid.kp), ("ki", pid.ki), ("kd", pid.kd)];
        let (key, unit, [stated, _]) = (self.key(), &pid.measured.unit, self.units());
        if !unit.is_empty() && unit != stated {
            return Some(format!(
                "y is in {unit}, but {key} takes {stated}; convert it in [data.computed] and identify again"
            ));
        }
        if let Some((name, gain)) = gains.iter().find(|(_, gain)| *gain < 0.0) {
            return Some(format!(
                "{name} is {}, but {key} takes no negative gain; invert the sign of one channel",
                number(*gain)
            ));
        }
        if self == Firmware::Odrive && (pid.kd != 0.0 || !pid.notches.is_empty()) {
            return Some(format!(
                "{key} has neither derivative nor notch; set terms = \"pi\" and notches = 0 in [redesign.pid]"
            ));
        }
        let (scales, largest) = BETAFLIGHT;
        let over = gains.into_iter().zip(scales).find(|((_, gain), scale)| gain / scale > largest);
        let ((name, gain), scale) = over.filter(|_| self == Firmware::Betaflight)?;
        let asked = number((gain / scale).round());
        let remedy = match unit.is_empty() {
            true => "log y in deg/s and u as axisP + axisI + axisD, and state the unit of y in [data]",
            false => {
                "a lower peak_sensitivity or a larger phase margin in [redesign.pid] gives smaller gains; u must be axisP + axisI + axisD"
            }
        };
        Some(format!("{name} is {asked} in {key}, at most {largest} are taken; {remedy}"))
    }
}

/// The lines, behind what every form says of itself.
pub(super) fn table(pid: &PidExport, head: &[String], firmware: Firmware) -> Result<String> {
    if let Some(problem) = firmware.problem(pid) {
        return Err(Error::NotAModel { path: PathBuf::from("pid.json"), problem });
    }
    let [y, u] = firmware.units();
    let mut text = head.iter().map(|line| format!("# {line}\n")).collect::<String>();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "# holds where y was logged in {y} and u as {u}: scale factor 1; otherwise scale the channels in [data.computed]"
    );
    let _ = writeln!(
        text,
        "# the firmware has a discretisation and filters of its own: fly or run it with care, log it, and identify again"
    );
    if firmware != Firmware::Odrive {
        text.push_str("# of the roll axis; write pitch or yaw for another\n");
    }
    let gains = [pid.kp, pid.ki, pid.kd];
    let mut lines = firmware.beyond(gains);
    lines.extend(firmware.gains(gains));
    if pid.kd != 0.0 && pid.derivative_filter > 0.0 {
        lines.extend(firmware.filter(pid, 0.5 / (std::f64::consts::PI * pid.derivative_filter))?);
    }
    for ([hz, width, depth], _) in &pid.notches {
        let [hz, width, depth] = [hz, width, depth].map(|v| number(*v));
        lines.push(format!("# and a notch at {hz} Hz, width {width}, depth {depth}, which this table does not set: without it the proof does not hold"));
    }
    lines.iter().for_each(|line| text.push_str(&format!("{line}\n")));
    Ok(text)
}

/// The cutoff of PX4's filter of second order, which takes the place of that of the design, of first order at `first`, Hz.
fn cutoff_of_px4(pid: &PidExport, first: f64) -> Result<Vec<String>> {
    let path = || PathBuf::from("pid.json");
    let Some(plant) = &pid.plant else {
        let problem = "the derivative filter of PX4 is of second order, and this run has no model with one input and one output on which it could be \
                       judged; set terms = \"pi\" in [redesign.pid]";
        return Err(Error::NotAModel { path: path(), problem: problem.into() });
    };
    match second_order(pid, plant, first)? {
        Some(SecondOrder { hz, peak, designed }) if peak <= MOST_PEAK * designed => Ok(vec![
            format!(
                "# IMU_DGYRO_CUTOFF is a filter of second order for all axes: with it the peak sensitivity on the model is {peak:.2}, {designed:.2} with \
                 the filter of the design, first order at {first:.2} Hz"
            ),
            format!("param set IMU_DGYRO_CUTOFF {hz:.1}"),
        ]),
        found => {
            let most = found.map_or("leaves the model unstable".to_owned(), |f| {
                format!("raises the peak sensitivity on the model from {:.2} to {:.2}", f.designed, f.peak)
            });
            let problem = format!(
                "the derivative is filtered by first order at {first:.2} Hz, that of PX4 by second order, whose best cutoff {most}; set terms = \"pi\" or a \
                 larger command_effort in [redesign.pid], which moves the filter up"
            );
            Err(Error::NotAModel { path: path(), problem })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use youla::lti::{Discrete, StateSpace};
    use youla::signal::Channel;

    fn pid() -> PidExport {
        PidExport {
            name: "pid".into(),
            measured: Channel::new("gyro", "deg/s"),
            commanded: Channel::new("sum", ""),
            ts: 5e-4,
            kp: 1.5,
            ki: 20.0,
            kd: 0.015,
            derivative_filter: 1.0 / (std::f64::consts::TAU * 80.0),
            tustin: false,
            integral: [0.01, 0.0],
            derivative: [6.0, 0.8],
            notches: vec![([180.0, 0.3, 0.1], [[1.0; 3]; 2])],
            delay: 0,
            reference_filter: 0.0,
            reference_weights: [1.0; 2],
            plant: None,
            origin: "a run".into(),
        }
    }

    #[test]
    fn gains_are_divided_by_the_scale_factors_of_the_firmware() {
        let text = table(&pid(), &[], Firmware::Betaflight).unwrap();
        for line in [
            "set p_roll = 47 ",
            "set i_roll = 82 ",
            "set d_roll = 28 ",
            "set dterm_lpf1_static_hz = 80\n",
            "notch at 180.0 Hz",
        ] {
            assert!(text.contains(line), "{text}");
        }
        let si = PidExport { measured: Channel::new("gyro", "rad/s"), ..pid() };
        let text = table(&si, &[], Firmware::ArduPilot).unwrap();
        assert!(text.contains("ATC_RAT_RLL_D,0.015\n") && text.contains("ATC_RAT_RLL_FLTD,80."), "{text}");
    }

    /// A rate of 1 / s behind a dead time of 2 samples at 2 kHz: the fast filter of the design has a near enough one of second order, a run without the model has
    /// none.
    #[test]
    fn the_filter_of_px4_is_judged_on_the_model() {
        let of = |ts: f64, filter_hz: f64| {
            let time = Discrete::new(ts).unwrap();
            let line = |c: &[f64]| vec![vec![c.to_vec()]];
            let plant =
                StateSpace::difference_equation(&line(&[0.0, 0.0, 0.0, ts]), &line(&[1.0, -1.0]), time).unwrap();
            let lag = 1.0 / (std::f64::consts::TAU * filter_hz);
            let derivative = [0.1 / (lag + ts), lag / (lag + ts)];
            PidExport {
                measured: Channel::new("gyro", "rad/s"),
                ts,
                kp: 25.0,
                ki: 0.0,
                kd: 0.1,
                derivative_filter: lag,
                integral: [0.0; 2],
                derivative,
                notches: Vec::new(),
                plant: Some(plant),
                ..pid()
            }
        };
        let text = table(&of(5e-4, 200.0), &[], Firmware::Px4).unwrap();
        let cutoff = text.lines().find_map(|line| line.strip_prefix("param set IMU_DGYRO_CUTOFF ")).unwrap();
        assert!(cutoff.parse::<f64>().unwrap() >= 200.0, "{text}");
        let without = table(&PidExport { plant: None, ..of(5e-4, 200.0) }, &[], Firmware::Px4).unwrap_err().to_string();
        assert!(without.contains("no model"), "{without}");
    }

    #[test]
    fn what_a_firmware_cannot_hold_is_refused() {
        let refused = |pid: PidExport, firmware, says: &str| {
            let error = table(&pid, &[], firmware).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        };
        refused(pid(), Firmware::Px4, "y is in deg/s, but px4 takes rad/s");
        refused(PidExport { kp: -1.0, ..pid() }, Firmware::Betaflight, "no negative gain");
        refused(PidExport { kp: 9.0, ..pid() }, Firmware::Betaflight, "kp is 281.0 in betaflight, at most 250");
        let turns = PidExport { measured: Channel::new("v", "turn/s"), ..pid() };
        refused(turns, Firmware::Odrive, "terms = \"pi\"");
    }
}
