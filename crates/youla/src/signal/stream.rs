//! Records that need not fit into memory: inputs and outputs handed out piece by piece, as often as they are asked for.
//!
//! A stream holds one or more experiments, one after the other. Whoever reads it says how many samples he wants next and
//! where to put them, so that memory is his to decide and no stream holds more than a buffer of fixed size.

use crate::{Error, Result};
use faer::MatMut;

/// Inputs and outputs of one or more experiments, in order of time.
///
/// ```
/// use faer::MatMut;
/// use youla::signal::SampleStream;
/// /// 1000 samples of a ramp and of its double.
/// struct Ramp(usize);
/// impl SampleStream for Ramp {
///     fn inputs(&self) -> usize { 1 }
///     fn outputs(&self) -> usize { 1 }
///     fn rewind(&mut self) -> youla::Result<()> { self.0 = 0; Ok(()) }
///     fn read(&mut self, mut rows: MatMut<'_, f64>) -> youla::Result<usize> {
///         let count = rows.nrows().min(1000 - self.0);
///         for k in 0..count {
///             let value = (self.0 + k) as f64;
///             (rows[(k, 0)], rows[(k, 1)]) = (value, 2.0 * value);
///         }
///         self.0 += count;
///         Ok(count)
///     }
///     fn next_experiment(&mut self) -> youla::Result<bool> { Ok(false) }
/// }
/// ```
pub trait SampleStream: Send {
    /// Number of inputs m.
    fn inputs(&self) -> usize;

    /// Number of outputs p.
    fn outputs(&self) -> usize;

    /// Goes back to the first sample of the first experiment. Each pass gives the same numbers.
    ///
    /// # Errors
    /// Those of the file behind the stream.
    fn rewind(&mut self) -> Result<()>;

    /// Writes the next samples of the current experiment into the rows `[u y]`, count x (m + p), and returns how many: fewer
    /// than there are rows only at the end of the experiment.
    ///
    /// # Errors
    /// Those of the file behind the stream, with the place of what is wrong.
    fn read(&mut self, rows: MatMut<'_, f64>) -> Result<usize>;

    /// Goes to the first sample of the next experiment; false if there is none.
    ///
    /// # Errors
    /// Those of the file behind the stream.
    fn next_experiment(&mut self) -> Result<bool>;
}

/// Streams with the same channels as one: their experiments one after the other, for example one file for each experiment.
pub struct JoinedStreams<S> {
    parts: Vec<S>,
    current: usize,
}

impl<S: SampleStream> JoinedStreams<S> {
    /// Joins at least one stream.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] without streams, [`Error::Ports`] where their numbers of channels differ.
    pub fn new(parts: Vec<S>) -> Result<Self> {
        let Some(first) = parts.first() else {
            return Err(Error::OutOfRange { what: "the number of streams".into(), value: 0.0, must: "at least 1" });
        };
        let (inputs, outputs) = (first.inputs(), first.outputs());
        for (k, part) in parts.iter().enumerate() {
            for (kind, expected, found) in [("inputs", inputs, part.inputs()), ("outputs", outputs, part.outputs())] {
                if found != expected {
                    return Err(Error::Ports {
                        what: format!("the number of {kind} of stream {}", k + 1),
                        expected,
                        found,
                    });
                }
            }
        }
        Ok(JoinedStreams { parts, current: 0 })
    }
}

impl<S: SampleStream> SampleStream for JoinedStreams<S> {
    fn inputs(&self) -> usize {
        self.parts[0].inputs()
    }

    fn outputs(&self) -> usize {
        self.parts[0].outputs()
    }

    fn rewind(&mut self) -> Result<()> {
        self.current = 0;
        self.parts[0].rewind()
    }

    fn read(&mut self, rows: MatMut<'_, f64>) -> Result<usize> {
        self.parts[self.current].read(rows)
    }

    fn next_experiment(&mut self) -> Result<bool> {
        if self.parts[self.current].next_experiment()? {
            return Ok(true);
        }
        if self.current + 1 == self.parts.len() {
            return Ok(false);
        }
        self.current += 1;
        self.parts[self.current].rewind()?;
        Ok(true)
    }
}

impl<S: SampleStream + ?Sized> SampleStream for Box<S> {
    fn inputs(&self) -> usize {
        (**self).inputs()
    }

    fn outputs(&self) -> usize {
        (**self).outputs()
    }

    fn rewind(&mut self) -> Result<()> {
        (**self).rewind()
    }

    fn read(&mut self, rows: MatMut<'_, f64>) -> Result<usize> {
        (**self).read(rows)
    }

    fn next_experiment(&mut self) -> Result<bool> {
        (**self).next_experiment()
    }
}
