//! What a twin controls: any plant, and a linear one with noise and what may happen to it.

use youla_rt::State;

/// A plant of M inputs and P outputs, one sample at a time: [`Plant::measure`], then [`Plant::apply`].
pub trait Plant<const M: usize, const P: usize> {
    /// The measurement of this sample.
    fn measure(&mut self) -> [f32; P];

    /// Moves on to the next sample under an input.
    fn apply(&mut self, u: &[f32; M]);
}

/// What may happen to a plant while it runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PlantFault {
    /// A sensor gives NaN.
    SensorNotFinite(usize),
    /// A sensor keeps its value.
    SensorStuck(usize),
    /// All actuators have this factor.
    ActuatorGain(f64),
}

/// `x+ = A x + B u + w, y = C x + v` in `f64`, w and v uniform.
#[derive(Debug, Clone)]
pub struct LinearPlant<const N: usize, const M: usize, const P: usize> {
    /// State matrix.
    pub a: [[f64; N]; N],
    /// Input matrix.
    pub b: [[f64; M]; N],
    /// Output matrix.
    pub c: [[f64; N]; P],
    /// Largest magnitude of w and v.
    pub noise: [f64; 2],
    /// Seed of the noise.
    pub seed: u64,
    /// At present.
    pub fault: Option<PlantFault>,
    state: State<f64, N>,
    last: [f32; P],
}

impl<const N: usize, const M: usize, const P: usize> LinearPlant<N, M, P> {
    /// At rest.
    pub fn new(a: [[f64; N]; N], b: [[f64; M]; N], c: [[f64; N]; P], noise: [f64; 2], seed: u64) -> Self {
        LinearPlant { a, b, c, noise, seed, fault: None, state: State::at_rest(), last: [0.0; P] }
    }

    /// Between -1 and 1: splitmix64.
    fn random(&mut self) -> f64 {
        self.seed = self.seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.seed;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ z >> 31) as i64 as f64 / 2_f64.powi(63)
    }

    /// Pushes the state.
    pub fn push(&mut self, by: [f64; N]) {
        let moved = std::array::from_fn(|i| self.state.xh()[i] + by[i]);
        self.state = State::new(moved);
    }

    /// The state.
    pub fn state(&self) -> &[f64; N] {
        self.state.xh()
    }
}

impl<const N: usize, const M: usize, const P: usize> Plant<M, P> for LinearPlant<N, M, P> {
    fn measure(&mut self) -> [f32; P] {
        for i in 0..P {
            let stuck = self.fault == Some(PlantFault::SensorStuck(i));
            let noise = self.noise[1] * self.random();
            let y: f64 = self.c[i].iter().zip(self.state.xh()).map(|(c, x)| c * x).sum();
            match self.fault {
                _ if stuck => (),
                Some(PlantFault::SensorNotFinite(at)) if at == i => self.last[i] = f32::NAN,
                _ => self.last[i] = (y + noise) as f32,
            }
        }
        self.last
    }

    fn apply(&mut self, u: &[f32; M]) {
        let gain = match self.fault {
            Some(PlantFault::ActuatorGain(gain)) => gain,
            _ => 1.0,
        };
        let mut next = [0.0; N];
        for i in 0..N {
            let of_x: f64 = self.a[i].iter().zip(self.state.xh()).map(|(a, x)| a * x).sum();
            let of_u: f64 = self.b[i].iter().zip(u).map(|(b, u)| b * gain * f64::from(*u)).sum();
            next[i] = of_x + of_u + self.noise[0] * self.random();
        }
        self.state = State::new(next);
    }
}
