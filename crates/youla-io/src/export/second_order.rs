//! The cutoff of a derivative filter of second order that stands for one of first order.
//!
//! PX4 filters the rate, of which it takes the derivative, by a Butterworth filter of second order through Tustin's rule with its cutoff kept:
//! `b (1 + q)^2 / (1 + a_1 q + a_2 q^2)` with `c = tan(pi f ts)`, `n = 1 + 2^0.5 c + c^2`, `b = c^2 / n`, `a_1 = 2 (c^2 - 1) / n`,
//! `a_2 = (1 - 2^0.5 c + c^2) / n`. No cutoff makes the same controller: the one with the lowest peak sensitivity on the model is taken.

use super::pid::PidExport;
use youla::control::peak_sensitivity;
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, Result};

/// Cutoffs that are tried, from that of the first order up.
const CUTOFFS: usize = 40;
/// Ratio of one cutoff to the next.
const STEP: f64 = 1.1;
/// Largest cutoff as a share of the sample rate: the filter ends at a half.
const LARGEST: f64 = 0.45;

/// A cutoff with what it does to the loop of the model.
pub(super) struct SecondOrder {
    /// Cutoff, Hz.
    pub(super) hz: f64,
    /// Peak sensitivity with it.
    pub(super) peak: f64,
    /// That of the design.
    pub(super) designed: f64,
}

/// The best cutoff on a plant with one input and one output, from that of the design, Hz, up; `None` where none stabilises it.
pub(super) fn second_order(pid: &PidExport, plant: &StateSpace<Discrete>, first: f64) -> Result<Option<SecondOrder>> {
    let [d0, d1] = pid.derivative;
    let time = plant.time();
    let designed = peak_sensitivity(plant, &law(pid, (vec![d0, -d0], vec![1.0, -d1]), time)?)?;
    let cutoffs = (0..CUTOFFS).map(|k| first * STEP.powi(k as i32)).filter(|hz| hz * pid.ts < LARGEST);
    let of = |hz: f64| Some((hz, peak_sensitivity(plant, &law(pid, butterworth(pid, hz), time).ok()?).ok()?));
    let best = cutoffs.filter_map(of).min_by(|a, b| a.1.total_cmp(&b.1));
    Ok(best.map(|(hz, peak)| SecondOrder { hz, peak, designed }))
}

/// Numerator and denominator of the derivative in powers of `q = z^-1`.
fn butterworth(pid: &PidExport, hz: f64) -> (Vec<f64>, Vec<f64>) {
    let c = (std::f64::consts::PI * hz * pid.ts).tan();
    let (root, n) = (std::f64::consts::SQRT_2 * c, 1.0 + std::f64::consts::SQRT_2 * c + c * c);
    let gain = pid.kd / pid.ts * c * c / n;
    // (1 - q) (1 + q)^2
    let numerator = [1.0, 1.0, -1.0, -1.0].map(|b| gain * b).to_vec();
    (numerator, vec![1.0, 2.0 * (c * c - 1.0) / n, (1.0 - root + c * c) / n])
}

/// `u = K y` with a derivative.
fn law(pid: &PidExport, derivative: (Vec<f64>, Vec<f64>), time: Discrete) -> Result<StateSpace<Discrete>> {
    let fraction =
        |b: &[f64], a: &[f64]| StateSpace::difference_equation(&vec![vec![b.to_vec()]], &vec![vec![a.to_vec()]], time);
    let gain = StateSpace::gain(Mat::from_fn(1, 1, |_, _| pid.kp), time)?;
    let mut sum = gain.plus(&fraction(&derivative.0, &derivative.1)?)?;
    if pid.integral != [0.0; 2] {
        sum = sum.plus(&fraction(&pid.integral, &[1.0, -1.0])?)?;
    }
    let notched = pid.notches.iter().try_fold(sum.negated(), |k, (_, [b, a])| k.then(&fraction(b, a)?))?;
    (0..pid.delay).try_fold(notched, |k, _| k.then(&fraction(&[0.0, 1.0], &[1.0])?))
}
