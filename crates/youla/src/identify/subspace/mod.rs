//! Subspace identification of `x+ = A x + B u, y = C x + D u + noise` from records of u and y: the N4SID family.
//!
//! One triangular factor of the block-Hankel data serves all weights: its past part gives the singular values, the order
//! and the observability matrix, from which A and C follow; the residuals of the same factor give the Kalman gain; B, D
//! and the initial states are the least-squares solution of the simulated output.
//!
//! The estimates of MOESP, N4SID and CVA are consistent for inputs that do not depend on the noise. Measurements from a
//! closed loop do not satisfy this: filter them by the coprime factors first, eq. (28), and identify S from alpha and beta,
//! eq. (25); or take PBSIDopt or SSARX, which start from the one-step predictor (`varx.rs` and beside it).
//!
//! References: Verhaegen, Automatica 30, 61 (1994), PO-MOESP; Van Overschee and De Moor, Subspace Identification for Linear
//! Systems, Kluwer 1996, chapters 4 and 6; Larimore, ACC 1983 and CDC 1990, CVA; Sima, Varga, SLICOT working note 2000-4.

mod innovation;
mod inputs;
mod open_loop;
mod options;
mod order;
#[cfg(feature = "serde")]
pub(super) mod order_form;
mod output_pair;
mod predictor_form;
mod projected;
pub(crate) mod records;
mod stability;
#[cfg(test)]
mod tests;
mod triangle;

pub use innovation::{Innovation, NoInnovation};
pub use inputs::output_error::{InputFit, OutputFit};
pub use options::{
    ChannelScaling, DataFactor, Factorisation, Feedthrough, InitialState, Order, Stability, SubspaceMethod,
    SubspaceOptions,
};
pub use order::OrderReport;
pub use records::delay::Delays;
pub use records::disturbance::{LineAmplitude, amplitudes, harmonics, lines};
pub use records::experiment::Experiment;
pub use stability::{MovedPole, StabilityReport};

use crate::lti::{Discrete, StateSpace};
use crate::{Error, Result};
use faer::{Mat, c64};
use inputs::output_error::Fitted;
use projected::{Estimate, Projected};
use records::channels::{Channels, check_blocks};
use triangle::factorisation::HankelLq;
use triangle::hankel_layout::HankelLayout;

/// Result of [`subspace`]. The states of MOESP, N4SID and CVA are those in which the observability matrix over the horizon
/// has orthonormal columns (with output scaling: of the scaled outputs); those of PBSIDopt those in which the
/// leading singular vectors of the predicted outputs are their observability matrix; those of SSARX have unit variance.
#[derive(Debug, Clone)]
pub struct SubspaceModel {
    /// The deterministic part, n states, m inputs, p outputs.
    pub model: StateSpace<Discrete>,
    /// Kalman gain and covariance of the innovations, or why there are none.
    pub innovation: Innovation,
    /// State at the first sample of each experiment that was used (the first of all, or that of the longest delay), n
    /// numbers each.
    pub initial_states: Vec<Vec<f64>>,
    /// Coefficients of the known disturbances per experiment, known signals x outputs; empty where none is known.
    pub disturbances: Vec<Mat<f64>>,
    /// Singular values of the weighted projection, horizon x p of them: cosines of canonical angles for CVA and SSARX, else
    /// unnormalised.
    pub singular_values: Vec<f64>,
    /// The order, without the states of delays, and what it was chosen by.
    pub order: OrderReport,
    /// Delay of each input in samples, as given; its states are behind the others, input by input, newest first.
    pub delays: Vec<usize>,
    /// The poles and what was done to them.
    pub stability: StabilityReport,
    /// How B and D were found and how well the model reproduces the outputs.
    pub fit: OutputFit,
    /// Block rows of the future.
    pub horizon: usize,
    /// Block rows of the past.
    pub past: usize,
    /// Columns of the block-Hankel matrices, over all experiments, less the directions that known disturbances take.
    pub columns: usize,
    /// Smallest over largest singular value of the block-Hankel matrix of the inputs with rows of unit length.
    pub excitation_rcond: f64,
    /// How the data were factored.
    pub factor: DataFactor,
}

