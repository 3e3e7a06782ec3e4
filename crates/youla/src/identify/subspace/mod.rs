//! Subspace identification of `x+ = A x + B u, y = C x + D u + noise` from records of u and y: the N4SID family.
//!
//! One triangular factor of the block-Hankel data serves all weights: its past part gives the singular values, the order
//! and the observability matrix, from which A and C follow; the residuals of the same factor give the Kalman gain; B, D
//! and the initial states are the least-squares solution of the simulated output.
//!
//! The estimates of MOESP, N4SID and CVA are consistent for inputs that do not depend on the noise. Measurements from a
//! closed loop do not satisfy this: filter them by the coprime factors first, eq. (28), and identify S from alpha and beta,
//! eq. (25); or take PBSIDopt, SSARX or PARSIM-S, which start from the one-step predictor (`varx.rs` and beside it).
//!
//! References: Verhaegen, Automatica 30, 61 (1994), PO-MOESP; Van Overschee and De Moor, Subspace Identification for Linear
//! Systems, Kluwer 1996, chapters 4 and 6; Larimore, ACC 1983 and CDC 1990, CVA; Sima, Varga, SLICOT working note 2000-4.

mod channels;
mod gram;
mod hankel;
mod innovation;
mod modal;
mod open_loop;
mod order;
mod output_error;
mod parsim;
mod pbsid;
mod predictor_form;
mod projection;
mod realisation;
mod sensitivity;
mod ssarx;
mod stability;
#[cfg(test)]
mod tests;
mod varx;

pub use innovation::{Innovation, NoInnovation};
pub use order::{OrderCandidate, OrderReport, OrderRule};
pub use output_error::{InputFit, OutputFit};
pub use stability::{MovedPole, StabilityReport};

use crate::Result;
use crate::lti::{Discrete, StateSpace};
use channels::Channels;
use faer::{MatRef, c64};
use realisation::OutputPair;
use serde::{Deserialize, Serialize};

/// Records of one experiment: row k is time k.
#[derive(Debug, Clone, Copy)]
pub struct Experiment<'a> {
    /// Inputs, N x m.
    pub u: MatRef<'a, f64>,
    /// Outputs, N x p.
    pub y: MatRef<'a, f64>,
}

/// Choices of [`subspace`].
///
/// ```
/// use youla::identify::subspace::{Order, SubspaceOptions, Weight};
/// let options = SubspaceOptions { weight: Weight::Cva, order: Order::Fixed(8), ..Default::default() };
/// assert_eq!(options.horizon, 20);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SubspaceOptions {
    /// Weight of the singular value decomposition, and with it the name of the method.
    pub weight: Weight,
    /// Block rows s of the future, and of the past unless said otherwise. They should cover one to two periods of the
    /// slowest mode.
    pub horizon: usize,
    /// Block rows p of the past; absent: as many as of the future. For the methods of closed loops it is the order of the
    /// predictor and should cover the time in which `(A - K C)^p` decays: with white noise at the outputs of a stable
    /// plant K is small, and this is the decay of the plant itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub past: Option<usize>,
    /// Order of the model.
    pub order: Order,
    /// Whether there is a direct path from u to y in the same sample.
    pub feedthrough: Feedthrough,
    /// How the block-Hankel data are factored.
    pub factorisation: Factorisation,
    /// What to do with an unstable estimate.
    pub stability: Stability,
    /// Units in which the least-squares problems are posed. The model always comes in the units of the record.
    pub scaling: ChannelScaling,
    /// The state at the first sample of each experiment.
    pub initial_state: InitialState,
}

impl Default for SubspaceOptions {
    fn default() -> Self {
        SubspaceOptions {
            weight: Weight::default(),
            horizon: 20,
            past: None,
            order: Order::default(),
            feedthrough: Feedthrough::default(),
            factorisation: Factorisation::default(),
            stability: Stability::default(),
            scaling: ChannelScaling::default(),
            initial_state: InitialState::default(),
        }
    }
}

impl SubspaceOptions {
    /// Block rows of the past.
    pub fn past(&self) -> usize {
        self.past.unwrap_or(self.horizon)
    }
}

