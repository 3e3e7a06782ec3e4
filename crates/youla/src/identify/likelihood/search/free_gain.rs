//! Noise that reaches the outputs by a path of its own: wind on the load of a crane, a road, the load side of a drive.
//!
//! ```text
//! x+ = A x + B u + K epsilon,     y = C x + D u + epsilon
//! ```
//! with all entries of K free (L. Ljung, System Identification, 2nd ed. (1999), section 4.3). Noise at the inputs of the plant has the zeros of
//! its response from there; here the noise has the poles of the plant and any zeros. Beside a resonance that little of the excitation
//! reaches, an autoregression takes too many coefficients for them, and in a loop a wrong plant takes fewer.

use super::block::Block;
use super::chart::Chart;
use super::driven::{Joint, LARGEST_POLE, LINES, Responses, hidden, longest, places_of, states_of};
use super::groups::grouped;
use super::linearise::{Filter, Linearised, MOST_COEFFICIENTS, linearise_quickly};
use super::model::Model;
use super::noise::Noise;
use super::point::Point;
use super::separable::separable;
use super::{DAMPED, FIRST_DAMPING, Found, SearchOptions, damped, moved, penalty, value_of, with_slope};
use crate::identify::likelihood::data::lanes::Lanes;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::linalg::Damping;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side, c64};
use pulp::Arch;
use std::sync::Arc;

/// Entries of K at most.
const MOST: usize = 40;
/// Ridge of a start, relative to its diagonal.
const RIDGE: f64 = 1e-9;

/// Gains, and the pole of colours.
type Gains = (Mat<f64>, Option<f64>);

/// A model, its gains, its value and the noise there.
struct At {
    point: Point,
    /// Those of the states, then of the colours, and the pole of these.
    gains: Gains,
    value: f64,
    noise: Noise,
}

/// What stays in a search.
#[derive(Clone)]
struct Search<'a> {
    spectra: &'a Spectra,
    options: &'a SearchOptions,
    hidden: Vec<usize>,
}

/// The model with K free; `None` where Schwarz's criterion is not less then.
pub(crate) fn with_free_gain(spectra: &Spectra, found: &Found, options: &SearchOptions) -> Option<Found> {
    let model = &found.point.model;
    let hidden = hidden(model, longest(spectra), 0..model.outputs);
    let search = Search { spectra, options, hidden };
    let entries = states_of(model, &search.hidden).len() * model.outputs;
    if separable(spectra.outputs) || entries == 0 || entries > MOST || found.noise.parameters() <= model.outputs {
        return None;
    }
    let residuals = found.point.residuals(spectra);
    let at_inputs = || Noise::at_inputs(spectra, &residuals, options.noise_order, model)?.joint;
    let of_inputs = found.noise.joint.clone().or_else(at_inputs);
    let of_inputs = of_inputs.map(|joint| (joint.kalman.gains(), joint.kalman.entry.colour));
    let starts = [of_inputs, search.regressed(model, &residuals).map(|gain| (gain, None))];
    let groups = grouped(spectra, &found.point, DAMPED);
    let near = Search { spectra: groups.as_ref().unwrap_or(spectra), ..search.clone() };
    let descended = |gain| Some(near.descended(near.at(found.point.clone(), gain, &found.noise.covariance)?));
    let ends = starts.into_iter().flatten().filter_map(descended);
    let of_ends = ends.min_by(|a, b| a.0.criterion(near.spectra).total_cmp(&b.0.criterion(near.spectra)));
    let (mut at, mut steps) = of_ends?;
    if groups.is_some() {
        let (last, taken) = search.descended(search.at(at.point, at.gains, &at.noise.covariance)?);
        (at, steps) = (last, steps + taken);
    }
    let freed = at.found(found, found.steps + steps);
    let samples = spectra.samples();
    (freed.criterion(samples) < found.criterion(samples)).then_some(freed)
}

/// The model of a part of the records, from that of all with such a gain; `None` where that has none.
pub(crate) fn with_gain_of(all: &Found, spectra: &Spectra, start: &Point, options: &SearchOptions) -> Option<Found> {
    let kalman = &all.noise.joint.as_ref()?.kalman;
    if kalman.entry.free.is_empty() {
        return None;
    }
    let hidden = hidden(&start.model, longest(spectra), 0..start.model.outputs);
    let (search, gains) = (Search { spectra, options, hidden }, (kalman.gains(), kalman.entry.colour));
    let (at, steps) = search.descended(search.at(start.clone(), gains, &all.noise.covariance)?);
    Some(at.found(all, steps))
}

impl At {
    /// Schwarz's, up to what the model adds.
    fn criterion(&self, spectra: &Spectra) -> f64 {
        self.value + penalty(self.noise.parameters(), spectra.samples(), &self.point)
    }

    /// As what a search found after so many steps, with what it has in common with another.
    fn found(self, like: &Found, steps: usize) -> Found {
        Found { point: self.point, noise: self.noise, deviance: self.value, steps, ..like.clone() }
    }
}

