//! The response of a system as a function of frequency, infinity included.

use crate::lti::response::HessenbergSystem;
use crate::lti::{StateSpace, TimeDomain, largest_singular_value};
use crate::{Mat, MatRef, Result, c64};
use std::f64::consts::PI;

/// The response of a system at one frequency at a time.
pub(crate) struct Curve<T: TimeDomain> {
    response: HessenbergSystem<T>,
    d: Mat<f64>,
    end: f64,
}

impl<T: TimeDomain> Curve<T> {
    pub(crate) fn new(system: &StateSpace<T>) -> Result<Self> {
        let end = system.time().sample_time().map_or(f64::INFINITY, |ts| PI / ts);
        Ok(Curve { response: HessenbergSystem::new(system)?, d: system.d().to_owned(), end })
    }

    /// Infinite or Nyquist frequency, rad/s.
    pub(crate) fn end(&self) -> f64 {
        self.end
    }

    /// p x m, at a frequency from zero to the end.
    pub(crate) fn at(&self, frequency: f64) -> Result<Mat<c64>> {
        let (p, m) = (self.d.nrows(), self.d.ncols());
        if frequency.is_infinite() || p * m == 0 {
            return Ok(Mat::from_fn(p, m, |i, j| c64::new(self.d[(i, j)], 0.0)));
        }
        let mut value = vec![c64::new(0.0, 0.0); p * m];
        self.response.fill(&[frequency], &mut value, p * m)?;
        Ok(MatRef::from_column_major_slice(&value, p, m).to_owned())
    }

    /// Largest singular value.
    pub(crate) fn gain(&self, frequency: f64) -> Result<f64> {
        largest_singular_value(self.at(frequency)?.as_ref())
    }
}
