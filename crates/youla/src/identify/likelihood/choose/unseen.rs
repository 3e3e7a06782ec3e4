//! Modes that only the noise shows.
//!
//! Where the excitation moves nothing, the inputs are what the feedback brings of the noise, and `y = (I - G K)^-1 H e` is all that is seen:
//! for every G there is an H that explains it. A peak of the noise takes four numbers as a mode of G and many as an autoregression, so
//! that Schwarz's criterion makes it a mode of the plant. It is left to the noise where the model rests on noise otherwise. Cogging of an axis
//! that moves back and forth is such a peak beside an excitation: a mode that its zeros nearly cancel, at which the model fails its tests.

use super::lines::Cleaned;
use super::problem::{Choice, Problem, Solution};
use super::solve::best;
use crate::identify::likelihood::{Candidate, Evidence};
use crate::identify::subspace::Experiment;
use std::f64::consts::TAU;
use std::sync::Arc;

/// A model without the modes that the excitation does not show.
pub(crate) struct WithoutUnseen {
    /// The model with the outputs that it is the model of.
    pub(crate) found: Cleaned,
    /// Frequencies of the modes that were left out, shares of the sample rate.
    turns: Vec<f64>,
}

impl WithoutUnseen {
    /// The same with the model that has the modes as a rival of equal weight: the region holds what they would do in the plant.
    pub(crate) fn beside(mut self, with: &Choice) -> Self {
        self.found.solution.unseen = Some(with.clone());
        self
    }

    /// The modes that were left out.
    pub(crate) fn evidence(&self, ts: f64) -> Evidence {
        let question = "Resonances that only the noise shows, left to the model of the noise (unseen modes)";
        let hz: Vec<String> = self.turns.iter().map(|turns| format!("{:.4}", turns / ts)).collect();
        let note =
            format!("at {} Hz, where the excitation shows none: the response there continues the model", hz.join(", "));
        Evidence::new(question, self.turns.len() as f64, 0.0).reported().noted(note)
    }
}

/// Whether a mode, at a share of the sample rate, is no disturbance at one frequency: a pole of the loop outside of the unit circle that the feedback
/// does not move.
pub(crate) fn is_damped(all: &Problem<'_>, choice: &Choice) -> impl Fn(f64) -> bool {
    let (resolved, outside) = (1.0 / all.samples().0 as f64, all.poles_outside(choice));
    move |turns| outside.iter().all(|(z, _)| (z.arg().abs() / TAU - turns).abs() > resolved)
}

