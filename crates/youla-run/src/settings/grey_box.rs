//! `[grey_box]`: a physical structure, its search and its intervals.

use super::options::Prediction;
use serde::{Deserialize, Serialize};
use youla_greybox::{Declaration, DeclaredStructure, GreyBoxOptions, IntervalOptions};

/// What is known of the plant's physics, the table `[grey_box]` of run.toml.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GreyBoxSettings {
    /// The structure; explained in `docs/grey-box.md`.
    pub structure: Declaration,
    /// Whether the initial values of the parameters are a second start, beside the projection of G(S).
    #[serde(default = "yes")]
    pub start_from_initial: bool,
    /// What is compared with the outputs: the plant alone, driven by the measured u, or the loop with the declared controller,
    /// driven by the known excitations.
    #[serde(default)]
    pub prediction: Prediction,
    /// The search.
    #[serde(default)]
    pub pem: GreyBoxOptions,
    /// Intervals of the parameters.
    #[serde(default)]
    pub intervals: IntervalOptions,
    /// Further structures, estimated in the same way and compared.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alternative: Vec<AlternativeStructure>,
}

/// A structure to compare with that of `[grey_box.structure]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AlternativeStructure {
    /// Name in tables.
    pub name: String,
    /// The structure.
    pub structure: Declaration,
    /// Whether one of the two holds the other, as with more or fewer fixed parameters: then the likelihood ratio is tested.
    #[serde(default)]
    pub nested: bool,
}

impl GreyBoxSettings {
    /// A structure, everything else as when absent.
    pub fn new(structure: Declaration) -> Self {
        GreyBoxSettings {
            structure,
            start_from_initial: yes(),
            prediction: Prediction::default(),
            pem: GreyBoxOptions::default(),
            intervals: IntervalOptions::default(),
            alternative: Vec::new(),
        }
    }

    /// What is wrong with a structure, beside `inputs` and `outputs` channels.
    pub(in crate::settings) fn problem(&self, inputs: usize, outputs: usize) -> Option<String> {
        let of = |(place, declaration): (String, &Declaration)| match DeclaredStructure::new(declaration) {
            Err(e) => Some(format!("{place} {e}")),
            Ok(structure) if structure.ports() != (inputs, outputs) => {
                let (m, p) = structure.ports();
                Some(format!("{place} has {m} inputs and {p} outputs, but [data] lists {inputs} and {outputs}"))
            }
            Ok(_) => None,
        };
        let own = ("[grey_box.structure]".to_owned(), &self.structure);
        let others = self
            .alternative
            .iter()
            .map(|a| (format!("[grey_box.alternative.structure] of {:?}", a.name), &a.structure));
        std::iter::once(own).chain(others).find_map(of)
    }
}

fn yes() -> bool {
    true
}
