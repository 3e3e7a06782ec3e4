//! Models on a page, a run's own or those of a comparison, from their entries; `key` names the method of the page.

use crate::summary::entries::{ModeEntry, RealPoleEntry};
use crate::summary::model::ModelEntry;
use youla_report::data;

/// Fits by record and output.
pub(crate) fn fits(key: &str, model: &ModelEntry) -> Vec<data::Fit> {
    let fit = |(record, (output, fit)): (&String, (usize, &Option<f64>))| data::Fit {
        record: record.clone(),
        output,
        method: key.to_owned(),
        fit: *fit,
    };
    let by_output = model.fit.iter().flat_map(|(record, of)| of.iter().enumerate().map(move |of| (record, of)));
    by_output.map(fit).collect()
}

/// The modes that the response of the model shows, and its real poles: without a damping ratio, but 0 for an integrator, -1 for a growth.
pub(crate) fn modes(key: &str, model: &ModelEntry) -> Vec<data::DrawnMode> {
    let mode = |m: &ModeEntry| {
        let deviation = m.hz_deviation.zip(m.zeta_deviation).map(|(hz, zeta)| [hz, zeta]);
        Some(data::DrawnMode {
            method: key.to_owned(),
            hz: m.hz?,
            zeta: m.zeta?,
            deviation,
            residue: m.residue.clone(),
        })
    };
    let real = |p: &RealPoleEntry| {
        let zeta = -(p.z - 1.0).partial_cmp(&0.0).map_or(0.0, |sign| f64::from(sign as i8));
        let deviation = p.hz_deviation.map(|hz| [hz, 0.0]);
        Some(data::DrawnMode { method: key.to_owned(), hz: p.hz?, zeta, deviation, residue: p.residue.clone() })
    };
    let mut all: Vec<_> = model.modes.iter().filter_map(mode).chain(model.real_poles.iter().filter_map(real)).collect();
    all.sort_by(|a, b| a.hz.total_cmp(&b.hz));
    all
}

/// Poles and zeros in z.
pub(crate) fn poles(key: &str, model: &ModelEntry) -> data::Poles {
    data::Poles { method: key.to_owned(), poles: model.poles.clone(), zeros: model.zeros.clone() }
}

/// How many modes of a model are left out, and why.
pub(crate) fn unlisted(key: &str, model: &ModelEntry) -> Option<data::UnlistedModes> {
    let (cancelled, above_nyquist) = (model.modes_cancelled, model.modes_above_nyquist);
    (cancelled + above_nyquist > 0).then(|| data::UnlistedModes { method: key.to_owned(), cancelled, above_nyquist })
}

/// The loop of a model with the controller that ran.
pub(crate) fn certificate(key: &str, model: &ModelEntry) -> data::Certificate {
    data::Certificate {
        method: key.to_owned(),
        order: model.order,
        stabilised_by_controller: Some(model.stabilised_by_controller),
        worst_closed_loop_pole: model.worst_closed_loop_pole(),
    }
}

/// Margins of that loop, and distances.
pub(crate) fn margins(key: &str, model: &ModelEntry) -> data::LoopMargins {
    data::LoopMargins { method: key.to_owned(), robustness: model.robustness.clone() }
}