/// The model without the modes at frequencies, shares of the sample rate, at which the excitation does not show it; `None` where there are none,
/// and where the order is given.
pub(crate) fn without_unseen(
    all: &Problem<'_>,
    now: &Cleaned,
    shown: &dyn Fn(f64) -> bool,
    table: &mut Vec<Candidate>,
) -> Option<WithoutUnseen> {
    let choice = &now.solution.chosen;
    let model = choice.found.point.model.separated().filter(|_| all.order.is_none())?;
    let turns_of = |k: usize| model.blocks[k].poles().into_iter().find(|pole| pole.im > 0.0).map(|z| z.arg() / TAU);
    let unseen: Vec<(usize, f64)> =
        (0..model.blocks.len()).filter_map(|k| Some((k, turns_of(k).filter(|turns| !shown(*turns))?))).collect();
    let (places, turns): (Vec<usize>, Vec<f64>) = unseen.into_iter().unzip();
    if places.is_empty() || places.len() == model.blocks.len() {
        return None;
    }
    let records: Vec<Experiment<'_>> = now.records(0, all.experiments);
    let problem = now.problem(all, &records);
    let spectra = Arc::new(problem.spectra(&choice.delays));
    let origin = "without what only the noise shows";
    let task = problem.beside(&choice.found.noise, model.without(&places), &spectra, origin);
    let mut tried = problem.run(vec![task], f64::INFINITY, table);
    let at = best(&tried)?.clone();
    problem.along_delays(&mut tried, &at, table);
    let at = best(&tried)?.clone();
    let solution: Solution = problem.concluded(tried, &at)?;
    Some(WithoutUnseen { found: Cleaned { solution, ..now.clone() }, turns })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Drive;
    use crate::identify::likelihood::{LikelihoodOptions, problem};
    use crate::lti::{Discrete, StateSpace, simulate};
    use faer::Mat;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// A mode at 0.1 of the sample rate beside a lag: it is left out where the excitation does not show it, and the lag stays.
    #[test]
    fn a_mode_that_is_not_shown_is_left_out_and_a_lag_stays() {
        let rng = &mut ChaCha8Rng::seed_from_u64(4);
        let mut normal = |size: f64| Mat::from_fn(3000, 1, |_, _| size * rng.sample::<f64, _>(StandardNormal));
        let (u, noise) = (normal(1.0), normal(0.05));
        let (cos, sin) = (0.97 * (TAU * 0.1).cos(), 0.97 * (TAU * 0.1).sin());
        let entries = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 0.9]];
        let a = Mat::from_fn(3, 3, |i, j| entries[i][j]);
        let (b, c) = (Mat::from_fn(3, 1, |_, _| 0.3), Mat::from_fn(1, 3, |_, _| 1.0));
        let plant = StateSpace::new(a, b, c, Mat::zeros(1, 1), Discrete::new(1.0).unwrap()).unwrap();
        let y = simulate(&plant, u.as_ref(), &[0.0; 3]).unwrap() + noise;
        let records = [Experiment::new(u.as_ref(), y.as_ref())];
        let all = problem(&records, None, &LikelihoodOptions::default()).unwrap();
        let solution = all.solve(&mut Vec::new()).unwrap();
        assert_eq!(solution.chosen.order(), 3);
        let now = Cleaned::untouched(solution);
        let without = |shown: &dyn Fn(f64) -> bool| without_unseen(&all, &now, shown, &mut Vec::new());
        assert!(without(&|_| true).is_none());
        let less = without(&|turns| turns < 0.05).unwrap();
        let left = &less.found.solution.chosen;
        let pole = left.found.point.model.poles()[0];
        assert!(left.order() == 1 && pole.im == 0.0 && (0.8..1.0).contains(&pole.re), "{} {pole}", left.order());
        assert!(less.turns.len() == 1 && (less.turns[0] - 0.1).abs() < 1e-3, "{:?}", less.turns);
        let beside = without(&|turns| turns < 0.05).unwrap().beside(&now.solution.chosen).found.solution;
        let (last, criterion) = beside.weighed().last().unwrap();
        assert_eq!(last.order(), 3);
        assert_eq!(criterion, beside.chosen.as_rival(beside.samples));
        let evidence = less.evidence(1e-3);
        assert!(evidence.holds() && evidence.note.starts_with("at 100."), "{evidence}");
    }

    /// A drive under a torque of 0.03 of the sample rate, a third of the excitation, whose phase jumps every 1500 samples, as that of cogging where an axis
    /// turns back: u, y and d.
    fn cogging(drive: &Drive, seed: u64) -> [Mat<f64>; 3] {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut phase = 0.0;
        drive.records(12000, |t| {
            if t % 1500 == 0 {
                phase = TAU * rng.random::<f64>();
            }
            let d = if rng.random::<bool>() { 1.0 } else { -1.0 };
            [d, 0.3 * (TAU * 0.03 * t as f64 + phase).cos(), 0.002 * rng.sample::<f64, _>(StandardNormal)]
        })
    }

    /// Beside an excitation that shows the response at its frequency, cogging is no mode of the drive, of whose margin the region would take more
    /// than half: the model is trusted in five of five records, with deviations that hold, and where it is named, as a line or as an unseen mode, it is
    /// not in the model. With a gain of its own for the noise the model with a mode for it passes its tests as well in some records.
    #[test]
    fn cogging_beside_an_excitation_is_left_to_the_noise() {
        let drive = Drive { pole: 0.995 };
        let mut named = 0;
        for seed in 0..5 {
            let found = drive.recommended(&cogging(&drive, seed), &LikelihoodOptions::default());
            assert!(found.trusted(), "seed {seed}: {:?}", found.reasons());
            let of = |name: &str| found.evidence.iter().find(|e| e.question.ends_with(name));
            for (test, before) in [("(unseen modes)", ""), ("(lines)", "taken out of the outputs ")] {
                if let Some(disturbance) = of(test) {
                    named += 1;
                    let at = disturbance.note.strip_prefix(before).unwrap();
                    assert!(
                        found.order == 2 && ["at 29.", "at 30."].iter().any(|near| at.starts_with(near)),
                        "{disturbance}"
                    );
                }
            }
            let error = drive.largest_error(&found);
            assert!(error < 2.5, "seed {seed}: {error}");
        }
        assert!(named >= 2, "{named}");
    }
}
