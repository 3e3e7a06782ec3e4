//! Random plants and random controllers: what a user may bring, the ordinary and the awkward.

use crate::common::{normal, random_system};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use youla::Mat;
use youla::lti::{StateSpace, TimeDomain};

/// A plant and the coordinates in which it was drawn, where no unit hides anything.
pub(crate) struct Drawn<T: TimeDomain> {
    /// States, inputs and outputs in units of their own.
    pub(crate) plant: StateSpace<T>,
    /// The same before the units.
    pub(crate) core: StateSpace<T>,
    /// `x_core = x * state`.
    pub(crate) state: Vec<f64>,
    /// `u_core = u * input`.
    pub(crate) input: Vec<f64>,
    /// `y = y_core * output`.
    pub(crate) output: Vec<f64>,
    /// Whether who designs the controller minds the units.
    pub(crate) mindful: bool,
}

impl<T: TimeDomain> Drawn<T> {
    /// A system from y to u, drawn without units, in those of the plant.
    pub(crate) fn in_units(&self, k: StateSpace<T>) -> StateSpace<T> {
        if !self.mindful {
            return k;
        }
        let b = Mat::from_fn(k.order(), k.inputs(), |i, j| k.b()[(i, j)] / self.output[j]);
        let c = Mat::from_fn(k.outputs(), k.order(), |i, j| k.c()[(i, j)] / self.input[i]);
        let d = Mat::from_fn(k.outputs(), k.inputs(), |i, j| k.d()[(i, j)] / self.input[i] / self.output[j]);
        system(&k, b, c, d)
    }
}

/// Ten to the power of a number between the two.
pub(crate) fn decades(rng: &mut ChaCha8Rng, from: f64, to: f64) -> f64 {
    10f64.powf(rng.random_range(from..to))
}

/// Orders from 0 to 40: 70 % up to 6, 20 % from 7 to 15, 7 % from 16 to 30, 3 % from 31 to 40.
fn order(rng: &mut ChaCha8Rng) -> usize {
    match rng.random_range(0..100) {
        0..70 => rng.random_range(0..=6),
        70..90 => rng.random_range(7..=15),
        90..97 => rng.random_range(16..=30),
        _ => rng.random_range(31..=40),
    }
}

/// A plant with 1 to 4 inputs and outputs: a random matrix or a sum of modes, in a third of the cases with one mode that is
/// almost or quite out of reach of the inputs or out of sight of the outputs, in a third with units over eight decades.
pub(crate) fn plant<T: TimeDomain>(rng: &mut ChaCha8Rng, time: T) -> Drawn<T> {
    let (n, m, p) = (order(rng), rng.random_range(1..=4), rng.random_range(1..=4));
    let feedthrough = if rng.random_bool(0.3) { 0.0 } else { 1.0 };
    let core = if n == 0 {
        StateSpace::gain(normal(rng, p, m), time).unwrap()
    } else if rng.random_bool(0.4) {
        let instability = rng.random_range(-0.3..0.3);
        let s = random_system(rng, (n, m, p), instability, time);
        system(&s, s.b().to_owned(), s.c().to_owned(), s.d() * faer::Scale(feedthrough))
    } else {
        modal(rng, (n, m, p), feedthrough, time)
    };
    let units = |rng: &mut ChaCha8Rng, count: usize, scaled: bool| -> Vec<f64> {
        (0..count).map(|_| if scaled { decades(rng, -4.0, 4.0) } else { 1.0 }).collect()
    };
    let (states, channels) = (rng.random_bool(0.3), rng.random_bool(0.3));
    let (x, u, y) = (units(rng, n, states), units(rng, m, channels), units(rng, p, channels));
    let plant = core.with_scaled_states(&x);
    let b = Mat::from_fn(n, m, |i, j| plant.b()[(i, j)] * u[j]);
    let c = Mat::from_fn(p, n, |i, j| plant.c()[(i, j)] * y[i]);
    let d = Mat::from_fn(p, m, |i, j| plant.d()[(i, j)] * y[i] * u[j]);
    let mindful = rng.random_bool(0.85);
    Drawn { plant: system(&plant, b, c, d), core, state: x, input: u, output: y, mindful }
}

