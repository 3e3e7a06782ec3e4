//! The distance of two plants by what a controller makes of them (G. Vinnicombe, Frequency domain uncertainty and the graph
//! topology, IEEE Trans. Autom. Control 38 (1993), 1371; Uncertainty and Feedback, 2001).
//!
//! With normalised coprime factors `G = N M^-1 = Mt^-1 Nt` (`M~M + N~N = I`, `Mt Mt~ + Nt Nt~ = I`) and, at each frequency,
//!
//! ```text
//! psi = Mt2 N1 - Nt2 M1          sigma_max(psi) = sigma_max((I + G2 G2*)^(-1/2) (G1 - G2) (I + G1* G1)^(-1/2))
//! Phi = M2~ M1 + N2~ N1          psi* psi + Phi* Phi = I
//!
//! nu-gap = max over omega of sigma_max(psi)   where det Phi has winding number zero, otherwise 1
//! ```
//!
//! A controller K stabilises every plant within a gap of less than b(G, K), and
//! `asin b(G2, K) >= asin b(G1, K) - asin nu-gap(G1, G2)`. All of this depends on the units of the channels: see
//! [`ChannelScales`]. The factors exist for unstable plants and for poles on the stability boundary alike.

mod factors;
#[cfg(test)]
mod reference_tests;
mod scales;
#[cfg(test)]
mod tests;

pub(crate) use factors::{normalised_left_factors, normalised_right_factors};
pub use scales::ChannelScales;

use super::margins::Loop;
use crate::linalg::{block, eigenvalues, eye};
use crate::lti::{Continuous, PeakGain, PeakOptions, StateSpace, TimeDomain, continuous_image, hinf_norm};
use crate::{Error, Mat, Result};
use faer::Scale;

/// Pointwise gap from which two plants count as farthest apart: det Phi is zero there to working precision.
const FARTHEST: f64 = 1.0 - 1e-12;

/// The nu-gap of two plants.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NuGap {
    /// The nu-gap, 0 to 1.
    pub value: f64,
    /// Largest pointwise gap, with its frequency and its bounds. The nu-gap where `winding` is zero.
    pub pointwise: PeakGain,
    /// Winding number of det Phi; where it is not zero no controller can be sure of both plants, and the nu-gap is 1. `None`
    /// where the pointwise gap is 1 already.
    pub winding: Option<i64>,
}

/// Normalised coprime margin b(G, K) of a plant under `u = K y` (positive feedback), 0 to 1:
///
/// ```text
/// b(G, K) = 1 / max over omega of sigma_max([I; K] (I - G K)^-1 [I, G]),      0 where the loop is unstable
/// ```
///
/// A lower bound to 1e-9. It depends on the units of the channels: see [`ChannelScales`].
///
/// # Errors
/// Ports, sample times and [`Error::AlgebraicLoop`] of [`super::closed_loop`].
///
/// ```
/// use youla::{Mat, control::coprime_margin, linalg::eye, lti::{Continuous, StateSpace}};
/// // 1 / s under u = -y: 1 / sqrt 2, the best there is.
/// let integrator = StateSpace::new(Mat::zeros(1, 1), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
/// let gain = StateSpace::gain(Mat::from_fn(1, 1, |_, _| -1.0), Continuous)?;
/// assert!((coprime_margin(&integrator, &gain)? - 0.5f64.sqrt()).abs() < 1e-8);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn coprime_margin<T: TimeDomain>(plant: &StateSpace<T>, controller: &StateSpace<T>) -> Result<f64> {
    match Loop::new(plant, controller) {
        Ok(closed) => closed.coprime_margin(),
        Err(Error::NotStabilising { .. }) => Ok(0.0),
        Err(other) => Err(other),
    }
}

/// The nu-gap of two plants with the same channels.
///
/// The pointwise gap lies between the bounds of [`hinf_norm`]; the winding number is a count of eigenvalues: `det Phi` has as many
/// zeros beyond the stability boundary as poles. Symmetric, and a metric (`tests::the_gap_is_a_metric`).
///
/// # Errors
/// [`Error::Ports`], [`Error::SampleTimeMismatch`]; [`Error::NotStabilisable`] or [`Error::NotDetectable`] for a plant with a mode that is not
/// stable and that no input moves or no output shows; those of the Riccati equations.
///
/// ```
/// use youla::{Mat, control::nu_gap, linalg::eye, lti::{Continuous, StateSpace}};
/// let lag = |pole: f64| StateSpace::new(Mat::from_fn(1, 1, |_, _| pole), eye(1), eye(1), Mat::zeros(1, 1), Continuous);
/// // Stable and unstable, yet near: 2000 / (1 + 1000^2).
/// let gap = nu_gap(&lag(0.001)?, &lag(-0.001)?)?;
/// assert!((gap.value - 2000.0 / 1000001.0).abs() < 1e-9);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn nu_gap<T: TimeDomain>(first: &StateSpace<T>, second: &StateSpace<T>) -> Result<NuGap> {
    check_channels(first, second)?;
    let (right, left) = (normalised_right_factors(first)?, normalised_left_factors(second)?);
    let pointwise = hinf_norm(&right.then(&left.map_input(&graph_of_complement(first)))?, &PeakOptions::default())?;
    if pointwise.value >= FARTHEST {
        return Ok(NuGap { value: 1.0, pointwise, winding: None });
    }
    let winding = winding_number(&right, &normalised_right_factors(second)?)?;
    let value = if winding == 0 { pointwise.value } else { 1.0 };
    Ok(NuGap { value, pointwise, winding: Some(winding) })
}

fn check_channels<T: TimeDomain>(first: &StateSpace<T>, second: &StateSpace<T>) -> Result<()> {
    for (what, found, expected) in [
        ("the number of inputs of the second plant", second.inputs(), first.inputs()),
        ("the number of outputs of the second plant", second.outputs(), first.outputs()),
    ] {
        if found != expected {
            return Err(Error::Ports { what: what.into(), expected, found });
        }
    }
    first.check_time("the gap of two plants", second)
}

/// P of `[Mt, Nt] P = [-Nt, Mt]`.
fn graph_of_complement<T: TimeDomain>(plant: &StateSpace<T>) -> Mat<f64> {
    let (m, p) = (plant.inputs(), plant.outputs());
    block(&[
        &[Mat::zeros(p, m).as_ref(), eye(p).as_ref()],
        &[(Scale(-1.0) * eye(m)).as_ref(), Mat::zeros(m, p).as_ref()],
    ])
}

/// Zeros less poles of det Phi beyond the stability boundary, from `[M1; N1]` and `[M2; N2]`: `det Phi = det D det(s I - Az) /
/// det(s I - A)` with `Az = A - B D^-1 C`, and half of the poles of Phi, those of `[M2; N2]~`, lie beyond.
fn winding_number<T: TimeDomain>(first: &StateSpace<T>, second: &StateSpace<T>) -> Result<i64> {
    let (first, second) = (continuous_image(first)?, continuous_image(second)?);
    let phi = first.then(&conjugate(&second)?)?;
    let zeros = eigenvalues("the winding number of a gap", phi.inverse()?.balanced()?.a())?;
    let beyond = zeros.into_iter().filter(|z| z.re > 0.0).count();
    Ok(beyond as i64 - second.order() as i64)
}

/// `G~(s) = G(-s)'`.
fn conjugate(system: &StateSpace<Continuous>) -> Result<StateSpace<Continuous>> {
    let dual = system.dual();
    let minus = Scale(-1.0);
    StateSpace::new(minus * dual.a(), dual.b().to_owned(), minus * dual.c(), dual.d().to_owned(), Continuous)
}
