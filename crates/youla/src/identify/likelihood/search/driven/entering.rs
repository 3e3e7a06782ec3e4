//! Noise at the inputs as a step of a search sees it: the plant shapes it, so that its filter moves with the parameters.
//!
//! With `v = y - G u` and `epsilon = v / H` the slopes of the whitened residual are those of
//! ```text
//! dG u + dH epsilon,      H = 1 + C M K,      M = (z I - A)^-1
//! ```
//! before the autoregression: of the output of a Kalman filter, `X = M (B (u + w) + z t + K epsilon)` with w the estimated noise at the inputs
//! where it has a colour, `w = K_w epsilon / (z - c)`, and `C M dK epsilon`. In a loop that holds the output, u is at low frequencies minus
//! the noise at the input. With the filter held, the squares would be least for a plant without gain there, and the information on its gain many
//! times too large.
//!
//! K is that of the Riccati equation, and its slopes solve one Stein equation for each parameter: with `F = A - K C` of plant and colour, P the
//! covariance of their states and S that of the innovation, K being optimal,
//! ```text
//! dP = F dP F' + (dA - K dC) P F' + F P (dA - K dC)' + d(lambda B B')
//! dK = ((dA - K dC) P C' + F (dP C' + P dC')) / S
//! ```
//! Source: L. Ljung, System Identification, 2nd ed. (1999), sections 7.2 and 10.3, in the form of a filter that depends on the plant.

use super::gains::hidden;
use super::{Driven, Entry, System};
use crate::identify::likelihood::data::lanes::Lanes;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::model::Model;
use crate::linalg::{RealSchur, discrete_lyapunov_on, real_schur};
use faer::Mat;

/// Noise at the inputs in one output.
pub(crate) struct Entering {
    /// The filter `1 / H` and the gain K.
    driven: Driven,
    /// Whether the output sees a state.
    seen: Vec<bool>,
    /// dK of the states of the plant, then of the colours, by parameters.
    slopes: Mat<f64>,
    /// The same along lambda and along the pole of the colour.
    by_entry: Mat<f64>,
}

/// What moves: A, B and C of one output.
struct Change {
    a: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
}

/// The filter of Kalman, from which the slopes of its gain follow.
struct Filter {
    system: System,
    ratio: f64,
    gain: Mat<f64>,
    /// `A - K C`, and its Schur form.
    closed: Mat<f64>,
    schur: RealSchur,
    covariance: Mat<f64>,
    /// Of the innovation.
    size: f64,
}

impl Filter {
    fn new(system: System, gain: Mat<f64>, covariance: Mat<f64>, ratio: f64) -> Option<Self> {
        let closed = &system.a - &gain * &system.c;
        let schur = real_schur("the noise", closed.as_ref()).ok()?;
        let size = (&system.c * &covariance * system.c.transpose())[(0, 0)] + 1.0;
        Some(Filter { system, ratio, gain, closed, schur, covariance, size })
    }

    fn unchanged(&self) -> Change {
        let of = |m: &Mat<f64>| Mat::zeros(m.nrows(), m.ncols());
        Change { a: of(&self.system.a), b: of(&self.system.b), c: of(&self.system.c) }
    }

    /// What moves with the entries of a block, whose states begin at `at` of the filter. Colours, whose states begin at the given place, drive the
    /// plant through its B, white noise drives it by itself.
    fn along(
        &self,
        (block, at): (&Block, usize),
        output: usize,
        colours: Option<usize>,
        moved: impl Fn(usize) -> f64,
    ) -> Change {
        let (s, m) = (block.states, block.b.len() / block.states);
        let mut change = self.unchanged();
        for i in 0..s {
            (0..s).for_each(|j| change.a[(at + i, at + j)] = moved(i * s + j));
            for j in 0..m {
                match colours {
                    Some(first) => change.a[(at + i, first + j)] = moved(s * s + i * m + j),
                    None => change.b[(at + i, j)] = moved(s * s + i * m + j),
                }
            }
            change.c[(0, at + i)] = moved(s * (s + m) + output * s + i);
        }
        change
    }

