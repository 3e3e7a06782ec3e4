//! The modes of a model that its response shows, with their residues, and how many others there are.
//!
//! A pole is no mode of the machine where zeros cancel it, which the factors of the Hansen scheme cause, where it is at or above the
//! Nyquist frequency, as every real pole below z = 0, and where it is a sample of delay, at z = 0.

use super::modes::Mode;
use super::{Discrete, Eigen, StateSpace, TimeDomain, frequency_response};
use crate::{Result, c64};
use std::f64::consts::TAU;

/// A mode is cancelled where its part of the response at its own frequency is smaller, for each output over all inputs together:
/// 3 % (0.26 dB) for a resonance, which a plot shows from there on, 20 % (1.6 dB) for a mode of at least this damping ratio.
///
/// In G(S) of both demos and of two measured machines this leaves out ten poles, none of which the machine has; of the poles that
/// the factors added some remain.
const CANCELLED: f64 = 0.03;
const CANCELLED_IF_DAMPED: f64 = 0.2;
const DAMPED: f64 = 0.1;

/// Distance from the unit circle at which responses are compared, so that an integrator has one.
const OUTSIDE: f64 = 1e-6;

/// A mode that the response shows.
#[derive(Debug, Clone, PartialEq)]
pub struct VisibleMode {
    /// The mode.
    pub mode: Mode,
    /// Its place in [`StateSpace::modes`].
    pub place: usize,
    /// Residue `C v w' B`, output by output the values of all inputs; of equal poles the sum.
    pub residue: Vec<c64>,
}

/// The modes that the response shows, by natural frequency, and the numbers of the others.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VisibleModes {
    /// The modes.
    pub modes: Vec<VisibleMode>,
    /// Modes that zeros cancel.
    pub cancelled: usize,
    /// Modes at or above the Nyquist frequency.
    pub above_nyquist: usize,
}

