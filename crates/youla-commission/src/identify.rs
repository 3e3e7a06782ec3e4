//! From rows to models: the run of a record, and the loop itself from an excitation that no noise moves.

use crate::Result;
use crate::parameter::{LoadedQ, at_plant_input};
use std::path::Path;
use youla::identify::subspace::{Experiment, InitialState, SubspaceMethod, SubspaceOptions, subspace};
use youla::lti::{Discrete, StateSpace};
use youla::signal::{Channel, LoopRecord, without_harmonics};
use youla::{Mat, MatRef};
use youla_io::{ChannelRef, ChannelSpec};
use youla_run::{DataFile, DataSettings, Identification, RunRecords, RunSettings, SourceFile, StageClock, identify};
use youla_twin::{LoggedValues, RunningLoop};

/// Rows of one experiment without the harmonics of the speed.
pub(crate) struct CleanRows {
    pub(crate) y: Mat<f64>,
    pub(crate) u: Mat<f64>,
    pub(crate) alpha: Mat<f64>,
}

/// Harmonics of the speed that are taken out.
const HARMONICS: usize = 5;

impl CleanRows {
    pub(crate) fn new(rows: &[LoggedValues], rpm: f64, time: Discrete) -> Result<Self> {
        let signal = |first: usize| Mat::from_fn(rows.len(), 2, |i, j| rows[i][first + j]);
        let clean = |m: Mat<f64>| -> Result<Mat<f64>> {
            let harmonics = if rpm > 0.0 { HARMONICS } else { 0 };
            Ok(without_harmonics(m.as_ref(), rpm / 60.0, harmonics, time)?)
        };
        // alpha too: what the lines take of the outputs is its response there.
        Ok(CleanRows { y: clean(signal(0))?, u: clean(signal(2))?, alpha: clean(signal(4))? })
    }
}

/// The run of a record: recommended model, scheme, verdict.
pub(crate) fn identified(running: &RunningLoop, rows: &CleanRows, name: &str) -> Result<Identification> {
    let spec = |name: &str, unit: &str| ChannelSpec::from(name, ChannelRef::Name(name.into()), unit);
    let specs = |names: [&str; 2], unit: &str| names.map(|name| spec(name, unit)).to_vec();
    let file = DataFile { file: "../log.csv".into(), skip: 0, take: None, segments: Vec::new(), name: None };
    let data = DataSettings {
        sample_time: Some(running.nominal.time().ts()),
        alpha: specs(["alpha_1", "alpha_2"], "V"),
        ..DataSettings::new(specs(["u_h", "u_v"], "V"), specs(["y_h", "y_v"], "um"), vec![file])
    };
    let description = running.description.clone();
    let mut settings = RunSettings::new(name.into(), data, description.controller);
    settings.nominal = Some(description.nominal);
    let time = running.nominal.time();
    let channels = |names: [&str; 2], unit: &str| names.map(|name| Channel::new(name, unit)).to_vec();
    let record = LoopRecord::new(time, rows.u.clone(), rows.y.clone())?.with_alpha(rows.alpha.clone())?.named("log");
    let records = RunRecords {
        time,
        inputs: channels(["u_h", "u_v"], "V"),
        outputs: channels(["y_h", "y_v"], "um"),
        estimation: vec![record],
        verification: Vec::new(),
        sources: vec![SourceFile { path: "../log.csv".into(), purpose: "estimation".into(), sha256: String::new() }],
        segments: Vec::new(),
        measured: None,
        true_plant: None,
    };
    let mut silent = |_| ();
    Ok(identify(settings, records, Path::new(""), &mut StageClock::new(&mut silent))?)
}

/// The loop from a disturbance at the plant input to the outputs, identified in open loop from the excitation of a record.
pub(crate) fn loop_response(
    running: &RunningLoop,
    q: Option<&LoadedQ>,
    rows: &CleanRows,
) -> Result<StateSpace<Discrete>> {
    let v = at_plant_input(running, q, &rows.alpha)?;
    response_to(v.as_ref(), rows.y.as_ref(), running.nominal.time())
}

/// The same from the disturbance v itself.
pub(crate) fn response_to(v: MatRef<'_, f64>, y: MatRef<'_, f64>, time: Discrete) -> Result<StateSpace<Discrete>> {
    let options = SubspaceOptions {
        method: SubspaceMethod::Cva,
        horizon: 30,
        initial_state: InitialState::Estimated,
        ..Default::default()
    };
    Ok(subspace(&[Experiment::new(v, y)], time, &options)?.model)
}
