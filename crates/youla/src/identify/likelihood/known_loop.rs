//! What is known of the loop in which the records were taken.

use crate::identify::likelihood::data::spectra::Sizes;
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

    /// K_d from y to u, m x p in units of the sizes: zero in open loop; `None` where the controller does not see all of y.
    pub(crate) fn direct(&self, sizes: &Sizes) -> Option<Mat<f64>> {
        let (m, p) = (sizes.u.len(), sizes.y.len());
        let Some(k) = self.controller else { return Some(Mat::zeros(m, p)) };
        // what it sees ends with y: y - r, or [u; y] for an observer
        let first = k.inputs().checked_sub(p)?;
        (k.outputs() == m).then(|| Mat::from_fn(m, p, |j, i| k.d()[(j, first + i)] * sizes.y[i] / sizes.u[j]))
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
