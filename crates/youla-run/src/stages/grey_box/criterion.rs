//! What the prediction-error method of a run compares with the outputs: the plant alone, or the loop that it makes with the
//! declared controller.
//!
//! ```text
//! open loop:    y - G_theta u                                   u measured
//! closed loop:  y - G_theta (I - K G_theta)^-1 (v1 - K r)       excitations known, K declared
//! ```
//! The second is for plants that integrate or are unstable, whose simulation drifts with every error of u.

use crate::records::RunRecords;
use crate::records::disturbance::without_lines;
use crate::settings::PredictionKind;
use crate::stages::context::RunContext;
use crate::stages::signals::DeviationSignals;
use crate::{Error, Result};
use faer::Scale;
use youla::Mat;
use youla::control::with_input_port;
use youla::factor::CoprimeFactors;
use youla::identify::hansen::HansenModel;
use youla::identify::subspace::Experiment;
use youla::linalg::block;
use youla::lti::{Discrete, Partitioned, StateSpace};
use youla::signal::LoopRecord;
use youla::validate::{LoopExcitation, fit, predict_closed_loop};
use youla_greybox::hansen_pem::{
    HansenPem, HansenPemOptions, PemRun, PemStart, SchemeData, pem_from_hansen, projection_target,
};
use youla_greybox::projected_pem::{projected, searched};
use youla_greybox::{
    DeclaredStructure, GreyBoxIntervals, GreyBoxModel, GreyBoxOptions, IntervalOptions, LoopOutput, Problem, greybox,
    greybox_intervals,
};

/// The measured outputs without known lines.
pub(crate) fn outputs_without_lines(records: &RunRecords) -> Result<Vec<Mat<f64>>> {
    let measured = |r: &LoopRecord| without_lines(r.y(), r.disturbance());
    records.estimation.iter().map(measured).collect()
}

/// The searches for the parameters of a structure.
#[derive(Debug)]
pub struct StructureSearch {
    /// The searches.
    pub runs: Vec<PemRun>,
    /// Which of them won.
    pub won: PemStart,
    /// Its model, with the covariance of the parameters.
    pub model: GreyBoxModel,
    /// Fit of G(S) to the same records, percent per output; `None` where the scheme gave no model.
    pub fit_of_plant: Option<Vec<f64>>,
    /// Whether the fit is clearly below that of G(S): a local minimum, or a structure that does not describe the plant.
    pub local_minimum_suspected: bool,
}

impl From<HansenPem> for StructureSearch {
    fn from(found: HansenPem) -> Self {
        let local_minimum_suspected = found.local_minimum_suspected();
        let HansenPem { runs, won, model, fit_of_plant, .. } = found;
        StructureSearch { runs, won, model, fit_of_plant: Some(fit_of_plant), local_minimum_suspected }
    }
}

/// The result of the scheme, from which the search may start.
#[derive(Clone, Copy)]
pub(crate) struct SchemeStart<'a> {
    pub(crate) factors: &'a CoprimeFactors<Discrete>,
    pub(crate) signals: &'a DeviationSignals,
    pub(crate) hansen: &'a HansenModel,
}

/// Data, loop and choices of the estimation.
pub(crate) struct Criterion<'a> {
    records: &'a RunRecords,
    outputs: &'a [Mat<f64>],
    options: &'a HansenPemOptions,
    closed: Option<Closed>,
}

/// The loop: its controller as `(y, w) -> u` with the external signals `w = [v1; r]` of each record.
struct Closed {
    /// `(y, v1) -> (u, z)`, as the verification takes it.
    ports: Partitioned<Discrete>,
    controller: Partitioned<Discrete>,
    external: Vec<Mat<f64>>,
}

impl<'a> Criterion<'a> {
    pub(crate) fn new(
        prediction: PredictionKind,
        run: RunContext<'a>,
        outputs: &'a [Mat<f64>],
        options: &'a HansenPemOptions,
    ) -> Result<Self> {
        let records = run.records;
        let closed = match prediction {
            PredictionKind::OpenLoop => None,
            PredictionKind::ClosedLoop => Some(Closed::new(run)?),
        };
        Ok(Criterion { records, outputs, options, closed })
    }