impl Search<'_> {
    /// K by least squares of `v - e` by `C M e`, where the innovations e are what long autoregressions leave of the residual v, on some of the lines
    /// (E. J. Hannan and J. Rissanen, Biometrika 69 (1982), 81).
    fn regressed(&self, model: &Model, residuals: &[Vec<c64>]) -> Option<Mat<f64>> {
        let (p, n) = (model.outputs, model.order());
        let noise = Noise::behind(self.spectra, residuals, self.options.noise_order, None);
        let states = states_of(model, &self.hidden);
        let count = states.len() * p;
        let (mut gram, mut cross) = (Mat::<f64>::zeros(count, count), Mat::<f64>::zeros(count, 1));
        let every = self.spectra.lines().div_ceil(LINES).max(1);
        let blocks = with_unit_inputs(model);
        for (lines, v) in self.spectra.records.iter().zip(residuals) {
            let z: Vec<c64> = lines.z.iter().step_by(every).copied().collect();
            let (mut filters, mut row) = (vec![c64::ZERO; p], vec![c64::ZERO; count]);
            let each = |at: usize, (left, lane): (&[Lanes], usize)| {
                let k = at * every;
                noise.filters(lines.z[k], &mut filters);
                let v = &v[k * p..][..p];
                let weight = lines.weight[k].powi(2);
                for o in 0..p {
                    let scale = filters[o] / noise.covariance[(o, o)].sqrt();
                    for (x, value) in row.iter_mut().enumerate() {
                        let left = &left[o * n + states[x / p]];
                        *value = scale * c64::new(left.re[lane], left.im[lane]) * filters[x % p] * v[x % p];
                    }
                    let target = scale * (v[o] - filters[o] * v[o]);
                    for (x, value) in row.iter().enumerate() {
                        cross[(x, 0)] += weight * (value.conj() * target).re;
                        (0..=x).for_each(|y| gram[(x, y)] += weight * (value.conj() * row[y]).re);
                    }
                }
            };
            Arch::new().dispatch(Responses { blocks: &blocks, inputs: n, hidden: &vec![Vec::new(); p], z: &z, each });
        }
        (0..count).for_each(|x| gram[(x, x)] *= 1.0 + RIDGE);
        let found = gram.llt(Side::Lower).ok()?.solve(&cross);
        let mut gain = Mat::zeros(n, p);
        (0..count).for_each(|x| gain[(states[x / p], x % p)] = found[(x, 0)]);
        Some(gain)
    }

    /// Where steps from a point end, and how many they are.
    fn descended(&self, mut at: At) -> (At, usize) {
        let (mut damping, mut steps) = (Damping::new(FIRST_DAMPING), 0);
        while steps < self.options.steps {
            let Some(lower) = self.step(&at, &mut damping) else { break };
            let gain = at.criterion(self.spectra) - lower.criterion(self.spectra);
            (at, steps) = (lower, steps + 1);
            if gain < self.options.tolerance {
                break;
            }
        }
        (at, steps)
    }

    /// Value and noise, given about the covariance of the innovations; `None` where no filter is stable, and where it has more coefficients than
    /// columns.
    fn at(&self, point: Point, gains: Gains, size: &Mat<f64>) -> Option<At> {
        let joint = Arc::new(Joint::of_gain(&point.model, &self.hidden, gains, size)?);
        let gains = (joint.kalman.gains(), joint.kalman.entry.colour);
        let rest = joint.rest(self.spectra, &point.residuals(self.spectra));
        let noise = Noise::behind(self.spectra, &rest, self.options.noise_order, Some(joint));
        let value = value_of(self.spectra, &noise, &point.model, self.options);
        let usable = value.is_finite() && noise.parameters() <= MOST_COEFFICIENTS;
        usable.then_some(At { point, gains, value, noise })
    }

    /// A step that lowers the value.
    fn step(&self, at: &At, damping: &mut Damping) -> Option<At> {
        let options = self.options;
        let chart = Chart::new(&at.point.model, options.feedthrough);
        let Linearised { factor, ends } = linearise_quickly(self.spectra, &at.point, (&chart, &at.noise), Filter::Free);
        let slope = super::slope(self.spectra, &at.point, (&chart, &at.noise), (options, true));
        let factor = with_slope(factor, &slope);
        let (gain, colour) = &at.gains;
        let (model, p, all) = (&at.point.model, gain.ncols(), factor.ncols() - 1);
        let places = places_of(model, &self.hidden, gain.nrows());
        // Criteria, for the autoregressions have an order of their own at each trial.
        let now = at.criterion(self.spectra);
        let step = |damping| damped(&factor, all, damping);
        damping.descend_sparingly(options.tolerance, step, |step| {
            let point = moved(&at.point, &chart, &ends, &step);
            // The entries of K come last, state by state, and behind them the pole of the colours.
            let mut gains = (gain.clone(), colour.map(|pole| (pole + step[all - 1]).clamp(0.0, LARGEST_POLE)));
            let last = all - usize::from(colour.is_some());
            for (x, change) in step[last - places.len() * p..last].iter().enumerate() {
                gains.0[(places[x / p], x % p)] += change;
            }
            let inside = point.model.poles().iter().all(|pole| pole.norm() <= options.radius);
            let trial = self.at(point, gains, &at.noise.covariance).filter(|_| inside)?;
            let gain = now - trial.criterion(self.spectra);
            Some((trial, gain))
        })
    }
}

/// The blocks of a model with an input for each state.
fn with_unit_inputs(model: &Model) -> Vec<Block> {
    let (n, mut first) = (model.order(), 0);
    let of = |block: &Block| {
        let unit = |x: usize| f64::from(x % n == first + x / n);
        let b = (0..block.states * n).map(unit).collect();
        first += block.states;
        Block { b, ..block.clone() }
    };
    model.blocks.iter().map(of).collect()
}
