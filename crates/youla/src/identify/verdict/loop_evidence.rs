//! What the known loop says: controller and excitation.

use crate::identify::likelihood::choose::problem::Solution;
use crate::identify::likelihood::data::spectra::{Sizes, Spectra};
use crate::identify::likelihood::deviation::missed::Missed;
use crate::identify::likelihood::deviation::{grid, response};
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::with_best_ends;
use crate::identify::likelihood::{Evidence, LoopKnowledge};
use crate::identify::subspace::Experiment;
use crate::linalg::TINY;
use crate::lti::{Discrete, StateSpace};
use faer::{MatRef, c64};

/// Largest relative error that the excitation may show.
const LARGEST_ERROR: f64 = 0.1;
/// Largest share of the inputs that the stated controller may leave.
const LARGEST_REST: f64 = 0.05;

/// What the stated controller and the known excitation say.
pub(crate) fn of_loop(
    spectra: &Spectra,
    solution: &Solution,
    known: Option<&LoopKnowledge<'_>>,
    missed: Option<&Missed>,
) -> Vec<Evidence> {
    let mut out = Vec::new();
    // Without a known excitation all of it is in what the controller leaves, which says nothing of the controller.
    let asked = known.filter(|_| missed.is_some());
    if let Some((k, known)) = asked.and_then(|known| Some((known.controller?, known))) {
        let records: Vec<_> =
            known.estimation.iter().chain(&known.verification).map(|r| (r.seen, r.explained)).collect();
        out.extend(controller(k, &records));
    }
    out.push(match missed {
        Some(missed) => error(spectra, solution, missed),
        None => Evidence::new("No external excitation is known in the estimation records (1: none)", 1.0, 0.0),
    });
    out
}

/// The error of the response that the excitation shows, relative, root mean square over frequency.
fn error(spectra: &Spectra, solution: &Solution, missed: &Missed) -> Evidence {
    let entries = spectra.inputs * spectra.outputs;
    let shares = grid(spectra.samples());
    let relative = |share: &f64| {
        let size: f64 = response(&solution.chosen, *share).iter().map(|g| g.norm_sqr()).sum();
        missed.near(*share, entries).iter().sum::<f64>() / size.max(TINY)
    };
    let mean = shares.iter().map(relative).sum::<f64>() / shares.len() as f64;
    Evidence::new(
        "Error of the model against the response that the excitation shows, relative, beyond chance (indirect response)",
        mean.sqrt(),
        LARGEST_ERROR,
    )
    .beyond_chance(missed.significance)
}

/// How well a controller explains the inputs: rms of `u - K (y - r) - d` over rms of `u - d`, ends of the records free.
fn controller(controller: &StateSpace<Discrete>, records: &[(MatRef<'_, f64>, MatRef<'_, f64>)]) -> Option<Evidence> {
    let experiments: Vec<Experiment<'_>> = records.iter().map(|(from, to)| Experiment::new(*from, *to)).collect();
    let (m, p) = (controller.inputs(), controller.outputs());
    let d = (0..p * m).map(|x| controller.d()[(x / m, x % m)]).collect();
    let model = Model::of(controller.a(), controller.b(), controller.c(), d)?;
    let sizes = Sizes { u: vec![1.0; m], y: vec![1.0; p] };
    let spectra = Spectra::new(&experiments, &sizes, &vec![0; m], 0);
    let point = with_best_ends(&spectra, model, &Noise::white(p));
    let power = |v: &[Vec<c64>]| v.iter().flatten().map(|x| x.norm_sqr()).sum::<f64>();
    let left = power(&point.residuals(&spectra));
    let all: f64 = spectra.records.iter().map(|r| r.y.iter().map(|x| x.norm_sqr()).sum::<f64>()).sum();
    Some(Evidence::new(
        "Part of the inputs that the stated controller does not explain (controller)",
        (left / all.max(TINY)).sqrt(),
        LARGEST_REST,
    ))
}
