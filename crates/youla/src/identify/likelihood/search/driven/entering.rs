//! Noise at the inputs as a step of a search sees it: the plant shapes it, so that its filter moves with the parameters.
//!
//! With `v = y - G u` and `epsilon = v / H` the slopes of the whitened residual are those of
//! ```text
//! dG u + dH epsilon,      H = 1 + C M K,      M = (z I - A)^-1
//! ```
//! before the autoregression: of the output of a Kalman filter of all outputs, `X = M (B (u + w) + z t + K epsilon)` with w the estimated
//! noise at the inputs where it has a colour, `w = (K_w epsilon + z t_w) / (z - c)`, and `C M dK epsilon`. In a loop that holds the output, u is at low frequencies minus
//! the noise at the input. With the filter held, the squares would be least for a plant without gain there, and the information on its gain many
//! times too large.
//!
//! K is that of the Riccati equation, and its slopes solve one Stein equation for each parameter: with `F = A - K C` of plant and colour, P the
//! covariance of their states, Q and R the variances at the inputs and of the sensors, S that of the innovation, K being optimal,
//! ```text
//! dP = F dP F' + (dA - K dC) P F' + F P (dA - K dC)' + d(B Q B') + K dR K'
//! dK = ((dA - K dC) P C' + F (dP C' + P dC') - K dR) S^-1
//! ```
//! Source: L. Ljung, System Identification, 2nd ed. (1999), sections 7.2 and 10.3, in the form of a filter that depends on the plant.

use super::gains::hidden;
use super::kalman::{System, diagonal, places_of};
use super::{Kalman, longest};
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::noise::Noise;
use crate::linalg::{RealSchur, discrete_lyapunov_on, real_schur};
use faer::Mat;

/// Noise at the inputs as all outputs see it.
pub(crate) struct Entering {
    /// The gain K.
    kalman: Kalman,
    /// Whether an output sees a state.
    seen: Vec<bool>,
    /// dK of the states of the plant, then of the colours, by parameters, for each output.
    slopes: Vec<Mat<f64>>,
    /// The same along each free variance and along the pole of the colour.
    by_entry: Vec<Mat<f64>>,
}

/// What moves: A, B and C, the variances at the inputs and those of the sensors.
struct Change {
    a: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
    inputs: Vec<f64>,
    sensors: Vec<f64>,
}

/// The filter of Kalman, from which the slopes of its gain follow.
struct Filter<'a> {
    system: System,
    kalman: &'a Kalman,
    gain: Mat<f64>,
    /// `A - K C`, and its Schur form.
    closed: Mat<f64>,
    schur: RealSchur,
    /// Inverse of S.
    precision: Mat<f64>,
}

impl<'a> Filter<'a> {
    fn new(system: System, kalman: &'a Kalman, gain: Mat<f64>) -> Option<Self> {
        let closed = &system.a - &gain * &system.c;
        let schur = real_schur("the noise", closed.as_ref()).ok()?;
        Some(Filter { system, kalman, gain, closed, schur, precision: kalman.precision() })
    }

    fn unchanged(&self) -> Change {
        let of = |m: &Mat<f64>| Mat::zeros(m.nrows(), m.ncols());
        let none = |v: &[f64]| vec![0.0; v.len()];
        let (System { a, b, c }, entry) = (&self.system, &self.kalman.entry);
        Change { a: of(a), b: of(b), c: of(c), inputs: none(&entry.inputs), sensors: none(&entry.sensors) }
    }

    /// What moves with the entries of a block, whose states begin at `at` of the filter. Colours, whose states begin at the given place, drive the
    /// plant through its B, white noise drives it by itself.
    fn along(&self, (block, at): (&Block, usize), colours: Option<usize>, moved: impl Fn(usize) -> f64) -> Change {
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
            (0..change.c.nrows()).for_each(|o| change.c[(o, at + i)] = moved(s * (s + m) + o * s + i));
        }
        change
    }

    /// dK along a change.
    fn slope(&self, change: &Change) -> Option<Mat<f64>> {
        let (System { b, c, .. }, closed, p) = (&self.system, &self.closed, &self.kalman.covariance);
        let at_inputs = &self.kalman.entry.inputs;
        let closed_change = &change.a - &self.gain * &change.c;
        let drive = |i: usize, j: usize| at_inputs[j] * change.b[(i, j)] + 0.5 * change.inputs[j] * b[(i, j)];
        let half = &closed_change * p * closed.transpose() + Mat::from_fn(b.nrows(), b.ncols(), drive) * b.transpose();
        let mut both = &half + half.transpose();
        let sensors = &self.gain * diagonal(&change.sensors);
        let of_sensors = change.sensors.iter().any(|v| *v != 0.0);
        if of_sensors {
            both += &sensors * self.gain.transpose();
        }
        let dp = discrete_lyapunov_on(&self.schur, both.as_ref()).ok()?;
        let mut dk = closed_change * p * c.transpose() + closed * (dp * c.transpose() + p * change.c.transpose());
        if of_sensors {
            dk -= sensors;
        }
        Some(dk * &self.precision)
    }
}

