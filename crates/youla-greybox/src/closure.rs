//! The closed loop of the model and the controller as what is compared with the data.
//!
//! With `J_K` in state space, `x_k+ = A_k x_k + B_y y + B_w w, u = C_u x_k + D_uy y + D_uw w, beta = C_b x_k + D_by y + D_bw w`,
//! and the sampled model `x+ = A x + B u, y = C x` (no direct path),
//! ```text
//! A_cl = [A + B D_uy C,  B C_u;  B_y C,  A_k]     B_cl = [B D_uw; B_w]     y = [C  0],   beta = [D_by C  C_b] + D_bw w
//! ```
//! Each entry is linear in B and in C, so that the slopes follow by the product rule. The residual for y is
//! `V (beta - S_m alpha) = (I - G_m K)^-1 (y - G_m u)`, for beta it is `beta - S_m alpha` with the S that the model induces: both
//! are those of a stable loop, whatever the model alone does (I. D. Landau and A. Karimi, Automatica 33 (1997), 1499, for the
//! first).

use crate::prediction::sampled::SampledSlope;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::linalg::block;
use youla::lti::{Discrete, Partitioned, StateSpace};
use youla::{Mat, MatRef};

/// What a closed-loop estimation compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoopOutput {
    /// The plant's outputs y with those of the simulated loop: closed-loop output error.
    #[default]
    Plant,
    /// beta with that of the simulated loop: the deviation system S that the structure induces.
    Deviation,
}

/// The controller around the model.
#[derive(Clone, Copy)]
pub(super) struct Closure<'a> {
    controller: &'a Partitioned<Discrete>,
    output: LoopOutput,
}

/// The parts of J_K.
struct Parts<'a> {
    a: MatRef<'a, f64>,
    b_y: MatRef<'a, f64>,
    b_w: MatRef<'a, f64>,
    c_u: MatRef<'a, f64>,
    c_b: MatRef<'a, f64>,
    d_uy: MatRef<'a, f64>,
    d_uw: MatRef<'a, f64>,
    d_by: MatRef<'a, f64>,
    d_bw: MatRef<'a, f64>,
}

impl<'a> Closure<'a> {
    pub(super) fn new(controller: &'a Partitioned<Discrete>, output: LoopOutput) -> Self {
        Closure { controller, output }
    }

    /// States of the controller.
    pub(super) fn order(&self) -> usize {
        self.controller.system().order()
    }

    /// Number of external inputs w.
    pub(super) fn inputs(&self) -> usize {
        self.controller.part(0, 1).inputs()
    }

    fn parts(&self) -> Parts<'_> {
        let system = self.controller.system();
        let (outputs, inputs) = (self.controller.part(0, 0).inputs(), self.controller.part(0, 0).outputs());
        let ((b_y, b_w), (c_u, c_b)) = (system.b().split_at_col(outputs), system.c().split_at_row(inputs));
        let (d_u, d_b) = system.d().split_at_row(inputs);
        let ((d_uy, d_uw), (d_by, d_bw)) = (d_u.split_at_col(outputs), d_b.split_at_col(outputs));
        Parts { a: system.a(), b_y, b_w, c_u, c_b, d_uy, d_uw, d_by, d_bw }
    }

    /// The loop from w to y or beta.
    ///
    /// # Errors
    /// [`youla::Error::Ports`] where the controller does not fit, [`youla::Error::OutOfRange`] for a model with a direct path.
    pub(super) fn close(&self, plant: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
        let controller = self.controller.part(0, 0);
        for (what, expected, found) in [
            ("the number of outputs of the controller", plant.inputs(), controller.outputs()),
            ("the number of inputs of the controller", plant.outputs(), controller.inputs()),
        ] {
            if expected != found {
                return Err(Error::Method(youla::Error::Ports { what: what.into(), expected, found }));
            }
        }
        let direct = plant.d().norm_max();
        if direct != 0.0 {
            let what = "the largest entry of D of the structure".into();
            return Err(Error::Method(youla::Error::OutOfRange {
                what,
                value: direct,
                must: "0 for a closed-loop estimation",
            }));
        }
        let k = self.parts();
        let (a, b, c) = (plant.a(), plant.b(), plant.c());
        let state = block(&[&[(a + b * k.d_uy * c).as_ref(), (b * k.c_u).as_ref()], &[(k.b_y * c).as_ref(), k.a]]);
        let input = block(&[&[(b * k.d_uw).as_ref()], &[k.b_w]]);
        let (seen, direct) = match self.output {
            LoopOutput::Plant => {
                let none = Mat::zeros(c.nrows(), self.order());
                (block(&[&[c, none.as_ref()]]), Mat::zeros(c.nrows(), self.inputs()))
            }
            LoopOutput::Deviation => (block(&[&[(k.d_by * c).as_ref(), k.c_b]]), k.d_bw.to_owned()),
        };
        StateSpace::new(state, input, seen, direct, plant.time()).map_err(Error::from)
    }

    /// The slopes of the loop from those of the model.
    pub(super) fn slopes(&self, plant: &StateSpace<Discrete>, of_plant: Vec<SampledSlope>) -> Vec<SampledSlope> {
        of_plant.into_iter().map(|slope| self.slope(plant, &slope)).collect()
    }

    fn slope(&self, plant: &StateSpace<Discrete>, slope: &SampledSlope) -> SampledSlope {
        let k = self.parts();
        let (n, nk, w) = (plant.order(), self.order(), self.inputs());
        let (b, c) = (plant.b(), plant.c());
        let (da, db) = slope.states.as_ref().split_at_col(n);
        let dc = slope.outputs.subcols(0, n);
        let top = [(da + db * k.d_uy * c + b * k.d_uy * dc), (db * k.c_u), (db * k.d_uw)];
        let below = [k.b_y * dc, Mat::zeros(nk, nk + w)];
        let states = block(&[
            &[top[0].as_ref(), block(&[&[top[1].as_ref(), top[2].as_ref()]]).as_ref()],
            &[below[0].as_ref(), below[1].as_ref()],
        ]);
        let seen = match self.output {
            LoopOutput::Plant => dc.to_owned(),
            LoopOutput::Deviation => k.d_by * dc,
        };
        let outputs = block(&[&[seen.as_ref(), Mat::zeros(seen.nrows(), nk + w).as_ref()]]);
        SampledSlope { states, outputs }
    }
}
