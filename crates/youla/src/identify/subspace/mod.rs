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

mod batch;
mod channels;
mod factorisation;
mod gram;
mod hankel;
mod innovation;
mod memory;
mod modal;
mod open_loop;
mod options;
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
pub use memory::ExperimentStream;
pub use options::{
    ChannelScaling, DataFactor, Factorisation, Feedthrough, InitialState, Order, Stability, SubspaceOptions, Weight,
};
pub use order::{OrderCandidate, OrderReport, OrderRule};
pub use output_error::{InputFit, OutputFit};
pub use stability::{MovedPole, StabilityReport};

use crate::lti::{Discrete, StateSpace};
use crate::record::SampleStream;
use crate::{Error, Result};
use channels::{Channels, check_blocks};
use factorisation::DataTriangle;
use faer::{MatRef, c64};
use realisation::OutputPair;

/// Records of one experiment: row k is time k.
#[derive(Debug, Clone, Copy)]
pub struct Experiment<'a> {
    /// Inputs, N x m.
    pub u: MatRef<'a, f64>,
    /// Outputs, N x p.
    pub y: MatRef<'a, f64>,
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
    SubspaceData::new(experiments, time, options)?.identify(options)
}

/// The same as [`subspace`] for records that need not fit into memory, by two passes over the stream: one for the channels and
/// the Gram matrix (or R by QR where the options ask for it), one for B, D and the initial states. Where the condition number
/// of the data does not allow the Gram matrix, a pass for QR comes between them.
///
/// The numbers are those of [`subspace`] to the last bit (`tests::stream::a_stream_gives_the_model_of_the_memory`), and
/// memory does not depend on the length: two batches of 4 MB and, by QR, one piece of 4000 rows for each thread.
///
/// # Errors
/// As [`subspace`], those of the stream, and [`crate::Error::RecordChanged`] where two passes give different lengths.
///
/// ```no_run
/// use youla::identify::subspace::{SubspaceOptions, subspace_stream};
/// use youla::{lti::Discrete, record::{ChannelRef, NpyStream}};
/// let [u, y] = [1, 2].map(ChannelRef::Column);
/// let mut stream = NpyStream::open("long.npy", &[u], &[y])?;
/// let found = subspace_stream(&mut stream, Discrete::new(1e-4)?, &SubspaceOptions::default())?;
/// # Ok::<(), youla::Error>(())
/// ```
pub fn subspace_stream(
    stream: &mut dyn SampleStream,
    time: Discrete,
    options: &SubspaceOptions,
) -> Result<SubspaceModel> {
    Factored::new(stream, time, options)?.identify(stream, options)
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
/// let data = SubspaceData::new(&[Experiment { u: u.as_ref(), y: y.as_ref() }], Discrete::new(0.1)?, &options)?;
/// for n in 1..3 {
///     let found = data.identify(&SubspaceOptions { order: Order::Fixed(n), ..options.clone() })?;
///     assert!(found.poles().iter().any(|pole| (pole.re - 0.5).abs() < 1e-9));
/// }
/// # Ok::<(), youla::Error>(())
/// ```
pub struct SubspaceData<'a> {
    experiments: Vec<Experiment<'a>>,
    factored: Factored,
}

impl<'a> SubspaceData<'a> {
    /// Checks, scales and factors the data for the horizon and past of `options`. The records themselves are not copied.
    ///
    /// # Errors
    /// As [`subspace`], but for those of a model.
    pub fn new(experiments: &[Experiment<'a>], time: Discrete, options: &SubspaceOptions) -> Result<Self> {
        let factored = Factored::new(&mut ExperimentStream::new(experiments)?, time, options)?;
        Ok(SubspaceData { experiments: experiments.to_vec(), factored })
    }

    /// The model for other options with the same data: weight, order, D, stability and initial states are free, horizon and
    /// past at most those of the factor; scaling and factorisation are part of the factor.
    ///
    /// # Errors
    /// As [`subspace`]; [`crate::Error::OutOfRange`] for a longer horizon or past, [`crate::Error::Refactor`] for another
    /// scaling or factorisation.
    pub fn identify(&self, options: &SubspaceOptions) -> Result<SubspaceModel> {
        self.factored.identify(&mut ExperimentStream::new(&self.experiments)?, options)
    }
}

/// What all models from the same records share.
struct Factored {
    channels: Channels,
    triangle: DataTriangle,
    time: Discrete,
    options: SubspaceOptions,
}

impl Factored {
    fn new(stream: &mut dyn SampleStream, time: Discrete, options: &SubspaceOptions) -> Result<Self> {
        let (triangle, channels) = DataTriangle::new(stream, options)?;
        Ok(Factored { channels, triangle, time, options: options.clone() })
    }

    /// A model, by one pass over the records from which it was factored.
    fn identify(&self, stream: &mut dyn SampleStream, options: &SubspaceOptions) -> Result<SubspaceModel> {
        let held = (self.options.scaling, self.options.factorisation);
        if (options.scaling, options.factorisation) != held {
            return Err(Error::Refactor);
        }
        check_blocks(options)?;
        let found = match options.weight.is_for_closed_loops() {
            true => predictor_form::estimate(&self.triangle, options, self.time)?,
            false => open_loop::estimate(&self.triangle, options, self.time)?,
        };
        let fitted =
            output_error::fit(stream, &self.channels, &found.pair, found.innovation.gain(), &found.stability, options)?;
        Ok(SubspaceModel {
            model: self.channels.unscale_model(found.pair, fitted.b, fitted.d, self.time)?,
            innovation: found.innovation.unscale(self.channels.y_scale()),
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