/// The method: weight `W1 O W2` of the projection O of the future outputs along the past, and the way to A and C.
///
/// [`Moesp`](Weight::Moesp), [`N4sid`](Weight::N4sid) and [`Cva`](Weight::Cva) are for inputs that do not depend on the
/// noise. The others stay consistent when u contains fed-back noise, and need no knowledge of the controller: they regress
/// on the past inputs and outputs of the one-step predictor, take A, C and K from the states, and B and D from the
/// one-step predictions. They need a plant without D or a controller without direct path, and a past p with `(A - K C)^p`
/// small; their parameters are many, so that for open-loop data the first three have less variance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weight {
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
    /// PARSIM-S: the future outputs regressed block row by block row on the past and one input; `W2` the past signals. For
    /// controllers that delay y by at least one sample.
    ParsimS,
}

impl Weight {
    /// Whether the method stays consistent when the inputs contain fed-back noise.
    pub fn is_for_closed_loops(self) -> bool {
        matches!(self, Weight::PbsidOpt | Weight::Ssarx | Weight::ParsimS)
    }
}

/// How the order is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Order {
    /// The order given.
    Fixed(usize),
    /// The order that the criterion of [`OrderRule::Svc`] proposes.
    Auto {
        /// Largest order to consider.
        max: usize,
    },
}

impl Default for Order {
    fn default() -> Self {
        Order::Auto { max: 12 }
    }
}

/// Direct path from input to output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Feedthrough {
    /// D = 0 exactly, as for a plant behind a zero-order hold.
    #[default]
    None,
    /// D is estimated.
    Estimated,
}

/// How the triangular factor of the block-Hankel data is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DataFactor {
    /// [`Factorisation::Gram`] or [`Factorisation::Qr`].
    pub by: Factorisation,
    /// Condition number of the data, columns of unit length, as estimated from the Gram matrix; absent where that was not
    /// tried or is not positive definite to working precision.
    pub condition: Option<f64>,
}

/// What to do with an unstable estimate of A. A stable one is never touched, however lightly damped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelScaling {
    /// The units of the record.
    None,
    /// Every channel is divided by its root-mean-square value over all experiments.
    #[default]
    Rms,
}

/// The state at the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitialState {
    /// Estimated, one per experiment.
    #[default]
    Estimated,
    /// Zero: the system was at rest.
    Zero,
}

/// Result of [`subspace`]. The states of MOESP, N4SID and CVA are those in which the observability matrix over the horizon
/// has orthonormal columns (with output scaling: of the scaled outputs); those of PBSIDopt and PARSIM-S those in which the
/// leading singular vectors of the predicted outputs are their observability matrix; those of SSARX have unit variance.
#[derive(Debug, Clone)]
pub struct SubspaceModel {
    /// The deterministic part, n states, m inputs, p outputs.
    pub model: StateSpace<Discrete>,
    /// Kalman gain and covariance of the innovations, or why there are none.
    pub innovation: Innovation,
    /// State at the first sample of each experiment, n numbers each.
    pub initial_states: Vec<Vec<f64>>,
    /// Singular values of the weighted projection, horizon x p of them: cosines of canonical angles for CVA and SSARX, else
    /// unnormalised.
    pub singular_values: Vec<f64>,
    /// The order and what other criteria would have proposed.
    pub order: OrderReport,
    /// The poles and what was done to them.
    pub stability: StabilityReport,
    /// How B and D were found and how well the model reproduces the outputs.
    pub fit: OutputFit,
    /// Block rows of the future.
    pub horizon: usize,
    /// Block rows of the past.
    pub past: usize,
    /// Columns of the block-Hankel matrices, over all experiments.
    pub columns: usize,
    /// Smallest over largest singular value of the block-Hankel matrix of the inputs with rows of unit length.
    pub excitation_rcond: f64,
    /// How the data were factored.
    pub factor: DataFactor,
}

impl SubspaceModel {
    /// Poles of the model.
    pub fn poles(&self) -> &[c64] {
        &self.stability.poles
    }
}

