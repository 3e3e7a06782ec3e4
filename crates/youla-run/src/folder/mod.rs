//! The numbered artefacts of a run folder, written stage by stage.

pub(crate) mod artefacts;
pub(crate) mod subspace_details;
pub(crate) mod write;

mod files;
mod uncertainty;

use crate::folder::artefacts::{Provenance, RunModelFile, SCHEMA};
use crate::folder::subspace_details::SubspaceDetails;
use crate::folder::uncertainty::UncertaintyFile;
use crate::page::pid;
use crate::page::redesign::{figure, loops};
use crate::result::Identification;
use crate::summary::certificate::CertificateEntry;
use crate::summary::entries::Refused;
use crate::summary::physical::PhysicalDetails;
use crate::summary::pid::PidEntry;
use crate::summary::recommended::{self, RecommendedDetails};
use crate::summary::redesign::RedesignEntry;
use crate::summary::reduction::{ReductionDetails, SweepFile, as_csv as sweep_csv, orders};
use crate::{Error, Result};
use files::{Artefact, FactorDetails, RecordsFile, ResidualsFile, SignalsFile, VerdictFile, exported, plain};
use serde::Serialize;
use youla::identify::HansenModel;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla::signal::LoopRecord;
use youla::{Mat, MatRef, c64};
use youla_io::folder::RunFolder;
use youla_io::{Packing, Value, Variable, write_mat};
use youla_report::{figure_csv, svg};

/// Writes all artefacts of a run except report and summary.
///
/// # Errors
/// [`youla_io::Error::Io`].
pub(crate) fn write_artefacts(found: &Identification, folder: &RunFolder) -> Result<()> {
    let provenance = Provenance {
        schema: SCHEMA,
        program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(),
        seed: found.settings.seed,
        sources: found.records.sources.clone(),
        options: found.settings.clone(),
    };
    let writer = Writer { found, folder, provenance };
    folder.text("run.toml", &found.settings.to_toml()?)?;
    writer.records()?;
    writer.factors()?;
    writer.signals()?;
    writer.models()?;
    writer.validation()?;
    writer.frequencies()?;
    writer.deviation()?;
    writer.reduction()?;
    writer.certificate()?;
    writer.redesign()?;
    writer.pid()
}

struct Writer<'a> {
    found: &'a Identification,
    folder: &'a RunFolder,
    provenance: Provenance,
}

