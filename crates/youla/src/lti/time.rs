//! The time domain as a type: the only place where continuous and discrete systems differ.

use crate::{Error, Result};
use faer::c64;
use std::fmt::Debug;

/// Continuous or discrete time.
pub trait TimeDomain: Copy + Debug + PartialEq + Send + Sync + 'static {
    /// The point of the stability boundary that belongs to the angular frequency `omega` in rad/s:
    /// `j omega` in continuous, `exp(j omega ts)` in discrete time.
    fn boundary(&self, omega: f64) -> c64;

    /// Distance of a pole beyond the stability boundary: `re p` in continuous, `|p| - 1` in discrete time.
    /// Negative means stable; zero counts as unstable.
    fn instability(&self, pole: c64) -> f64;

    /// The continuous-time pole in rad/s: itself, or `ln(z) / ts`.
    fn continuous_pole(&self, pole: c64) -> c64;

    /// Sample time in seconds, `None` in continuous time.
    fn sample_time(&self) -> Option<f64>;
}

/// Continuous time: poles in rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Continuous;

/// Discrete time with a sample time in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Discrete {
    ts: f64,
}

impl Discrete {
    /// Discrete time with sample time `ts` in seconds.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless `ts` is positive and finite.
    pub fn new(ts: f64) -> Result<Self> {
        if ts > 0.0 && ts.is_finite() {
            Ok(Discrete { ts })
        } else {
            Err(Error::OutOfRange { what: "the sample time".into(), value: ts, must: "a positive number of seconds" })
        }
    }

    /// Sample time in seconds.
    pub fn ts(&self) -> f64 {
        self.ts
    }
}

impl TimeDomain for Continuous {
    fn boundary(&self, omega: f64) -> c64 {
        c64::new(0.0, omega)
    }

    fn instability(&self, pole: c64) -> f64 {
        pole.re
    }

    fn continuous_pole(&self, pole: c64) -> c64 {
        pole
    }

    fn sample_time(&self) -> Option<f64> {
        None
    }
}

impl TimeDomain for Discrete {
    fn boundary(&self, omega: f64) -> c64 {
        c64::new(0.0, omega * self.ts).exp()
    }

    fn instability(&self, pole: c64) -> f64 {
        pole.norm() - 1.0
    }

    fn continuous_pole(&self, pole: c64) -> c64 {
        pole.ln() / self.ts
    }

    fn sample_time(&self) -> Option<f64> {
        Some(self.ts)
    }
}
