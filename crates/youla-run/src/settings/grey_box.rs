//! `[grey_box]`: a physical structure and how it is compared with the data.

use super::options::PredictionKind;
use serde::{Deserialize, Serialize};
use youla_greybox::{Declaration, DeclaredStructure, GreyBoxOptions, NoiseKind};

/// What is known of the plant's physics, the table `[grey_box]` of run.toml.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GreyBoxSettings {
    /// The structure; explained in `docs/grey-box.md`.
    pub structure: Declaration,
    /// What is compared with the outputs: the plant alone, driven by the measured u, or the loop with the declared controller,
    /// driven by the known excitations.
    #[serde(default)]
    pub prediction: PredictionKind,
    /// The model of the noise.
    #[serde(default)]
    pub noise: NoiseKind,
    /// Known delay of each input in whole samples, beyond the zero-order hold; none when empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub delays: Vec<usize>,
    /// Further structures, estimated in the same way and compared.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alternative: Vec<AlternativeStructure>,
    /// Whether the initial values of the parameters are a second start, beside the projection of G(S); not a key of run.toml.
    #[serde(skip, default = "yes")]
    pub start_from_initial: bool,
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
            prediction: PredictionKind::default(),
            noise: NoiseKind::default(),
            delays: Vec::new(),
            alternative: Vec::new(),
            start_from_initial: yes(),
        }
    }

    /// The options of the search.
    pub(crate) fn search(&self) -> GreyBoxOptions {
        GreyBoxOptions { noise: self.noise.into(), delays: self.delays.clone(), ..GreyBoxOptions::default() }
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
