//! Displacement sensors: run-out, white noise and a converter.

use super::parameters::{Adc, RigParameters, Rotation};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// First number of the random streams of a rig; excitations that are seeded alike use the small numbers.
const FIRST_STREAM: u64 = 0x7269_6700;

/// The random stream of the noise of one sensor, 0 horizontal, 1 vertical.
pub(super) fn noise_stream(seed: u64, axis: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(FIRST_STREAM + axis);
    rng
}

/// Both sensors: `y = convert(l + run-out + noise)`.
#[derive(Debug, Clone)]
pub(super) struct Sensors {
    noise: f64,
    streams: [ChaCha8Rng; 2],
    converter: Option<Converter>,
    run_out: Option<RunOut>,
}

impl Sensors {
    /// White noise alone, as in the paper.
    pub(super) fn ideal(parameters: &RigParameters, seed: u64) -> Self {
        let streams = [0, 1].map(|axis| noise_stream(seed, axis));
        Sensors { noise: parameters.sensor.noise.value, streams, converter: None, run_out: None }
    }

    /// With the converter, where there is one.
    pub(super) fn converted(parameters: &RigParameters, seed: u64) -> Self {
        let converter = parameters.sensor.adc.as_ref().map(Converter::new);
        Sensors { converter, ..Self::ideal(parameters, seed) }
    }

    /// With converter and run-out.
    pub(super) fn of_turning_shaft(parameters: &RigParameters, seed: u64) -> Self {
        let run_out = Some(RunOut::new(&parameters.rotation));
        Sensors { run_out, ..Self::converted(parameters, seed) }
    }

    /// Readings at the displacement l, um, and the angle of the shaft.
    pub(super) fn read(&mut self, l: [f64; 2], angle: f64) -> [f64; 2] {
        let mut y = l;
        if let Some(run_out) = &self.run_out {
            let seen = run_out.seen(angle);
            y = [y[0] + seen[0], y[1] + seen[1]];
        }
        for (y, stream) in y.iter_mut().zip(&mut self.streams) {
            *y += self.noise * stream.sample::<f64, _>(StandardNormal);
            if let Some(converter) = &self.converter {
                *y = converter.convert(*y);
            }
        }
        y
    }
}

/// Rounds to whole steps and clips at the ends of the range.
#[derive(Debug, Clone)]
struct Converter {
    /// Step, um.
    step: f64,
    /// Number of steps below zero; one fewer above.
    half: f64,
}

impl Converter {
    fn new(adc: &Adc) -> Self {
        let half = f64::from(adc.bits.value - 1).exp2();
        Converter { step: adc.range.value / adc.gain.value / half, half }
    }

    fn convert(&self, y: f64) -> f64 {
        self.step * (y / self.step).round().clamp(-self.half, self.half - 1.0)
    }
}

/// The surface that the sensors see, `sum_h a_h cos(h theta + phi_h)`; the vertical sensor sees it a quarter turn later.
#[derive(Debug, Clone)]
struct RunOut {
    /// `a_h [cos phi_h, sin phi_h]`.
    harmonics: [[f64; 2]; 5],
}

impl RunOut {
    fn new(rotation: &Rotation) -> Self {
        let (amplitude, angle) = (rotation.run_out_amplitude.value, rotation.run_out_angle.value);
        let harmonics = std::array::from_fn(|h| [amplitude[h] * angle[h].cos(), amplitude[h] * angle[h].sin()]);
        RunOut { harmonics }
    }

    fn seen(&self, angle: f64) -> [f64; 2] {
        let (sin, cos) = angle.sin_cos();
        [self.surface([cos, sin]), self.surface([sin, -cos])]
    }

    /// Real part of `sum_h c_h turn^h`, by Horner's rule in complex numbers.
    fn surface(&self, turn: [f64; 2]) -> f64 {
        let times_turn = |x: [f64; 2]| [x[0] * turn[0] - x[1] * turn[1], x[0] * turn[1] + x[1] * turn[0]];
        let sum = self.harmonics.iter().rev().fold([0.0; 2], |sum, c| times_turn([sum[0] + c[0], sum[1] + c[1]]));
        sum[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_converter_rounds_to_its_step_and_clips() {
        let converter = Converter::new(RigParameters::shipped().sensor.adc.as_ref().unwrap());
        assert!((converter.step - 0.0388).abs() < 1e-4);
        for y in [0.01, -3.3, 11.7] {
            assert!((converter.convert(y) - y).abs() <= 0.5 * converter.step * (1.0 + 1e-12));
        }
        assert_eq!(converter.convert(1e6), 32767.0 * converter.step);
        assert_eq!(converter.convert(-1e6), -32768.0 * converter.step);
    }

    #[test]
    fn streams_of_the_sensors_are_uncorrelated() {
        let count = 20_000;
        let draw = |seed, axis| -> Vec<f64> {
            let mut rng = noise_stream(seed, axis);
            (0..count).map(|_| rng.sample(StandardNormal)).collect()
        };
        let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>() / count as f64;
        let (h, v, other) = (draw(1, 0), draw(1, 1), draw(2, 0));
        assert!((product(&h, &h) - 1.0).abs() < 0.05);
        // Four standard deviations.
        let bound = 4.0 / (count as f64).sqrt();
        assert!(product(&h, &v).abs() < bound);
        assert!(product(&h, &other).abs() < bound);
        assert!(product(&h[1..], &v[..count - 1]).abs() < bound);
    }
}
