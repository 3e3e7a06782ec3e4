//! How long past and future are.

/// Block rows of the past and of the future, given or left to the data.
///
/// The future should cover one to two periods of the slowest mode. For the methods of closed loops the past is the order of the
/// predictor and should cover the time in which `(A - K C)^p` decays: with white noise at the outputs of a stable plant K is
/// small, and this is the decay of the plant itself.
///
/// In files: `30` for both, `{ future = 30, past = 60 }`, `"auto"` for [`Horizon::AUTO`], or `{ max_past = 150 }`.
///
/// ```
/// use youla::identify::subspace::Horizon;
/// assert_eq!(Horizon::from(30), Horizon::Fixed { future: 30, past: 30 });
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "HorizonKeys", into = "HorizonKeys"))]
pub enum Horizon {
    /// As many block rows as given.
    Fixed {
        /// Of the future, at least 2.
        future: usize,
        /// Of the past, at least 1.
        past: usize,
    },
    /// Both from the data, by the order of a vector autoregression.
    Auto {
        /// Longest past to consider, block rows.
        max_past: usize,
    },
}

impl Default for Horizon {
    fn default() -> Self {
        Horizon::from(20)
    }
}

/// As many block rows of the past as of the future.
impl From<usize> for Horizon {
    fn from(rows: usize) -> Self {
        Horizon::Fixed { future: rows, past: rows }
    }
}

impl Horizon {
    /// Left to the data, with a past of at most 60 block rows; chosen, not measured.
    pub const AUTO: Horizon = Horizon::Auto { max_past: 60 };

    /// Block rows of the past; the longest one considered where the data choose.
    pub fn past(self) -> usize {
        match self {
            Horizon::Fixed { past, .. } => past,
            Horizon::Auto { max_past } => max_past,
        }
    }

    /// Block rows of the future; the shortest one, 1, where the data choose.
    pub fn future(self) -> usize {
        match self {
            Horizon::Fixed { future, .. } => future,
            Horizon::Auto { .. } => 1,
        }
    }

    /// Whether the data choose.
    pub fn is_auto(self) -> bool {
        matches!(self, Horizon::Auto { .. })
    }
}

/// The forms of a horizon in files.
#[cfg(feature = "serde")]
#[derive(Clone, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "the horizon is a number of block rows, `{ future = 30, past = 60 }`, \"auto\" or `{ max_past = 150 }`"
)]
enum HorizonKeys {
    /// Block rows of the past and of the future.
    Equal(usize),
    /// Block rows of each.
    Fixed { future: usize, past: usize },
    /// Both from the data, by the order of a vector autoregression of at most 60 block rows.
    Word(AutoWord),
    /// The same with the longest past to consider.
    Auto { max_past: usize },
}

/// The word for a choice by the data.
#[cfg(feature = "serde")]
#[derive(Clone, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
enum AutoWord {
    /// The data choose.
    Auto,
}

#[cfg(feature = "serde")]
impl From<HorizonKeys> for Horizon {
    fn from(keys: HorizonKeys) -> Self {
        match keys {
            HorizonKeys::Equal(rows) => Horizon::from(rows),
            HorizonKeys::Fixed { future, past } => Horizon::Fixed { future, past },
            HorizonKeys::Word(AutoWord::Auto) => Horizon::AUTO,
            HorizonKeys::Auto { max_past } => Horizon::Auto { max_past },
        }
    }
}

#[cfg(feature = "serde")]
impl From<Horizon> for HorizonKeys {
    fn from(horizon: Horizon) -> Self {
        match horizon {
            Horizon::Fixed { future, past } if future == past => HorizonKeys::Equal(past),
            Horizon::Fixed { future, past } => HorizonKeys::Fixed { future, past },
            Horizon::AUTO => HorizonKeys::Word(AutoWord::Auto),
            Horizon::Auto { max_past } => HorizonKeys::Auto { max_past },
        }
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
