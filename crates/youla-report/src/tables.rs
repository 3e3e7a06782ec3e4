//! Tables of the report: fits by record and output, modes by frequency, one column per method.

use serde::Serialize;

use super::data::{DrawnMode, ReportData};
use super::same_mode::match_modes;

/// One record and output with the fit of each method.
#[derive(Debug, Serialize, PartialEq)]
pub(super) struct FitRow {
    pub(super) record: String,
    pub(super) output: usize,
    pub(super) cells: Vec<FitCell>,
}

/// One fit.
#[derive(Debug, Clone, Serialize, PartialEq)]
pub(super) struct FitCell {
    /// Percent, absent where it was not computed.
    pub(super) fit: Option<f64>,
    /// Whether the fit was asked for but the prediction diverged.
    pub(super) diverged: bool,
    /// Whether no other method does better in this row.
    pub(super) best: bool,
}

/// Fits in the order of records in the data, methods as columns.
pub(super) fn fit_rows(data: &ReportData) -> Vec<FitRow> {
    let mut keys: Vec<(&str, usize)> = Vec::new();
    for fit in &data.fits {
        if !keys.contains(&(&fit.record, fit.output)) {
            keys.push((&fit.record, fit.output));
        }
    }
    keys.iter()
        .map(|&(record, output)| {
            let cell = |method: &str| {
                data.fits.iter().find(|f| f.record == record && f.output == output && f.method == method)
            };
            let fits: Vec<_> = data.methods.iter().map(|method| cell(&method.key)).collect();
            let best = fits.iter().flatten().filter_map(|fit| fit.fit).fold(f64::NEG_INFINITY, f64::max);
            let cells = fits
                .iter()
                .map(|entry| {
                    let fit = entry.and_then(|e| e.fit);
                    FitCell { fit, diverged: entry.is_some() && fit.is_none(), best: fit == Some(best) }
                })
                .collect();
            FitRow { record: record.to_owned(), output, cells }
        })
        .collect()
}

/// What a mode is, in every table the same.
#[derive(Debug, Clone, Copy, Serialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Nature {
    /// A pair that decays.
    Pair,
    /// A pair that grows.
    GrowingPair,
    /// A pair that grows by less than two standard deviations of its damping ratio.
    PerhapsGrowingPair,
    /// A real pole that decays.
    Real,
    /// A real pole that grows.
    GrowingReal,
    /// A real pole within two standard deviations of an integrator, on either side.
    NearIntegrator,
    /// A pole at 1.
    Integrator,
}

/// Standard deviations within which a mode is not told from its neighbour on the other side of the boundary of stability.
const TOLD: f64 = 2.0;

impl Nature {
    fn of(mode: &DrawnMode) -> Self {
        let within = |size: f64, k: usize| mode.deviation.is_some_and(|deviation| size < TOLD * deviation[k]);
        match mode.zeta {
            _ if mode.hz == 0.0 => Nature::Integrator,
            zeta if zeta.abs() >= 1.0 && within(mode.hz, 0) => Nature::NearIntegrator,
            zeta if zeta >= 1.0 => Nature::Real,
            zeta if zeta <= -1.0 => Nature::GrowingReal,
            zeta if zeta < 0.0 && within(-zeta, 1) => Nature::PerhapsGrowingPair,
            zeta if zeta < 0.0 => Nature::GrowingPair,
            _ => Nature::Pair,
        }
    }
}

/// A mode as the tables show it.
#[derive(Debug, Clone, Serialize, PartialEq)]
pub(super) struct ShownMode {
    #[serde(flatten)]
    pub(super) mode: DrawnMode,
    pub(super) nature: Nature,
}

impl From<&DrawnMode> for ShownMode {
    fn from(mode: &DrawnMode) -> Self {
        ShownMode { mode: mode.clone(), nature: Nature::of(mode) }
    }
}

/// A mode that several models have, one place per method.
#[derive(Debug, Serialize, PartialEq)]
pub(super) struct ModeRow {
    pub(super) cells: Vec<Option<ShownMode>>,
}

