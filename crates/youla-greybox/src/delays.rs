//! Known delays of the inputs: the records are shifted, and the sampled model gets the delays as states.

use crate::{Error, Result};
use youla::Mat;
use youla::identify::subspace::{Delays, Experiment};
use youla::linalg::check_shape;

/// The records as the structure without delays sees them.
pub(super) struct Shifted<'a> {
    pub(super) delays: Delays,
    given: &'a [Experiment<'a>],
    inputs: Vec<Mat<f64>>,
}

impl<'a> Shifted<'a> {
    /// One delay per input, or none at all. Where nothing is delayed, nothing is copied.
    pub(super) fn new(given: &'a [Experiment<'a>], delays: &[usize]) -> Result<Self> {
        let columns = given.first().map_or(delays.len(), |e| e.u.ncols());
        let delays = Delays::new(delays, columns)?;
        let longest = delays.longest();
        if longest == 0 {
            return Ok(Shifted { delays, given, inputs: Vec::new() });
        }
        for (k, Experiment { u, y, .. }) in given.iter().enumerate() {
            check_shape(&format!("the input record of experiment {}", k + 1), *u, (u.nrows(), columns))?;
            check_shape(&format!("the output record of experiment {}", k + 1), *y, (u.nrows(), y.ncols()))?;
            if u.nrows() <= longest {
                let what = format!("experiment {} with a delay of {longest} samples", k + 1);
                return Err(Error::Method(youla::Error::TooFewSamples { what, found: u.nrows(), needed: longest + 1 }));
            }
        }
        let inputs = given.iter().map(|e| delays.shift(e.u)).collect();
        Ok(Shifted { delays, given, inputs })
    }

    /// From the first sample on that all inputs reach.
    pub(super) fn experiments(&self) -> Vec<Experiment<'_>> {
        if self.inputs.is_empty() {
            return self.given.to_vec();
        }
        let longest = self.delays.longest();
        let pairs = self.inputs.iter().zip(self.given);
        pairs.map(|(u, e)| Experiment::new(u.as_ref(), e.y.subrows(longest, u.nrows()))).collect()
    }

    /// The states of the structure with those of the delays behind them.
    pub(super) fn initial_states(&self, states: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let with_delays = |(mut x0, e): (Vec<f64>, &Experiment<'_>)| {
            x0.extend(self.delays.states_at_start(e));
            x0
        };
        states.into_iter().zip(self.given).map(with_delays).collect()
    }
}