    fn experiments(&self) -> Vec<Experiment<'_>> {
        let input = |k: usize| match &self.closed {
            None => self.records.estimation[k].u(),
            Some(closed) => closed.external[k].as_ref(),
        };
        self.outputs.iter().enumerate().map(|(k, y)| Experiment::new(input(k), y.as_ref())).collect()
    }

    /// The best of the searches from the projection of G(S), where there is one, and from the initial values.
    pub(crate) fn estimate(
        &self,
        start: Option<SchemeStart<'_>>,
        structure: &DeclaredStructure,
        nominal: Option<&[f64]>,
    ) -> Result<StructureSearch> {
        let Some(SchemeStart { factors, signals, hansen }) = start else {
            return self.of_initial_values(structure, nominal);
        };
        let (signals, hansen) = (&signals.experiments, hansen.clone());
        let Some(closed) = &self.closed else {
            let experiments = &self.experiments();
            let data = SchemeData { factors, signals };
            let problem = Problem::new(structure, experiments, self.records.time);
            return Ok(pem_from_hansen(hansen, data, &problem, nominal, self.options)?.into());
        };
        let target = projection_target(factors, &hansen.deviation.model, signals, self.options)?;
        let cost = |theta: &[f64]| self.cost(closed, structure, theta);
        let order = projected(structure, &target, nominal, &self.options.projection, cost)?;
        let best = order.first().map(|(cost, p)| (PemStart::Projection, *cost, p.start(structure)));
        let initial = nominal.map(|n| (PemStart::Nominal, cost(n), n.to_vec()));
        let search = |theta: &[f64]| self.search(closed, structure, theta, &self.options.pem);
        let (runs, best) = searched(best.into_iter().chain(initial).collect(), search);
        let Some((won, model)) = best else {
            return Err(runs
                .into_iter()
                .find_map(|run| run.cost.err())
                .unwrap_or(youla_greybox::Error::NoStart)
                .into());
        };
        let fit_of_plant = self.fit_of_plant(closed, &hansen.plant)?;
        let projections = order.into_iter().map(|(_, projection)| projection).collect();
        Ok(HansenPem { hansen, projections, runs, won, model, fit_of_plant }.into())
    }

    /// The search where the scheme gave no model.
    fn of_initial_values(&self, structure: &DeclaredStructure, nominal: Option<&[f64]>) -> Result<StructureSearch> {
        let (theta, options) = (nominal.ok_or(youla_greybox::Error::NoStart)?, &self.options.pem);
        let (experiments, time) = (&self.experiments(), self.records.time);
        let search = |options: &GreyBoxOptions| match &self.closed {
            None => greybox(&Problem::new(structure, experiments, time), theta, options),
            Some(closed) => self.search(closed, structure, theta, options),
        };
        let cost_at_start = search(&GreyBoxOptions { max_iterations: 0, ..options.clone() })?.cost;
        let (model, start) = (search(options)?, PemStart::Nominal);
        let runs = vec![PemRun { start, cost_at_start, cost: Ok(model.cost) }];
        Ok(StructureSearch { runs, won: start, model, fit_of_plant: None, local_minimum_suspected: false })
    }

    /// Intervals of an estimate.
    pub(crate) fn intervals(
        &self,
        structure: &DeclaredStructure,
        found: &GreyBoxModel,
        asked: &IntervalOptions,
    ) -> Result<GreyBoxIntervals> {
        let (experiments, time, options) = (&self.experiments(), self.records.time, &self.options.pem);
        let open = Problem::new(structure, experiments, time);
        let problem = match &self.closed {
            None => open,
            Some(Closed { controller, .. }) => open.in_loop(controller, LoopOutput::Plant),
        };
        Ok(greybox_intervals(&problem, found, options, asked)?)
    }

    fn search(
        &self,
        closed: &Closed,
        structure: &DeclaredStructure,
        start: &[f64],
        options: &GreyBoxOptions,
    ) -> youla_greybox::Result<GreyBoxModel> {
        let (experiments, time) = (&self.experiments(), self.records.time);
        let problem = Problem::new(structure, experiments, time).in_loop(&closed.controller, LoopOutput::Plant);
        greybox(&problem, start, options)
    }

    /// The criterion without a search, infinite where the loop diverges.
    fn cost(&self, closed: &Closed, structure: &DeclaredStructure, theta: &[f64]) -> f64 {
        let options = GreyBoxOptions { max_iterations: 0, ..self.options.pem.clone() };
        self.search(closed, structure, theta, &options).map_or(f64::INFINITY, |found| found.cost)
    }

    /// Fit (26) of G(S) in the same loop over all records, percent; minus infinity where it diverges.
    fn fit_of_plant(&self, closed: &Closed, plant: &StateSpace<Discrete>) -> Result<Vec<f64>> {
        let mut predicted = Vec::new();
        for (r, y) in self.records.estimation.iter().zip(self.outputs) {
            let excitation = LoopExcitation { input: r.alpha().or(r.input_excitation()), reference: r.reference() };
            match predict_closed_loop(plant, &closed.ports, excitation, y.as_ref()) {
                Ok(yp) => predicted.push(yp),
                Err(youla::Error::Diverged { .. }) => return Ok(vec![f64::NEG_INFINITY; plant.outputs()]),
                Err(other) => return Err(other.into()),
            }
        }
        Ok(fit(stacked(self.outputs).as_ref(), stacked(&predicted).as_ref())?)
    }
}