/// Estimates a state-space model from one or more experiments on the same system.
///
/// With the block-Hankel matrices `U_p, Y_p` (past) and `U_f, Y_f` (future) of s block rows,
/// ```text
/// [U_f; U_p; Y_p; Y_f] = R' Q',    R32' = W2-weighted part of Y_f along [U_p; Y_p]
/// W1 R32' = U S V',   Gamma = W1^-1 U(:, 1:n),   C = Gamma(1:p, :),   A = Gamma(1:end-p, :)^+ Gamma(p+1:end, :)
/// K, Lambda : from the residuals of the state and output equations by a Riccati equation
/// B, D, x0  : min sum |y - yhat|^2 over the simulated (for unstable A: one-step predicted) outputs
/// ```
/// for MOESP, N4SID and CVA, and for PBSIDopt, SSARX and PARSIM-S with `z = [u; y]` and a state T read from the past p
/// ```text
/// y(k) = sum_{i=1..p} Xi_i z(k-i) + D u(k) + e(k),   x(k) = T [z(k-p); ...; z(k-1)] by the method, and its shift x(k+1)
/// C, e : y(k) on x(k), u(k);    A : x(k+1) on x(k), u(k), e(k);    K, Lambda : from the residuals by a Riccati equation
/// B, D, x0 : min sum |y - yhat|^2 over the one-step predicted outputs
/// ```
/// Experiments are joined as columns, never across their boundaries; each has its own initial state.
///
/// # Errors
/// [`crate::Error::Shape`] where records differ in length or channels, [`crate::Error::NotFinite`],
/// [`crate::Error::TooFewSamples`], [`crate::Error::ConstantChannel`], [`crate::Error::NotExciting`],
/// [`crate::Error::OrderBeyondHorizon`], [`crate::Error::OutOfRange`] for a horizon below 2 or an order of 0,
/// [`crate::Error::Unstable`] unless unstable estimates are allowed.
///
/// # Accuracy
/// Noise-free records of random systems give their transfer function back to 1e-8 (`tests::recovery::recovers_random_systems`,
/// `tests::closed_loop::noise_free_systems_are_recovered`);
/// the published figures of SLICOT on measured data hold to 0.5 % (`tests::measured::slicot_figures`). The result does not depend
/// on the number of threads.
///
/// ```
/// use youla::{Mat, lti::Discrete};
/// use youla::identify::subspace::{Experiment, Order, SubspaceOptions, subspace};
/// // y(k+1) = 0.5 y(k) + u(k)
/// let u = Mat::from_fn(300, 1, |k, _| ((k * k) as f64).sin());
/// let mut y = Mat::zeros(300, 1);
/// for k in 0..299 {
///     y[(k + 1, 0)] = 0.5 * y[(k, 0)] + u[(k, 0)];
/// }
/// let options = SubspaceOptions { horizon: 5, order: Order::Fixed(1), ..Default::default() };
/// let found = subspace(&[Experiment { u: u.as_ref(), y: y.as_ref() }], Discrete::new(0.1)?, &options)?;
/// assert!((found.poles()[0].re - 0.5).abs() < 1e-9);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn subspace(experiments: &[Experiment<'_>], time: Discrete, options: &SubspaceOptions) -> Result<SubspaceModel> {
    let data = Channels::new(experiments, options)?;
    let found = match options.weight.is_for_closed_loops() {
        true => predictor_form::estimate(&data, options, time)?,
        false => open_loop::estimate(&data, options, time)?,
    };
    let fitted = output_error::fit(&data, &found.pair, found.innovation.gain(), &found.stability, options)?;
    Ok(SubspaceModel {
        model: data.unscale_model(found.pair, fitted.b, fitted.d, time)?,
        innovation: found.innovation.unscale(&data.y_scale),
        initial_states: fitted.initial_states,
        singular_values: found.singular_values,
        order: found.order,
        stability: found.stability,
        fit: fitted.quality,
        horizon: options.horizon,
        past: options.past(),
        columns: found.columns,
        excitation_rcond: found.excitation_rcond,
        factor: found.factor,
    })
}

/// What the data say about all but B, D and the initial states, in scaled units.
struct Estimate {
    pair: OutputPair,
    stability: StabilityReport,
    innovation: Innovation,
    singular_values: Vec<f64>,
    order: OrderReport,
    columns: usize,
    excitation_rcond: f64,
    factor: DataFactor,
}
