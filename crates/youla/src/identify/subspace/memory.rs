//! Records in memory as a stream.

use super::experiment::Experiment;
use crate::signal::SampleStream;
use crate::{Error, MatRef, Result};
use faer::MatMut;

/// Experiments that are in memory already, as a stream of views: nothing is copied but what is asked for.
///
/// The numbers of channels are those of the first experiment.
#[derive(Debug, Clone)]
pub struct ExperimentStream<'a> {
    experiments: &'a [Experiment<'a>],
    current: usize,
    next: usize,
}

impl<'a> ExperimentStream<'a> {
    /// A stream of at least one experiment.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] without experiments, inputs or outputs, [`crate::Error::Shape`] where the records differ
    /// in length or channels, [`Error::Unsupported`] for known disturbances.
    pub fn new(experiments: &'a [Experiment<'a>]) -> Result<Self> {
        super::channels::check_shapes(experiments)?;
        if experiments.iter().any(|e| e.disturbance.is_some()) {
            let instead = "identify from the records in memory, or leave the disturbance out";
            return Err(Error::Unsupported { what: "a known disturbance in a stream of samples", instead });
        }
        Ok(ExperimentStream { experiments, current: 0, next: 0 })
    }
}

impl SampleStream for ExperimentStream<'_> {
    fn inputs(&self) -> usize {
        self.experiments[0].u.ncols()
    }

    fn outputs(&self) -> usize {
        self.experiments[0].y.ncols()
    }

    fn rewind(&mut self) -> Result<()> {
        (self.current, self.next) = (0, 0);
        Ok(())
    }

    fn read(&mut self, mut rows: MatMut<'_, f64>) -> Result<usize> {
        let Experiment { u, y, .. } = self.experiments[self.current];
        let count = rows.nrows().min(u.nrows() - self.next);
        let mut copy = |from: MatRef<'_, f64>, to: usize| {
            rows.as_mut().submatrix_mut(0, to, count, from.ncols()).copy_from(from.subrows(self.next, count));
        };
        copy(u, 0);
        copy(y, u.ncols());
        self.next += count;
        Ok(count)
    }

    fn next_experiment(&mut self) -> Result<bool> {
        self.current += 1;
        self.next = 0;
        if self.current < self.experiments.len() {
            return Ok(true);
        }
        self.current = self.experiments.len() - 1;
        self.next = self.experiments[self.current].u.nrows();
        Ok(false)
    }
}
