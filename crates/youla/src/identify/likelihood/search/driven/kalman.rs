//! The Kalman filter of outputs that see noise at the inputs of a plant.

use crate::identify::likelihood::search::model::Model;
use crate::linalg::{RiccatiProblem, block, dare, eigenvalues};
use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Scale, c64};
use std::ops::Range;

/// Largest change of the logarithm of a variance in a step.
const LARGEST_CHANGE: f64 = 2.0;
/// Pole of a colour at most: beyond it is a random walk.
pub(crate) const LARGEST_POLE: f64 = 1.0 - 1e-5;

/// Variances of the noise, up to a common factor, and the pole of that at the inputs where it has a colour.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// Of the noise at each input.
    pub(crate) inputs: Vec<f64>,
    /// Of the noise of the sensor of each output.
    pub(crate) sensors: Vec<f64>,
    /// c.
    pub(crate) colour: Option<f64>,
    /// The states whose gains are free in place of variances.
    pub(crate) free: Vec<usize>,
}

impl Entry {
    /// Noise of equal size at all inputs that one output sees: lambda beside a sensor of unit noise.
    pub(crate) fn of_one(ratio: f64, inputs: usize) -> Self {
        Entry { inputs: vec![ratio; inputs], sensors: vec![1.0], colour: None, free: Vec::new() }
    }

    /// lambda of one output.
    pub(crate) fn ratio(&self) -> f64 {
        self.inputs[0]
    }

    /// What of the variances is free, as changes of those at the inputs and of those of the sensors.
    pub(crate) fn directions(&self) -> Vec<[Vec<f64>; 2]> {
        let (m, p) = (self.inputs.len(), self.sensors.len());
        if !self.free.is_empty() {
            return Vec::new();
        }
        let unit = |count: usize, at: Option<usize>| (0..count).map(|i| f64::from(at == Some(i))).collect();
        if p == 1 {
            return vec![[vec![1.0; m], vec![0.0]]];
        }
        let of_inputs = (0..m).map(|j| [unit(m, Some(j)), unit(p, None)]);
        of_inputs.chain((1..p).map(|i| [unit(m, None), unit(p, Some(i))])).collect()
    }

    /// After the last part of a step of the parameters of the model and of the noise: those of its directions and of the pole of the colour.
    /// Variances stay positive, `v exp(change / v)`.
    pub(crate) fn moved(&self, step: &[f64]) -> Self {
        let mut moved = self.clone();
        let Some(first) = step.len().checked_sub(self.parameters()) else { return moved };
        let (directions, own) = (self.directions(), &step[first..]);
        let along =
            |which: usize, k: usize| directions.iter().zip(own).map(|(d, step)| d[which][k] * step).sum::<f64>();
        let after = |v: f64, change: f64| v * (change / v).clamp(-LARGEST_CHANGE, LARGEST_CHANGE).exp();
        moved.inputs.iter_mut().enumerate().for_each(|(j, v)| *v = after(*v, along(0, j)));
        moved.sensors.iter_mut().enumerate().for_each(|(i, v)| *v = after(*v, along(1, i)));
        let change = own.last().copied().unwrap_or(0.0);
        moved.colour = self.colour.map(|pole| (pole + change).clamp(0.0, LARGEST_POLE));
        moved
    }

    /// Number of its parameters.
    pub(crate) fn parameters(&self) -> usize {
        if !self.free.is_empty() {
            let colours = self.colour.map_or(0, |_| self.inputs.len());
            return (self.free.len() + colours) * self.sensors.len() + usize::from(self.colour.is_some());
        }
        let sizes = if self.sensors.len() == 1 { 1 } else { self.inputs.len() + self.sensors.len() - 1 };
        sizes + usize::from(self.colour.is_some())
    }
}

/// What white noise drives: the plant, behind one state for each input where the noise has a colour.
pub(super) struct System {
    pub(super) a: Mat<f64>,
    pub(super) b: Mat<f64>,
    pub(super) c: Mat<f64>,
}

impl System {
    pub(super) fn new(plant: &Model, outputs: Range<usize>, colour: Option<f64>) -> Self {
        let (a, b, c) = plant.matrices();
        let c = c.subrows(outputs.start, outputs.len()).to_owned();
        let Some(pole) = colour else { return System { a, b, c } };
        let (n, m) = (a.nrows(), b.ncols());
        let colours = Mat::<f64>::identity(m, m);
        System {
            a: block(&[&[a.as_ref(), b.as_ref()], &[Mat::zeros(m, n).as_ref(), (&colours * pole).as_ref()]]),
            b: block(&[&[Mat::zeros(n, m).as_ref()], &[colours.as_ref()]]),
            c: block(&[&[c.as_ref(), Mat::zeros(outputs.len(), m).as_ref()]]),
        }
    }
}

/// Gains and covariances of the filter.
#[derive(Debug, Clone)]
pub(crate) struct Kalman {
    /// Variances and colour.
    pub(crate) entry: Entry,
    /// K, states of the model x outputs, zero for states that are hidden.
    pub(crate) gain: Mat<f64>,
    /// B of the model, zero for states that are hidden.
    pub(crate) b: Mat<f64>,
    /// The same as K of the colour, m x outputs; without rows of white noise.
    pub(crate) of_colour: Mat<f64>,
    /// Covariance of the states that are not hidden and of the colours before a sample is known, and S of the innovations.
    pub(super) covariance: Mat<f64>,
    size: Mat<f64>,
    /// Product of the magnitudes of the poles outside of the unit circle.
    pub(crate) unstable: f64,
}

