//! Table 1: the nominal model from an open-loop experiment, and the three experiments around it.

use super::experiment::{Case, StudyExperiment, run};
use super::item::{excitation, generator};
use super::settings::PaperSettings;
use crate::{Error, Result};
use rand::RngExt;
use rayon::prelude::*;
use youla::identify::subspace;
use youla_greybox::{GreyBoxModel, Problem, greybox};
use youla_twin::BearingStructure;
use youla_twin::rig::{
    Bearing, BearingRig, ExperimentRecord, Fidelity, OpenLoop, RigParameters, SimulatedRig, run_experiment,
};

/// First stream of the experiments; those of study and map lie elsewhere.
const FIRST: u64 = 1 << 50;

/// The preliminary open-loop identification.
#[derive(Debug, Clone)]
pub struct OpenLoopFit {
    /// The record at 0 rpm without a controller.
    pub record: ExperimentRecord,
    /// The grey-box fit of D, K, B and P.
    pub found: GreyBoxModel,
    /// Its parameters.
    pub bearing: Bearing,
}

/// Everything behind Table 1.
#[derive(Debug, Clone)]
pub struct Experiments {
    /// The nominal model.
    pub nominal: OpenLoopFit,
    /// The columns of Table 1.
    pub list: Vec<StudyExperiment>,
}

/// Identifies the nominal model in open loop at 0 rpm, degrades it in the three ways of the paper and runs the three
/// experiments on the digital twin.
///
/// # Errors
/// [`youla::Error::NotStabilising`] where the controller does not stabilise a degraded model or the rig;
/// speeds and parameters without meaning.
pub fn experiments(parameters: &RigParameters, settings: &PaperSettings) -> Result<Experiments> {
    let cases = cases(settings);
    for case in &cases {
        BearingRig::new(parameters, case.fidelity, 0)?;
    }
    let nominal = open_loop(parameters, settings).map_err(|e| e.within("open-loop experiment at 0 rpm"))?;
    let list = cases
        .into_par_iter()
        .enumerate()
        .map(|(k, case)| {
            let title = case.title.clone();
            run(case, &nominal.bearing, parameters, settings, FIRST + 16 * (k as u64 + 1))
                .map_err(|e| e.within(format!("experiment {title}")))
        })
        .collect::<Vec<Result<_>>>();
    Ok(Experiments { nominal, list: list.into_iter().collect::<Result<_>>()? })
}

fn open_loop(parameters: &RigParameters, settings: &PaperSettings) -> Result<OpenLoopFit> {
    let mut rig = BearingRig::new(parameters, Fidelity::Instrumented, generator(settings.seed, FIRST).random())?;
    let e = &settings.experiments;
    let alpha = excitation(&e.excitation, e.samples, rig.time(), settings.seed, FIRST + 1)?;
    let record = run_experiment(&mut rig, &mut OpenLoop, alpha.as_ref(), &parameters.safety)?;
    let experiment = [subspace::Experiment::new(record.u_applied.as_ref(), record.y.as_ref())];
    let start = BearingStructure::parameters(&e.start);
    let found = greybox(&Problem::new(&BearingStructure, &experiment, rig.time()), &start, &settings.pem)?;
    if !found.stable {
        let pole = found.model.worst_pole()?.unwrap_or_default();
        return Err(Error::Method(youla::Error::Unstable {
            what: "the model that was fitted in open loop".into(),
            pole,
        }));
    }
    Ok(OpenLoopFit { bearing: BearingStructure::bearing(&found.parameters)?, record, found })
}

/// The columns of Table 1 with the paper's figures: nominal, PEM, G(S), G_red(S).
fn cases(settings: &PaperSettings) -> Vec<Case> {
    let rpm = settings.experiments.rpm;
    vec![
        Case {
            key: "speed",
            title: format!("{rpm} rpm, B x 0.7"),
            a_factor: 1.0,
            b_factor: 0.7,
            fidelity: Fidelity::Rotating { rpm },
            figure: 7,
            published: [[51.36, 54.13], [62.87, 75.78], [61.94, 69.19], [60.71, 69.33]],
        },
        Case {
            key: "high-deviation",
            title: "0 rpm, A x 0.5".into(),
            a_factor: 0.5,
            b_factor: 1.0,
            fidelity: Fidelity::Instrumented,
            figure: 6,
            published: [[3.19, 3.0], [48.91, 39.47], [76.76, 83.58], [76.73, 83.53]],
        },
        Case {
            key: "small-deviation",
            title: "0 rpm, A x 0.97".into(),
            a_factor: 0.97,
            b_factor: 1.0,
            fidelity: Fidelity::Instrumented,
            figure: 9,
            published: [[83.21, 76.12], [83.9, 84.63], [83.53, 81.18], [83.07, 79.59]],
        },
    ]
}
