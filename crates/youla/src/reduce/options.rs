//! What a reduction is asked to do.

use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Mat, Result};

/// How a model is reduced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum ReductionMethod {
    /// Weak states are dropped (B. C. Moore, IEEE Trans. Autom. Control 26 (1981), 17).
    #[default]
    BalancedTruncation,
    /// Weak states follow without delay, `dx/dt = 0` or `x(k+1) = x(k)`, which keeps the static gain.
    SingularPerturbation,
    /// Balanced truncation of the normalised right coprime factors: for unstable models as they are, with a bound in the gap
    /// metric. Outputs and inputs must be scaled.
    NormalisedCoprime,
    /// Balanced truncation with the weights of the loop, `Mt + S Ut` at the outputs and `M + U S` at the inputs (D. F. Enns,
    /// 1984): no bound, and stability is not guaranteed.
    Weighted,
}

impl std::fmt::Display for ReductionMethod {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            ReductionMethod::BalancedTruncation => "balanced truncation",
            ReductionMethod::SingularPerturbation => "singular-perturbation approximation",
            ReductionMethod::NormalisedCoprime => "balanced truncation of normalised coprime factors",
            ReductionMethod::Weighted => "balanced truncation weighted by the loop",
        })
    }
}

/// How many states are kept; in files a number, `"minimal"`, `"auto"`, or a table with the key `bound` or `closed-loop`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "super::order_form::ReducedForm", into = "super::order_form::ReducedForm"))]
pub enum ReducedOrder {
    /// All that are controllable and observable to working precision: removes exact cancellations only.
    #[default]
    Minimal,
    /// This number, with the states of the poles that are kept apart.
    Fixed(usize),
    /// The fewest for which the error bound does not exceed this value, in output units per input unit (scaled, where scales are
    /// given) or in the gap metric.
    Bound(f64),
    /// The fewest which the controller stabilises with a relative error of the closed loop from alpha to y of at most this value;
    /// [`super::reduce_in_loop`] only.
    ClosedLoop(f64),
}

/// Choices of [`super::reduce`] and [`super::reduce_in_loop`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct ReductionOptions {
    /// How states are removed.
    pub method: ReductionMethod,
    /// Number of states that are kept.
    pub order: ReducedOrder,
    /// Poles at or beyond this boundary are kept as they are and only the rest is reduced: a modulus from 0 to 1 in discrete, a real part
    /// of at most 0 in continuous time. Absent: everything is reduced, and must be stable but for normalised coprime factors.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub stability_boundary: Option<f64>,
    /// States whose Hankel singular value is below this fraction of the largest count as not minimal; no key of run.toml.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub minimality: f64,
    /// Sizes of the outputs, one per output, that matter equally; 1 each when absent; no key of run.toml. A run takes the rms of its
    /// estimation records for normalised coprime factors.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub output_scale: Option<Vec<f64>>,
    /// Sizes of the inputs, one per input; 1 each, or the rms, when absent, as for the outputs.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub input_scale: Option<Vec<f64>>,
}

impl Default for ReductionOptions {
    fn default() -> Self {
        ReductionOptions {
            method: ReductionMethod::default(),
            order: ReducedOrder::default(),
            minimality: 1e-12,
            stability_boundary: None,
            output_scale: None,
            input_scale: None,
        }
    }
}

