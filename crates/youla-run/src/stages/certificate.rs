//! `[certificate]`: what a run states about the loop of its model beyond the poles of the estimate.

use crate::Result;
use crate::stages::context::RunContext;
use crate::stages::validate::robustness::channel_scales;
use youla::control::{Margins, closed_loop, with_input_port};
use youla::factor::CoprimeFactors;
use youla::identify::likelihood::Recommendation;
use youla::lti::Discrete;
use youla::validate::{
    BandCertificate, BandOptions, ExactCertificate, MarginInterval, certify_deviation, certify_region, margin_intervals,
};

/// What a run states about the loop of the recommended plant with the controller that ran.
#[derive(Debug, Clone)]
pub struct RunCertificate {
    /// The exact test by S, with its identity.
    pub exact: ExactCertificate,
    /// The controller on every plant within the region.
    pub band: BandCertificate,
    /// Margins with intervals; empty where the loop is unstable.
    pub margins: Vec<MarginInterval>,
}

/// The certificate of a run; `margins` are those of its loop where they are known.
///
/// # Errors
/// Numerical conditions of the estimate itself.
pub(crate) fn certificate(
    run: RunContext<'_>,
    factors: &CoprimeFactors<Discrete>,
    model: &Recommendation,
    margins: Option<&Margins>,
) -> Result<RunCertificate> {
    let (plant, k) = (&model.plant, run.declared.controller());
    let exact = certify_deviation(factors, &factors.deviation_of(plant)?, None)?;
    let ports = with_input_port(k)?;
    let band =
        certify_region(&model.region, &BandOptions::default(), |_| Ok(true), |plant| closed_loop(plant, &ports))?;
    let scales = channel_scales(run.records).ok();
    let intervals = |margins: &Margins| margin_intervals(margins, plant, k, &model.region, scales.as_ref(), band.level);
    let margins = match (exact.stable, margins) {
        (true, Some(margins)) => intervals(margins)?,
        (true, None) => intervals(&youla::control::margins(plant, k)?)?,
        (false, _) => Vec::new(),
    };
    Ok(RunCertificate { exact, band, margins })
}
