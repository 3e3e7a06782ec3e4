//! The options of the library's methods as run.toml shows them: the choices of a user. Options that no user sets keep their defaults,
//! and are not written.

use super::order::{OrderForm, ReducedForm};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use youla::identify::likelihood::LikelihoodOptions;
use youla::identify::subspace::{Feedthrough, Horizon, Stability, SubspaceMethod, SubspaceOptions};
use youla::reduce::{ReductionMethod, ReductionOptions};

/// Options with the table that shows them.
pub(in crate::settings) trait Shown: Sized + Clone {
    /// What run.toml says of them.
    type Table: Serialize + DeserializeOwned + From<Self> + Into<Self>;
}

pub(in crate::settings) fn serialize<T: Shown, S: Serializer>(options: &T, s: S) -> Result<S::Ok, S::Error> {
    T::Table::from(options.clone()).serialize(s)
}

pub(in crate::settings) fn deserialize<'de, T: Shown, D: Deserializer<'de>>(d: D) -> Result<T, D::Error> {
    T::Table::deserialize(d).map(Into::into)
}

/// The same of a table that may be absent.
pub(in crate::settings) mod optional {
    use super::{Deserialize, Deserializer, Serialize, Serializer, Shown};

    pub(in crate::settings) fn serialize<T: Shown, S: Serializer>(o: &Option<T>, s: S) -> Result<S::Ok, S::Error> {
        o.clone().map(T::Table::from).serialize(s)
    }

    pub(in crate::settings) fn deserialize<'de, T: Shown, D: Deserializer<'de>>(d: D) -> Result<Option<T>, D::Error> {
        Ok(Option::<T::Table>::deserialize(d)?.map(Into::into))
    }
}

/// Choices of a subspace identification.
#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct SubspaceTable {
    /// The method: it sets the weights of the singular value decomposition.
    method: SubspaceMethod,
    /// Block rows s of the future, and of the past unless said otherwise. They should cover one to two periods of the slowest mode.
    horizon: usize,
    /// Block rows p of the past; absent: as many as of the future. For the methods of closed loops it is the order of the predictor and
    /// should cover the time in which `(A - K C)^p` decays: with white noise at the outputs of a stable plant K is small, and this is
    /// the decay of the plant itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    past: Option<usize>,
    /// Order of the model, of S in `[hansen]`.
    order: OrderForm,
    /// Whether there is a direct path from u to y in the same sample.
    feedthrough: Feedthrough,
    /// Known delay of each input in samples, beyond the one of a system without direct path; none where empty. The model has them as
    /// states with poles at 0, after those of `order`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    delays: Vec<usize>,
    /// What to do with an unstable estimate.
    stability: Stability,
}

impl Default for SubspaceTable {
    fn default() -> Self {
        SubspaceOptions::default().into()
    }
}

impl Shown for SubspaceOptions {
    type Table = SubspaceTable;
}

impl From<SubspaceOptions> for SubspaceTable {
    fn from(options: SubspaceOptions) -> Self {
        let SubspaceOptions { method, horizon, order, feedthrough, delays, stability, .. } = options;
        let Horizon { future, past } = horizon;
        let past = (past != future).then_some(past);
        SubspaceTable { method, horizon: future, past, order: order.into(), feedthrough, delays, stability }
    }
}

impl From<SubspaceTable> for SubspaceOptions {
    fn from(table: SubspaceTable) -> Self {
        let SubspaceTable { method, horizon: future, past, order, feedthrough, delays, stability } = table;
        let horizon = Horizon { future, past: past.unwrap_or(future) };
        SubspaceOptions {
            method,
            horizon,
            order: order.into(),
            feedthrough,
            delays,
            stability,
            ..SubspaceOptions::default()
        }
    }
}

/// What is known of the recommended model beforehand; the rest is chosen by the evidence of the records.
#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::settings) struct RecommendedTable {
    /// Number of states, those of the dead time not counted.
    order: OrderForm,
    /// Dead time of each input in samples, beyond the one sample of a plant without feedthrough; chosen when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    dead_time: Option<Vec<usize>>,
    /// Whether an input acts on the outputs of the same sample; chosen when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    feedthrough: Option<bool>,
    /// Largest order that is tried.
    largest_order: usize,
}

impl Default for RecommendedTable {
    fn default() -> Self {
        LikelihoodOptions::default().into()
    }
}

impl Shown for LikelihoodOptions {
    type Table = RecommendedTable;
}

impl From<LikelihoodOptions> for RecommendedTable {
    fn from(LikelihoodOptions { order, dead_time, feedthrough, largest_order }: LikelihoodOptions) -> Self {
        RecommendedTable { order: order.into(), dead_time, feedthrough, largest_order }
    }
}

impl From<RecommendedTable> for LikelihoodOptions {
    fn from(RecommendedTable { order, dead_time, feedthrough, largest_order }: RecommendedTable) -> Self {
        LikelihoodOptions { order: order.number(), dead_time, feedthrough, largest_order }
    }
}

/// Choices of the reduction.
#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::settings) struct ReductionTable {
    /// How states are removed.
    method: ReductionMethod,
    /// Number of states that are kept.
    order: ReducedForm,
    /// Poles at or beyond this modulus, from 0 to 1, are kept as they are and only the rest is reduced. Absent: everything is reduced,
    /// and must be stable but for normalised coprime factors.
    #[serde(skip_serializing_if = "Option::is_none")]
    stability_boundary: Option<f64>,
}

impl Default for ReductionTable {
    fn default() -> Self {
        ReductionOptions::default().into()
    }
}

impl Shown for ReductionOptions {
    type Table = ReductionTable;
}

impl From<ReductionOptions> for ReductionTable {
    fn from(ReductionOptions { method, order, stability_boundary, .. }: ReductionOptions) -> Self {
        ReductionTable { method, order: order.into(), stability_boundary }
    }
}

impl From<ReductionTable> for ReductionOptions {
    fn from(ReductionTable { method, order, stability_boundary }: ReductionTable) -> Self {
        ReductionOptions { method, order: order.into(), stability_boundary, ..ReductionOptions::default() }
    }
}