impl Entering {
    /// Of the noise of records, in the coordinates of a model; `None` where none enters.
    pub(crate) fn new(spectra: &Spectra, model: &Model, chart: &Chart, noise: &Noise) -> Option<Self> {
        let hidden = hidden(model, longest(spectra), 0..model.outputs);
        let entry = noise.entry()?.clone();
        if !entry.free.is_empty() {
            return Some(Entering::free(noise.joint.as_ref()?.kalman.clone(), model, chart));
        }
        let kalman = Kalman::new(model, &hidden, (0..model.outputs, entry))?.0;
        let (m, n, p) = (model.inputs, model.order(), model.outputs);
        // Of the states of the filter their places among those of the plant, behind which are those of the colours.
        let gains = kalman.gains();
        let places = places_of(model, &hidden, gains.nrows());
        let of_plant = places.len() - kalman.of_colour.nrows();
        let seen = (0..n).map(|state| places.contains(&state)).collect();
        let gain = Mat::from_fn(places.len(), p, |i, o| gains[(places[i], o)]);
        let system = System::new(&model.without(&hidden), 0..p, kalman.entry.colour);
        let filter = Filter::new(system, &kalman, gain)?;
        let put = |to: &mut [Mat<f64>], column: usize, change: &Change| {
            let dk = filter.slope(change)?;
            for (o, to) in to.iter_mut().enumerate() {
                places.iter().enumerate().for_each(|(i, place)| to[(*place, column)] = dk[(i, o)]);
            }
            Some(())
        };
        let mut slopes = vec![Mat::<f64>::zeros(n + m, chart.parameters()); p];
        let colours = kalman.entry.colour.map(|_| of_plant);
        let (mut column, mut at) = (0, 0);
        for (k, block) in model.blocks.iter().enumerate() {
            if !hidden.contains(&k) {
                for q in 0..chart.parameters_of(k) {
                    let moved = |entry: usize| chart.direction(k, entry, q);
                    put(&mut slopes, column + q, &filter.along((block, at), colours, moved))?;
                }
                at += block.states;
            }
            column += chart.parameters_of(k);
        }
        let mut by_entry = vec![Mat::<f64>::zeros(n + m, kalman.entry.parameters()); p];
        let directions = kalman.entry.directions();
        let of_colour = directions.len();
        for (which, [inputs, sensors]) in directions.into_iter().enumerate() {
            put(&mut by_entry, which, &Change { inputs, sensors, ..filter.unchanged() })?;
        }
        if kalman.entry.colour.is_some() {
            let mut change = filter.unchanged();
            (0..m).for_each(|j| change.a[(of_plant + j, of_plant + j)] = 1.0);
            put(&mut by_entry, of_colour, &change)?;
        }
        Some(Entering { kalman, seen, slopes, by_entry })
    }

    /// Of gains that are free: they stay where the plant moves.
    fn free(kalman: Kalman, model: &Model, chart: &Chart) -> Self {
        let (n, m, p) = (model.order(), model.inputs, model.outputs);
        let free = &kalman.entry.free;
        let seen = (0..n).map(|state| free.contains(&state)).collect();
        let places: Vec<usize> = free.iter().copied().chain(n..n + kalman.of_colour.nrows()).collect();
        let mut by_entry = vec![Mat::<f64>::zeros(n + m, kalman.entry.parameters()); p];
        for (which, (state, o)) in places.iter().flat_map(|state| (0..p).map(move |o| (*state, o))).enumerate() {
            by_entry[o][(state, which)] = 1.0;
        }
        Entering { kalman, seen, slopes: vec![Mat::zeros(n + m, chart.parameters()); p], by_entry }
    }

    /// Pole of the colour.
    pub(crate) fn colour(&self) -> Option<f64> {
        self.kalman.entry.colour
    }

    /// Number of free variances, and of the pole of the colour.
    pub(crate) fn parameters(&self) -> usize {
        self.kalman.entry.parameters()
    }

    /// K_w of an input and an output.
    #[inline(always)]
    pub(crate) fn of_colour(&self, input: usize, output: usize) -> f64 {
        self.kalman.of_colour[(input, output)]
    }

    /// K of a state and an output.
    #[inline(always)]
    pub(crate) fn gain(&self, state: usize, output: usize) -> f64 {
        self.kalman.gain[(state, output)]
    }

    /// Whether an output sees a state.
    #[inline(always)]
    pub(crate) fn sees(&self, state: usize) -> bool {
        self.seen[state]
    }

    /// dK of a state and an output along a parameter.
    #[inline(always)]
    pub(crate) fn slope(&self, (state, output): (usize, usize), parameter: usize) -> f64 {
        self.slopes[output][(state, parameter)]
    }

    /// The same along a free variance, or along the pole of the colour, the last.
    #[inline(always)]
    pub(crate) fn by_entry(&self, (state, output): (usize, usize), which: usize) -> f64 {
        self.by_entry[output][(state, which)]
    }
}
