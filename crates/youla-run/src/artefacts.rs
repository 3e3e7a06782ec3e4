//! The numbered artefacts of a run folder, as data.

use super::pipeline::Identification;
use super::records::{LoopRecord, SourceFile};
use super::redesign;
use super::reduction;
use super::settings::RunSettings;
use super::stabilisation::{as_csv, as_json};
use super::uncertainty::SystemUncertainty;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::factor::YoulaSignals;
use youla::identify::subspace::stabilisation::StabilisationDiagram;
use youla::identify::subspace::{SubspaceModel, amplitudes};
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla::{Mat, MatRef, c64};
use youla_io::folder::RunFolder;
use youla_io::{Packing, Value, Variable, write_mat};
use youla_report::{figure_csv, svg};

/// Version of the layout of all artefacts and of summary.json.
pub const SCHEMA: u32 = 1;

/// Where an artefact comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance<O = RunSettings> {
    /// Version of the layout.
    pub schema: u32,
    /// Program and version.
    pub program: String,
    /// Seed of simulated data.
    pub seed: Option<u64>,
    /// Files that were read, with their SHA-256.
    pub sources: Vec<SourceFile>,
    /// All options of the run.
    pub options: O,
}

/// A discrete-time model as an artefact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelFile<O = RunSettings> {
    /// What the model is.
    pub name: String,
    /// Channels of its inputs.
    pub inputs: Vec<Channel>,
    /// Channels of its outputs.
    pub outputs: Vec<Channel>,
    /// Sample time, seconds.
    pub ts: f64,
    /// A by rows.
    pub a: Vec<Vec<f64>>,
    /// B by rows.
    pub b: Vec<Vec<f64>>,
    /// C by rows.
    pub c: Vec<Vec<f64>>,
    /// D by rows.
    pub d: Vec<Vec<f64>>,
    /// Poles, real and imaginary parts.
    pub poles: Vec<[f64; 2]>,
    /// Further results that belong to the model.
    pub details: serde_json::Value,
    /// Where it comes from.
    pub provenance: Provenance<O>,
}

impl<O> ModelFile<O> {
    /// Describes a model with its inputs and outputs.
    ///
    /// # Errors
    /// [`youla::Error::NoConvergence`] of the poles.
    pub fn new(
        name: &str,
        model: &StateSpace<Discrete>,
        (inputs, outputs): (Vec<Channel>, Vec<Channel>),
        details: serde_json::Value,
        provenance: Provenance<O>,
    ) -> Result<Self> {
        let rows = |m: MatRef<'_, f64>| (0..m.nrows()).map(|i| m.row(i).iter().copied().collect()).collect();
        Ok(ModelFile {
            name: name.to_owned(),
            inputs,
            outputs,
            ts: model.time().ts(),
            a: rows(model.a()),
            b: rows(model.b()),
            c: rows(model.c()),
            d: rows(model.d()),
            poles: pairs(&model.poles()?),
            details,
            provenance,
        })
    }

    /// The model itself.
    ///
    /// # Errors
    /// Shapes that do not fit, as in a file that was changed by hand.
    pub fn system(&self) -> Result<StateSpace<Discrete>> {
        let (n, m) = (self.a.len(), self.inputs.len());
        let matrix = |rows: &[Vec<f64>], columns: usize| {
            Mat::from_fn(rows.len(), columns, |i, j| rows[i].get(j).copied().unwrap_or(f64::NAN))
        };
        Ok(StateSpace::new(
            matrix(&self.a, n),
            matrix(&self.b, m),
            matrix(&self.c, n),
            matrix(&self.d, m),
            Discrete::new(self.ts)?,
        )?)
    }
}

/// Writes all artefacts of a run except report and summary.
///
/// # Errors
/// [`youla_io::Error::Io`].
pub fn write_artefacts(found: &Identification, folder: &RunFolder) -> Result<()> {
    let writer = Writer { found, folder, provenance: provenance(found) };
    folder.text("run.toml", &found.settings.to_toml()?)?;
    writer.records()?;
    writer.factors()?;
    writer.signals()?;
    writer.models()?;
    writer.verdict()?;
    writer.certificate()?;
    writer.redesign()
}

/// The provenance that every artefact of a run carries.
pub(super) fn provenance(found: &Identification) -> Provenance {
    Provenance {
        schema: SCHEMA,
        program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(),
        seed: found.settings.seed,
        sources: found.records.sources.clone(),
        options: found.settings.clone(),
    }
}

