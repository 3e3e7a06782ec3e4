//! The weighted projection of the future outputs along the past, its singular values and the observability matrix.

use super::Weight;
use super::hankel::HankelFactor;
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Directions of the future outputs below this share of the largest are noise-free to working precision and cannot be
/// whitened.
const WHITENING_TOLERANCE: f64 = 1e-10;

/// The singular value decomposition of the weighted projection.
pub(super) struct Projection {
    /// Descending, one per row of the observability matrix.
    pub(super) singular_values: Vec<f64>,
    /// Whether they are canonical correlations.
    canonical: bool,
    /// Columns span the observability matrix in the order of the singular values, orthonormal.
    basis: Mat<f64>,
}

impl Projection {
    /// `Gamma` for order n, with orthonormal columns.
    pub(super) fn observability(&self, order: usize) -> MatRef<'_, f64> {
        self.basis.as_ref().subcols(0, order)
    }
}

/// Singular values and observability matrix for a weight.
pub(super) fn project(factor: &HankelFactor, weight: Weight) -> Result<Projection> {
    match weight {
        Weight::Cva => canonical(factor),
        _ => unweighted(factor),
    }
}

/// Canonical correlations: cosines of the angles between past and future, freed of the future inputs; those of the projection
/// where it has them.
pub(super) fn canonical_correlations(factor: &HankelFactor, projection: &Projection) -> Result<Vec<f64>> {
    if projection.canonical {
        return Ok(projection.singular_values.clone());
    }
    let mut values = Whitened::new(factor)?.past.singular_values().map_err(|_| no_convergence())?;
    values.resize(factor.horizon * factor.outputs, 0.0);
    Ok(values)
}

/// `[R32' R33'] = Uw Sw Vw'` and what the past says of the white future outputs.
struct Whitened {
    uw: Mat<f64>,
    sw: Vec<f64>,
    /// `Sw^-1 Uw' R32'`.
    past: Mat<f64>,
}

impl Whitened {
    fn new(factor: &HankelFactor) -> Result<Self> {
        let (uw, mut sw) = left_singular(factor.future_beyond_inputs().transpose())?;
        let rank = sw.iter().filter(|s| **s > WHITENING_TOLERANCE * sw[0]).count();
        let uw = uw.subcols(0, rank).to_owned();
        sw.truncate(rank);
        let mut past = uw.transpose() * factor.future_by_past().transpose();
        sw.iter().enumerate().for_each(|(i, s)| past.row_mut(i).iter_mut().for_each(|v| *v /= s));
        Ok(Whitened { uw, sw, past })
    }
}

/// `R32' = U S V'`, Gamma = U.
fn unweighted(factor: &HankelFactor) -> Result<Projection> {
    let (u, singular_values) = left_singular(factor.future_by_past().transpose())?;
    Ok(Projection { singular_values, canonical: false, basis: u })
}

/// `[R32' R33'] = Uw Sw Vw'`, `Sw^-1 Uw' R32' = U S V'`, Gamma = orthonormalised `Uw Sw U`.
fn canonical(factor: &HankelFactor) -> Result<Projection> {
    let Whitened { uw, sw, past } = Whitened::new(factor)?;
    let rank = sw.len();
    let (mut u, mut singular_values) = left_singular(past.as_ref())?;
    (0..rank).for_each(|i| u.row_mut(i).iter_mut().for_each(|v| *v *= sw[i]));
    let count = factor.horizon * factor.outputs;
    singular_values.resize(count, 0.0);
    let mut spanned = Mat::zeros(count, count);
    spanned.as_mut().subcols_mut(0, rank).copy_from(uw * u);
    // Keep the unused directions last, so that the basis is complete even where the data are free of noise.
    let basis = orthonormal(spanned.as_ref().subcols(0, rank), count);
    Ok(Projection { singular_values, canonical: true, basis })
}

/// Orthonormal columns, the first k of which span the first k columns of `a`.
fn orthonormal(a: MatRef<'_, f64>, count: usize) -> Mat<f64> {
    let qr = a.qr();
    let mut q = qr.compute_Q();
    for j in 0..a.ncols() {
        if qr.R()[(j, j)] < 0.0 {
            q.col_mut(j).iter_mut().for_each(|v| *v = -*v);
        }
    }
    q.as_ref().subcols(0, count).to_owned()
}

/// Left singular vectors (square) and as many singular values, zero beyond the columns of `a`.
fn left_singular(a: MatRef<'_, f64>) -> Result<(Mat<f64>, Vec<f64>)> {
    // The right vectors of a wide matrix would be most of the work.
    let svd = if a.ncols() < a.nrows() { a.svd() } else { a.thin_svd() }.map_err(|_| no_convergence())?;
    let mut sigma: Vec<f64> = svd.S().column_vector().iter().copied().collect();
    sigma.resize(a.nrows(), 0.0);
    Ok((svd.U().to_owned(), sigma))
}

fn no_convergence() -> Error {
    Error::NoConvergence { what: "the singular values of the projected outputs".into(), iterations: 0 }
}
