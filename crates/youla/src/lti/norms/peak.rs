//! The largest gain of a system over frequency, `max sigma_max(G(j omega))` or `max sigma_max(G(exp(j omega ts)))`, with a
//! guarantee: N. A. Bruinsma and M. Steinbuch, Syst. Control Lett. 14 (1990), 287; S. Boyd, V. Balakrishnan and P. Kabamba,
//! Math. Control Signals Syst. 2 (1989), 207.
//!
//! 1. A lower bound: the gain at frequency zero, at the other end (infinity or Nyquist) and at the poles.
//! 2. At a level just above it, the imaginary eigenvalues of a Hamiltonian matrix are the frequencies where a singular value
//!    equals the level. If there is none, the level is an upper bound. Otherwise the gain is computed there and half-way
//!    between them, the best of these is the next lower bound, and the step is repeated; it converges quadratically.
//!
//! Rounding moves imaginary eigenvalues off the axis. No threshold therefore decides which of them count: the gain is
//! computed at the imaginary parts of all, and a level is an upper bound where no gain exceeds it.

use super::curve::Curve;
use super::hamiltonian::Crossings;
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Result};

/// Steps before the tolerance is widened, by a factor of two with every further one.
const PATIENCE: usize = 12;

/// Steps in all.
const LIMIT: usize = 60;

/// Distance of a pole from the stability boundary, over the size of the state matrix, that is none.
const ON_BOUNDARY: f64 = 4.0 * f64::EPSILON;

/// Choices of [`hinf_norm`] and [`linf_norm`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct PeakOptions {
    /// Relative distance of the two bounds, 1e-12 to 1.
    pub tolerance: f64,
}

impl Default for PeakOptions {
    fn default() -> Self {
        PeakOptions { tolerance: 1e-9 }
    }
}

/// The largest gain of a system over frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PeakGain {
    /// The gain at `frequency`: a lower bound that is attained.
    pub value: f64,
    /// A level that no gain reaches, by the eigenvalue test: `value` times 1 + tolerance. It is higher only where rounding keeps
    /// the test from passing there.
    pub upper: f64,
    /// Where, rad/s; infinite where the gain of a continuous system is largest at infinite frequency.
    pub frequency: f64,
    /// Eigenvalue tests that were made.
    pub iterations: usize,
}

/// H-infinity norm of a stable system (p x m): its largest gain over frequency, to the tolerance of the options.
///
/// Lightly damped modes need no grid. 1e-9 against closed forms down to a damping ratio of 1e-6, and against SLICOT's AB13DD (tests
/// beside the code). A system without states has the largest singular value of D, one without inputs or outputs zero.
///
/// # Errors
/// [`Error::Unstable`] with the pole (see [`linf_norm`]), [`Error::PoleOnBoundary`] for a pole too near to the boundary to
/// be told from one on it, [`Error::OutOfRange`] for a tolerance.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, PeakOptions, StateSpace, hinf_norm}};
/// let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [-1.0, -0.02]][i][j]);
/// let (b, c) = (Mat::from_fn(2, 1, |i, _| i as f64), Mat::from_fn(1, 2, |_, j| 1.0 - j as f64));
/// let resonance = StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?;
/// let peak = hinf_norm(&resonance, &PeakOptions::default())?;
/// // Damping ratio 0.01: 1 / (2 zeta sqrt(1 - zeta^2)).
/// assert!((peak.value - 50.0 / (1.0 - 1e-4f64).sqrt()).abs() < 1e-7 && peak.value <= peak.upper);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn hinf_norm<T: TimeDomain>(system: &StateSpace<T>, options: &PeakOptions) -> Result<PeakGain> {
    system.balanced()?.require_stable("the system whose H-infinity norm is asked for")?;
    linf_norm(system, options)
}