/// Real and imaginary parts, as JSON has them.
pub(super) fn pairs(poles: &[c64]) -> Vec<[f64; 2]> {
    poles.iter().map(|p| [p.re, p.im]).collect()
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
        let count = |group: &[LoopRecord]| -> Vec<serde_json::Value> {
            group.iter().map(|r| serde_json::json!({"name": r.name, "samples": r.samples()})).collect()
        };
        let index = serde_json::json!({
            "sample_time": records.time.ts(),
            "inputs": records.inputs,
            "outputs": records.outputs,
            "estimation": count(&records.estimation),
            "verification": count(&records.verification),
            "segments": records.segments,
            "provenance": self.provenance,
        });
        self.folder.json("1-record/records.json", &index)?;
        let mut check = self.found.data.json();
        check["provenance"] = serde_json::json!(self.provenance);
        Ok(self.folder.json("1-record/check.json", &check)?)
    }

    fn record(&self, purpose: &str, record: &LoopRecord) -> Result<()> {
        let mut variables = vec![number("ts", record.time.ts())];
        let groups = [
            ("u", Some(&record.u)),
            ("y", Some(&record.y)),
            ("input_excitation", record.input_excitation.as_ref()),
            ("reference", record.reference.as_ref()),
            ("alpha", record.alpha.as_ref()),
            ("disturbance", record.disturbance.as_ref()),
        ];
        for (name, matrix) in groups {
            variables.extend(matrix.map(|m| array(name, m.as_ref())));
        }
        self.mat(&format!("1-record/{purpose}-{}.mat", record.name), &variables)
    }

    /// `2-factor/`: the two systems of (15), the controller and the nominal model.
    fn factors(&self) -> Result<()> {
        let f = &self.found.factorisation;
        let details = serde_json::json!({"bezout_residual": f.bezout_residual});
        let loop_ports: Vec<Channel> =
            self.found.records.inputs.iter().chain(&self.found.records.outputs).cloned().collect();
        let youla = |names: [&str; 2]| -> Vec<Channel> {
            let channel = |name: &str, c: &Channel| Channel::new(format!("{name} of {}", c.name), &c.unit);
            let (u, y) = (self.found.records.inputs.iter(), self.found.records.outputs.iter());
            u.map(|c| channel(names[0], c)).chain(y.map(|c| channel(names[1], c))).collect()
        };
        let (right, left) = (f.factors.right().system(), f.factors.left().system());
        self.model_with("2-factor/right", right, youla(["eta", "epsilon"]), loop_ports.clone(), details.clone())?;
        self.model_with("2-factor/left", left, loop_ports, youla(["alpha", "beta"]), details)?;
        let (u, y) = (self.found.records.inputs.clone(), self.found.records.outputs.clone());
        self.model_with("2-factor/controller", &f.controller, y, u, serde_json::Value::Null)?;
        self.model("2-factor/nominal", &f.nominal, serde_json::Value::Null)
    }

    /// `3-signals/`: alpha and beta of each estimation record.
    fn signals(&self) -> Result<()> {
        let s = &self.found.signals;
        for (record, YoulaSignals { alpha, beta }) in self.found.records.estimation.iter().zip(&s.experiments) {
            let variables = [
                number("ts", record.time.ts()),
                number("dropped_samples", s.settle as f64),
                array("alpha", alpha.as_ref()),
                array("beta", beta.as_ref()),
            ];
            self.mat(&format!("3-signals/{}.mat", record.name), &variables)?;
        }
        let index = serde_json::json!({
            "dropped_samples": s.settle,
            "controller_mismatch": s.controller_mismatch,
            "provenance": self.provenance,
        });
        Ok(self.folder.json("3-signals/signals.json", &index)?)
    }

    /// `4-identify/`, `5-recombine/`, `6-reduce/`: the models.
    fn models(&self) -> Result<()> {
        let found = self.found;
        let (u, y) = (&found.records.inputs, &found.records.outputs);
        let named = |name: &str, channels: &[Channel]| -> Vec<Channel> {
            channels.iter().map(|c| Channel::new(format!("{name} of {}", c.name), &c.unit)).collect()
        };
        let s = &found.hansen.deviation;
        let mut details = subspace_details(s);
        if let Some(form) = &found.hansen.innovation_form {
            let gain: Vec<Vec<f64>> = form.gain.row_iter().map(|row| row.iter().copied().collect()).collect();
            details["innovation_form"] = serde_json::json!({
                "gain": gain, "iterations": form.iterations, "stop": form.stop, "change": form.change,
                "misfit": form.misfit, "from_kalman": form.from_kalman,
            });
        }
        if let Some(refinement) = &found.refinement {
            details["refinement"] = serde_json::json!(refinement);
        }
        self.model_with("4-identify/deviation", &s.model, named("alpha", u), named("beta", y), details)?;
        match &found.direct {
            Some(Ok(direct)) => self.model("4-identify/direct", &direct.model, subspace_details(direct))?,
            Some(Err(e)) => self.folder.json("4-identify/direct.json", &refused(e))?,
            None => {}
        }
        self.diagram("4-identify/stabilisation_deviation", found.diagrams.deviation.as_ref(), &named("beta", y))?;
        self.diagram("4-identify/stabilisation_direct", found.diagrams.direct.as_ref(), y)?;
        self.model("5-recombine/hansen", &found.hansen.plant, serde_json::Value::Null)?;
        let known = &found.uncertainty;
        self.uncertainty("4-identify/uncertainty.json", &known.deviation)?;
        self.uncertainty("5-recombine/uncertainty.json", &known.plant)?;
        self.uncertainty("4-identify/grey_box_uncertainty.json", &known.grey_box)?;
        match &found.grey_box {
            Some(Ok(run)) => self.model("4-identify/grey_box", &run.found.model.model, run.details()?)?,
            Some(Err(e)) => self.folder.json("4-identify/grey_box.json", &refused(e))?,
            None => {}
        }
        match &found.reduction {
            Some(Ok(r)) => {
                self.model("6-reduce/hansen_reduced", &r.found.reduction.model, r.details())?;
                let mut file = reduction::as_json(r);
                file["provenance"] = serde_json::json!(self.provenance);
                self.folder.json("6-reduce/sweep.json", &file)?;
                Ok(self.folder.text("6-reduce/sweep.csv", &reduction::as_csv(&r.found.sweep))?)
            }
            Some(Err(e)) => Ok(self.folder.json("6-reduce/hansen_reduced.json", &refused(e))?),
            None => Ok(()),
        }
    }

    /// A stabilisation diagram, or why there is none.
    fn diagram(&self, name: &str, diagram: Option<&Result<StabilisationDiagram>>, outputs: &[Channel]) -> Result<()> {
        match diagram {
            Some(Ok(diagram)) => {
                let mut file = as_json(diagram, outputs);
                file["provenance"] = serde_json::json!(self.provenance);
                self.folder.json(&format!("{name}.json"), &file)?;
                Ok(self.folder.text(&format!("{name}.csv"), &as_csv(diagram))?)
            }
            Some(Err(e)) => Ok(self.folder.json(&format!("{name}.json"), &refused(e))?),
            None => Ok(()),
        }
    }

    /// `7-validate/certificate.json`.
    fn certificate(&self) -> Result<()> {
        let Some(certificate) = &self.found.certificate else { return Ok(()) };
        let mut file = certificate.json();
        file["provenance"] = serde_json::json!(self.provenance);
        Ok(self.folder.json("7-validate/certificate.json", &file)?)
    }

    /// `8-redesign/`: the new controller as model, as data and as source for `youla-rt`, and what it promises.
    fn redesign(&self) -> Result<()> {
        match &self.found.redesign {
            Some(Ok(new)) => {
                let (u, y) = (self.found.records.inputs.clone(), self.found.records.outputs.clone());
                self.model_with("8-redesign/new_controller", &new.controller.system, y, u, serde_json::Value::Null)?;
                let exported = redesign::exported(self.found, new);
                self.folder.text("8-redesign/controller.rs", &exported.rust())?;
                self.folder.json("8-redesign/controller.json", &exported)?;
                let (figure, loops) = (redesign::figure(new)?, redesign::loops());
                self.folder.text("8-redesign/response.csv", &figure_csv(&figure, &loops))?;
                self.folder.text("8-redesign/response.svg", &svg(&figure, &loops)?)?;
                let mut file = redesign::json(new);
                file["provenance"] = serde_json::json!(self.provenance);
                Ok(self.folder.json("8-redesign/redesign.json", &file)?)
            }
            Some(Err(e)) => Ok(self.folder.json("8-redesign/redesign.json", &refused(e))?),
            None => Ok(()),
        }
    }

    /// `7-validate/verdict.json` and the predictions.
    fn verdict(&self) -> Result<()> {
        let mut models = serde_json::Map::new();
        for v in &self.found.verdict.models {
            let records: Vec<_> = v
                .records
                .iter()
                .map(|r| {
                    let failure = r.predicted.as_ref().err();
                    serde_json::json!({"record": r.record, "fit": r.fit, "vaf": r.vaf, "failure": failure})
                })
                .collect();
            let entry = serde_json::json!({
                "order": v.model.order(),
                "poles": pairs(&v.poles),
                "modes": v.modes.iter().map(|m| serde_json::json!({"hz": m.hz, "zeta": m.zeta})).collect::<Vec<_>>(),
                "stabilised_by_controller": v.certificate.stable,
                "closed_loop_poles": pairs(&v.certificate.poles),
                "robustness": super::robustness::artefact(&v.robustness),
                "records": records,
            });
            models.insert(v.method.key().into(), entry);
        }
        let scales = self.found.verdict.scales.as_ref().map(super::robustness::scales_entry);
        self.folder.json(
            "7-validate/verdict.json",
            &serde_json::json!({"models": models, "channel_scales": scales, "provenance": self.provenance}),
        )?;
        let residuals = super::residual_tests::artefact(self.found, &self.provenance);
        self.folder.json("7-validate/residuals.json", &residuals)?;
        for (k, record) in self.found.records.verification.iter().enumerate() {
            let mut variables = vec![number("ts", record.time.ts()), array("measured", record.y.as_ref())];
            for v in &self.found.verdict.models {
                let predicted = v.records[k].predicted.as_ref().ok();
                variables.extend(predicted.map(|p| array(v.method.key(), p.as_ref())));
            }
            self.mat(&format!("7-validate/{}.mat", record.name), &variables)?;
        }
        Ok(())
    }

    fn model(&self, name: &str, model: &StateSpace<Discrete>, details: serde_json::Value) -> Result<()> {
        let (u, y) = (self.found.records.inputs.clone(), self.found.records.outputs.clone());
        self.model_with(name, model, u, y, details)
    }

    /// Nothing where there is none.
    fn uncertainty(&self, name: &str, known: &Option<SystemUncertainty>) -> Result<()> {
        let Some(known) = known else { return Ok(()) };
        let mut file = known.json(&self.found.hz);
        file["provenance"] = serde_json::json!(self.provenance);
        Ok(self.folder.json(name, &file)?)
    }

    fn model_with(
        &self,
        name: &str,
        model: &StateSpace<Discrete>,
        inputs: Vec<Channel>,
        outputs: Vec<Channel>,
        details: serde_json::Value,
    ) -> Result<()> {
        let title = name.rsplit('/').next().unwrap_or(name);
        let file = ModelFile::new(title, model, (inputs, outputs), details, self.provenance.clone())?;
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

    fn mat(&self, name: &str, variables: &[Variable]) -> Result<()> {
        Ok(self.folder.file(name, |path| write_mat(path, variables, Packing::Plain))?)
    }
}

pub(super) fn subspace_details(s: &SubspaceModel) -> serde_json::Value {
    serde_json::json!({
        "order": s.order.order,
        "horizon": s.horizon,
        "past": s.past,
        "automatic_horizon": s.automatic_horizon,
        "order_choice": s.order,
        "columns": s.columns,
        "singular_values": s.singular_values,
        "excitation_rcond": s.excitation_rcond,
        "factor": s.factor,
        "stable": s.stability.stable,
        "moved_poles": s.stability.moved.iter().map(|m| [[m.from.re, m.from.im], [m.to.re, m.to.im]]).collect::<Vec<_>>(),
        "initial_states": s.initial_states,
        "delays": s.delays,
        "disturbances": s.disturbances.iter().map(|a| amplitudes(a.as_ref())).collect::<Vec<_>>(),
    })
}

fn refused(e: &Error) -> serde_json::Value {
    serde_json::json!({"refused": e.to_string()})
}

fn number(name: &str, value: f64) -> Variable {
    Variable { name: name.into(), value: Value::scalar(value) }
}

fn array(name: &str, value: MatRef<'_, f64>) -> Variable {
    Variable { name: name.into(), value: Value::matrix(value) }
}
