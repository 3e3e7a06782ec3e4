//! PID controllers `kp + ki/s + kd s/(1 + filter s)` as they are programmed (K. J. Åström, T. Hägglund, Advanced PID Control, ISA,
//! 2006, section 13.4): with `q = z^-1`,
//!
//! ```text
//!                    integral                          filtered derivative
//! backward Euler     ki ts / (1 - q)                   kd (1 - q) / (filter + ts - filter q)
//! Tustin             ki ts/2 (1 + q) / (1 - q)         2 kd (1 - q) / (2 filter + ts + (ts - 2 filter) q)
//! ```
//!
//! and notches behind them, by Tustin's rule with the frequency w of the notch kept (R. Bristow-Johnson, Cookbook formulae for audio
//! EQ biquad filter coefficients):
//!
//! ```text
//! s^2 + 2 depth width w s + w^2        1 + a depth - 2 cos(w ts) q + (1 - a depth) q^2
//! ----------------------------    ->   -----------------------------------------------,      a = width sin(w ts)
//! s^2 + 2 width w s + w^2              1 + a - 2 cos(w ts) q + (1 - a) q^2
//! ```

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use youla::linalg::block_diagonal;
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef, Result, c64};

/// How the integral and the derivative part of a PID are programmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Discretisation {
    /// Backward differences, `s = (1 - z^-1)/ts`: the integral includes the error of the present sample.
    BackwardEuler,
    /// Tustin's rule, `s = 2/ts (1 - z^-1)/(1 + z^-1)`.
    Tustin,
}

/// Gains of a PID in its parallel form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PidGains {
    /// The rule by which integral and derivative are programmed.
    pub discretisation: Discretisation,
    /// Proportional gain, unit of u per unit of y.
    pub kp: f64,
    /// Integral gain, per second.
    pub ki: f64,
    /// Derivative gain, seconds.
    pub kd: f64,
    /// Time constant of the filter of the derivative, seconds.
    pub derivative_filter: f64,
}

impl PidGains {
    /// Integral and derivative as gain, numerator and denominator in ascending powers of `z^-1`.
    pub fn parts(&self, ts: f64) -> [(f64, [f64; 2], [f64; 2]); 2] {
        let filter = self.derivative_filter;
        match self.discretisation {
            Discretisation::BackwardEuler => {
                [(self.ki, [ts, 0.0], [1.0, -1.0]), (self.kd, [1.0, -1.0], [filter + ts, -filter])]
            }
            Discretisation::Tustin => {
                let derivative = (self.kd, [2.0, -2.0], [2.0 * filter + ts, ts - 2.0 * filter]);
                [(self.ki, [0.5 * ts, 0.5 * ts], [1.0, -1.0]), derivative]
            }
        }
    }

    /// From the error to the command, with a state for each part that is there.
    ///
    /// # Errors
    /// Those of [`StateSpace::difference_equation`].
    pub fn system(&self, time: Discrete) -> Result<StateSpace<Discrete>> {
        let mut sum = StateSpace::gain(Mat::from_fn(1, 1, |_, _| self.kp), time)?;
        for (gain, numerator, denominator) in self.parts(time.ts()) {
            if gain != 0.0 {
                let numerator = vec![vec![numerator.map(|b| gain * b).to_vec()]];
                sum =
                    sum.plus(&StateSpace::difference_equation(&numerator, &vec![vec![denominator.to_vec()]], time)?)?;
            }
        }
        Ok(sum)
    }
}

/// The controllers of all channels as one, `u = K y`, positive feedback.
pub(super) fn whole(of: &[PidController], time: Discrete) -> Result<StateSpace<Discrete>> {
    diagonal(&of.iter().map(|c| c.system(time)).collect::<Result<Vec<_>>>()?)
}

/// Systems of one sample time side by side, each from its inputs to its outputs.
///
/// # Errors
/// Those of [`StateSpace::new`].
///
/// # Panics
/// When there is none.
pub fn diagonal(of: &[StateSpace<Discrete>]) -> Result<StateSpace<Discrete>> {
    let join = |pick: fn(&StateSpace<Discrete>) -> MatRef<'_, f64>| {
        of.iter().fold(Mat::zeros(0, 0), |sum: Mat<f64>, s| block_diagonal(sum.as_ref(), pick(s)))
    };
    StateSpace::new(join(|s| s.a()), join(|s| s.b()), join(|s| s.c()), join(|s| s.d()), of[0].time())
}

/// A notch behind a PID.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Notch {
    /// Frequency, Hz.
    pub hz: f64,
    /// Damping ratio of its poles.
    pub width: f64,
    /// Gain at its frequency, 1 for none.
    pub depth: f64,
}

impl Notch {
    /// Numerator and denominator in ascending powers of `z^-1`, the first coefficient of the denominator being 1.
    pub fn coefficients(&self, ts: f64) -> [[f64; 3]; 2] {
        let (sin, cos) = (TAU * self.hz * ts).sin_cos();
        let a = self.width * sin;
        let by = 1.0 / (1.0 + a);
        [
            [(1.0 + a * self.depth) * by, -2.0 * cos * by, (1.0 - a * self.depth) * by],
            [1.0, -2.0 * cos * by, (1.0 - a) * by],
        ]
    }
}

/// A PID with notches behind it and the dead time of its machine; negative feedback, `u = C (r - y)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PidController {
    /// The gains.
    #[serde(flatten)]
    pub gains: PidGains,
    /// The notches.
    pub notches: Vec<Notch>,
    /// Dead time in whole samples, beyond what the controller itself delays.
    pub delay: usize,
}

impl PidController {
    /// `u = K y`, K = -C, positive feedback.
    ///
    /// # Errors
    /// Those of [`StateSpace::difference_equation`].
    pub fn system(&self, time: Discrete) -> Result<StateSpace<Discrete>> {
        let mut chain = self.gains.system(time)?.negated();
        for notch in &self.notches {
            let [numerator, denominator] = notch.coefficients(time.ts()).map(|c| vec![vec![c.to_vec()]]);
            chain = chain.then(&StateSpace::difference_equation(&numerator, &denominator, time)?)?;
        }
        chain.delayed(self.delay)
    }

    /// Numerator and monic denominator at `q = z^-1`, C being their quotient; that of a part that is not there is 1.
    pub(super) fn at(&self, ts: f64, q: c64) -> [c64; 2] {
        let line = |c: &[f64]| c.iter().rev().fold(c64::ZERO, |sum, c| sum * q + *c);
        let (mut numerator, mut denominator) = (c64::new(self.gains.kp, 0.0), c64::ONE);
        for (gain, b, a) in self.gains.parts(ts) {
            if gain != 0.0 {
                let (b, a) = (line(&b.map(|c| gain * c / a[0])), line(&a.map(|c| c / a[0])));
                numerator = numerator * a + denominator * b;
                denominator *= a;
            }
        }
        for notch in &self.notches {
            let [b, a] = notch.coefficients(ts);
            numerator *= line(&b);
            denominator *= line(&a);
        }
        [numerator * q.powu(self.delay as u32), denominator]
    }
}
