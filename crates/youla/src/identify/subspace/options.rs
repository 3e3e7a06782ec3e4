//! The choices of [`crate::identify::subspace::subspace`], one plain struct for library, run.toml and Python.

use crate::{Error, Result};

/// Choices of [`crate::identify::subspace::subspace`].
///
/// ```
/// use youla::identify::subspace::{Order, SubspaceOptions, SubspaceMethod};
/// let options = SubspaceOptions { method: SubspaceMethod::Cva, order: Order::Fixed(8), ..Default::default() };
/// assert_eq!(options.horizon, 20);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct SubspaceOptions {
    /// The method: it sets the weights of the singular value decomposition.
    pub method: SubspaceMethod,
    /// Block rows s of the future, and of the past unless said otherwise. They should cover one to two periods of the slowest mode.
    pub horizon: usize,
    /// Block rows p of the past; absent: as many as of the future. For the methods of closed loops it is the order of the predictor and
    /// should cover the time in which `(A - K C)^p` decays: with white noise at the outputs of a stable plant K is small, and this is
    /// the decay of the plant itself.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub past: Option<usize>,
    /// Order of the model, of S in `[hansen]`.
    pub order: Order,
    /// Whether there is a direct path from u to y in the same sample.
    pub feedthrough: Feedthrough,
    /// Known delay of each input in samples, beyond the one of a system without direct path; none where empty. The model has them as
    /// states with poles at 0, after those of `order`.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub delays: Vec<usize>,
    /// What to do with an unstable estimate.
    pub stability: Stability,
    /// How the block-Hankel data are factored; no key of run.toml.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub factorisation: Factorisation,
    /// Units in which the least-squares problems are posed; no key of run.toml. The model always comes in the units of the record.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub scaling: ChannelScaling,
    /// The state at the first sample of each experiment; no key of run.toml.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub initial_state: InitialState,
}

impl Default for SubspaceOptions {
    fn default() -> Self {
        SubspaceOptions {
            method: SubspaceMethod::default(),
            horizon: 20,
            past: None,
            order: Order::default(),
            feedthrough: Feedthrough::default(),
            delays: Vec::new(),
            stability: Stability::default(),
            factorisation: Factorisation::default(),
            scaling: ChannelScaling::default(),
            initial_state: InitialState::default(),
        }
    }
}

impl SubspaceOptions {
    /// Block rows of the past and of the future.
    pub fn block_rows(&self) -> (usize, usize) {
        (self.past.unwrap_or(self.horizon), self.horizon)
    }
}

/// The method: weight `W1 O W2` of the projection O of the future outputs along the past, and the way to A and C.
///
/// [`Moesp`](SubspaceMethod::Moesp), [`N4sid`](SubspaceMethod::N4sid) and [`Cva`](SubspaceMethod::Cva) are for inputs that do not depend on the
/// noise. The others stay consistent when u contains fed-back noise, and need no knowledge of the controller: they regress
/// on the past inputs and outputs of the one-step predictor, take A, C and K from the states, and B and D from the
/// one-step predictions. They need a plant without D or a controller without direct path, and a past p with `(A - K C)^p`
/// small; their parameters are many, so that for open-loop data the first three have less variance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum SubspaceMethod {
    /// PO-MOESP: `W1 = I`, `W2` the projection onto the complement of the future inputs; A from the shift of the
    /// observability matrix.
    #[default]
    Moesp,
    /// Robust N4SID: the same weights; A and C by regression of the state sequence on its past.
    N4sid,
    /// Canonical variates: `W1` whitens the future outputs, so that the singular values do not depend on the units of the
    /// outputs; A from the shift of the observability matrix.
    Cva,
    /// PBSIDopt: the outputs as the regression coefficients predict them from the past alone; `W2` the past signals. The
    /// method of choice in closed loop, also for an unstable plant.
    PbsidOpt,
    /// SSARX: canonical variates of the past with the future outputs, freed of what the regression takes from the future
    /// inputs and outputs. As PBSIDopt, independent of the units of the outputs also without scaling.
    Ssarx,
}