impl ReductionOptions {
    pub(super) fn check<T: TimeDomain>(&self, system: &StateSpace<T>) -> Result<()> {
        let refuse =
            |what: &str, value: f64, must: &'static str| Err(Error::OutOfRange { what: what.into(), value, must });
        let not_negative = |value: f64| value >= 0.0;
        match self.order {
            ReducedOrder::Bound(bound) if !not_negative(bound) => {
                return refuse("the error bound", bound, "zero or positive");
            }
            ReducedOrder::ClosedLoop(limit) if !not_negative(limit) => {
                return refuse("the closed-loop error", limit, "zero or positive");
            }
            ReducedOrder::Bound(_) if self.method == ReductionMethod::Weighted => {
                return Err(Error::Unsupported {
                    what: "order = { bound = ... } with method = \"weighted\"",
                    instead: "the weighted reduction has no error bound; give the number of states or order = { closed-loop = ... }",
                });
            }
            _ => {}
        }
        if !not_negative(self.minimality) {
            let what = "the relative size of negligible Hankel singular values";
            return refuse(what, self.minimality, "zero or positive");
        }
        let Some(boundary) = self.stability_boundary else { return Ok(()) };
        const WHAT: &str = "the stability boundary";
        match system.time().sample_time() {
            _ if self.method == ReductionMethod::NormalisedCoprime => {
                refuse(WHAT, boundary, "left out with method = \"normalised-coprime\", which keeps nothing apart")
            }
            Some(_) if !(0.0..=1.0).contains(&boundary) => refuse(WHAT, boundary, "a modulus from 0 to 1"),
            None if !(boundary.is_finite() && boundary <= 0.0) => refuse(WHAT, boundary, "a real part of at most 0"),
            _ => Ok(()),
        }
    }
}

/// Sizes of outputs and inputs that matter equally.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scales {
    output: Option<Vec<f64>>,
    input: Option<Vec<f64>>,
}

impl Scales {
    pub(super) fn new<T: TimeDomain>(options: &ReductionOptions, system: &StateSpace<T>) -> Result<Self> {
        for (what, scale, expected) in [
            ("output_scale", &options.output_scale, system.outputs()),
            ("input_scale", &options.input_scale, system.inputs()),
        ] {
            let Some(scale) = scale else { continue };
            if scale.len() != expected {
                return Err(Error::Ports { what: format!("the length of {what}"), expected, found: scale.len() });
            }
            if let Some(value) = scale.iter().copied().find(|s| !(*s > 0.0 && s.is_finite())) {
                return Err(Error::OutOfRange { what: format!("an entry of {what}"), value, must: "positive" });
            }
        }
        Ok(Scales { output: options.output_scale.clone(), input: options.input_scale.clone() })
    }

    /// `Dy^-1 G Du` of a system from inputs to outputs.
    pub(super) fn apply<T: TimeDomain>(&self, system: &StateSpace<T>) -> StateSpace<T> {
        mapped(mapped(system.clone(), &self.output, true, true), &self.input, false, false)
    }

    /// `Dy G Du^-1`: the inverse of [`Self::apply`].
    pub(super) fn undo<T: TimeDomain>(&self, system: &StateSpace<T>) -> StateSpace<T> {
        mapped(mapped(system.clone(), &self.output, true, false), &self.input, false, true)
    }

    /// `Dy^-1 W Dy` of a weight at the outputs.
    pub(super) fn at_outputs<T: TimeDomain>(&self, weight: &StateSpace<T>) -> StateSpace<T> {
        mapped(mapped(weight.clone(), &self.output, true, true), &self.output, false, false)
    }

    /// `Du^-1 W Du` of a weight at the inputs.
    pub(super) fn at_inputs<T: TimeDomain>(&self, weight: &StateSpace<T>) -> StateSpace<T> {
        mapped(mapped(weight.clone(), &self.input, true, true), &self.input, false, false)
    }
}

/// A system whose outputs (or inputs) are multiplied or divided by sizes.
fn mapped<T: TimeDomain>(
    system: StateSpace<T>,
    sizes: &Option<Vec<f64>>,
    outputs: bool,
    divide: bool,
) -> StateSpace<T> {
    let Some(sizes) = sizes else { return system };
    let n = sizes.len();
    let entry = |i: usize| if divide { 1.0 / sizes[i] } else { sizes[i] };
    let diagonal = Mat::from_fn(n, n, |i, j| if i == j { entry(i) } else { 0.0 });
    if outputs { system.map_output(&diagonal) } else { system.map_input(&diagonal) }
}
