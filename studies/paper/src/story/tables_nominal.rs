//! The nominal model: parameters and modes.

use super::modes::{oscillations, real_poles};
use super::tables::{plain, row};
use super::words::{fixed, short};
use crate::study::Paper;
use crate::{Error, Result};
use youla_greybox::Structure;
use youla_report::story::Table;
use youla_twin::BearingStructure;
use youla_twin::rig::Bearing;

const UNITS: [&str; 14] = {
    const D: &str = "1/s";
    const K: &str = "1/s^2";
    const B: &str = "um/(s^2 V)";
    [D, D, D, D, K, K, K, K, B, B, B, B, D, D]
};

/// The 14 parameters beside (9)-(12), and beside those of the rig where its file was edited.
pub(super) fn parameters(paper: &Paper) -> Table {
    let printed = BearingStructure::parameters(&Bearing::default());
    let rig = BearingStructure::parameters(&paper.rig.bearing.model());
    let found = &paper.experiments.nominal.found;
    let deviations = found.standard_deviations();
    let edited = rig != printed;
    let mut header = vec!["parameter", "unit", "(9)-(12)", "identified", "standard deviation", "difference, %"];
    if edited {
        header.insert(3, "rig file");
    }
    let rows = BearingStructure.names().into_iter().enumerate().map(|(k, name)| {
        let value = found.parameters[k];
        let mut cells = vec![
            name,
            UNITS[k].to_owned(),
            short(printed[k], 5),
            short(value, 5),
            deviations.as_ref().map_or_else(|| "not determined".into(), |s| short(s[k], 3)),
            fixed(100.0 * (value / rig[k] - 1.0), 1),
        ];
        if edited {
            cells.insert(3, short(rig[k], 5));
        }
        row(cells)
    });
    plain(
        "nominal-parameters",
        "Nominal model",
        "Parameters of the open-loop fit beside those of the paper; h and v are horizontal and vertical, the standard \
         deviations are those of the noise alone, and the difference is that from the rig.",
        &header,
        rows.collect(),
    )
}

/// Modes and actuators of the fit and of the rig at rest.
pub(super) fn modes(paper: &Paper) -> Result<Table> {
    let of = |name: &str, bearing: &Bearing| {
        let modes = bearing.plant()?.modes()?;
        Ok::<_, Error>(row([name.to_owned(), oscillations(&modes, f64::INFINITY), real_poles(&modes, f64::INFINITY)]))
    };
    Ok(plain(
        "nominal-modes",
        "Modes of the nominal model",
        "Natural frequencies with damping ratios, and corner frequencies of the actuators.",
        &["model", "oscillating, Hz (damping)", "real poles, Hz"],
        vec![of("identified", &paper.experiments.nominal.bearing)?, of("rig at rest", &paper.rig.bearing.model())?],
    ))
}
