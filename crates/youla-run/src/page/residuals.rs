//! Tests of the residuals in the report.

use crate::result::Identification;
use crate::settings::PredictionKind;
use crate::stages::validate::residuals::ResidualPredictor;
use youla::validate::{PREDICTION_STEPS, ResidualCorrelations};
use youla_report::data;

/// What the report draws.
pub(crate) fn drawn(found: &Identification) -> Option<data::Residuals> {
    let mut tests = Vec::new();
    for v in &found.validation.models {
        for record in &v.records {
            // A residual or an excitation that is zero throughout has no correlations; `residuals.json` says so by null.
            let Some(r) = record.residuals.as_ref().filter(|r| exist(&r.correlations)) else { continue };
            tests.push(data::DrawnResidualTest {
                record: record.record.clone(),
                method: v.method.key().into(),
                excitations: r.excitations.clone(),
                independent: r.independent(),
                auto: r
                    .correlations
                    .auto
                    .iter()
                    .map(|values| data::Correlation::new(values, r.correlations.auto_band))
                    .collect(),
                cross: r.correlations.cross.iter().map(|c| data::Correlation::new(&c.values, c.band)).collect(),
                k_step_fits: r
                    .k_step_fits
                    .iter()
                    .map(|f| f.iter().map(|f| f.is_finite().then_some(*f)).collect())
                    .collect(),
                predictor: match r.predictor {
                    ResidualPredictor::Kalman => "Kalman gain".into(),
                    ResidualPredictor::Autoregression => "autoregression".into(),
                },
            });
        }
    }
    let of = match found.validation.prediction {
        PredictionKind::OpenLoop => "the simulation from the measured input",
        PredictionKind::ClosedLoop => "the simulation under the controller from the known excitations",
    };
    (!tests.is_empty()).then(|| data::Residuals {
        prediction: of.into(),
        external: found
            .validation
            .models
            .iter()
            .flat_map(|v| &v.records)
            .filter_map(|r| r.residuals.as_ref())
            .all(|r| r.external),
        steps: PREDICTION_STEPS.to_vec(),
        tests,
    })
}

/// Whether all correlations are numbers.
fn exist(found: &ResidualCorrelations) -> bool {
    let cross = found.cross.iter().flat_map(|c| &c.values);
    found.auto.iter().flatten().chain(cross).all(|value| value.is_finite())
}
