//! Hysteresis of a piezo under voltage drive: the Prandtl-Ishlinskii operator (K. Kuhnen, Modeling, identification and
//! compensation of complex hysteretic nonlinearities, Eur. J. Control 9 (2003), 407),
//!
//! ```text
//! h = w_0 v + w sum_i z_i,    z_i = max(v - r_i, min(v + r_i, z_i)),    r_i = i stroke / (operators + 1)
//! ```
//!
//! with equal weights w of the play operators. It is independent of the rate and remembers turning points only.

use super::parameters::Hysteresis;

/// One piezo: the operator and its memory, at rest at first.
///
/// Over the full stroke the widest part of the loop is the stated share of the travel, and cycles of the stated amplitude
/// have gain 1 from turning point to turning point (held by `the_loop_is_as_wide_as_stated`).
#[derive(Debug, Clone)]
pub struct Piezo {
    direct: f64,
    weight: f64,
    thresholds: Vec<f64>,
    plays: Vec<f64>,
}

impl Piezo {
    /// A piezo that is driven over plus and minus `stroke`, V.
    ///
    /// On the rising branch of the full cycle `z_i = max(v - r_i, r_i - stroke)`. At v = 0 the loop is therefore
    /// `2 w sum min(r_i, stroke - r_i)` wide, and its travel is `2 (w_0 stroke + w sum (stroke - r_i))`; the ratio is the
    /// stated width.
    pub fn new(parameters: &Hysteresis, stroke: f64) -> Self {
        let count = parameters.operators.value;
        let thresholds: Vec<f64> = (1..=count).map(|i| stroke * i as f64 / (count + 1) as f64).collect();
        let widest: f64 = thresholds.iter().map(|r| r.min(stroke - r)).sum();
        let weight = parameters.width.value * stroke / widest;
        let direct = 1.0 - weight * thresholds.iter().map(|r| 1.0 - r / stroke).sum::<f64>();
        let amplitude = parameters.unit_gain_amplitude.value;
        let gain = direct + weight * thresholds.iter().map(|r| (1.0 - r / amplitude).max(0.0)).sum::<f64>();
        Piezo { direct: direct / gain, weight: weight / gain, plays: vec![0.0; count], thresholds }
    }

    /// The output at the voltage v, after all voltages before it.
    #[inline]
    pub fn output(&mut self, v: f64) -> f64 {
        let mut sum = 0.0;
        for (z, r) in self.plays.iter_mut().zip(&self.thresholds) {
            *z = (v - r).max((v + r).min(*z));
            sum += *z;
        }
        self.direct * v + self.weight * sum
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::{Basis, Quantity};
    use super::*;

    fn piezo(operators: usize, width: f64) -> Piezo {
        let basis = Basis::Assumption;
        let parameters = Hysteresis {
            operators: Quantity::new(operators, basis),
            width: Quantity::new(width, basis),
            unit_gain_amplitude: Quantity::new(1.0, basis),
        };
        Piezo::new(&parameters, 5.0)
    }

    /// Voltages and outputs of two cycles of a triangle after the first quarter.
    fn cycles(piezo: &mut Piezo, amplitude: f64) -> Vec<(f64, f64)> {
        let triangle = |k: usize| match (k % 4000) as f64 / 1000.0 {
            p if p < 1.0 => p,
            p if p < 3.0 => 2.0 - p,
            p => p - 4.0,
        };
        (0..9000).map(|k| amplitude * triangle(k)).map(|v| (v, piezo.output(v))).collect()
    }

    #[test]
    fn the_loop_is_as_wide_as_stated() {
        for (operators, width) in [(1, 0.1), (8, 0.12), (10, 0.15), (10, 0.0)] {
            let trace = cycles(&mut piezo(operators, width), 5.0);
            let (falling, rising) = (&trace[1000..3000], &trace[3000..5000]);
            let travel = falling[0].1 - rising[0].1;
            let widest = (1..2000).map(|k| falling[2000 - k].1 - rising[k].1).fold(f64::MIN, f64::max);
            assert!((widest / travel - width).abs() < 1e-9, "{operators}: {}", widest / travel);
            let small = cycles(&mut piezo(operators, width), 1.0);
            assert!((small[1000].1 - 1.0).abs() < 1e-12);
            assert!((small[3000].1 + 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_second_cycle_repeats_the_first() {
        let trace = cycles(&mut piezo(10, 0.12), 3.0);
        assert_eq!(trace[1000..5000], trace[5000..9000]);
    }
}