impl SubspaceModel {
    /// Poles of the model, those of delays at 0 last.
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
/// for MOESP, N4SID and CVA, and for PBSIDopt and SSARX with `z = [u; y]` and a state T read from the past p
/// ```text
/// y(k) = sum_{i=1..p} Xi_i z(k-i) + D u(k) + e(k),   x(k) = T [z(k-p); ...; z(k-1)] by the method, and its shift x(k+1)
/// C, e : y(k) on x(k), u(k);    A : x(k+1) on x(k), u(k), e(k);    K, Lambda : from the residuals by a Riccati equation
/// B, D, x0 : min sum |y - yhat|^2 over the one-step predicted outputs
/// ```
/// Experiments are joined as columns, never across their boundaries; each has its own initial state, and its own coefficients of
/// known disturbances.
///
/// # Errors
/// [`crate::Error::Shape`] where records differ in length, channels or number of known signals, [`crate::Error::NotFinite`],
/// [`crate::Error::TooFewSamples`], [`crate::Error::ConstantChannel`], [`crate::Error::InsufficientExcitation`],
/// [`crate::Error::Order`], [`crate::Error::OutOfRange`] for a horizon below 2 or an order of 0,
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
/// let found = subspace(&[Experiment::new(u.as_ref(), y.as_ref())], Discrete::new(0.1)?, &options)?;
/// assert!((found.poles()[0].re - 0.5).abs() < 1e-9);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn subspace(experiments: &[Experiment<'_>], time: Discrete, options: &SubspaceOptions) -> Result<SubspaceModel> {
    in_pool(|| SubspaceData::new(experiments, time, options)?.identify(options))
}

/// Runs on a thread of the pool, so that the parallel steps within need not wake it one by one.
fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::scope(|_| work())
}

/// Records with the triangular factor of their block-Hankel matrix: models of any weight and order and of any horizon and
/// past up to those of the factor come from it without another pass over the Hankel data.
///
/// ```
/// use youla::{Mat, lti::Discrete};
/// use youla::identify::subspace::{Experiment, Order, SubspaceData, SubspaceOptions};
/// let u = Mat::from_fn(300, 1, |k, _| ((k * k) as f64).sin());
/// let mut y = Mat::zeros(300, 1);
/// for k in 0..299 {
///     y[(k + 1, 0)] = 0.5 * y[(k, 0)] + u[(k, 0)];
/// }
/// let options = SubspaceOptions { horizon: 5, ..Default::default() };
/// let data = SubspaceData::new(&[Experiment::new(u.as_ref(), y.as_ref())], Discrete::new(0.1)?, &options)?;
/// for n in 1..3 {
///     let found = data.identify(&SubspaceOptions { order: Order::Fixed(n), ..options.clone() })?;
///     assert!(found.poles().iter().any(|pole| (pole.re - 0.5).abs() < 1e-9));
/// }
/// # Ok::<(), youla::Error>(())
/// ```
pub struct SubspaceData<'a> {
    channels: Channels<'a>,
    triangle: HankelLq,
    time: Discrete,
    factored: SubspaceOptions,
}

