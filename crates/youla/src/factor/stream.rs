//! From (u, y) to (alpha, beta) for records that need not fit into memory: the filter (28) behind a stream.

use super::CoprimeFactors;
use crate::linalg::{check_finite, check_shape};
use crate::lti::{Discrete, SimulationState, Simulator};
use crate::signal::SampleStream;
use crate::{Error, Mat, Result};
use faer::MatMut;

/// Samples read at a time to be dropped.
const PIECE: usize = 4096;

/// A stream of alpha and beta, the inputs and outputs of the deviation system S, made from a stream of u and y.
///
/// The numbers are those of [`CoprimeFactors::signals`] without their first samples. The filter starts at rest in each
/// experiment.
pub struct YoulaStream<S> {
    inner: S,
    filter: Simulator,
    rest: Vec<f64>,
    state: SimulationState,
    /// Samples to drop at the start of each experiment, which hold the transient of the filter.
    settle: usize,
    /// Samples of the current experiment that have been read.
    read: usize,
    experiment: usize,
}

impl<S: SampleStream> YoulaStream<S> {
    /// Filters a stream of u and y and drops the first `settle` samples of each experiment, for example
    /// [`CoprimeFactors::settling_samples`] of them.
    ///
    /// # Errors
    /// [`Error::Shape`] where the channels of the stream do not fit the factors.
    pub fn new(factors: &CoprimeFactors<Discrete>, inner: S, settle: usize) -> Result<Self> {
        let empty = |channels| Mat::<f64>::zeros(0, channels);
        check_shape("the stream of plant inputs", empty(inner.inputs()).as_ref(), (0, factors.inputs()))?;
        check_shape("the stream of plant outputs", empty(inner.outputs()).as_ref(), (0, factors.outputs()))?;
        let system = factors.left().system();
        let filter = Simulator::new(system);
        let rest = vec![0.0; system.order()];
        let state = filter.start(&rest)?;
        Ok(YoulaStream { inner, filter, rest, state, settle, read: 0, experiment: 0 })
    }

    fn restart(&mut self) -> Result<()> {
        self.state = self.filter.start(&self.rest)?;
        self.read = 0;
        Ok(())
    }

    /// Reads and filters what there is room for.
    fn filtered(&mut self, mut rows: MatMut<'_, f64>) -> Result<usize> {
        let count = self.inner.read(rows.as_mut())?.min(rows.nrows());
        let what = format!("the record of u and y of experiment {}", self.experiment + 1);
        check_finite(&what, rows.as_ref().subrows(0, count))?;
        let mut now = vec![0.0; rows.ncols()];
        for k in 0..count {
            now.iter_mut().zip(rows.as_ref().row(k).iter()).for_each(|(now, value)| *now = *value);
            let out = self.filter.step(&mut self.state, &now);
            rows.as_mut().row_mut(k).iter_mut().zip(out).for_each(|(value, out)| *value = *out);
        }
        self.read += count;
        Ok(count)
    }

    /// Reads what is to be dropped.
    fn settle(&mut self) -> Result<()> {
        let mut dropped = Mat::zeros(PIECE.min(self.settle.saturating_sub(self.read)), self.channels());
        while self.read < self.settle {
            let wanted = PIECE.min(self.settle - self.read);
            if self.filtered(dropped.as_mut().subrows_mut(0, wanted))? < wanted {
                break;
            }
        }
        Ok(())
    }

    fn channels(&self) -> usize {
        self.inner.inputs() + self.inner.outputs()
    }
}

impl<S: SampleStream> SampleStream for YoulaStream<S> {
    fn inputs(&self) -> usize {
        self.inner.inputs()
    }

    fn outputs(&self) -> usize {
        self.inner.outputs()
    }

    fn rewind(&mut self) -> Result<()> {
        self.inner.rewind()?;
        self.experiment = 0;
        self.restart()
    }

    fn read(&mut self, rows: MatMut<'_, f64>) -> Result<usize> {
        self.settle()?;
        let wanted = rows.nrows();
        let count = if self.read < self.settle { 0 } else { self.filtered(rows)? };
        if wanted > 0 && self.read <= self.settle {
            let what = format!("experiment {}, of which the first {} samples settle", self.experiment + 1, self.settle);
            return Err(Error::TooFewSamples { what, found: self.read, needed: self.settle + 1 });
        }
        Ok(count)
    }

    fn next_experiment(&mut self) -> Result<bool> {
        let more = self.inner.next_experiment()?;
        if more {
            self.experiment += 1;
            self.restart()?;
        }
        Ok(more)
    }
}