/// The same states with other ports.
fn system<T: TimeDomain>(of: &StateSpace<T>, b: Mat<f64>, c: Mat<f64>, d: Mat<f64>) -> StateSpace<T> {
    StateSpace::new(of.a().to_owned(), b, c, d, of.time()).unwrap()
}

/// Modes from 0.1 to 10 rad/s, damping ratios from 1e-6 to 1, a quarter of them negative, some integrators, behind a rotation.
fn modal<T: TimeDomain>(
    rng: &mut ChaCha8Rng,
    shape: (usize, usize, usize),
    feedthrough: f64,
    time: T,
) -> StateSpace<T> {
    let (n, m, p) = shape;
    let (mut a, mut b, mut c) = (Mat::<f64>::zeros(n, n), normal(rng, n, m), normal(rng, p, n));
    let mut k = 0;
    while k < n {
        let size = if k + 1 < n && rng.random_bool(0.7) { 2 } else { 1 };
        let (w, zeta) = (decades(rng, -1.0, 1.0), decades(rng, -6.0, 0.0));
        let sign = if rng.random_bool(0.25) { 1.0 } else { -1.0 };
        let (mut re, im) = if size == 2 { (sign * zeta * w, w * (1.0 - zeta * zeta).sqrt()) } else { (sign * w, 0.0) };
        if size == 1 && rng.random_bool(0.2) {
            re = 0.0;
        }
        let (re, im) = match time.sample_time() {
            None => (re, im),
            Some(ts) => ((re * ts).exp() * (im * ts).cos(), (re * ts).exp() * (im * ts).sin()),
        };
        for i in 0..size {
            a[(k + i, k + i)] = re;
        }
        if size == 2 {
            (a[(k, k + 1)], a[(k + 1, k)]) = (im, -im);
        }
        k += size;
    }
    if rng.random_bool(0.5) {
        let (k, weak) = (rng.random_range(0..n), if rng.random_bool(0.3) { 0.0 } else { decades(rng, -18.0, 0.0) });
        let first = if k > 0 && a[(k, k - 1)] != 0.0 { k - 1 } else { k };
        let last = if k + 1 < n && a[(k, k + 1)] != 0.0 { k + 1 } else { k };
        let input = rng.random::<bool>();
        for i in first..=last {
            (0..m).for_each(|j| b[(i, j)] *= if input { weak } else { 1.0 });
            (0..p).for_each(|j| c[(j, i)] *= if input { 1.0 } else { weak });
        }
    }
    let q = normal(rng, n, n).qr().compute_thin_Q();
    let d = normal(rng, p, m) * faer::Scale(feedthrough);
    StateSpace::new(&q * a * q.transpose(), &q * b, c * q.transpose(), d, time).unwrap()
}

/// A controller with nothing to do with the plant: a gain of any size, or a random system.
pub(crate) fn foreign<T: TimeDomain>(rng: &mut ChaCha8Rng, plant: &StateSpace<T>) -> StateSpace<T> {
    let (m, p, time) = (plant.inputs(), plant.outputs(), plant.time());
    let gain = decades(rng, -4.0, 1.0);
    match rng.random_range(0..3) {
        0 => StateSpace::gain(Mat::zeros(m, p), time).unwrap(),
        1 => StateSpace::gain(normal(rng, m, p) * faer::Scale(gain), time).unwrap(),
        _ => {
            let (n, instability) = (rng.random_range(1..=6), rng.random_range(-0.5..0.1));
            let s = random_system(rng, (n, p, m), instability, time);
            system(&s, s.b() * faer::Scale(gain), s.c().to_owned(), s.d() * faer::Scale(gain))
        }
    }
}