impl Writer<'_> {
    /// `1-record/`: every record as it was used, channels by name.
    fn records(&self) -> Result<()> {
        let records = &self.found.records;
        let purposes = [("estimation", &records.estimation), ("verification", &records.verification)];
        for (purpose, group) in purposes {
            for record in group {
                self.record(purpose, record)?;
            }
        }
        self.json("1-record/records.json", RecordsFile::from(records))?;
        self.json("1-record/check.json", self.found.data.entry())
    }

    fn record(&self, purpose: &str, record: &LoopRecord) -> Result<()> {
        let mut variables = vec![number("ts", record.time().ts())];
        let groups = [
            ("u", Some(record.u())),
            ("y", Some(record.y())),
            ("input_excitation", record.input_excitation()),
            ("reference", record.reference()),
            ("alpha", record.alpha()),
            ("disturbance", record.disturbance()),
        ];
        for (name, matrix) in groups {
            variables.extend(matrix.map(|m| array(name, m.as_ref())));
        }
        self.mat(&format!("1-record/{purpose}-{}.mat", record.name()), &variables)
    }

    /// `2-factor/`: the two systems of (15), the controller, and the nominal model where one was given.
    fn factors(&self) -> Result<()> {
        let declared = &self.found.declared;
        let (u, y) = (self.found.records.inputs.clone(), self.found.records.outputs.clone());
        self.model_with("2-factor/controller", declared.controller(), (y, u), &())?;
        if let Some(nominal) = &declared.nominal {
            self.model("2-factor/nominal", nominal, &())?;
        }
        if let Some(plant) = &self.found.records.true_plant {
            self.model("2-factor/true_plant", plant, &())?;
        }
        let f = match &self.found.filtered {
            Ok(filtered) => &filtered.factorisation,
            Err(reason) => return self.refused("2-factor/factors.json", reason),
        };
        let details = FactorDetails { bezout_residual: f.bezout_residual };
        let loop_ports: Vec<Channel> =
            self.found.records.inputs.iter().chain(&self.found.records.outputs).cloned().collect();
        let youla = |names: [&str; 2]| -> Vec<Channel> {
            let channel = |name: &str, c: &Channel| Channel::new(format!("{name} of {}", c.name), &c.unit);
            let (u, y) = (self.found.records.inputs.iter(), self.found.records.outputs.iter());
            u.map(|c| channel(names[0], c)).chain(y.map(|c| channel(names[1], c))).collect()
        };
        let (right, left) = (f.factors.right().system(), f.factors.left().system());
        self.model_with("2-factor/right", right, (youla(["eta", "epsilon"]), loop_ports.clone()), &details)?;
        self.model_with("2-factor/left", left, (loop_ports, youla(["alpha", "beta"])), &details)
    }

    /// `3-signals/`: alpha and beta of each estimation record.
    fn signals(&self) -> Result<()> {
        let Some(s) = self.found.signals() else { return Ok(()) };
        for (record, signals) in self.found.records.estimation.iter().zip(&s.experiments) {
            let variables = [
                number("ts", record.time().ts()),
                number("dropped_samples", s.settle as f64),
                array("alpha", signals.alpha()),
                array("beta", signals.beta()),
            ];
            self.mat(&format!("3-signals/{}.mat", record.name()), &variables)?;
        }
        let file = SignalsFile { dropped_samples: s.settle, controller_mismatch: s.controller_mismatch };
        self.json("3-signals/signals.json", file)
    }

    /// `4-identify/`, `5-recombine/`, `6-reduce/`: the models.
    fn models(&self) -> Result<()> {
        let found = self.found;
        self.outcome(recommended::FILE, Some(&found.recommended), |model| {
            let name = recommended::FILE.trim_end_matches(".json");
            self.model(name, &model.plant, &RecommendedDetails::new(model))?;
            self.json("4-identify/region.json", to_value(&model.region)?)
        })?;
        self.outcome("4-identify/direct.json", found.direct.as_ref(), |direct| {
            self.model("4-identify/direct", &direct.model, &SubspaceDetails::from(direct))
        })?;
        self.grey_box()?;
        self.outcome("4-identify/deviation.json", found.hansen.as_ref(), |scheme| self.scheme(scheme))
    }

    /// The physical structure.
    fn grey_box(&self) -> Result<()> {
        if let Some(known) = &self.found.grey_box_uncertainty {
            self.json("4-identify/grey_box_uncertainty.json", UncertaintyFile::new(known, &self.found.hz))?;
        }
        self.outcome("4-identify/grey_box.json", self.found.grey_box.as_ref(), |run| {
            self.model("4-identify/grey_box", &run.found.model.model, &PhysicalDetails::new(run)?)
        })
    }

    /// What the scheme gave.
    fn scheme(&self, scheme: &HansenModel) -> Result<()> {
        let (u, y) = (&self.found.records.inputs, &self.found.records.outputs);
        let named = |name: &str, channels: &[Channel]| -> Vec<Channel> {
            channels.iter().map(|c| Channel::new(format!("{name} of {}", c.name), &c.unit)).collect()
        };
        let (s, details) = (&scheme.deviation, SubspaceDetails::from(&scheme.deviation));
        self.model_with("4-identify/hansen_deviation", &s.model, (named("alpha", u), named("beta", y)), &details)?;
        self.model("5-recombine/hansen", &scheme.plant, &())
    }

    /// S of the recommended plant.
    fn deviation(&self) -> Result<()> {
        let Some(s) = self.found.deviation()? else { return Ok(()) };
        let (u, y) = (&self.found.records.inputs, &self.found.records.outputs);
        let named = |name: &str, channels: &[Channel]| -> Vec<Channel> {
            channels.iter().map(|c| Channel::new(format!("{name} of {}", c.name), &c.unit)).collect()
        };
        self.model_with("4-identify/deviation", &s, (named("alpha", u), named("beta", y)), &())
    }

    /// `6-reduce/`: the reduced plant and what every order costs.
    fn reduction(&self) -> Result<()> {
        self.outcome("6-reduce/hansen_reduced.json", self.found.reduction.as_ref(), |r| {
            self.model("6-reduce/hansen_reduced", &r.found.reduction.model, &ReductionDetails::from(r))?;
            self.json("6-reduce/sweep.json", SweepFile::from(r))?;
            Ok(self.folder.text("6-reduce/sweep.csv", &sweep_csv(&orders(r)))?)
        })
    }

    /// `7-validate/certificate.json`.
    fn certificate(&self) -> Result<()> {
        let file = "7-validate/certificate.json";
        self.outcome(file, self.found.certificate.as_ref(), |found| self.json(file, CertificateEntry::from(found)))
    }

    /// `8-redesign/`: the new controller as model, as data and as source for `youla-rt`, and what it promises.
    fn redesign(&self) -> Result<()> {
        self.outcome("8-redesign/redesign.json", self.found.redesign.as_ref(), |new| {
            let (u, y) = (self.found.records.inputs.clone(), self.found.records.outputs.clone());
            self.model_with("8-redesign/new_controller", &new.controller.system, (y, u), &())?;
            let exported = exported(&self.found.records, new);
            self.folder.text("8-redesign/controller.rs", &exported.rust())?;
            self.folder.json("8-redesign/controller.json", &exported)?;
            let (figure, loops) = (figure(new)?, loops());
            self.folder.text("8-redesign/response.csv", &figure_csv(&figure, &loops))?;
            self.folder.text("8-redesign/response.svg", &svg(&figure, &loops)?)?;
            self.json("8-redesign/redesign.json", RedesignEntry::from(new))
        })
    }

    /// `8-redesign/`: the new PID with its proof, and the controller to go back to.
    fn pid(&self) -> Result<()> {
        self.outcome("8-redesign/pid.json", self.found.pid.as_ref(), |new| {
            let (u, y) = (self.found.records.inputs.clone(), self.found.records.outputs.clone());
            self.model_with("8-redesign/new_controller", &new.system, (y, u), &())?;
            let controller = plain(&self.found.records, "pid", &new.computed()?);
            self.folder.text("8-redesign/controller.rs", &controller.rust())?;
            self.folder.json("8-redesign/controller.json", &controller)?;
            let ran = &self.found.settings.controller;
            let running = match ran.delay() {
                0 => new.running.clone(),
                // A controller with `delay` needs neither a nominal model nor a file.
                _ => ran.without_delay().realise(new.running.time(), None, std::path::Path::new("."))?.system().clone(),
            };
            self.folder.json("8-redesign/revert.json", &plain(&self.found.records, "running", &running))?;
            let (figure, steps) = (pid::figure(new), pid::steps());
            self.folder.text("8-redesign/response.csv", &figure_csv(&figure, &steps))?;
            self.folder.text("8-redesign/response.svg", &svg(&figure, &steps)?)?;
            self.json("8-redesign/pid.json", PidEntry::from(new))
        })
    }

    /// `7-validate/verdict.json`, `7-validate/residuals.json` and the predictions.
    fn validation(&self) -> Result<()> {
        let validation = &self.found.validation;
        self.json("7-validate/verdict.json", VerdictFile::new(self.found)?)?;
        self.json("7-validate/residuals.json", ResidualsFile::from(&validation.models[..]))?;
        for (k, record) in self.found.records.verification.iter().enumerate() {
            let mut variables = vec![number("ts", record.time().ts()), array("measured", record.y())];
            for v in &self.found.validation.models {
                let predicted = v.records[k].predicted.as_ref().ok();
                variables.extend(predicted.map(|p| array(v.method.key(), p.as_ref())));
            }
            self.mat(&format!("7-validate/{}.mat", record.name()), &variables)?;
        }
        Ok(())
    }

    /// The frequencies of the report and the response that rests on no model, with all digits.
    fn frequencies(&self) -> Result<()> {
        let column = |values: &[f64]| array("hz", Mat::from_fn(values.len(), 1, |i, _| values[i]).as_ref()).value;
        let mut variables = vec![Variable { name: "hz".into(), value: column(&self.found.hz) }];
        if let Some(Ok(measured)) = &self.found.indirect {
            let response = &measured.response;
            let (p, m) = (self.found.records.outputs.len(), self.found.records.inputs.len());
            let part = |of: fn(c64) -> f64| {
                Mat::from_fn(response.omega.len(), p * m, |k, i| of(response.at(k)[(i / m, i % m)]))
            };
            variables.push(Variable { name: "measured_omega".into(), value: column(&response.omega) });
            variables.push(array("measured_re", part(|g| g.re).as_ref()));
            variables.push(array("measured_im", part(|g| g.im).as_ref()));
        }
        self.mat("4-identify/frequencies.mat", &variables)
    }

    fn model(&self, name: &str, model: &StateSpace<Discrete>, details: &impl Serialize) -> Result<()> {
        let (u, y) = (self.found.records.inputs.clone(), self.found.records.outputs.clone());
        self.model_with(name, model, (u, y), details)
    }

    fn model_with(
        &self,
        name: &str,
        model: &StateSpace<Discrete>,
        ports: (Vec<Channel>, Vec<Channel>),
        details: &impl Serialize,
    ) -> Result<()> {
        let title = name.rsplit('/').next().unwrap_or(name);
        let details = to_value(details)?;
        let file = RunModelFile::new(title, model, ports, details, self.provenance.clone())?;
        self.folder.json(&format!("{name}.json"), &file)?;
        let variables = [
            array("a", model.a()),
            array("b", model.b()),
            array("c", model.c()),
            array("d", model.d()),
            number("ts", model.time().ts()),
            Variable { name: "program".into(), value: Value::text(&self.provenance.program) },
        ];
        self.mat(&format!("{name}.mat"), &variables)
    }

    /// A file of a stage with the provenance of the run.
    fn json(&self, name: &str, content: impl Serialize) -> Result<()> {
        Ok(self.folder.json(name, &Artefact { content, provenance: &self.provenance })?)
    }

    /// What a stage gave, or in its `file` why it gave nothing; no file where it was not asked for.
    fn outcome<T>(&self, file: &str, found: Option<&Result<T>>, write: impl FnOnce(&T) -> Result<()>) -> Result<()> {
        match found {
            Some(Ok(found)) => write(found),
            Some(Err(reason)) => self.refused(file, reason),
            None => Ok(()),
        }
    }

    /// The reason why there is no such file.
    fn refused(&self, name: &str, reason: &Error) -> Result<()> {
        Ok(self.folder.json(name, &Refused { refused: reason.to_string() })?)
    }

    fn mat(&self, name: &str, variables: &[Variable]) -> Result<()> {
        Ok(self.folder.file(name, |path| write_mat(path, variables, Packing::Plain))?)
    }
}

/// Details of a model as the artefact holds them.
pub(crate) fn to_value(details: &impl Serialize) -> Result<serde_json::Value> {
    serde_json::to_value(details).map_err(|source| Error::Report(youla_report::Error::ReportData { source }))
}

fn number(name: &str, value: f64) -> Variable {
    Variable { name: name.into(), value: Value::scalar(value) }
}

fn array(name: &str, value: MatRef<'_, f64>) -> Variable {
    Variable { name: name.into(), value: Value::matrix(value) }
}
