//! What may be fixed about the recommended model.

/// What is known of the recommended model beforehand; the rest is chosen by the evidence of the records.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct LikelihoodOptions {
    /// Number of states, those of the dead time not counted.
    #[cfg_attr(feature = "serde", serde(with = "crate::identify::subspace::order_form"))]
    #[cfg_attr(feature = "schema", schemars(with = "crate::identify::subspace::order_form::OrderForm"))]
    pub order: Option<usize>,
    /// Dead time of each input in samples, beyond the one sample of a plant without feedthrough; chosen when absent.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub dead_time: Option<Vec<usize>>,
    /// Whether an input acts on the outputs of the same sample; chosen when absent.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub feedthrough: Option<bool>,
    /// Largest order that is tried.
    pub largest_order: usize,
}

impl Default for LikelihoodOptions {
    fn default() -> Self {
        LikelihoodOptions { order: None, dead_time: None, feedthrough: None, largest_order: 100 }
    }
}
