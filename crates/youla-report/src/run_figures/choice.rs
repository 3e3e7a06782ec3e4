//! The part of a run that is drawn.

use serde::{Deserialize, Serialize};

use crate::data::{MethodRole, ReportData};
use crate::phase;
use crate::{Error, Result};
use youla::signal::Channel;
use youla::signal::unknown;

/// Which outputs, inputs, records and methods are drawn; everything where nothing is said.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FigureChoice {
    /// An output, by its name: of verification, residuals and frequency responses.
    pub output: Option<String>,
    /// An input, by its name: of frequency responses.
    pub input: Option<String>,
    /// A record, by its name: of signals, verification and residuals.
    pub record: Option<String>,
    /// Methods, by their keys: wherever models are compared.
    pub methods: Option<Vec<String>>,
}

/// A run less what is not chosen, phases on their branches.
pub(super) struct Chosen {
    pub(super) data: ReportData,
    pub(super) output: Option<usize>,
    /// Whether the run has more than one of each.
    pub(super) several_experiments: bool,
    pub(super) several_verifications: bool,
}

impl FigureChoice {
    /// The fields that say something.
    pub fn made(&self) -> impl Iterator<Item = &'static str> {
        let said = [
            ("output", self.output.is_some()),
            ("input", self.input.is_some()),
            ("record", self.record.is_some()),
            ("methods", self.methods.is_some()),
        ];
        said.into_iter().filter(|(_, said)| *said).map(|(field, _)| field)
    }

    pub(super) fn of(&self, data: &ReportData) -> Result<Chosen> {
        let place = |what, name: &Option<String>, channels: &[Channel]| match name {
            None => Ok(None),
            Some(name) => channel(what, name, channels).map(Some),
        };
        let output = place("outputs", &self.output, &data.outputs)?;
        let input = place("inputs", &self.input, &data.inputs)?;
        self.check_record(data)?;
        self.check_methods(data)?;
        let mut chosen = data.clone();
        align(&mut chosen);
        self.keep_records(&mut chosen);
        self.keep_methods(&mut chosen);
        keep_channels(&mut chosen, output, input);
        let several = |names: Vec<&String>| names.windows(2).any(|pair| pair[0] != pair[1]);
        Ok(Chosen {
            data: chosen,
            output,
            several_experiments: several(data.experiments.iter().map(|e| &e.name).collect()),
            several_verifications: several(data.verification.iter().map(|v| &v.record).collect()),
        })
    }

    fn check_record(&self, data: &ReportData) -> Result<()> {
        let Some(name) = &self.record else { return Ok(()) };
        let tests = data.residuals.iter().flat_map(|r| &r.tests).map(|t| &t.record);
        let names = data.experiments.iter().map(|e| &e.name).chain(data.verification.iter().map(|v| &v.record));
        let mut known: Vec<String> = Vec::new();
        for record in names.chain(tests) {
            if !known.contains(record) {
                known.push(record.clone());
            }
        }
        if known.contains(name) { Ok(()) } else { Err(unknown("the list of records of the run", name, known).into()) }
    }

    fn check_methods(&self, data: &ReportData) -> Result<()> {
        let known = || data.methods.iter().map(|method| method.key.clone()).collect::<Vec<_>>();
        let absent = |name: &&String| !data.methods.iter().any(|method| method.key == **name);
        match self.methods.iter().flatten().find(absent) {
            Some(name) => Err(unknown("the list of methods of the run", name, known()).into()),
            None => Ok(()),
        }
    }

    fn keep_records(&self, data: &mut ReportData) {
        let Some(name) = &self.record else { return };
        data.experiments.retain(|experiment| experiment.name == *name);
        data.verification.retain(|verification| verification.record == *name);
        data.residuals.iter_mut().for_each(|residuals| residuals.tests.retain(|test| test.record == *name));
    }

    fn keep_methods(&self, data: &mut ReportData) {
        let Some(keys) = &self.methods else { return };
        data.orders.retain(|choice| keys.contains(&choice.method));
        let outputs = data.verification.iter_mut().flat_map(|record| &mut record.outputs);
        outputs.for_each(|output| output.predictions.retain(|prediction| keys.contains(&prediction.method)));
        data.residuals.iter_mut().for_each(|residuals| residuals.tests.retain(|test| keys.contains(&test.method)));
        data.poles.retain(|poles| keys.contains(&poles.method));
        if let Some(frequency) = &mut data.frequency {
            frequency.models.retain(|model| keys.contains(&model.method));
            frequency.bands.retain(|band| keys.contains(&band.method));
            frequency.singular.retain(|one| keys.contains(&one.method));
        }
    }
}

fn channel(what: &str, name: &str, channels: &[Channel]) -> Result<usize, Error> {
    let known = || channels.iter().map(|channel| channel.name.clone()).collect();
    let place = channels.iter().position(|channel| channel.name == name);
    place.ok_or_else(|| unknown(&format!("the list of {what} of the run"), name, known()).into())
}

fn keep_channels(data: &mut ReportData, output: Option<usize>, input: Option<usize>) {
    let kept = |o: usize, i: usize| output.is_none_or(|k| k == o) && input.is_none_or(|k| k == i);
    data.verification.iter_mut().for_each(|record| record.outputs.retain(|o| output.is_none_or(|k| k == o.output)));
    if let Some(frequency) = &mut data.frequency {
        frequency.models.retain(|model| kept(model.output, model.input));
        frequency.indirect.retain(|measured| kept(measured.output, measured.input));
        frequency.bands.retain(|band| kept(band.output, band.input));
    }
}

fn align(data: &mut ReportData) {
    let methods = data.methods.clone();
    let role =
        |key: &str| methods.iter().find(|method| method.key == key).map_or(MethodRole::Other, |method| method.role);
    if let Some(frequency) = &mut data.frequency {
        phase::align(frequency, role);
    }
}
