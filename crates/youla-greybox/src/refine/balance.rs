//! The states in which local coordinates are laid: balanced ones, of the predictor where there is one.
//!
//! ```text
//! P = L_c L_c',  Q = L_o L_o',   L_o' L_c = U S V',   x = T z,   T = L_c V S^(-1/2),   T^-1 = S^(-1/2) U' L_o'
//! ```

use crate::Result;
use youla::Mat;
use youla::linalg::{block, discrete_gramian_factor};
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
            Some((t, inverse)) => {
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
fn transformation(model: &StateSpace<Discrete>, gain: Option<&Mat<f64>>) -> Option<(Mat<f64>, Mat<f64>)> {
    let (a, b) = match gain {
        None => (model.a().to_owned(), model.b().to_owned()),
        Some(k) => {
            let b = block(&[&[(model.b() - k * model.d()).as_ref(), k.as_ref()]]);
            (model.a() - k * model.c(), b)
        }
    };
    let reached = discrete_gramian_factor(a.as_ref(), b.as_ref()).ok()?.l;
    let seen = discrete_gramian_factor(a.transpose(), model.c().transpose()).ok()?.l;
    let svd = (seen.transpose() * &reached).svd().ok()?;
    let sigma: Vec<f64> = svd.S().column_vector().iter().copied().collect();
    let (largest, smallest) = (sigma.first()?, sigma.last()?);
    // Written so that values that are not numbers are refused too.
    let usable = *smallest > NEGLIGIBLE * largest;
    if !usable {
        return None;
    }
    let n = sigma.len();
    let (v, u) = (svd.V(), svd.U());
    let right = Mat::from_fn(n, n, |i, j| v[(i, j)] / sigma[j].sqrt());
    let left = Mat::from_fn(n, n, |i, j| u[(j, i)] / sigma[i].sqrt());
    Some((reached * right, left * seen.transpose()))
}
