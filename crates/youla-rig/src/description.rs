//! What a machine says of itself.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use youla_link::{LARGEST_BODY, RowShape};

/// Bytes of the first sample's number before the rows of a frame.
const FIRST: usize = 8;

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
    /// [`Error::Description`] where they are not such a TOML, or a name, a number of channels or an order cannot be used.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let refused = |problem: &dyn std::fmt::Display| Error::Description(problem.to_string());
        let text = std::str::from_utf8(bytes).map_err(|problem| refused(&problem))?;
        let description: Description = toml::from_str(text).map_err(|problem| refused(&problem))?;
        description.check()?;
        Ok(description)
    }

    fn check(&self) -> Result<()> {
        self.check_name("name", &self.name)?;
        let time = self.sample_time;
        if !(time.is_finite() && time > 0.0) {
            return self.refuse("sample_time", &format!("{time} s"), "it must be above 0");
        }
        for (list, channels) in [("inputs", &self.inputs), ("outputs", &self.outputs)] {
            if channels.is_empty() {
                return self.refuse(list, "[]", "a machine has one channel of each or more");
            }
            for (number, channel) in (1..).zip(channels) {
                self.check_name(&format!("{list}, channel {number}, name"), &channel.name)?;
                self.check_text(&format!("{list}, channel {number}, unit"), &channel.unit)?;
            }
        }
        let mut columns = HashSet::new();
        if let Some(twice) = self.columns().into_iter().find(|column| !columns.insert(column.clone())) {
            return self.refuse(
                "a channel's name",
                &twice,
                "it is a column of the log already; every name is there once",
            );
        }
        let shape = self.shape();
        if FIRST + shape.bytes() > LARGEST_BODY {
            let size = format!("{} inputs, {} outputs", shape.inputs, shape.outputs);
            return self.refuse("inputs and outputs", &size, "a frame has no room for a row of so many");
        }
        // Coefficients of A, B and C, numbered by 16 bits.
        let ports = shape.inputs + shape.outputs;
        let coefficients = |order: usize| order.checked_mul(order.checked_add(ports)?);
        match self.q_order {
            Some(order) if coefficients(order).is_none_or(|count| count > usize::from(u16::MAX)) => {
                self.refuse("q_order", &order.to_string(), "the link carries 65535 coefficients at most")
            }
            _ => Ok(()),
        }
    }

    /// It becomes a column of a log: in a CSV file, in run.toml, in messages.
    fn check_name(&self, field: &str, name: &str) -> Result<()> {
        if name.trim().is_empty() || name.trim() != name {
            return self.refuse(field, name, "a name is not empty, and has no space at its ends");
        }
        if name.contains([',', ';', '"', '\'']) {
            return self.refuse(field, name, "a name has no comma, semicolon or quote");
        }
        self.check_text(field, name)
    }

    fn check_text(&self, field: &str, text: &str) -> Result<()> {
        match text.chars().any(char::is_control) {
            true => self.refuse(field, text, "it has a line break or another control character"),
            false => Ok(()),
        }
    }

    fn refuse(&self, field: &str, value: &str, problem: &str) -> Result<()> {
        let shown = |text: &str| text.chars().take(40).flat_map(char::escape_debug).collect::<String>();
        let (machine, value) = (shown(&self.name), shown(value));
        Err(Error::Description(format!("machine \"{machine}\": {field} = \"{value}\": {problem}")))
    }

    /// Numbers of inputs and outputs.
    pub fn shape(&self) -> RowShape {
        RowShape { inputs: self.inputs.len(), outputs: self.outputs.len() }
    }

    /// Columns of a log: time, y, u, alpha, beta, status.
    pub(crate) fn columns(&self) -> Vec<String> {
        let y = self.outputs.iter().map(|channel| channel.name.clone());
        let u = self.inputs.iter().map(|channel| channel.name.clone());
        let alpha = (1..=self.inputs.len()).map(|number| format!("alpha_{number}"));
        let beta = (1..=self.outputs.len()).map(|number| format!("beta_{number}"));
        let ends = ["t".to_owned()].into_iter().chain(y).chain(u).chain(alpha).chain(beta);
        ends.chain(["status".to_owned()]).collect()
    }
}
