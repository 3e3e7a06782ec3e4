//! How long past and future are.

/// Block rows of the past and of the future.
///
/// The future should cover one to two periods of the slowest mode. For the methods of closed loops the past is the order of the
/// predictor and should cover the time in which `(A - K C)^p` decays: with white noise at the outputs of a stable plant K is
/// small, and this is the decay of the plant itself.
///
/// In files: `30` for both, or `{ future = 30, past = 60 }`.
///
/// ```
/// use youla::identify::subspace::Horizon;
/// assert_eq!(Horizon::from(30), Horizon { future: 30, past: 30 });
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "HorizonKeys", into = "HorizonKeys"))]
pub struct Horizon {
    /// Of the future, at least 2.
    pub future: usize,
    /// Of the past, at least 1.
    pub past: usize,
}

impl Default for Horizon {
    fn default() -> Self {
        Horizon::from(20)
    }
}

/// As many block rows of the past as of the future.
impl From<usize> for Horizon {
    fn from(rows: usize) -> Self {
        Horizon { future: rows, past: rows }
    }
}

/// The forms of a horizon in files.
#[cfg(feature = "serde")]
#[derive(Clone, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "the horizon is a number of block rows or `{ future = 30, past = 60 }`"
)]
enum HorizonKeys {
    /// Block rows of the past and of the future.
    Equal(usize),
    /// Block rows of each.
    Fixed { future: usize, past: usize },
}

#[cfg(feature = "serde")]
impl From<HorizonKeys> for Horizon {
    fn from(keys: HorizonKeys) -> Self {
        match keys {
            HorizonKeys::Equal(rows) => Horizon::from(rows),
            HorizonKeys::Fixed { future, past } => Horizon { future, past },
        }
    }
}

#[cfg(feature = "serde")]
impl From<Horizon> for HorizonKeys {
    fn from(Horizon { future, past }: Horizon) -> Self {
        if future == past { HorizonKeys::Equal(past) } else { HorizonKeys::Fixed { future, past } }
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Horizon {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Horizon".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        HorizonKeys::json_schema(generator)
    }
}
