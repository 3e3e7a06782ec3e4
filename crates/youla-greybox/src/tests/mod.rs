mod closure;
mod estimates;
mod gradient;
mod limits;
mod noise;

pub(super) use gradient::{comparison, gradient_error};

use crate::{DeclaredStructure, Structure, Template};
use faer::Mat;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::sync::LazyLock;
use youla::identify::subspace::Experiment;
use youla::lti::{Discrete, simulate};
use youla::signal::{Excitation, SquareWaves};

/// An open-loop experiment on the bearing.
struct OpenLoop {
    u: Mat<f64>,
    y: Mat<f64>,
}

impl OpenLoop {
    fn experiment(&self) -> Experiment<'_> {
        Experiment::new(self.u.as_ref(), self.y.as_ref())
    }
}

fn time() -> Discrete {
    Discrete::new(2e-4).unwrap()
}

/// The bearing of the paper as a declared structure.
pub(super) fn bearing() -> &'static DeclaredStructure {
    static BEARING: LazyLock<DeclaredStructure> =
        LazyLock::new(|| DeclaredStructure::new(&Template::Bearing.declaration().unwrap()).unwrap());
    &BEARING
}

/// Its parameters.
pub(super) fn truth() -> Vec<f64> {
    bearing().start()
}

/// Square waves of 0.5 V, white output noise of `deviation` um per output.
fn open_loop(samples: usize, deviation: [f64; 2], x0: &[f64; 6], seed: u64) -> OpenLoop {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let waves = SquareWaves { amplitude: 0.5, hold_min: 5, hold_max: 40 };
    let u = Excitation::SquareWaves(waves).generate(samples, 2, time(), &mut rng).unwrap();
    let plant = bearing().model(&truth()).unwrap().zoh(time()).unwrap();
    let clean = simulate(&plant, u.as_ref(), x0).unwrap();
    let y = Mat::from_fn(samples, 2, |k, i| clean[(k, i)] + deviation[i] * rng.sample::<f64, _>(StandardNormal));
    OpenLoop { u, y }
}

/// Every parameter off by up to `share` of itself, in either direction.
pub(super) fn off(theta: &[f64], share: f64, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    theta.iter().map(|v| v * (1.0 + share * (2.0 * rng.random::<f64>() - 1.0))).collect()
}
