//! A model against the response at the lines, and the part of the response that no linear model explains, with the noise of the
//! data as the only scale.
//!
//! Over groups of neighbouring lines, `sum |G_model - G|^2 / sum var G` has an F distribution where the model is right; Paulson's
//! cube root makes a standard normal number of it.

use super::LineResponse;
use super::output_rest;
use super::settling::GROUP;
use crate::lti::FrequencyResponse;
use crate::statistics::f_deviations;
use faer::{Mat, RowRef, c64};
use std::f64::consts::TAU;

/// What a group of neighbouring lines says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineGroup {
    /// Output and input.
    pub entry: (usize, usize),
    /// First and last frequency, Hz.
    pub hz: [f64; 2],
    /// Standard normal number of the excess over the noise.
    pub deviations: f64,
    /// Root mean square of the excess, relative to the response.
    pub relative: f64,
}

impl LineResponse {
    /// A model of the plant at `self.response.omega` against a response to `z = [u, y]`, group by group: the rest `T_y - G T_u`, which is
    /// linear in the noise however small the part of u is that the excitation moves. `relative` is the rest over `T_y`.
    ///
    /// # Panics
    /// If z has not as many signals as the model has inputs and outputs, or the model has fewer frequencies.
    pub fn against(&self, model: &FrequencyResponse) -> Vec<LineGroup> {
        let (p, m) = self.response.omega.first().map_or((0, 0), |_| (model.at(0).nrows(), model.at(0).ncols()));
        let rests: Vec<[Mat<c64>; 2]> = (0..self.response.omega.len())
            .map(|k| {
                let of = output_rest(model.at(k));
                let signals = self.own.get(k).map_or(self.response.at(k), |own| own.means.as_ref());
                [&of * signals, &of * &self.noise[k] * of.adjoint()]
            })
            .collect();
        let of_entry = |(i, j): (usize, usize)| match self.own.is_empty() {
            true => self.of_response((i, j), m, &rests),
            false => self.of_own_lines((i, j), m, &rests),
        };
        (0..p).flat_map(|i| (0..m).map(move |j| (i, j))).flat_map(of_entry).collect()
    }

    fn of_response(&self, (i, j): (usize, usize), m: usize, rests: &[[Mat<c64>; 2]]) -> Vec<LineGroup> {
        let found: Vec<f64> = rests.iter().map(|[rest, _]| rest[(i, j)].norm_sqr()).collect();
        let noise = rests.iter().zip(&self.excitation);
        let noise: Vec<f64> = noise.map(|([_, c], excitation)| excitation[(j, j)].re * c[(i, i)].re).collect();
        let size: Vec<f64> = self.response.entry(m + i, j).iter().map(|t| t.norm_sqr()).collect();
        let lines: Vec<usize> = (0..rests.len()).collect();
        self.groups((i, j), &lines, [&found, &noise, &size], (2.0, self.degrees()))
    }

    /// `y - G u` at the lines that the input excites alone.
    fn of_own_lines(&self, (i, j): (usize, usize), m: usize, rests: &[[Mat<c64>; 2]]) -> Vec<LineGroup> {
        let lines: Vec<usize> = (0..rests.len()).filter(|k| self.own[*k].input == j).collect();
        let count = self.periods.len() as f64;
        let power = |row: RowRef<'_, c64>| row.squared_norm_l2() / count;
        let found: Vec<f64> = lines.iter().map(|k| power(rests[*k][0].row(i))).collect();
        let noise: Vec<f64> = lines.iter().map(|k| rests[*k][1][(i, i)].re).collect();
        let size: Vec<f64> = lines.iter().map(|k| power(self.own[*k].means.row(m + i))).collect();
        self.groups((i, j), &lines, [&found, &noise, &size], (2.0 * count, self.degrees()))
    }

    /// What nonlinear distortion adds to the noise, group by group, for the response from one realisation of the phases; empty unless
    /// there are more experiments than inputs. `1 / (1 + relative^2)` of the power is the most that a linear model explains.
    pub fn distortion(&self) -> Vec<LineGroup> {
        let (experiments, inputs) = (self.periods.len(), self.response.at(0).ncols());
        let realisations = experiments as f64 / inputs as f64;
        let of = |(i, j): (usize, usize)| {
            let total = self.total_variance(i, j)?;
            let degrees = (2.0 * (experiments - inputs) as f64, self.degrees());
            let size: Vec<f64> = self.response.entry(i, j).iter().map(|g| g.norm_sqr()).collect();
            let lines: Vec<usize> = (0..size.len()).collect();
            let mut groups = self.groups((i, j), &lines, [&total, &self.noise_variance(i, j), &size], degrees);
            groups.iter_mut().for_each(|group| group.relative *= realisations.sqrt());
            Some(groups)
        };
        self.entries().filter_map(of).flatten().collect()
    }

    /// Degrees of freedom of the noise variance at a line.
    pub(crate) fn degrees(&self) -> f64 {
        self.degrees
    }

