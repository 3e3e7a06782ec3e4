//! Known delays of the inputs, as exact shifts of the record and as states of the model.
//!
//! ```text
//! y(k) depends on u_j(k - d_j):   z_1+ = u_j,  z_2+ = z_1, ...,  z_d in the place of u_j,   d poles at 0
//! ```
//! No sample is invented: each experiment starts at the largest delay, and the delay states there are the inputs before.

use crate::identify::subspace::records::experiment::Experiment;
use crate::lti::{Discrete, StateSpace};
use crate::{Error, Mat, MatRef, Result};

/// Delays per input, in samples.
#[derive(Clone)]
pub struct Delays {
    samples: Vec<usize>,
}

impl Delays {
    /// As given, or none at all.
    pub fn new(given: &[usize], inputs: usize) -> Result<Self> {
        if given.is_empty() || given.len() == inputs {
            return Ok(Delays { samples: if given.is_empty() { vec![0; inputs] } else { given.to_vec() } });
        }
        let (value, must) = (given.len() as f64, "one per input, or none");
        Err(Error::OutOfRange { what: "the number of delays".into(), value, must })
    }

    /// Samples without a shifted input at the start of each record.
    pub fn longest(&self) -> usize {
        self.samples.iter().copied().max().unwrap_or(0)
    }

    /// All delays together: the states that they take.
    pub(crate) fn states(&self) -> usize {
        self.samples.iter().sum()
    }

    /// The inputs as the system without delays sees them, from the first sample on that all of them reach.
    pub fn shift(&self, u: MatRef<'_, f64>) -> Mat<f64> {
        let longest = self.longest();
        Mat::from_fn(u.nrows() - longest, u.ncols(), |k, j| u[(k + longest - self.samples[j], j)])
    }

    /// The delay states at the first sample that is used.
    pub fn states_at_start(&self, experiment: &Experiment<'_>) -> Vec<f64> {
        let longest = self.longest();
        let of_input = |(j, d): (usize, &usize)| (1..=*d).map(move |back| experiment.u[(longest - back, j)]);
        self.samples.iter().enumerate().flat_map(of_input).collect()
    }

    /// The model from the inputs as measured: states of the system, then the delay states input by input.
    pub fn put_before(&self, model: StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
        if self.states() == 0 {
            return Ok(model);
        }
        let (n, m, p, total) = (model.order(), model.inputs(), model.outputs(), model.order() + self.states());
        let (mut a, mut b) = (Mat::zeros(total, total), Mat::zeros(total, m));
        let (mut c, mut d) = (Mat::zeros(p, total), Mat::zeros(p, m));
        a.as_mut().submatrix_mut(0, 0, n, n).copy_from(model.a());
        c.as_mut().subcols_mut(0, n).copy_from(model.c());
        let mut first = n;
        for (j, delay) in self.samples.iter().copied().enumerate() {
            if delay == 0 {
                b.as_mut().submatrix_mut(0, j, n, 1).copy_from(model.b().subcols(j, 1));
                d.as_mut().subcols_mut(j, 1).copy_from(model.d().subcols(j, 1));
                continue;
            }
            let last = first + delay - 1;
            b[(first, j)] = 1.0;
            (first..last).for_each(|z| a[(z + 1, z)] = 1.0);
            a.as_mut().submatrix_mut(0, last, n, 1).copy_from(model.b().subcols(j, 1));
            c.as_mut().subcols_mut(last, 1).copy_from(model.d().subcols(j, 1));
            first = last + 1;
        }
        StateSpace::new(a, b, c, d, model.time())
    }
}