impl Closed {
    fn new(run: RunContext<'_>) -> Result<Self> {
        let (records, controller) = (run.records, run.declared.controller());
        let with_alpha = records.estimation.iter().any(|r| r.alpha().is_some());
        let ports = match run.factorisation.filter(|_| with_alpha) {
            Some(factorisation) => factorisation.factors.j_k()?,
            None if with_alpha => {
                return Err(Error::Method(youla::Error::Unsupported {
                    what: "prediction = \"closed-loop\" with an excitation alpha but without coprime factors",
                    instead: "correct what the run says of the factors, or log the excitation at the plant input",
                }));
            }
            None => with_input_port(controller)?,
        };
        let (m, p) = (controller.outputs(), controller.inputs());
        let external = records.estimation.iter().map(|r| {
            let (no_input, no_reference) = (Mat::zeros(r.samples(), m), Mat::zeros(r.samples(), p));
            let added = r.alpha().or(r.input_excitation()).unwrap_or(no_input.as_ref());
            block(&[&[added, r.reference().unwrap_or(no_reference.as_ref())]])
        });
        let external = external.collect();
        Ok(Closed { controller: with_reference(&ports, m, p)?, ports, external })
    }
}

/// `(y, v) -> u` as `(y, [v; r]) -> u` with y - r in the place of y.
fn with_reference(ports: &Partitioned<Discrete>, m: usize, p: usize) -> Result<Partitioned<Discrete>> {
    let system = ports.system();
    let beside = |matrix: youla::MatRef<'_, f64>| {
        let of_reference = Scale(-1.0) * matrix.subcols(0, p);
        block(&[&[matrix, of_reference.as_ref()]])
    };
    let (c, d) = (system.c().subrows(0, m), system.d().subrows(0, m));
    let system = StateSpace::new(system.a().to_owned(), beside(system.b()), c.to_owned(), beside(d), system.time())?;
    Ok(Partitioned::new(system, m, p)?)
}

/// Records one below the other.
fn stacked(records: &[Mat<f64>]) -> Mat<f64> {
    let rows: Vec<[youla::MatRef<'_, f64>; 1]> = records.iter().map(|r| [r.as_ref()]).collect();
    block(&rows.iter().map(|row| row.as_slice()).collect::<Vec<_>>())
}