impl Kalman {
    /// Of some outputs, without the blocks that are hidden from them; `A - K C` of plant and colours comes with it.
    pub(super) fn new(
        model: &Model,
        hidden: &[usize],
        (outputs, entry): (Range<usize>, Entry),
    ) -> Option<(Self, Mat<f64>)> {
        let plant = model.without(hidden);
        let System { a, b, c } = System::new(&plant, outputs.clone(), entry.colour);
        let largest = entry.inputs.iter().copied().fold(0.0, f64::max);
        let shares = Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] * (entry.inputs[j] / largest));
        let q = &shares * b.transpose() * Scale(largest);
        let sensors = diagonal(&entry.sensors);
        let dual = RiccatiProblem { a: a.transpose(), b: c.transpose(), q: q.as_ref(), r: sensors.as_ref(), s: None };
        let solution = dare("the noise", &dual).ok()?;
        let k = solution.gain.transpose().to_owned();
        let closed = &a - &k * &c;
        let size = &c * &solution.x * c.transpose() + sensors;
        Some((Kalman::placed(model, hidden, &k, (entry, solution.x, size)), closed))
    }

    /// Of gains that are free but for the states of hidden blocks, those of the model, then those of the colours with their pole, and about the
    /// covariance of the innovations. Gains that leave `A - K C` unstable are replaced by those of the same spectrum, by the Riccati equation of
    /// `K epsilon`; `None` where it has no solution.
    pub(super) fn of_gain(
        model: &Model,
        hidden: &[usize],
        (gain, colour): (Mat<f64>, Option<f64>),
        size: &Mat<f64>,
    ) -> Option<Self> {
        let p = gain.ncols();
        let System { a, c, .. } = System::new(&model.without(hidden), 0..p, colour);
        let places = places_of(model, hidden, gain.nrows());
        let mut k = Mat::from_fn(places.len(), p, |i, o| gain[(places[i], o)]);
        let zeros = eigenvalues("the noise", (&a - &k * &c).as_ref()).ok()?;
        if zeros.iter().any(|zero| zero.norm() >= 1.0) {
            let (q, s) = (&k * size * k.transpose(), &k * size);
            let (a, b, s) = (a.transpose(), c.transpose(), Some(s.as_ref()));
            let dual = RiccatiProblem { a, b, q: q.as_ref(), r: size.as_ref(), s };
            k = dare("the noise", &dual).ok()?.gain.transpose().to_owned();
        }
        let free = states_of(model, hidden);
        let entry = Entry { inputs: vec![1.0; model.inputs], sensors: vec![1.0; p], colour, free };
        Some(Kalman::placed(model, hidden, &k, (entry, Mat::zeros(0, 0), size.clone())))
    }

    /// Of the gains of the states that are not hidden, then of the colours.
    fn placed(
        model: &Model,
        hidden: &[usize],
        k: &Mat<f64>,
        (entry, covariance, size): (Entry, Mat<f64>, Mat<f64>),
    ) -> Self {
        let states = states_of(model, hidden);
        let of_model = model.matrices().1;
        let (mut gain, mut b) = (Mat::zeros(model.order(), k.ncols()), Mat::zeros(model.order(), model.inputs));
        for (i, state) in states.iter().enumerate() {
            gain.row_mut(*state).copy_from(k.row(i));
            b.row_mut(*state).copy_from(of_model.row(*state));
        }
        let of_colour = k.subrows(states.len(), k.nrows() - states.len()).to_owned();
        let unstable = model.without(hidden).poles().iter().map(|p: &c64| p.norm().max(1.0)).product();
        Kalman { entry, gain, b, of_colour, covariance, size, unstable }
    }

    /// The gains of the states of the model, then those of the colours.
    pub(crate) fn gains(&self) -> Mat<f64> {
        block(&[&[self.gain.as_ref()], &[self.of_colour.as_ref()]])
    }

    /// Inverse of the covariance of the innovations, S = C P C' + R.
    pub(super) fn precision(&self) -> Mat<f64> {
        self.size.partial_piv_lu().inverse()
    }
}

pub(super) fn diagonal(values: &[f64]) -> Mat<f64> {
    Mat::from_fn(values.len(), values.len(), |i, j| if i == j { values[i] } else { 0.0 })
}

/// The states of a model without those of some blocks.
pub(crate) fn states_of(model: &Model, hidden: &[usize]) -> Vec<usize> {
    let mut first = 0;
    let mut of_block = |k: usize| {
        let states = first..first + model.blocks[k].states;
        first = states.end;
        if hidden.contains(&k) { 0..0 } else { states }
    };
    (0..model.blocks.len()).flat_map(&mut of_block).collect()
}

/// The same, and the rows behind those of the states.
pub(crate) fn places_of(model: &Model, hidden: &[usize], rows: usize) -> Vec<usize> {
    states_of(model, hidden).into_iter().chain(model.order()..rows).collect()
}
