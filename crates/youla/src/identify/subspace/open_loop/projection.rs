//! The weighted projection of the future outputs along the past, its singular values and the observability matrix.

use crate::identify::subspace::SubspaceMethod;
use crate::identify::subspace::open_loop::hankel::{FAR_FROM_DEPENDENT, HankelFactor};
use crate::linalg::triangular_condition;
use crate::{Error, Result};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::prelude::*;
use faer::{Mat, MatRef, Par};

/// Directions of the future outputs below this share of the largest are noise-free to working precision and cannot be
/// whitened.
const WHITENING_TOLERANCE: f64 = 1e-10;

/// The singular value decomposition of the weighted projection.
pub(crate) struct Projection {
    /// Descending, one per row of the observability matrix.
    pub(crate) singular_values: Vec<f64>,
    /// Whether they are canonical correlations.
    canonical: bool,
    /// Columns span the observability matrix in the order of the singular values, orthonormal.
    basis: Mat<f64>,
}

impl Projection {
    /// `Gamma` for order n, with orthonormal columns.
    pub(crate) fn observability(&self, order: usize) -> MatRef<'_, f64> {
        self.basis.as_ref().subcols(0, order)
    }
}

/// Singular values and observability matrix for a weight.
pub(crate) fn project(factor: &HankelFactor, method: SubspaceMethod) -> Result<Projection> {
    match method {
        SubspaceMethod::Cva => canonical(factor),
        _ => unweighted(factor),
    }
}

/// Canonical correlations: cosines of the angles between past and future, freed of the future inputs; those of the projection
/// where it has them.
pub(crate) fn canonical_correlations(factor: &HankelFactor, projection: &Projection) -> Result<Vec<f64>> {
    if projection.canonical {
        return Ok(projection.singular_values.clone());
    }
    let mut values = Whitened::new(factor)?.past.singular_values().map_err(|_| no_convergence())?;
    values.resize(factor.horizon * factor.outputs, 0.0);
    Ok(values)
}

/// `W W' = [R32' R33'] [R32' R33']'` and what the past says of the white future outputs.
struct Whitened {
    /// A square root W: a row per future output, a column per direction in which they vary.
    root: Mat<f64>,
    /// `W^+ R32'`.
    past: Mat<f64>,
}

impl Whitened {
    /// By QR where the future outputs are far from dependent, else by their singular values, the zero ones left out.
    fn new(factor: &HankelFactor) -> Result<Self> {
        let (future, by_past) = (factor.future_beyond_inputs(), factor.future_by_past());
        if future.nrows() >= future.ncols() {
            let qr = future.qr();
            let root = qr.thin_R().transpose();
            let unit = Mat::from_fn(root.nrows(), root.ncols(), |i, j| root[(i, j)] / root.row(i).norm_l2());
            if triangular_condition(unit.as_ref()) < FAR_FROM_DEPENDENT {
                let mut past = by_past.transpose().to_owned();
                root.solve_lower_triangular_in_place(past.as_mut());
                return Ok(Whitened { root: root.to_owned(), past });
            }
        }
        let (mut root, sw) = left_singular(future.transpose())?;
        let rank = sw.iter().filter(|s| **s > WHITENING_TOLERANCE * sw[0]).count();
        root = root.subcols(0, rank).to_owned();
        let mut past = root.transpose() * by_past.transpose();
        for (i, s) in sw[..rank].iter().enumerate() {
            past.row_mut(i).iter_mut().for_each(|v| *v /= s);
            root.col_mut(i).iter_mut().for_each(|v| *v *= s);
        }
        Ok(Whitened { root, past })
    }
}

/// `R32' = U S V'`, Gamma = U.
fn unweighted(factor: &HankelFactor) -> Result<Projection> {
    let (u, singular_values) = left_singular(factor.future_by_past().transpose())?;
    Ok(Projection { singular_values, canonical: false, basis: u })
}

/// `W^+ R32' = U S V'`, Gamma = orthonormalised `W U`.
fn canonical(factor: &HankelFactor) -> Result<Projection> {
    let Whitened { root, past } = Whitened::new(factor)?;
    let (u, mut singular_values) = left_singular(past.as_ref())?;
    let count = factor.horizon * factor.outputs;
    singular_values.resize(count, 0.0);
    // Keep the unused directions last, so that the basis is complete even where the data are free of noise.
    let basis = orthonormal((root * u).as_ref(), count);
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
    let rows = a.nrows();
    if a.ncols() > rows {
        // The right vectors of a wide matrix would be most of the work.
        return left_singular(a.transpose().qr().thin_R().transpose());
    }
    let (mut u, mut sigma) = (Mat::zeros(rows, rows), vec![0.0; a.ncols()]);
    let need = svd_scratch::<f64>(rows, a.ncols(), ComputeSvdVectors::Full, ComputeSvdVectors::No, Par::Seq, default());
    let mut memory = MemBuffer::new(need);
    let values = faer::diag::DiagMut::from_slice_mut(&mut sigma);
    let vectors = Some(u.as_mut());
    svd(a, values, vectors, None, Par::Seq, MemStack::new(&mut memory), default()).map_err(|_| no_convergence())?;
    sigma.resize(rows, 0.0);
    Ok((u, sigma))
}

fn no_convergence() -> Error {
    Error::NoConvergence { what: "the singular values of the projected outputs".into(), iterations: 0 }
}
