//! Output noise of known colour: everything is compared behind `H^-1`.
//!
//! ```text
//! H^-1 (y - yhat) = H^-1 y - H^-1 G u,     H^-1 = [Ah Bh; Ch I]
//! H^-1 G : A = [Ad 0; Bh C  Ah],  B = [Bd; Bh D],  C = [C  Ch],  D = D
//! ```
//! The measured outputs are filtered once.

use crate::prediction::sampled::SampledSlope;
use crate::{Error, Result};
use youla::Mat;
use youla::identify::subspace::Experiment;
use youla::linalg::block;
use youla::lti::{Discrete, StateSpace, simulate};

/// `H^-1`.
pub(crate) struct Whitening {
    inverse: StateSpace<Discrete>,
}

impl Whitening {
    pub(crate) fn new(inverse: StateSpace<Discrete>) -> Self {
        Whitening { inverse }
    }

    /// States of `H^-1`.
    pub(crate) fn order(&self) -> usize {
        self.inverse.order()
    }

    /// `H^-1 y` from rest.
    pub(crate) fn outputs(&self, experiment: &Experiment<'_>) -> Result<Mat<f64>> {
        simulate(&self.inverse, experiment.y, &vec![0.0; self.order()]).map_err(Error::from)
    }

    /// `H^-1 G`.
    pub(crate) fn system(&self, plant: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
        let (h, n) = (&self.inverse, plant.order());
        let above = Mat::zeros(n, h.order());
        let state = block(&[&[plant.a(), above.as_ref()], &[(h.b() * plant.c()).as_ref(), h.a()]]);
        let input = block(&[&[plant.b()], &[(h.b() * plant.d()).as_ref()]]);
        StateSpace::new(state, input, block(&[&[plant.c(), h.c()]]), plant.d().to_owned(), plant.time())
            .map_err(Error::from)
    }

    /// Its slopes from those of the plant.
    pub(crate) fn slopes(&self, plant: &StateSpace<Discrete>, of_plant: Vec<SampledSlope>) -> Vec<SampledSlope> {
        let (n, m, nh) = (plant.order(), plant.inputs(), self.order());
        let spread = |part: &Mat<f64>| {
            let (of_states, of_inputs) = part.as_ref().split_at_col(n);
            block(&[&[of_states, Mat::zeros(part.nrows(), nh).as_ref(), of_inputs]])
        };
        let slope = |slope: SampledSlope| {
            let through = spread(&(self.inverse.b() * &slope.outputs));
            let states = block(&[&[spread(&slope.states).as_ref()], &[through.as_ref()]]);
            debug_assert_eq!(states.ncols(), n + nh + m);
            SampledSlope { states, outputs: spread(&slope.outputs) }
        };
        of_plant.into_iter().map(slope).collect()
    }
}