    fn entries(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (p, m) =
            self.response.omega.first().map_or((0, 0), |_| (self.response.at(0).nrows(), self.response.at(0).ncols()));
        (0..p).flat_map(move |i| (0..m).map(move |j| (i, j)))
    }

    /// `found`, `noise` and `size` at `lines`; `degrees` are those of `found` and of `noise` at one line.
    fn groups(
        &self,
        entry: (usize, usize),
        lines: &[usize],
        [found, noise, size]: [&[f64]; 3],
        degrees: (f64, f64),
    ) -> Vec<LineGroup> {
        let group = |first: usize| {
            let range = first..(first + GROUP).min(found.len());
            let sum = |of: &[f64]| of[range.clone()].iter().sum::<f64>();
            let (found, noise, count) = (sum(found), sum(noise), range.len() as f64);
            LineGroup {
                entry,
                hz: [range.start, range.end - 1].map(|k| self.response.omega[lines[k]] / TAU),
                deviations: f_deviations(found / noise.max(f64::MIN_POSITIVE), count * degrees.0, count * degrees.1),
                relative: ((found - noise).max(0.0) / sum(size).max(f64::MIN_POSITIVE)).sqrt(),
            }
        };
        (0..found.len()).step_by(GROUP).map(group).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::lti::{Discrete, StateSpace, frequency_response};
    use crate::signal::{PeriodicExperiment, line_response};
    use crate::{Mat, c64};
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use std::f64::consts::TAU;

    /// u and y of `y = G u + 0.3 u^3 share + noise` under multisines of random phases, six periods of 200 samples.
    fn plant(share: f64, seed: u64) -> (StateSpace<Discrete>, Vec<[Mat<f64>; 2]>) {
        let one = |v: f64| Mat::from_fn(1, 1, |_, _| v);
        let g = StateSpace::new(one(0.8), one(1.0), one(0.5), one(0.0), Discrete::new(1.0).unwrap()).unwrap();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let record = |_| {
            let phases: Vec<f64> = (0..60).map(|_| TAU * rng.random::<f64>()).collect();
            let sine = |t: usize, l: usize| (TAU * (l + 1) as f64 * t as f64 / 200.0 + phases[l]).cos();
            let u = Mat::from_fn(1400, 1, |t, _| 0.2 * (0..60).map(|l| sine(t, l)).sum::<f64>());
            let (mut x, mut y) = (0.0, Mat::zeros(1400, 1));
            for t in 0..1400 {
                y[(t, 0)] = 0.5 * x + 0.05 * rng.sample::<f64, _>(StandardNormal);
                x = 0.8 * x + u[(t, 0)] + share * u[(t, 0)].powi(3);
            }
            [u, y]
        };
        let records = (0..4).map(record).collect();
        (g, records)
    }

    /// Largest standard normal numbers of the model's error and of the distortion, with the errors relative to the response.
    fn worst(share: f64, wrong: f64, seed: u64) -> [[f64; 2]; 2] {
        let (g, records) = plant(share, seed);
        let both: Vec<Mat<f64>> = records
            .iter()
            .map(|[u, y]| Mat::from_fn(1400, 2, |t, k| if k == 0 { u[(t, 0)] } else { y[(t, 0)] }))
            .collect();
        let pairs = records.iter().zip(&both);
        let experiments: Vec<_> =
            pairs.map(|([u, _], z)| PeriodicExperiment { d: u.as_ref(), z: z.as_ref() }).collect();
        let found = line_response(&experiments, g.time()).unwrap();
        let mut model = frequency_response(&g, &found.response.omega).unwrap();
        let values: Vec<c64> = model.entry(0, 0).iter().map(|v| v * (1.0 + wrong)).collect();
        model = crate::lti::FrequencyResponse::new(model.omega, values, 1, 1);
        let largest = |groups: Vec<super::LineGroup>| {
            let by = groups.into_iter().max_by(|a, b| a.deviations.total_cmp(&b.deviations)).unwrap();
            [by.deviations, by.relative]
        };
        [largest(found.against(&model)), largest(found.plant().unwrap().distortion())]
    }

    /// 40 records with 8 groups each: a standard normal number above 4.5 has a probability of 1e-3 over all.
    #[test]
    fn a_right_model_of_a_linear_plant_raises_no_alarm() {
        for seed in 0..40 {
            let [model, distortion] = worst(0.0, 0.0, seed);
            assert!(model[0] < 4.5 && distortion[0] < 4.5, "{model:?} {distortion:?}");
        }
    }

    /// A wrong gain is seen with its size; the distortion is that of the cubic, not of the model.
    #[test]
    fn a_wrong_model_and_a_cubic_are_told_apart() {
        let [model, distortion] = worst(0.0, 0.05, 1);
        assert!(model[0] > 10.0 && (0.03..0.07).contains(&model[1]), "{model:?}");
        assert!(distortion[0] < 4.5, "{distortion:?}");
        let [_, distortion] = worst(0.01, 0.0, 1);
        assert!(distortion[0] > 10.0 && distortion[1] > 0.005, "{distortion:?}");
    }
}
