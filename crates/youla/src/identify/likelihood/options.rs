//! What may be fixed about the recommended model.

/// What is known of the recommended model beforehand; the rest is chosen by the evidence of the records.
#[derive(Debug, Clone, PartialEq)]
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
    /// Seconds after which no further order or dead time is tried; the best model until then is kept, and a line of the result says that the search
    /// was ended. A search that has begun ends first. The result depends on the speed of the machine. No limit when absent.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub time_limit: Option<u32>,
    /// Of each output, the step in seconds of the samples of another clock from which it was interpolated; `None` for outputs that were not, empty
    /// where none was. The error of the interpolation is in the region. In run.toml the channels state it.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub sampled_every: Vec<Option<f64>>,
}

impl Default for LikelihoodOptions {
    fn default() -> Self {
        let (largest_order, sampled_every) = (super::LARGEST_ORDER, Vec::new());
        LikelihoodOptions {
            order: None,
            dead_time: None,
            feedthrough: None,
            largest_order,
            time_limit: None,
            sampled_every,
        }
    }
}
