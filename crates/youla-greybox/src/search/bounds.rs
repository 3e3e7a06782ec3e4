//! Bounds of the parameters, and which of them hold a parameter back.
//!
//! At a bound the minimum is where the gradient g of the criterion points outward, `g_j >= 0` at a lower and `g_j <= 0` at
//! an upper one, and is zero for all other parameters (J. Nocedal and S. J. Wright, Numerical Optimization, 2nd ed.,
//! Springer 2006, section 16.7). A parameter that its bound holds back in this sense stays for the next step.

use crate::prediction::linearisation::Linearisation;
use crate::structure::Structure;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// A parameter that ended at a bound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AtBound {
    /// Its name.
    pub parameter: String,
    /// Which bound.
    pub side: Side,
    /// The bound.
    pub value: f64,
}

/// One of the two bounds of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The smallest value.
    Lower,
    /// The largest value.
    Upper,
}

/// Smallest and largest values, checked.
pub(crate) struct Bounds {
    names: Vec<String>,
    limits: Vec<(f64, f64)>,
}

impl Bounds {
    /// Those of a structure; `start`, of the right length, must lie within them.
    pub(crate) fn new(structure: &dyn Structure, start: &[f64]) -> Result<Self> {
        let (names, limits) = (structure.names(), structure.bounds());
        if limits.len() != names.len() {
            let what = "the number of bounds of the structure".into();
            return Err(Error::Method(youla::Error::Ports { what, expected: names.len(), found: limits.len() }));
        }
        for ((name, (min, max)), value) in names.iter().zip(&limits).zip(start) {
            let (name, min, max) = (name.clone(), *min, *max);
            if min.partial_cmp(&max) != Some(std::cmp::Ordering::Less) {
                return Err(Error::EmptyBounds { name, min, max });
            }
            if !(min..=max).contains(value) {
                return Err(Error::OutsideBounds { name, value: *value, min, max });
            }
        }
        Ok(Bounds { names, limits })
    }

    /// The same with parameters behind them that have no bounds, up to these names.
    pub(crate) fn extended(mut self, names: &[String]) -> Self {
        self.limits.resize(names.len(), (f64::NEG_INFINITY, f64::INFINITY));
        self.names = names.to_vec();
        self
    }

    /// The parameters that no bound holds back.
    pub(crate) fn free(&self, theta: &[f64], here: &Linearisation) -> Vec<usize> {
        let downhill = |j: usize| (here.jacobian().col(j).transpose() * here.residual())[0];
        let held = |j: &usize| match self.side(*j, theta[*j]) {
            Some(Side::Lower) => downhill(*j) <= 0.0,
            Some(Side::Upper) => downhill(*j) >= 0.0,
            None => false,
        };
        (0..theta.len()).filter(|j| !held(j)).collect()
    }

    /// The bound beyond which a value of a parameter lies.
    pub(crate) fn crossed(&self, parameter: usize, value: f64) -> Option<f64> {
        let (min, max) = self.limits[parameter];
        if value < min {
            Some(min)
        } else if value > max {
            Some(max)
        } else {
            None
        }
    }

    /// The parameters that are at a bound.
    pub(crate) fn touched(&self, theta: &[f64]) -> Vec<AtBound> {
        let touched = |(j, value): (usize, &f64)| {
            let side = self.side(j, *value)?;
            Some(AtBound { parameter: self.names[j].clone(), side, value: *value })
        };
        theta.iter().enumerate().filter_map(touched).collect()
    }

    fn side(&self, parameter: usize, value: f64) -> Option<Side> {
        let (min, max) = self.limits[parameter];
        if value <= min {
            Some(Side::Lower)
        } else if value >= max {
            Some(Side::Upper)
        } else {
            None
        }
    }
}
