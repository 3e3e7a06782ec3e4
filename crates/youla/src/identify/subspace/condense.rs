//! The records as what they say of B, D and x0: one triangular factor per output and experiment over
//! `[x0 | disturbances | B | its row of D | y]`, from the samples in the order of time.
//!
//! Where A has eigenvectors that are far from dependent, all outputs share the modes ([`super::modal`]), by sums of products
//! ([`super::modal_sums`]) or, where these would lose too many digits, by QR of the rows; else output by output
//! ([`super::sensitivity`]).

use super::channels::Channels;
use super::disturbance::{KnownColumns, Regressors};
use super::modal::{Modes, Rows};
use super::modal_sums::Sums;
use super::sensitivity::{KnownShare, Predictor, Sensitivity, Unknowns};
use super::view::View;
use crate::linalg::{SequentialQr, block};
use faer::{Mat, MatRef};
use rayon::prelude::*;

/// Samples taken in at a time: what is made of them stays in the cache, and there is work for all threads.
const BATCH: usize = 1 << 16;
/// Samples folded in at a time, output by output.
const PIECE: usize = 4000;

/// One factor per output.
pub(super) type Factors = Vec<Mat<f64>>;

/// How the regressors are made, the first way that works.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Sums,
    Rows,
    ByOutputs,
}

/// What all experiments share.
struct Regression<'a> {
    predictor: &'a Predictor,
    unknowns: &'a Unknowns,
    modes: Option<Modes>,
    /// By which the channels of `[u; y]` are to be divided.
    scale: Vec<f64>,
}

impl<'a> Regression<'a> {
    fn new(predictor: &'a Predictor, unknowns: &'a Unknowns, scale: Vec<f64>) -> Self {
        Regression { predictor, unknowns, modes: Modes::of(predictor), scale }
    }

    /// The way that comes first.
    fn first_way(&self) -> Way {
        match &self.modes {
            Some(modes) if Sums::can_be_of(modes.lambda()) => Way::Sums,
            _ => self.safe_way(),
        }
    }

    /// The way that works where [`Way::Sums`] loses too many digits.
    fn safe_way(&self) -> Way {
        if self.modes.is_some() { Way::Rows } else { Way::ByOutputs }
    }
}

/// The factors of all experiments in memory.
pub(super) fn condense(data: &Channels<'_>, predictor: &Predictor, unknowns: &Unknowns) -> Vec<Factors> {
    let regression = Regression::new(predictor, unknowns, data.scale_of_views());
    data.views()
        .par_iter()
        .map(|view| {
            let known = regressors(*view, predictor);
            let of = |way: Way| {
                let mut sums = Condenser::new(&regression, way, known.columns);
                for start in (0..view.samples()).step_by(BATCH) {
                    let count = BATCH.min(view.samples() - start);
                    let part = view.part(start, count);
                    sums.add(part.u, part.y, known.signals.subrows(start, count));
                }
                sums.factors()
            };
            of(regression.first_way()).or_else(|| of(regression.safe_way())).unwrap_or_default()
        })
        .collect()
}

/// The regressors of the disturbances' coefficients: the known signals, for a predictor each at each output as the predictor
/// passes it on to all outputs.
pub(super) fn regressors(view: View<'_>, predictor: &Predictor) -> Regressors {
    let (w, p) = (view.w, view.y.ncols());
    let columns = KnownColumns { known: w.ncols(), outputs: p, crossed: false };
    if w.ncols() == 0 || predictor.k.is_none() {
        return Regressors { signals: w.to_owned(), columns };
    }
    let crossed: Vec<Mat<f64>> = (0..p * w.ncols())
        .filter_map(|a| {
            let (l, j) = (a / w.ncols(), a % w.ncols());
            let at_output = Mat::from_fn(w.nrows(), p, |k, i| if i == l { w[(k, j)] } else { 0.0 });
            Some(KnownShare::new(predictor)?.without(at_output.as_ref()))
        })
        .collect();
    let signals = Mat::from_fn(w.nrows(), crossed.len() * p, |k, c| crossed[c / p][(k, c % p)]);
    Regressors { signals, columns: KnownColumns { crossed: true, ..columns } }
}