/// Largest gain over frequency of a system that may be unstable but has no pole on the stability boundary; of a stable system
/// it is the H-infinity norm.
///
/// # Errors
/// [`Error::PoleOnBoundary`] naming the frequency, [`Error::OutOfRange`] for a tolerance.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Continuous, PeakOptions, StateSpace, linf_norm}};
/// let unstable = StateSpace::new(eye(1) * faer::Scale(2.0), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
/// assert_eq!(linf_norm(&unstable, &PeakOptions::default())?.value, 0.5);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn linf_norm<T: TimeDomain>(system: &StateSpace<T>, options: &PeakOptions) -> Result<PeakGain> {
    let tolerance = options.tolerance;
    if !(1e-12..=1.0).contains(&tolerance) {
        let what = "the tolerance of a norm".into();
        return Err(Error::OutOfRange { what, value: tolerance, must: "a number from 1e-12 to 1" });
    }
    let system = system.balanced()?;
    let poles = frequencies_of_poles(&system)?;
    if system.inputs() == 0 || system.outputs() == 0 {
        return Ok(PeakGain { value: 0.0, upper: 0.0, frequency: 0.0, iterations: 0 });
    }
    let mut search = Search::new(&system)?;
    search.start(&poles)?;
    search.raise(tolerance)
}

/// Frequencies at which poles show in the gain: their imaginary part, their magnitude and the resonance between.
pub(super) fn frequencies_of_poles<T: TimeDomain>(system: &StateSpace<T>) -> Result<Vec<f64>> {
    let time = system.time();
    let size = match time.sample_time() {
        Some(_) => system.a().norm_l2().max(1.0),
        None => system.a().norm_l2(),
    };
    let mut all = Vec::new();
    for pole in system.poles()? {
        let s = time.continuous_pole(pole);
        if time.instability(pole).abs() <= ON_BOUNDARY * size {
            return Err(Error::PoleOnBoundary { omega: s.im.abs() });
        }
        let (imaginary, magnitude) = (s.im.abs(), s.re.hypot(s.im));
        let resonance = ((imaginary - s.re.abs()) * (imaginary + s.re.abs())).max(0.0).sqrt();
        all.extend([imaginary, magnitude, resonance]);
    }
    Ok(all)
}

/// The best lower bound so far.
struct Search<'a, T: TimeDomain> {
    system: &'a StateSpace<T>,
    curve: Curve<T>,
    value: f64,
    frequency: f64,
}

impl<'a, T: TimeDomain> Search<'a, T> {
    fn new(system: &'a StateSpace<T>) -> Result<Self> {
        Ok(Search { system, curve: Curve::new(system)?, value: 0.0, frequency: 0.0 })
    }

    /// Step 1.
    fn start(&mut self, poles: &[f64]) -> Result<()> {
        let end = self.curve.end();
        self.visit([0.0, end].into_iter().chain(poles.iter().copied()))?;
        if self.value == 0.0 {
            // More frequencies than a transfer function that is not zero has zeros.
            let reach = poles.iter().copied().fold(1.0, f64::max).min(end);
            let count = 2 * self.system.order() + 2;
            self.visit((1..=count).map(|k| reach * k as f64 / count as f64))?;
        }
        Ok(())
    }

    /// Step 2, until a level is not reached.
    fn raise(mut self, mut tolerance: f64) -> Result<PeakGain> {
        for iterations in 0..LIMIT {
            let upper = self.value * (1.0 + tolerance);
            if self.value == 0.0 || self.system.order() == 0 {
                return Ok(PeakGain { value: self.value, upper, frequency: self.frequency, iterations });
            }
            let crossings = Crossings::at_level(self.system, &self.curve, upper)?;
            self.visit(crossings.frequencies())?;
            if self.value <= upper {
                let iterations = iterations + 1;
                return Ok(PeakGain { value: self.value, upper, frequency: self.frequency, iterations });
            }
            if iterations >= PATIENCE {
                tolerance = (2.0 * tolerance).min(1.0);
            }
        }
        Err(Error::NoConvergence { what: "the largest gain over frequency".into(), iterations: LIMIT })
    }

    fn visit(&mut self, frequencies: impl IntoIterator<Item = f64>) -> Result<()> {
        for frequency in frequencies {
            let frequency = frequency.clamp(0.0, self.curve.end());
            let gain = self.curve.gain(frequency)?;
            if gain > self.value {
                (self.value, self.frequency) = (gain, frequency);
            }
        }
        Ok(())
    }
}
