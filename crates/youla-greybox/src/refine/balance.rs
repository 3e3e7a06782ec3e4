//! The states in which local coordinates are laid: balanced ones, of the predictor where there is one.

use crate::Result;
use youla::Mat;
use youla::linalg::{block, gramian_balancing};
use youla::lti::{Discrete, StateSpace};

/// Smallest over largest Hankel singular value below which states are only scaled.
const NEGLIGIBLE: f64 = 1e-10;

/// A model with its gain.
pub(super) struct Balanced {
    pub(super) model: StateSpace<Discrete>,
    pub(super) gain: Option<Mat<f64>>,
}

impl Balanced {
    /// Balances what is stable and minimal; any other model gets scaled states.
    pub(super) fn new(model: &StateSpace<Discrete>, gain: Option<Mat<f64>>) -> Result<Self> {
        match transformation(model, gain.as_ref()) {
            Some([t, inverse]) => {
                let (a, b) = (&inverse * model.a() * &t, &inverse * model.b());
                let balanced = StateSpace::new(a, b, model.c() * &t, model.d().to_owned(), model.time())?;
                Ok(Balanced { model: balanced, gain: gain.map(|k| inverse * k) })
            }
            None => {
                let scales = model.state_scales()?;
                let scaled = |k: Mat<f64>| Mat::from_fn(k.nrows(), k.ncols(), |i, j| k[(i, j)] / scales[i]);
                Ok(Balanced { model: model.with_scaled_states(&scales), gain: gain.map(scaled) })
            }
        }
    }
}

/// T and its inverse.
fn transformation(model: &StateSpace<Discrete>, gain: Option<&Mat<f64>>) -> Option<[Mat<f64>; 2]> {
    let (a, b) = match gain {
        None => (model.a().to_owned(), model.b().to_owned()),
        Some(k) => {
            let b = block(&[&[(model.b() - k * model.d()).as_ref(), k.as_ref()]]);
            (model.a() - k * model.c(), b)
        }
    };
    gramian_balancing([a.as_ref(), b.as_ref(), model.c()], NEGLIGIBLE)
}
