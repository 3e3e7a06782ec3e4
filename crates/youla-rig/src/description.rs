//! What a machine says of itself.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use youla_link::RowShape;

/// A channel of a rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigChannel {
    /// Its name.
    pub name: String,
    /// Its unit.
    #[serde(default)]
    pub unit: String,
}

/// The description of a machine: TOML. Tables with other names than these, `[nominal.state_space]` and `[controller.observer]` for example,
/// go into the run.toml of its logs.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct Description {
    /// Its name.
    pub name: String,
    /// Sample time, seconds.
    pub sample_time: f64,
    /// Plant inputs u.
    pub inputs: Vec<RigChannel>,
    /// Plant outputs y.
    pub outputs: Vec<RigChannel>,
    /// Order of its banks of Q; absent where it takes none.
    #[serde(default)]
    pub q_order: Option<usize>,
    /// Whatever else it states.
    #[serde(flatten)]
    pub further: toml::Table,
}

impl Description {
    /// From the bytes of a reply.
    ///
    /// # Errors
    /// [`Error::Description`] where they are not such a TOML.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let refused = |problem: &dyn std::fmt::Display| Error::Description(problem.to_string());
        let text = std::str::from_utf8(bytes).map_err(|problem| refused(&problem))?;
        let description: Description = toml::from_str(text).map_err(|problem| refused(&problem))?;
        let time = description.sample_time;
        if !(time.is_finite() && time > 0.0) {
            return Err(refused(&format!("the sample time is {time} s; it must be above 0")));
        }
        if description.inputs.is_empty() || description.outputs.is_empty() {
            return Err(refused(&"it has no inputs or no outputs"));
        }
        Ok(description)
    }

    /// Numbers of inputs and outputs.
    pub fn shape(&self) -> RowShape {
        RowShape { inputs: self.inputs.len(), outputs: self.outputs.len() }
    }

    /// Columns of a log: time, y, u, alpha, beta, status.
    pub fn columns(&self) -> Vec<String> {
        let y = self.outputs.iter().map(|channel| channel.name.clone());
        let u = self.inputs.iter().map(|channel| channel.name.clone());
        let alpha = (1..=self.inputs.len()).map(|number| format!("alpha_{number}"));
        let beta = (1..=self.outputs.len()).map(|number| format!("beta_{number}"));
        let ends = ["t".to_owned()].into_iter().chain(y).chain(u).chain(alpha).chain(beta);
        ends.chain(["status".to_owned()]).collect()
    }
}
