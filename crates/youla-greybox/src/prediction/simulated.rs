//! What is simulated with the sampled model, and with what its outputs are compared.

use crate::closure::Closure;
use crate::prediction::noise::NoiseModel;
use crate::prediction::predictor::Predictor;
use crate::prediction::sampled::SampledSlope;
use crate::prediction::sensitivity::Samples;
use crate::prediction::whitening::Whitening;
use crate::{Error, Result};
use youla::identify::subspace::Experiment;
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// What is simulated.
pub(crate) enum Simulated<'a> {
    /// The plant: output error.
    Plant,
    /// The controller around the plant.
    Loop(Closure<'a>),
    /// The one-step predictor with a free gain.
    Predictor(Predictor),
    /// The plant behind the inverse of the noise filter.
    Filtered(Whitening),
}

impl<'a> Simulated<'a> {
    /// What belongs to a closure or to a noise model; a loop has no noise model.
    pub(crate) fn new(
        closure: Option<Closure<'a>>,
        noise: &NoiseModel,
        (order, outputs): (usize, usize),
        time: Discrete,
    ) -> Result<Self> {
        match (closure, noise) {
            (Some(closure), NoiseModel::OutputError) => Ok(Simulated::Loop(closure)),
            (Some(_), _) => {
                let (what, instead) = ("a noise model inside of a simulated loop", "take noise = \"output-error\"");
                Err(Error::Method(youla::Error::Unsupported { what, instead }))
            }
            (None, NoiseModel::OutputError) => Ok(Simulated::Plant),
            (None, NoiseModel::Innovation(start)) => {
                Ok(Simulated::Predictor(Predictor::new(&start.gain, order, outputs)?))
            }
            (None, NoiseModel::Filter(filter)) => {
                Ok(Simulated::Filtered(Whitening::new(filter.inverse(outputs, time)?)))
            }
        }
    }

    /// States beyond those of the plant.
    pub(crate) fn further_states(&self) -> usize {
        match self {
            Simulated::Plant | Simulated::Predictor(_) => 0,
            Simulated::Loop(closure) => closure.order(),
            Simulated::Filtered(whitening) => whitening.order(),
        }
    }

    /// Columns of the input records, of a plant with `plant` inputs.
    pub(crate) fn inputs(&self, plant: usize) -> usize {
        match self {
            Simulated::Loop(closure) => closure.inputs(),
            _ => plant,
        }
    }

    /// Unknowns beside the parameters of the structure: the entries of K.
    pub(crate) fn gains(&self) -> usize {
        match self {
            Simulated::Predictor(predictor) => predictor.gains(),
            _ => 0,
        }
    }

    /// What is simulated; `None` where it is the plant.
    pub(crate) fn system(&self, plant: &StateSpace<Discrete>, gain: &[f64]) -> Result<Option<StateSpace<Discrete>>> {
        match self {
            Simulated::Plant => Ok(None),
            Simulated::Loop(closure) => closure.close(plant).map(Some),
            Simulated::Predictor(predictor) => predictor.system(plant, gain).map(Some),
            Simulated::Filtered(whitening) => whitening.system(plant).map(Some),
        }
    }

    /// Its slopes from those of the plant.
    pub(crate) fn slopes(
        &self,
        plant: &StateSpace<Discrete>,
        gain: &[f64],
        of_plant: Vec<SampledSlope>,
    ) -> Vec<SampledSlope> {
        match self {
            Simulated::Plant => of_plant,
            Simulated::Loop(closure) => closure.slopes(plant, of_plant),
            Simulated::Predictor(predictor) => predictor.slopes(plant, gain, of_plant),
            Simulated::Filtered(whitening) => whitening.slopes(plant, of_plant),
        }
    }

    /// The records, sample after sample, the outputs divided by their deviations.
    pub(crate) fn samples(&self, experiment: &Experiment<'_>, deviations: &[f64]) -> Result<Samples> {
        let Experiment { u, y, .. } = *experiment;
        Ok(match self {
            Simulated::Plant | Simulated::Loop(_) => interleave(&[u], y, deviations),
            Simulated::Predictor(_) => interleave(&[u, y], y, deviations),
            Simulated::Filtered(whitening) => {
                let white: Mat<f64> = whitening.outputs(experiment)?;
                interleave(&[u], white.as_ref(), deviations)
            }
        })
    }
}

fn interleave(inputs: &[MatRef<'_, f64>], y: MatRef<'_, f64>, deviations: &[f64]) -> Samples {
    let row = |k: usize| inputs.iter().flat_map(move |part| part.row(k).iter().copied());
    let u: Vec<f64> = (0..y.nrows()).flat_map(row).collect();
    let y: Vec<f64> = y.row_iter().flat_map(|row| row.iter().zip(deviations).map(|(y, d)| y / d)).collect();
    Samples { u, count: y.len() / deviations.len(), y }
}

/// A system with its outputs divided by the deviations of their noise.
pub(crate) fn with_scaled_outputs(system: &StateSpace<Discrete>, deviations: &[f64]) -> Result<StateSpace<Discrete>> {
    let divide = |m: MatRef<'_, f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] / deviations[i]);
    let (a, b) = (system.a().to_owned(), system.b().to_owned());
    StateSpace::new(a, b, divide(system.c()), divide(system.d()), system.time()).map_err(Error::from)
}

/// The same for slopes.
pub(crate) fn with_scaled_slopes(slopes: Vec<SampledSlope>, deviations: &[f64]) -> Vec<SampledSlope> {
    let divide = |m: &Mat<f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] / deviations[i]);
    slopes.into_iter().map(|s| SampledSlope { outputs: divide(&s.outputs), ..s }).collect()
}
