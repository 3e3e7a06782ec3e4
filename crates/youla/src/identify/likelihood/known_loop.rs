//! What is known of the loop in which the records were taken.

use crate::identify::likelihood::data::spectra::Sizes;
use crate::identify::likelihood::search::feedthrough::Answer;
use crate::identify::verdict::share_at_limit;
use crate::linalg::{check_finite, check_shape};
use crate::lti::{Discrete, StateSpace};
use crate::{Error, Mat, MatRef, Result};

/// The signals of one record in the terms of the controller.
///
/// ```text
/// u = K (y - r) + d:           seen = y - r,    explained = u - d,       excitation = d or r
/// u = F x^ + alpha, observer:  seen = [u y],    explained = u - alpha,   excitation = alpha
/// ```
#[derive(Debug, Clone, Copy)]
pub struct LoopSignals<'a> {
    /// What the controller sees, N x its inputs.
    pub seen: MatRef<'a, f64>,
    /// The inputs of the plant that it explains: u without the excitation that is added to it, N x m.
    pub explained: MatRef<'a, f64>,
    /// The inputs of the plant as logged, N x m.
    pub applied: MatRef<'a, f64>,
    /// The external excitation, wherever it enters, N x any number of channels; `None` where it is not known.
    pub excitation: Option<MatRef<'a, f64>>,
}

/// The controller that ran, and the signals of each record in its terms.
#[derive(Debug, Clone)]
pub struct LoopKnowledge<'a> {
    pub(crate) controller: Option<&'a StateSpace<Discrete>>,
    pub(crate) feedback: Option<&'a StateSpace<Discrete>>,
    pub(crate) estimation: Vec<LoopSignals<'a>>,
    pub(crate) verification: Vec<LoopSignals<'a>>,
}

impl<'a> LoopKnowledge<'a> {
    /// From the controller (from what it sees to the inputs that it explains; `None` in open loop), the feedback `u = K y` that it makes,
    /// and the signals of each record in the order of the experiments.
    ///
    /// # Errors
    /// [`Error::Shape`] and [`Error::NotFinite`] with the record.
    pub fn new(
        controller: Option<&'a StateSpace<Discrete>>,
        feedback: Option<&'a StateSpace<Discrete>>,
        estimation: Vec<LoopSignals<'a>>,
        verification: Vec<LoopSignals<'a>>,
    ) -> Result<Self> {
        for (kind, records) in [("estimation", &estimation), ("verification", &verification)] {
            for (k, record) in records.iter().enumerate() {
                check(controller, record).map_err(|e| e.within(format!("{kind} record {}", k + 1)))?;
            }
        }
        Ok(LoopKnowledge { controller, feedback, estimation, verification })
    }

    /// The same of some of the records, by their places.
    pub(crate) fn of_records(&self, estimation: &[usize], verification: &[usize]) -> Self {
        let some =
            |all: &[LoopSignals<'a>], places: &[usize]| places.iter().filter_map(|k| all.get(*k).copied()).collect();
        LoopKnowledge {
            controller: self.controller,
            feedback: self.feedback,
            estimation: some(&self.estimation, estimation),
            verification: some(&self.verification, verification),
        }
    }

    /// What the controller answers to y in the same sample, in units of the sizes: nothing in open loop; `None` where the controller does not see
    /// all of y.
    pub(crate) fn direct(&self, sizes: &Sizes) -> Option<Answer> {
        let (m, p) = (sizes.u.len(), sizes.y.len());
        let Some(k) = self.controller else { return Some(Answer { gain: Mat::zeros(m, p), share: 1.0 }) };
        // what it sees ends with y: y - r, or [u; y] for an observer
        let first = k.inputs().checked_sub(p)?;
        let gain = || Mat::from_fn(m, p, |j, i| k.d()[(j, first + i)] * sizes.y[i] / sizes.u[j]);
        (k.outputs() == m).then(|| Answer { gain: gain(), share: 1.0 - share_at_limit(&self.estimation) })
    }
}

fn check(controller: Option<&StateSpace<Discrete>>, record: &LoopSignals<'_>) -> Result<(), Error> {
    let rows = record.seen.nrows();
    if let Some(k) = controller {
        check_shape("what the controller sees", record.seen, (rows, k.inputs()))?;
        check_shape("what the controller explains", record.explained, (rows, k.outputs()))?;
    }
    check_finite("what the controller sees", record.seen)?;
    check_finite("what the controller explains", record.explained)?;
    if let Some(x) = record.excitation {
        check_shape("the excitation", x, (rows, x.ncols()))?;
        check_finite("the excitation", x)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::likelihood::{Experiment, LikelihoodOptions, recommend};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// `u = clamp(d - 0.5 y)`, at its limits in a sixth of the samples: D, which is zero, is within three deviations (0.0045). With an answer
    /// counted in every sample it is 0.044.
    #[test]
    fn an_input_at_its_limit_answers_nothing_in_the_same_sample() {
        let (rows, rng) = (20_000, &mut ChaCha8Rng::seed_from_u64(4));
        let mut normal = |size: f64| Mat::from_fn(rows, 1, |_, _| size * rng.sample::<f64, _>(StandardNormal));
        let (d, mut y) = (normal(1.0), normal(0.6));
        let (mut u, mut x) = (Mat::<f64>::zeros(rows, 1), 0.0);
        for t in 0..rows {
            y[(t, 0)] += x;
            u[(t, 0)] = (d[(t, 0)] - 0.5 * y[(t, 0)]).clamp(-1.6, 1.6);
            x = 0.9 * x + u[(t, 0)];
        }
        let time = Discrete::new(0.01).unwrap();
        let k = StateSpace::gain(Mat::from_fn(1, 1, |_, _| -0.5), time).unwrap();
        let explained = &u - &d;
        let signals = LoopSignals {
            seen: y.as_ref(),
            explained: explained.as_ref(),
            applied: u.as_ref(),
            excitation: Some(d.as_ref()),
        };
        let known = LoopKnowledge::new(Some(&k), Some(&k), vec![signals], Vec::new()).unwrap();
        let share = known.direct(&Sizes { u: vec![1.0], y: vec![1.0] }).unwrap().share;
        assert!((0.8..0.88).contains(&share), "{share}");
        let options = LikelihoodOptions { feedthrough: Some(true), ..Default::default() };
        let records = [Experiment::new(u.as_ref(), y.as_ref())];
        let found = recommend(&records, &[], Some(&known), time, &options).unwrap();
        assert!(found.plant.d()[(0, 0)].abs() < 0.0135, "{}", found.plant.d()[(0, 0)]);
    }
}