/// Takes in the samples of one experiment.
struct Condenser<'a> {
    regression: &'a Regression<'a>,
    share: Option<KnownShare>,
    known: KnownColumns,
    state: State<'a>,
}

enum State<'a> {
    Sums(&'a Modes, Sums<'a>),
    Rows(&'a Modes, Box<Rows>),
    ByOutputs(Vec<(Sensitivity<'a>, SequentialQr)>),
}

impl<'a> Condenser<'a> {
    /// Before the first sample.
    fn new(regression: &'a Regression<'a>, way: Way, known: KnownColumns) -> Self {
        let (unknowns, predictor) = (regression.unknowns, regression.predictor);
        let beside = unknowns.through() + known.columns() + unknowns.outputs;
        let output =
            |i| (Sensitivity::new(predictor, i, unknowns), SequentialQr::new(unknowns.width_of_output(i), PIECE));
        let state = match (way, &regression.modes) {
            (Way::Sums, Some(modes)) => State::Sums(modes, Sums::new(modes.lambda(), unknowns.inputs, beside)),
            (Way::Rows, Some(modes)) => State::Rows(modes, Box::new(Rows::new(modes, unknowns, beside))),
            _ => State::ByOutputs((0..unknowns.outputs).map(output).collect()),
        };
        Condenser { regression, share: KnownShare::new(predictor), known, state }
    }

    /// Takes in the next samples, with the regressors of disturbances.
    fn add(&mut self, u: MatRef<'_, f64>, y: MatRef<'_, f64>, known: MatRef<'_, f64>) {
        let unknowns = self.regression.unknowns;
        let (u_scale, y_scale) = self.regression.scale.split_at(unknowns.inputs);
        let scaled =
            |m: MatRef<'_, f64>, scale: &[f64]| Mat::from_fn(m.nrows(), m.ncols(), |k, j| m[(k, j)] / scale[j]);
        let targets = self.share.as_mut().map(|share| share.without(scaled(y, y_scale).as_ref()));
        let targets = targets.as_ref().map_or(y, |targets| targets.as_ref());
        let beside = || block(&[&[u.subcols(0, unknowns.through()), known, targets]]);
        match &mut self.state {
            State::Sums(_, sums) => sums.add(u, beside().as_ref()),
            State::Rows(_, rows) => rows.add(u, beside().as_ref()),
            State::ByOutputs(outputs) => {
                let u = scaled(u, u_scale);
                let unscaled = self.share.is_none();
                outputs.par_iter_mut().enumerate().for_each(|(i, (sensitivity, triangle))| {
                    let scale = if unscaled { y_scale[i] } else { 1.0 };
                    let target: Vec<f64> = targets.col(i).iter().map(|y| y / scale).collect();
                    let known = self.known.of_output(known, i);
                    for start in (0..target.len()).step_by(PIECE) {
                        let count = PIECE.min(target.len() - start);
                        let (u, known) = (u.as_ref().subrows(start, count), known.as_ref().subrows(start, count));
                        let target = &target[start..start + count];
                        triangle.fold(count, |rows| sensitivity.fill(u, known, target, rows));
                    }
                });
            }
        }
    }

    /// The factors of all outputs; `None` where the way was not good enough.
    fn factors(&self) -> Option<Factors> {
        let unknowns = self.regression.unknowns;
        let mut scale = self.regression.scale.clone();
        if self.share.is_some() {
            scale[unknowns.inputs..].fill(1.0);
        }
        let by_outputs = |modes: &Modes, shared: Mat<f64>| modes.by_outputs(shared, &self.known, unknowns, &scale);
        match &self.state {
            State::Sums(modes, sums) => Some(by_outputs(modes, sums.factor(unknowns.initial > 0)?)),
            State::Rows(modes, rows) => Some(by_outputs(modes, rows.factor())),
            State::ByOutputs(outputs) => Some(outputs.iter().map(|(_, triangle)| triangle.r().to_owned()).collect()),
        }
    }
}
