//! The options of the library's methods as run.toml shows them: the choices of a user. Options that no user sets keep their defaults,
//! and are not written.

use super::order::{self, OrderForm, ReducedForm};
use serde::de::{DeserializeOwned, Error, Unexpected};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use youla::identify::likelihood::LikelihoodOptions;
use youla::identify::subspace::{Feedthrough, Horizon, Order, Stability, SubspaceMethod, SubspaceOptions};
use youla::reduce::{ReducedOrder, ReductionMethod, ReductionOptions};

/// Options with the table that shows them.
pub(in crate::settings) trait Shown: Sized + Clone {
    /// What run.toml says of them.
    type Table: Serialize + DeserializeOwned + From<Self> + TryInto<Self, Error: std::fmt::Display>;
}

pub(in crate::settings) fn serialize<T: Shown, S: Serializer>(options: &T, s: S) -> Result<S::Ok, S::Error> {
    T::Table::from(options.clone()).serialize(s)
}

pub(in crate::settings) fn deserialize<'de, T: Shown, D: Deserializer<'de>>(d: D) -> Result<T, D::Error> {
    T::Table::deserialize(d)?.try_into().map_err(D::Error::custom)
}

/// The same of a table that may be absent.
pub(in crate::settings) mod optional {
    use super::{Deserialize, Deserializer, Error, Serialize, Serializer, Shown};

    pub(in crate::settings) fn serialize<T: Shown, S: Serializer>(o: &Option<T>, s: S) -> Result<S::Ok, S::Error> {
        o.clone().map(T::Table::from).serialize(s)
    }

    pub(in crate::settings) fn deserialize<'de, T: Shown, D: Deserializer<'de>>(d: D) -> Result<Option<T>, D::Error> {
        Option::<T::Table>::deserialize(d)?.map(|table| table.try_into().map_err(D::Error::custom)).transpose()
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
    #[serde(with = "order")]
    #[schemars(with = "OrderForm")]
    order: Order,
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
        SubspaceTable { method, horizon: future, past, order, feedthrough, delays, stability }
    }
}

impl From<SubspaceTable> for SubspaceOptions {
    fn from(table: SubspaceTable) -> Self {
        let SubspaceTable { method, horizon: future, past, order, feedthrough, delays, stability } = table;
        let horizon = Horizon { future, past: past.unwrap_or(future) };
        SubspaceOptions { method, horizon, order, feedthrough, delays, stability, ..SubspaceOptions::default() }
    }
}

/// A number, or `"auto"`, which is `None`.
mod number_or_auto {
    use super::{Deserializer, Error, Serialize, Serializer, StatesForm, Unexpected, order};
    use serde::de::Visitor;
    use std::fmt;

    pub(super) fn serialize<S: Serializer>(rows: &Option<usize>, s: S) -> Result<S::Ok, S::Error> {
        rows.map_or(StatesForm::Word(order::AutoWord::Auto), StatesForm::Number).serialize(s)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Option<usize>, D::Error> {
        d.deserialize_any(Rows)
    }

    struct Rows;

    impl Visitor<'_> for Rows {
        type Value = Option<usize>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a whole number, zero or positive, or \"auto\"")
        }

        fn visit_i64<E: Error>(self, value: i64) -> Result<Option<usize>, E> {
            usize::try_from(value).map(Some).map_err(|_| E::invalid_value(Unexpected::Signed(value), &self))
        }

        fn visit_u64<E: Error>(self, value: u64) -> Result<Option<usize>, E> {
            usize::try_from(value).map(Some).map_err(|_| E::invalid_value(Unexpected::Unsigned(value), &self))
        }

        fn visit_str<E: Error>(self, value: &str) -> Result<Option<usize>, E> {
            if value == "auto" { Ok(None) } else { Err(E::invalid_value(Unexpected::Str(value), &self)) }
        }
    }
}

/// What is known of the recommended model beforehand; the rest is chosen by the evidence of the records.
#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::settings) struct RecommendedTable {
    /// Number of states, those of the dead time not counted.
    #[serde(with = "number_or_auto")]
    #[schemars(with = "StatesForm")]
    order: Option<usize>,
    /// Dead time of each input in samples, beyond the one sample of a plant without feedthrough; chosen when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    dead_time: Option<Vec<usize>>,
    /// Whether an input acts on the outputs of the same sample; chosen when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    feedthrough: Option<bool>,
    /// Largest order that is tried.
    largest_order: usize,
}

/// A number of states.
#[derive(Serialize, schemars::JsonSchema)]
#[serde(untagged)]
enum StatesForm {
    /// This number.
    Number(usize),
    /// The number that the evidence of the records asks for.
    Word(order::AutoWord),
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
        RecommendedTable { order, dead_time, feedthrough, largest_order }
    }
}

impl From<RecommendedTable> for LikelihoodOptions {
    fn from(RecommendedTable { order, dead_time, feedthrough, largest_order }: RecommendedTable) -> Self {
        LikelihoodOptions { order, dead_time, feedthrough, largest_order }
    }
}

/// Choices of the reduction.
#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::settings) struct ReductionTable {
    /// How states are removed.
    method: ReductionMethod,
    /// Number of states that are kept.
    #[serde(with = "order")]
    #[schemars(with = "ReducedForm")]
    order: ReducedOrder,
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
        ReductionTable { method, order, stability_boundary }
    }
}

impl From<ReductionTable> for ReductionOptions {
    fn from(ReductionTable { method, order, stability_boundary }: ReductionTable) -> Self {
        ReductionOptions { method, order, stability_boundary, ..ReductionOptions::default() }
    }
}