    /// dK along a change and along a change of lambda.
    fn slope(&self, change: &Change, of_ratio: f64) -> Option<Mat<f64>> {
        let (p, closed, c) = (&self.covariance, &self.closed, &self.system.c);
        let closed_change = &change.a - &self.gain * &change.c;
        let half = &closed_change * p * closed.transpose()
            + (self.ratio * &change.b + 0.5 * of_ratio * &self.system.b) * self.system.b.transpose();
        let dp = discrete_lyapunov_on(&self.schur, (&half + half.transpose()).as_ref()).ok()?;
        let dk = closed_change * p * c.transpose() + closed * (dp * c.transpose() + p * change.c.transpose());
        Some(dk * faer::Scale(1.0 / self.size))
    }
}

impl Entering {
    /// In the coordinates of a model; `longest` is the number of samples of the longest record.
    pub(crate) fn new((model, longest): (&Model, f64), chart: &Chart, (output, entry): (usize, Entry)) -> Option<Self> {
        let hidden = hidden(model, longest, output);
        let driven = Driven::of_entry(model, &hidden, (output, entry))?;
        let (m, n) = (model.inputs, model.order());
        let of_block = |k: usize| std::iter::repeat_n(!hidden.contains(&k), model.blocks[k].states);
        let seen: Vec<bool> = (0..model.blocks.len()).flat_map(of_block).collect();
        // Of the states of the filter their places among those of the plant, behind which are those of the colours.
        let mut places: Vec<usize> = (0..n).filter(|i| seen[*i]).collect();
        let of_plant = places.len();
        places.extend((0..driven.of_colour.len()).map(|j| n + j));
        let known = |i: usize| if i < n { driven.gain[i] } else { driven.of_colour[i - n] };
        let gain = Mat::from_fn(places.len(), 1, |i, _| known(places[i]));
        let system = System::new(&model.without(&hidden), output, entry.colour);
        let filter = Filter::new(system, gain, driven.covariance.clone(), entry.ratio)?;
        let mut slopes = Mat::<f64>::zeros(n + m, chart.parameters());
        let put = |to: &mut Mat<f64>, column: usize, change: &Change, of_ratio: f64| {
            let dk = filter.slope(change, of_ratio)?;
            places.iter().enumerate().for_each(|(i, place)| to[(*place, column)] = dk[(i, 0)]);
            Some(())
        };
        let colours = entry.colour.map(|_| of_plant);
        let (mut column, mut at) = (0, 0);
        for (k, block) in model.blocks.iter().enumerate() {
            if !hidden.contains(&k) {
                for q in 0..chart.parameters_of(k) {
                    let moved = |entry: usize| chart.direction(k, entry, q);
                    let change = filter.along((block, at), output, colours, moved);
                    put(&mut slopes, column + q, &change, 0.0)?;
                }
                at += block.states;
            }
            column += chart.parameters_of(k);
        }
        let mut by_entry = Mat::<f64>::zeros(n + m, 2);
        put(&mut by_entry, 0, &filter.unchanged(), 1.0)?;
        if entry.colour.is_some() {
            let mut change = filter.unchanged();
            (0..m).for_each(|j| change.a[(of_plant + j, of_plant + j)] = 1.0);
            put(&mut by_entry, 1, &change, 0.0)?;
        }
        Some(Entering { driven, seen, slopes, by_entry })
    }

    /// `epsilon`, the residual behind `1 / H`.
    #[inline(always)]
    pub(crate) fn innovation(&self, residual: &Lanes, back: &Lanes) -> Lanes {
        let mut rest = *residual;
        self.driven.apply_unmirrored(back, &mut rest);
        rest
    }

    /// Pole of the colour.
    pub(crate) fn colour(&self) -> Option<f64> {
        self.driven.entry.colour
    }

    /// K_w of an input.
    #[inline(always)]
    pub(crate) fn of_colour(&self, input: usize) -> f64 {
        self.driven.of_colour[input]
    }

    /// K of a state.
    #[inline(always)]
    pub(crate) fn gain(&self, state: usize) -> f64 {
        self.driven.gain[state]
    }

    /// Whether the output sees a state.
    #[inline(always)]
    pub(crate) fn sees(&self, state: usize) -> bool {
        self.seen[state]
    }

    /// dK of a state along the parameters, or along lambda and the pole of the colour.
    #[inline(always)]
    pub(crate) fn slope(&self, state: usize, parameter: usize) -> f64 {
        self.slopes[(state, parameter)]
    }

    /// dK of a state along lambda (0) and along the pole of the colour (1).
    #[inline(always)]
    pub(crate) fn by_entry(&self, state: usize, which: usize) -> f64 {
        self.by_entry[(state, which)]
    }
}