impl SubspaceMethod {
    /// Whether the method stays consistent when the inputs contain fed-back noise.
    pub fn is_for_closed_loops(self) -> bool {
        matches!(self, SubspaceMethod::PbsidOpt | SubspaceMethod::Ssarx)
    }
}

/// How the order is found; in files a number, or `"auto"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "super::order_form::OrderForm", into = "super::order_form::OrderForm"))]
pub enum Order {
    /// The order given.
    Fixed(usize),
    /// By the singular value criterion, at most this; the horizon may allow less.
    Auto(usize),
}

impl Default for Order {
    fn default() -> Self {
        Order::Auto(12)
    }
}

/// Direct path from input to output.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Feedthrough {
    /// D = 0 exactly, as for a plant behind a zero-order hold.
    #[default]
    None,
    /// D is estimated.
    Estimated,
    /// The marked entries of D are estimated, the others are 0: `[output][input]`. The methods of closed loops regress each
    /// output on the past and on its own inputs of the same sample.
    Entries(Vec<Vec<bool>>),
}

impl Feedthrough {
    /// Refuses marks that do not fit D.
    pub(super) fn check(&self, inputs: usize, outputs: usize) -> Result<()> {
        let Feedthrough::Entries(rows) = self else { return Ok(()) };
        let unfit = rows.iter().map(Vec::len).find(|columns| *columns != inputs);
        if rows.len() == outputs && unfit.is_none() {
            return Ok(());
        }
        let what = "the table of entries of D (feedthrough)".into();
        Err(Error::Shape { what, expected: (outputs, inputs), found: (rows.len(), unfit.unwrap_or(inputs)) })
    }

    /// Per output, the inputs whose entries of D are estimated.
    pub(super) fn inputs_of_outputs(&self, inputs: usize, outputs: usize) -> Vec<Vec<usize>> {
        match self {
            Feedthrough::None => vec![Vec::new(); outputs],
            Feedthrough::Estimated => vec![(0..inputs).collect(); outputs],
            Feedthrough::Entries(rows) => rows.iter().map(|row| (0..inputs).filter(|j| row[*j]).collect()).collect(),
        }
    }
}

/// How the triangular factor of the block-Hankel data is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Factorisation {
    /// From the Gram matrix where the condition number of the data allows it (up to 1e4 with columns of unit length), else
    /// by QR.
    #[default]
    Auto,
    /// Cholesky factor of the Gram matrix, which lag sums give: fast, with the square of the condition number.
    Gram,
    /// Orthogonal reduction of the data.
    Qr,
}

/// How the block-Hankel data were factored.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DataFactor {
    /// [`Factorisation::Gram`] or [`Factorisation::Qr`].
    pub by: Factorisation,
    /// Condition number of the data, columns of unit length, as estimated from the Gram matrix; absent where that was not
    /// tried or is not positive definite to working precision.
    pub condition: Option<f64>,
}

/// What to do with an unstable estimate of A. A stable one is never touched, however lightly damped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Stability {
    /// Refuse it with its worst pole.
    #[default]
    Require,
    /// Return it as it is; B and D then come from the one-step prediction instead of the simulation.
    Allow,
    /// Reflect its unstable poles at the unit circle, then estimate B and D for the changed A. Reported with the result.
    Constrain,
}

/// Scaling of the channels inside of the method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum ChannelScaling {
    /// The units of the record.
    None,
    /// Every channel is divided by its root-mean-square value over all experiments.
    #[default]
    Rms,
}

/// The state at the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum InitialState {
    /// Estimated, one per experiment.
    #[default]
    Estimated,
    /// Zero: the system was at rest.
    Zero,
    /// The steady state at the first sample of the inputs. Grey-box structures only.
    SteadyState,
}
