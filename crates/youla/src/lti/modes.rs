//! The modes of a system: natural frequency `|s| / 2 pi` and damping ratio `zeta = -Re s / |s|` of its poles, where
//! `s = ln(z) / ts` for a discrete pole z.

use super::{StateSpace, TimeDomain};
use crate::Result;
use crate::linalg::{balance, eigenvalues};
use faer::c64;
use std::f64::consts::TAU;

/// One real pole or one conjugate pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Natural frequency, Hz; infinite for a discrete pole at zero.
    pub hz: f64,
    /// Damping ratio: 1 for a decaying real pole, 0 on the stability boundary, negative where the mode grows.
    pub zeta: f64,
    /// The pole in the domain of the system (rad/s or z), imaginary part not negative.
    pub pole: c64,
}

impl<T: TimeDomain> StateSpace<T> {
    /// The modes in the order of their natural frequencies, one per real pole and one per conjugate pair.
    ///
    /// # Errors
    /// [`crate::Error::NoConvergence`] of the eigenvalues.
    ///
    /// ```
    /// use youla::{Mat, linalg::eye, lti::{Continuous, StateSpace}};
    /// let a = Mat::from_fn(2, 2, |i, j| [[0.0, 100.0], [-100.0, -10.0]][i][j]);
    /// let oscillator = StateSpace::new(a, eye(2), eye(2), Mat::zeros(2, 2), Continuous)?;
    /// let modes = oscillator.modes()?;
    /// assert_eq!(modes.len(), 1);
    /// assert!((modes[0].zeta - 0.05).abs() < 1e-12);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn modes(&self) -> Result<Vec<Mode>> {
        let balanced = balance("the state matrix", self.a())?;
        let poles = eigenvalues("the state matrix", balanced.a.as_ref())?;
        let mut modes: Vec<Mode> = poles.into_iter().filter(|p| p.im >= 0.0).map(|p| mode(self.time(), p)).collect();
        modes.sort_by(|l, r| l.hz.total_cmp(&r.hz).then(l.zeta.total_cmp(&r.zeta)));
        Ok(modes)
    }
}

/// The mode of one pole.
pub fn mode<T: TimeDomain>(time: T, pole: c64) -> Mode {
    let s = time.continuous_pole(pole);
    let size = s.re.hypot(s.im);
    let zeta = match size {
        0.0 => 0.0,
        f64::INFINITY => 1.0,
        _ => -s.re / size,
    };
    Mode { hz: size / TAU, zeta, pole }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::eye;
    use crate::lti::{Continuous, Discrete};
    use faer::Mat;

    #[test]
    fn boundary_and_unstable_poles_have_modes() {
        let a = Mat::from_fn(2, 2, |i, j| if i == j { [0.0, 3.0][i] } else { 0.0 });
        let modes = StateSpace::new(a.clone(), eye(2), eye(2), eye(2), Continuous).unwrap().modes().unwrap();
        assert_eq!((modes[0].hz, modes[0].zeta, modes[1].zeta), (0.0, 0.0, -1.0));
        let modes = StateSpace::new(a, eye(2), eye(2), eye(2), Discrete::new(1.0).unwrap()).unwrap().modes().unwrap();
        assert_eq!((modes[0].zeta, modes[1].hz, modes[1].zeta), (-1.0, f64::INFINITY, 1.0));
    }
}