/// Modes by rising frequency; those of each method are compared with the first ones in their rows.
pub(super) fn mode_rows(data: &ReportData) -> Vec<ModeRow> {
    let mut rows: Vec<ModeRow> = Vec::new();
    for (column, method) in data.methods.iter().enumerate() {
        let own: Vec<&DrawnMode> = data.modes.iter().filter(|mode| mode.method == method.key).collect();
        let first: Vec<&DrawnMode> =
            rows.iter().filter_map(|row| Some(&row.cells.iter().flatten().next()?.mode)).collect();
        let places = match_modes(&own, &first);
        for (mode, place) in own.into_iter().zip(places) {
            let place = place.unwrap_or_else(|| {
                rows.push(ModeRow { cells: vec![None; data.methods.len()] });
                rows.len() - 1
            });
            rows[place].cells[column] = Some(mode.into());
        }
    }
    let hz = |row: &ModeRow| row.cells.iter().flatten().next().map_or(0.0, |shown| shown.mode.hz);
    rows.sort_by(|a, b| hz(a).total_cmp(&hz(b)));
    rows
}

#[cfg(test)]
mod tests {
    use super::super::data::{DrawnMethod, Fit};
    use super::*;

    fn data() -> ReportData {
        let fit =
            |record: &str, method: &str, fit| Fit { record: record.into(), output: 0, method: method.into(), fit };
        let mode =
            |method: &str, hz| DrawnMode { method: method.into(), hz, zeta: 0.1, deviation: None, residue: Vec::new() };
        ReportData {
            methods: vec![DrawnMethod::nominal(), DrawnMethod::direct(), DrawnMethod::hansen()],
            fits: vec![fit("b", "hansen", Some(90.0)), fit("b", "direct", None), fit("a", "hansen", Some(80.0))],
            modes: vec![mode("hansen", 54.9), mode("direct", 54.0), mode("direct", 56.0), mode("hansen", 120.0)],
            ..ReportData::default()
        }
    }

    #[test]
    fn fits_keep_the_order_of_the_data() {
        let rows = fit_rows(&data());
        assert_eq!(rows.iter().map(|row| row.record.as_str()).collect::<Vec<_>>(), ["b", "a"]);
        assert_eq!(rows[0].cells[0], FitCell { fit: None, diverged: false, best: false });
        assert_eq!(rows[0].cells[1], FitCell { fit: None, diverged: true, best: false });
        assert_eq!(rows[0].cells[2], FitCell { fit: Some(90.0), diverged: false, best: true });
    }

    #[test]
    fn modes_of_one_method_never_share_a_place() {
        let frequencies: Vec<Vec<Option<f64>>> = mode_rows(&data())
            .iter()
            .map(|row| row.cells.iter().map(|cell| cell.as_ref().map(|shown| shown.mode.hz)).collect())
            .collect();
        let expected = [[None, Some(54.0), Some(54.9)], [None, Some(56.0), None], [None, None, Some(120.0)]];
        assert_eq!(frequencies, expected);
    }

    #[test]
    fn a_pole_within_its_deviation_of_an_integrator_is_none_that_grows() {
        let nature = |hz, zeta, deviation| {
            Nature::of(&DrawnMode { method: String::new(), hz, zeta, deviation, residue: Vec::new() })
        };
        assert_eq!(nature(0.01, -1.0, Some([0.12, 0.0])), Nature::NearIntegrator);
        assert_eq!(nature(0.01, 1.0, Some([0.12, 0.0])), Nature::NearIntegrator);
        assert_eq!(nature(0.04, -1.0, Some([0.0076, 0.0])), Nature::GrowingReal);
        assert_eq!(nature(0.04, -1.0, None), Nature::GrowingReal);
        assert_eq!(nature(0.0, 0.0, None), Nature::Integrator);
        assert_eq!(nature(0.27, -1e-4, Some([0.01, 0.02])), Nature::PerhapsGrowingPair);
        assert_eq!(nature(0.27, -0.1, Some([0.01, 0.02])), Nature::GrowingPair);
    }
}