impl<'a> SubspaceData<'a> {
    /// Checks and factors the data for the horizon and past of `options`. The records are not copied, but where delays or
    /// disturbances are taken out of them: known disturbances are projected out of the factor, and each model has their
    /// coefficients in [`SubspaceModel::disturbances`].
    ///
    /// # Errors
    /// As [`subspace`], but for those of a model.
    pub fn new(experiments: &[Experiment<'a>], time: Discrete, options: &SubspaceOptions) -> Result<Self> {
        in_pool(|| Self::factored(experiments, time, options))
    }

    fn factored(experiments: &[Experiment<'a>], time: Discrete, options: &SubspaceOptions) -> Result<Self> {
        let channels = Channels::new(experiments, options)?;
        let rows = options.block_rows();
        channels.check_lengths(rows)?;
        let triangle = HankelLq::new(&channels, rows, HankelLayout::of(options), options.factorisation)?;
        Ok(SubspaceData { channels, triangle, time, factored: options.clone() })
    }

    /// The model for other options with the same data: weight, order, D, stability and initial states are free, horizon and
    /// past at most those of the factor; scaling, factorisation and delays are part of the factor.
    ///
    /// # Errors
    /// As [`subspace`]; [`crate::Error::OutOfRange`] for a longer horizon or past, [`crate::Error::Unsupported`] for another
    /// scaling, factorisation or delays.
    pub fn identify(&self, options: &SubspaceOptions) -> Result<SubspaceModel> {
        self.check(options)?;
        in_pool(|| self.model(&Projected::new(&self.triangle, options)?, options))
    }

    /// Refuses options that these data do not serve.
    fn check(&self, options: &SubspaceOptions) -> Result<()> {
        let held = &self.factored;
        if (options.scaling, options.factorisation, &options.delays) != (held.scaling, held.factorisation, &held.delays)
        {
            return Err(Error::Unsupported {
                what: "another scaling, factorisation or delay than that of the factored data",
                instead: "factor the records again",
            });
        }
        check_blocks(options)?;
        options.feedthrough.check(self.channels.inputs, self.channels.outputs)
    }

    fn model(&self, projected: &Projected, options: &SubspaceOptions) -> Result<SubspaceModel> {
        let Order::Fixed(order) = options.order else {
            let order = order::choose(options.order, projected.evidence()?)?;
            let scaled = self.scaled_model(projected, order.order, options)?;
            return self.finished(projected, order, scaled, options);
        };
        order::check(order)?;
        let (evidence, scaled) = rayon::join(|| projected.evidence(), || self.scaled_model(projected, order, options));
        let order = order::choose(options.order, evidence?)?;
        self.finished(projected, order, scaled?, options)
    }

    /// The model in the units of the record, with all that is known of it.
    fn finished(
        &self,
        projected: &Projected,
        order: OrderReport,
        scaled: ScaledModel,
        options: &SubspaceOptions,
    ) -> Result<SubspaceModel> {
        let ScaledModel { estimate, fitted } = scaled;
        let (factor, columns) = projected.data();
        let (delays, delayed) = (&self.channels.delays, &self.channels.delayed);
        let model = self.channels.unscale_model(&estimate.pair, &fitted.b, &fitted.d, self.time)?;
        let mut stability = estimate.stability;
        stability.poles.extend(vec![c64::new(0.0, 0.0); delays.states()]);
        Ok(SubspaceModel {
            model: delays.put_before(model)?,
            innovation: estimate.innovation.unscale(self.channels.y_scale()).beside_delays(delays.states()),
            initial_states: fitted.initial_states.into_iter().zip(delayed).map(|(x, z)| [&x[..], z].concat()).collect(),
            disturbances: self.channels.unscale_disturbances(fitted.disturbances),
            singular_values: projected.singular_values().to_vec(),
            order,
            delays: options.delays.clone(),
            stability,
            fit: fitted.quality,
            horizon: options.horizon,
            past: options.block_rows().0,
            columns,
            excitation_rcond: projected.excitation_rcond(),
            factor,
        })
    }

    /// The model of one order in scaled units.
    fn scaled_model(&self, projected: &Projected, order: usize, options: &SubspaceOptions) -> Result<ScaledModel> {
        let estimate = projected.estimate(order, options.stability, self.time)?;
        let gain = estimate.innovation.gain();
        let fitted = inputs::output_error::fit(&self.channels, &estimate.pair, gain, &estimate.stability, options)?;
        Ok(ScaledModel { estimate, fitted })
    }
}

/// All of a model, in scaled units.
struct ScaledModel {
    estimate: Estimate,
    fitted: Fitted,
}
