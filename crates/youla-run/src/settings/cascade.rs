//! A velocity loop inside a position loop with feedforward, as servo drives compute it, in one difference equation.
//!
//! ```text
//! v = P (r - y) + kv D r          D = (1 - z^-1) / ts
//! u = V (v - W y) + ka D^2 r      W: slope of y behind the filter of the velocity
//! ```
//! P and V are PID. With `P = Bp / Ap` and likewise V and W, negative feedback,
//!
//! ```text
//! Ap Av Aw u = T r - S y,     S = Bv (Bp Aw + Bw Ap),     T = Bv Aw (Bp + kv D Ap) + ka D^2 Ap Av Aw
//! ```

use super::feedback::Feedback;
use super::pid::{Discretisation, Pid};
use serde::{Deserialize, Serialize};
use youla_loop::redesign::structured::PidGains;

/// Position and velocity loop of a drive, one measured position; the velocity is its slope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cascade {
    /// Sign in which the controller is written down; never guessed.
    pub feedback: Feedback,
    /// The rule by which integrals, derivatives and the slope of the position were programmed.
    pub discretisation: Discretisation,
    /// From the error of the position to the velocity that is asked for.
    pub position: CascadeGains,
    /// From the error of the velocity to the command.
    pub velocity: CascadeGains,
    /// Time constant of the filter of the measured velocity, seconds.
    #[serde(default)]
    pub velocity_filter: f64,
    /// Part of the slope of the reference that is added to the velocity that is asked for; 1 for all of it.
    #[serde(default)]
    pub velocity_feedforward: f64,
    /// Command per second difference of the reference over the square of the sample time.
    #[serde(default)]
    pub acceleration_feedforward: f64,
    /// Dead time in whole samples, beyond what the controller itself delays.
    #[serde(default)]
    pub delay: usize,
}

/// Gains of one loop of a cascade, `kp + ki/s + kd s/(1 + derivative_filter s)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CascadeGains {
    /// Proportional gain.
    pub kp: f64,
    /// Integral gain, per second.
    #[serde(default)]
    pub ki: f64,
    /// Derivative gain, seconds.
    #[serde(default)]
    pub kd: f64,
    /// Time constant of the filter of the derivative, seconds.
    #[serde(default)]
    pub derivative_filter: f64,
}

impl Cascade {
    /// The three systems of the cascade: position controller, velocity controller, slope of the position.
    fn parts(&self) -> [Pid; 3] {
        let pid = |CascadeGains { kp, ki, kd, derivative_filter: filter }: CascadeGains| Pid {
            discretisation: self.discretisation,
            kp,
            ki,
            kd,
            filter,
            integral_time: None,
        };
        let slope = CascadeGains { kp: 0.0, ki: 0.0, kd: 1.0, derivative_filter: self.velocity_filter };
        [self.position, self.velocity, slope].map(pid)
    }

    pub(super) fn problem(&self) -> Option<String> {
        let feedforward = [self.velocity_feedforward, self.acceleration_feedforward];
        if !feedforward.iter().all(|k| k.is_finite()) {
            return Some("[controller.cascade] has a feedforward that is no finite number".into());
        }
        self.parts().iter().find_map(Pid::problem)
    }

    /// Denominator, path from the position and path from the reference of the difference equation of the cascade at a sample time in seconds,
    /// ascending powers of `z^-1`.
    pub(super) fn polynomials(&self, ts: f64) -> [Vec<f64>; 3] {
        let [(bp, ap), (bv, av), (bw, aw)] = self.parts().map(|pid| quotient(&pid.gains(), ts));
        let slope = [1.0 / ts, -1.0 / ts];
        let scaled = |gain: f64, c: &[f64]| c.iter().map(|c| gain * c).collect::<Vec<_>>();
        let denominator = product(&product(&ap, &av), &aw);
        let from_output = product(&bv, &sum(&product(&bp, &aw), &product(&bw, &ap)));
        let asked = sum(&bp, &product(&scaled(self.velocity_feedforward, &slope), &ap));
        let acceleration = scaled(self.acceleration_feedforward, &product(&slope, &slope));
        let from_reference = sum(&product(&product(&bv, &aw), &asked), &product(&acceleration, &denominator));
        // With positive feedback the whole law has the other sign: u = K (y - r) and what is beside it.
        let sign = if self.feedback == Feedback::Negative { 1.0 } else { -1.0 };
        [denominator, from_output, scaled(sign, &from_reference)]
    }
}

/// Numerator and denominator of a PID in ascending powers of `z^-1`.
fn quotient(gains: &PidGains, ts: f64) -> (Vec<f64>, Vec<f64>) {
    let parts = gains.parts(ts).into_iter().filter(|(gain, ..)| *gain != 0.0);
    parts.fold((vec![gains.kp], vec![1.0]), |(b, a), (gain, numerator, denominator)| {
        let added = product(&a, &numerator.map(|c| gain * c));
        (sum(&product(&b, &denominator), &added), product(&a, &denominator))
    })
}

fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut c = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        b.iter().enumerate().for_each(|(j, b)| c[i + j] += a * b);
    }
    c
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    let at = |c: &[f64], k: usize| c.get(k).copied().unwrap_or(0.0);
    (0..a.len().max(b.len())).map(|k| at(a, k) + at(b, k)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The command by the difference equation is that of the two loops, sample by sample, as a drive computes them.
    #[test]
    fn the_difference_equation_is_the_cascade() {
        let ts = 0.01;
        let gains = |kp, ki| CascadeGains { kp, ki, kd: 0.0, derivative_filter: 0.0 };
        let cascade = Cascade {
            feedback: Feedback::Negative,
            discretisation: Discretisation::BackwardEuler,
            position: gains(8.0, 0.0),
            velocity: gains(0.5, 3.0),
            velocity_filter: 0.02,
            velocity_feedforward: 0.9,
            acceleration_feedforward: 0.05,
            delay: 0,
        };
        let [r, s, t] = cascade.polynomials(ts);
        let (mut u, mut y, mut reference) = (Vec::new(), Vec::new(), Vec::new());
        let (mut filtered, mut integral) = (0.0, 0.0);
        for k in 0..200 {
            let time = k as f64 * ts;
            y.push((7.0 * time).sin() + 0.1 * time);
            reference.push((3.0 * time).cos() - 1.0);
            let at = |v: &[f64], lag: usize| if k >= lag { v[k - lag] } else { 0.0 };
            // The drive.
            let slope = (at(&y, 0) - at(&y, 1)) / ts;
            filtered += ts / (0.02 + ts) * (slope - filtered);
            let asked = 8.0 * (at(&reference, 0) - at(&y, 0)) + 0.9 * (at(&reference, 0) - at(&reference, 1)) / ts;
            let error = asked - filtered;
            integral += ts * error;
            let curvature = (at(&reference, 0) - 2.0 * at(&reference, 1) + at(&reference, 2)) / ts.powi(2);
            let drive = 0.5 * error + 3.0 * integral + 0.05 * curvature;
            // The difference equation.
            let along = |c: &[f64], v: &[f64]| c.iter().enumerate().map(|(lag, c)| c * at(v, lag)).sum::<f64>();
            u.push(0.0);
            let command = (along(&t, &reference) - along(&s, &y) - along(&r, &u)) / r[0];
            u[k] = command;
            assert!((command - drive).abs() < 1e-9 * (1.0 + drive.abs()), "row {k}: {command} and {drive}");
        }
    }
}
