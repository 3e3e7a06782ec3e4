//! The records as what they say of B, D and x0: one triangular factor per output and experiment over
//! `[x0 | disturbances | B | its row of D | y]`, from the samples in the order of time.

use crate::identify::subspace::inputs::sensitivity::{KnownShare, Predictor, Sensitivity, Unknowns};
use crate::identify::subspace::records::channels::Channels;
use crate::identify::subspace::records::view::Signals;
use crate::linalg::SequentialQr;
use faer::{Mat, MatRef};
use rayon::prelude::*;

/// Samples folded in at a time.
const PIECE: usize = 4000;

/// One factor per output.
pub(crate) type Factors = Vec<Mat<f64>>;

/// The factors of all experiments.
pub(crate) fn condense(data: &Channels<'_>, predictor: &Predictor, unknowns: &Unknowns) -> Vec<Factors> {
    data.scaled().par_iter().map(|signals| of_experiment(signals, predictor, unknowns)).collect()
}

fn of_experiment(signals: &Signals, predictor: &Predictor, unknowns: &Unknowns) -> Factors {
    let known = regressors(signals.w.as_ref(), predictor);
    let share = KnownShare::new(predictor);
    let targets = share.map_or_else(|| signals.y.clone(), |mut share| share.without(signals.y.as_ref()));
    let factor = |i: usize| {
        let mut sensitivity = Sensitivity::new(predictor, i, unknowns);
        let mut triangle = SequentialQr::new(unknowns.width_of_output(i), PIECE);
        let target = targets.col_as_slice(i);
        for start in (0..target.len()).step_by(PIECE) {
            let count = PIECE.min(target.len() - start);
            let (u, known) = (signals.u.subrows(start, count), known[i].subrows(start, count));
            triangle.fold(count, |rows| sensitivity.fill(u, known, &target[start..start + count], rows));
        }
        triangle.r().to_owned()
    };
    (0..unknowns.outputs).into_par_iter().map(factor).collect()
}

/// Per output, the regressors of the disturbances' coefficients (known signal by known signal within each output): the known
/// signals, for a predictor each at each output as the predictor passes it on to all outputs.
fn regressors(w: MatRef<'_, f64>, predictor: &Predictor) -> Vec<Mat<f64>> {
    let (signals, p) = (w.ncols(), predictor.c.nrows());
    let at_output = |a: usize| {
        let (output, j) = (a / signals, a % signals);
        Mat::from_fn(w.nrows(), p, |k, i| if i == output { w[(k, j)] } else { 0.0 })
    };
    let passed_on = |a: usize| {
        let alone = at_output(a);
        KnownShare::new(predictor).map_or_else(|| alone.clone(), |mut share| share.without(alone.as_ref()))
    };
    let each: Vec<Mat<f64>> = (0..p * signals).map(passed_on).collect();
    (0..p).map(|i| Mat::from_fn(w.nrows(), each.len(), |k, a| each[a][(k, i)])).collect()
}