impl StateSpace<Discrete> {
    /// The modes that the response shows.
    ///
    /// A mode is cancelled where its part of the response at its own frequency is below 3 %, of a mode with a damping ratio of 0.1 or
    /// more below 20 %, for each output.
    ///
    /// # Errors
    /// [`crate::Error::NoConvergence`] of the eigenvalues; those of the frequency response.
    pub fn visible_modes(&self) -> Result<VisibleModes> {
        let (eigen, ts) = (Eigen::new(self)?, self.time().ts());
        let groups: Vec<&[usize]> = eigen.complete_groups().collect();
        // Both lists are computed from A by themselves: the nearest pole is the same one.
        let nearest = |pole: c64| {
            let distance = |k: &usize| (eigen.poles()[*k] - pole).norm();
            (0..eigen.poles().len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
        };
        let mut found = VisibleModes::default();
        for (place, mode) in self.modes()?.into_iter().enumerate().filter(|(_, m)| m.hz.is_finite()) {
            // As many steps as rounding of the frequency takes: a real pole below zero is at the Nyquist frequency or above.
            if mode.hz * ts >= 0.5 * (1.0 - 1e-9) {
                found.above_nyquist += 1;
                continue;
            }
            let group = nearest(mode.pole).and_then(|k| groups.iter().find(|group| group.contains(&k)));
            let residue = group.map(|group| self.residue_of(&eigen, group));
            match residue {
                Some(residue) if self.is_cancelled(&mode, &residue)? => found.cancelled += 1,
                residue => found.modes.push(VisibleMode { mode, place, residue: residue.unwrap_or_default() }),
            }
        }
        Ok(found)
    }

    fn residue_of(&self, eigen: &Eigen, group: &[usize]) -> Vec<c64> {
        let mut sum = vec![c64::ZERO; self.outputs() * self.inputs()];
        for k in group {
            let (c, b) = eigen.directions(*k, self);
            let products = c.iter().flat_map(|c| b.iter().map(move |b| c * b));
            sum.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
        }
        sum
    }

    fn is_cancelled(&self, mode: &Mode, residue: &[c64]) -> Result<bool> {
        let ts = self.time().ts();
        let omega = TAU * (mode.hz * ts).max(OUTSIDE) / ts;
        // G(rho z) is the response of the system with A / rho and B / rho.
        let rho = 1.0 + OUTSIDE;
        let [a, b] = [self.a(), self.b()].map(|m| m * faer::Scale(1.0 / rho));
        let outside = StateSpace::new(a, b, self.c().to_owned(), self.d().to_owned(), self.time())?;
        let response = frequency_response(&outside, &[omega])?;
        let z = self.time().boundary(omega) * rho;
        let part = |r: &c64| {
            let pair = if mode.pole.im > 0.0 { r.conj() / (z - mode.pole.conj()) } else { c64::ZERO };
            (r / (z - mode.pole) + pair).norm_sqr()
        };
        let limit = if mode.zeta.abs() < DAMPED { CANCELLED } else { CANCELLED_IF_DAMPED };
        let shows = |output: usize| {
            let own: f64 = residue[output * self.inputs()..(output + 1) * self.inputs()].iter().map(part).sum();
            let whole: f64 = (0..self.inputs()).map(|j| response.at(0)[(output, j)].norm_sqr()).sum();
            own > limit.powi(2) * whole
        };
        Ok(!(0..self.outputs()).any(shows))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mat;

    /// Modal blocks beside each other from one input to one output: `(a, b, c)` of each, poles in rows.
    fn parallel(blocks: &[(&[f64], f64)]) -> StateSpace<Discrete> {
        let n: usize = blocks.iter().map(|(poles, _)| poles.len()).sum();
        let (mut a, mut b, mut c) = (Mat::zeros(n, n), Mat::zeros(n, 1), Mat::zeros(1, n));
        let mut at = 0;
        for (pole, gain) in blocks {
            match *pole {
                [real] => a[(at, at)] = *real,
                [re, im] => {
                    (a[(at, at)], a[(at + 1, at + 1)]) = (*re, *re);
                    (a[(at, at + 1)], a[(at + 1, at)]) = (*im, -im);
                }
                _ => unreachable!("a pole or a pair"),
            }
            (b[(at, 0)], c[(0, at)]) = (1.0, *gain);
            at += pole.len();
        }
        StateSpace::new(a, b, c, Mat::zeros(1, 1), Discrete::new(0.01).unwrap()).unwrap()
    }

    #[test]
    fn cancelled_modes_and_those_above_the_nyquist_frequency_are_counted_only() {
        let blocks: [(&[f64], f64); 5] =
            [(&[0.9, 0.3], 1.0), (&[0.7, 0.5], 1e-4), (&[-0.6], 1.0), (&[0.0], 1.0), (&[0.8], 0.5)];
        let found = parallel(&blocks).visible_modes().unwrap();
        let poles: Vec<c64> = found.modes.iter().map(|m| m.mode.pole).collect();
        assert_eq!((found.cancelled, found.above_nyquist, poles.len()), (1, 1, 2), "{poles:?}");
        assert!(poles.iter().any(|p| (p - c64::new(0.9, 0.3)).norm() < 1e-12));
        let residue = found.modes.iter().find(|m| m.mode.pole.im > 0.0).map(|m| m.residue[0]);
        // (z - 0.9) / ((z - 0.9)^2 + 0.09) has the residue 1/2 at either pole.
        assert!(residue.is_some_and(|r| (r - c64::new(0.5, 0.0)).norm() < 1e-12), "{residue:?}");
    }

    /// An integrator above all frequencies hides no pole behind it, and is no cancelled one.
    #[test]
    fn an_integrator_with_a_lag_has_both_modes() {
        let found = parallel(&[(&[1.0], 1.0), (&[0.99], -1.0)]).visible_modes().unwrap();
        assert_eq!((found.modes.len(), found.cancelled), (2, 0));
    }

    /// Of two equal poles without an eigenvector each, none is left out.
    #[test]
    fn defective_poles_are_kept() {
        let a = Mat::from_fn(2, 2, |i, j| [[0.9, 1.0], [0.0, 0.9]][i][j]);
        let (b, c) = (Mat::from_fn(2, 1, |i, _| i as f64), Mat::from_fn(1, 2, |_, j| 1.0 - j as f64));
        let system = StateSpace::new(a, b, c, Mat::zeros(1, 1), Discrete::new(1.0).unwrap()).unwrap();
        assert_eq!(system.visible_modes().unwrap().modes.len(), 2);
    }
}
