//! The loop as it is described: nominal model, gains, factors, and the numbers that the firmware takes.

use crate::station::{NUMBERS, Q_STATES, STATES};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use youla::factor::CoprimeFactors;
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};
use youla_io::toml_file;
use youla_run::{ControllerSettings, NominalModel};

/// The file of a loop: `[nominal]` and `[controller]` as in run.toml.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopDescription {
    /// The nominal model.
    pub nominal: NominalModel,
    /// The controller that runs: an observer with its gains.
    pub controller: ControllerSettings,
}

impl LoopDescription {
    /// The two tables of a file that may hold others, for example a run.toml.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] with line and key.
    pub(crate) fn of_file(path: &Path) -> Result<Self> {
        #[derive(Deserialize)]
        struct Tables {
            nominal: NominalModel,
            controller: ControllerSettings,
        }
        let text = youla_io::read_text(path)?;
        let Tables { nominal, controller } = toml_file::parse(&text, path)?;
        Ok(LoopDescription { nominal, controller })
    }
}

/// The same as systems.
#[derive(Debug)]
pub struct RunningLoop {
    /// The two tables of its file.
    pub description: LoopDescription,
    /// The nominal model, states scaled.
    pub nominal: StateSpace<Discrete>,
    /// State feedback.
    pub f: Mat<f64>,
    /// Observer gain.
    pub l: Mat<f64>,
    /// Factors of nominal model and controller.
    pub factors: CoprimeFactors<Discrete>,
    /// Largest order of Q.
    pub q_states: usize,
}

impl RunningLoop {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Loop`] where the firmware cannot run this loop.
    pub fn read(path: &Path, time: Discrete) -> Result<Self> {
        let text = youla_io::read_text(path)?;
        let description: LoopDescription = toml_file::parse(&text, path)?;
        Self::new(description, path, time)
    }

    /// The loop of a description; matrices in files are beside `path`.
    ///
    /// # Errors
    /// As [`RunningLoop::read`].
    pub fn new(description: LoopDescription, path: &Path, time: Discrete) -> Result<Self> {
        let running = Self::of_any_size(description, path, time)?;
        let nominal = &running.nominal;
        if nominal.order() > STATES || (nominal.inputs(), nominal.outputs()) != (2, 2) {
            let problem = format!(
                "the nominal model has {} states, {} inputs and {} outputs; the firmware takes at most {STATES} states, 2 inputs and 2 \
                 outputs",
                nominal.order(),
                nominal.inputs(),
                nominal.outputs()
            );
            return Err(Error::Loop { path: path.to_owned(), problem });
        }
        Ok(running)
    }

    /// The loop that a machine with banks of `q_states` states runs.
    ///
    /// # Errors
    /// As [`RunningLoop::read`].
    pub fn of_machine(path: &Path, time: Discrete, q_states: usize) -> Result<Self> {
        let running = Self::of_any_size(LoopDescription::of_file(path)?, path, time)?;
        let ports = (running.nominal.inputs(), running.nominal.outputs());
        if ports != (2, 2) {
            let problem =
                format!("a campaign takes 2 inputs and 2 outputs; the nominal model has {} and {}", ports.0, ports.1);
            return Err(Error::Loop { path: path.to_owned(), problem });
        }
        Ok(RunningLoop { q_states, ..running })
    }

    /// A loop that need not fit the firmware of a campaign.
    pub(crate) fn of_any_size(description: LoopDescription, path: &Path, time: Discrete) -> Result<Self> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let nominal = description.nominal.realise(folder, time)?;
        let running = description.controller.realise(nominal.time(), Some(&nominal), folder)?;
        let Some([f, l]) = running.gains() else {
            let problem = "the controller of the firmware is an observer; give [controller.observer]".into();
            return Err(Error::Loop { path: path.to_owned(), problem });
        };
        let scale = nominal.state_scales()?;
        let balanced = nominal.with_scaled_states(&scale);
        let f = Mat::from_fn(f.nrows(), f.ncols(), |i, j| f[(i, j)] * scale[j]);
        let l = Mat::from_fn(l.nrows(), l.ncols(), |i, j| l[(i, j)] / scale[i]);
        let factors = CoprimeFactors::observer(&balanced, f.as_ref(), l.as_ref())?;
        Ok(RunningLoop { description, nominal: balanced, f, l, factors, q_states: Q_STATES })
    }

    /// What [`crate::Target::start`] takes: limits of y, beta, u and change of u, each for two channels; samples clipped, stuck and of the ramp.
    pub fn numbers(&self, limits: &[f64; 8], counts: [u16; 3]) -> Vec<f32> {
        let g = &self.nominal;
        let mut numbers = Vec::with_capacity(NUMBERS);
        let parts = [
            (g.a(), STATES, STATES),
            (g.b(), STATES, 2),
            (g.c(), 2, STATES),
            (g.d(), 2, 2),
            (self.f.as_ref(), 2, STATES),
            (self.l.as_ref(), STATES, 2),
        ];
        parts.iter().for_each(|(matrix, rows, columns)| numbers.extend(padded(*matrix, *rows, *columns)));
        numbers.extend(limits.iter().map(|limit| *limit as f32));
        numbers.extend(counts.iter().map(|count| f32::from(*count)));
        numbers
    }
}

/// A matrix by rows, filled up with zeros.
pub fn padded(m: MatRef<'_, f64>, rows: usize, columns: usize) -> Vec<f32> {
    let entry = |i: usize, j: usize| if i < m.nrows() && j < m.ncols() { m[(i, j)] as f32 } else { 0.0 };
    (0..rows * columns).map(|k| entry(k / columns, k % columns)).collect()
}
