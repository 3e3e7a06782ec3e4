//! What happens to an unstable estimate of A: refused, allowed, or its unstable poles reflected by name.
//!
//! A reflected pole is `z -> 1 / conj(z)`, which keeps its frequency and the magnitude of its response. Only the unstable
//! modes change: with right and left eigenvectors v, w of A, `A+ = A + sum (z+ - z) v w' / (w' v)`.

use crate::identify::subspace::Stability;
use crate::identify::subspace::output_pair::OutputPair;
use crate::linalg::{Eigenvectors, check_finite, eigenvalues};
use crate::lti::{Discrete, TimeDomain};
use crate::{Error, Result};
use faer::{Mat, c64};

/// Largest magnitude of a reflected pole, for poles on the unit circle itself.
const LARGEST_REFLECTED: f64 = 1.0 - 1e-6;

/// What is refused, and what keeps it.
const KEPT: &str = "the estimated model (stability = \"allow\" keeps an unstable one)";

/// A pole that was changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovedPole {
    /// As estimated.
    pub from: c64,
    /// As returned.
    pub to: c64,
}

/// The poles of the model and what was done to them.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilityReport {
    /// Poles of the returned model.
    pub poles: Vec<c64>,
    /// The largest of them.
    pub worst: c64,
    /// Whether all lie inside of the unit circle.
    pub stable: bool,
    /// Poles that were reflected; empty unless constraining was asked for and needed.
    pub moved: Vec<MovedPole>,
}

/// Applies the choice to an estimate.
pub(super) fn apply(choice: Stability, pair: OutputPair, time: Discrete) -> Result<(OutputPair, StabilityReport)> {
    let report = inspect(&pair, time)?;
    match choice {
        _ if report.stable => Ok((pair, report)),
        Stability::Require => Err(Error::Unstable { what: KEPT.into(), pole: report.worst }),
        Stability::Allow => Ok((pair, report)),
        Stability::Constrain => constrain(pair, &report, time),
    }
}

fn inspect(pair: &OutputPair, time: Discrete) -> Result<StabilityReport> {
    let poles = eigenvalues("the estimated state matrix", pair.a.as_ref())?;
    let worst = poles.iter().copied().fold(c64::new(0.0, 0.0), |w, p| if p.norm() > w.norm() { p } else { w });
    Ok(StabilityReport { poles, worst, stable: time.instability(worst) < 0.0, moved: Vec::new() })
}

fn constrain(pair: OutputPair, before: &StabilityReport, time: Discrete) -> Result<(OutputPair, StabilityReport)> {
    let unstable = |z: &c64| time.instability(*z) >= 0.0;
    let (a, moved) = move_poles(&pair, |z| if unstable(&z) { reflect(z) } else { z })?;
    let pair = OutputPair { a, c: pair.c };
    let after = inspect(&pair, time)?;
    if !after.stable {
        return Err(Error::Unstable { what: "the estimated model with reflected poles".into(), pole: before.worst });
    }
    Ok((pair, StabilityReport { moved, ..after }))
}

fn reflect(z: c64) -> c64 {
    z / z.norm() * (1.0 / z.norm()).min(LARGEST_REFLECTED)
}

/// Replaces the eigenvalues that `target` changes, and nothing else.
fn move_poles(pair: &OutputPair, target: impl Fn(c64) -> c64) -> Result<(Mat<f64>, Vec<MovedPole>)> {
    let Eigenvectors { values, right, left, .. } = Eigenvectors::of("the estimated state matrix", pair.a.as_ref())?;
    let n = pair.a.nrows();
    let mut a = pair.a.clone();
    let mut moved = Vec::new();
    for (k, from) in values.into_iter().enumerate() {
        let to = target(from);
        if to != from {
            moved.push(MovedPole { from, to });
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                a[(i, j)] += ((to - from) * right[(i, k)] * left[(k, j)]).re;
            }
        }
    }
    check_finite("the state matrix with reflected poles", a.as_ref())?;
    Ok((a, moved))
}
