//! The bearing in closed loop with nominal models that are 50 and 90 % wrong.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::Mat;
use youla::control::closed_loop;
use youla::factor::YoulaSignals;
use youla::identify::hansen::hansen;
use youla::identify::subspace::{Experiment, Order};
use youla::linalg::{block, eye};
use youla::lti::{Continuous, Discrete, StateSpace, simulate};
use youla::signal::{Excitation, SquareWaves};
use youla::validate::fit;
use youla_greybox::hansen_pem::{HansenPemOptions, PemStart, SchemeData, hansen_pem, projection_target};
use youla_greybox::{Error, Matrix, Problem, Result, Slope, Structure, greybox, project};
use youla_paper::study::{Design, PaperSettings, design};
use youla_twin::BearingStructure;
use youla_twin::rig::{Bearing, degraded};

struct Loop {
    design: Design,
    plant: StateSpace<Discrete>,
    nominal: Vec<f64>,
}

struct Log {
    u: Mat<f64>,
    y: Mat<f64>,
}

impl Log {
    fn experiment(&self) -> Experiment<'_> {
        Experiment::new(self.u.as_ref(), self.y.as_ref())
    }
}

impl Loop {
    fn new(theta: f64) -> Self {
        let time = Discrete::new(2e-4).unwrap();
        let truth = Bearing::default();
        let sampled = |a_factor| degraded(&truth.plant().unwrap(), a_factor, 1.0).unwrap().zoh(time).unwrap();
        let controller = PaperSettings::shipped().controller;
        let design = design(&sampled(1.0 - theta), &sampled(1.0), &controller.command_weights, &controller).unwrap();
        let nominal = BearingStructure::parameters(&truth.degraded(1.0 - theta, 1.0).unwrap());
        Loop { design, plant: sampled(1.0), nominal }
    }

    /// 1 s under square waves, white output noise of `noise` um.
    fn log(&self, noise: f64, seed: u64) -> Log {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let waves = SquareWaves { amplitude: 0.5, hold_min: 5, hold_max: 40 };
        let alpha = Excitation::SquareWaves(waves).generate(5000, 2, self.plant.time(), &mut rng).unwrap();
        let n = Mat::from_fn(5000, 2, |_, _| noise * rng.sample::<f64, _>(StandardNormal));
        let rig = closed_loop(&self.plant, &self.design.factors.j_k().unwrap()).unwrap();
        let excited = block(&[&[alpha.as_ref(), n.as_ref()]]);
        let log = simulate(&rig, excited.as_ref(), &vec![0.0; rig.order()]).unwrap();
        Log { u: log.subcols(0, 2).to_owned(), y: log.subcols(2, 2).to_owned() }
    }

    fn data<'a>(&'a self, signals: &'a [YoulaSignals]) -> SchemeData<'a> {
        SchemeData { factors: &self.design.factors, signals }
    }

    fn signals(&self, log: &Log) -> [YoulaSignals; 1] {
        [self.design.factors.signals(log.u.as_ref(), log.y.as_ref()).unwrap()]
    }
}

fn options() -> HansenPemOptions {
    let settings = PaperSettings::shipped();
    HansenPemOptions { hansen: settings.hansen, pem: settings.pem, ..Default::default() }
}

#[test]
fn a_record_without_noise_gives_the_parameters_by_projection_alone() {
    let bearing = Loop::new(0.5);
    let log = bearing.log(0.0, 1);
    let (options, signals) = (options(), bearing.signals(&log));
    assert_eq!(options.hansen.order, Order::Fixed(12));
    let found = hansen(&bearing.design.factors, &signals, &options.hansen).unwrap();
    let target = projection_target(&bearing.design.factors, &found.deviation.model, &signals, &options).unwrap();
    let projected = project(&BearingStructure, &target, &[], &options.projection).unwrap();
    let truth = BearingStructure::parameters(&Bearing::default());
    for (found, truth) in projected.parameters.iter().zip(truth) {
        assert!((found / truth - 1.0).abs() < 1e-4, "{found} for {truth}");
    }
}

/// A nominal model of which all entries of A are a tenth of the true ones. The search from it ends in a local minimum, that from the
/// projection ends where one from the true parameters does.
#[test]
fn a_nominal_model_that_is_90_percent_wrong() {
    let bearing = Loop::new(0.9);
    let truth = BearingStructure::parameters(&Bearing::default());
    let verification = bearing.log(0.0, 99);
    let worse = |model: &StateSpace<Discrete>| {
        let simulated = simulate(model, verification.u.as_ref(), &vec![0.0; model.order()]);
        let percent = simulated.and_then(|y| fit(verification.y.as_ref(), y.as_ref()));
        percent.map_or(f64::NEG_INFINITY, |f| f[0].min(f[1]))
    };
    for seed in 1..=5 {
        let log = bearing.log(0.2, seed);
        let pem = |start: &[f64]| {
            greybox(&Problem::new(&BearingStructure, &[log.experiment()], bearing.plant.time()), start, &options().pem)
                .map_or(f64::NEG_INFINITY, |found| worse(&found.model))
        };
        let signals = bearing.signals(&log);
        let found = hansen_pem(
            bearing.data(&signals),
            &Problem::new(&BearingStructure, &[log.experiment()], bearing.plant.time()),
            None,
            &options(),
        )
        .unwrap();
        let (ours, oracle, single) = (worse(&found.model.model), pem(&truth), pem(&bearing.nominal));
        assert!(oracle - ours < 0.1, "seed {seed}: {ours} of {oracle}");
        assert!(single < oracle - 1.0, "seed {seed}: from the nominal model {single} of {oracle}");
        assert!(
            !found.local_minimum_suspected() && found.model.covariance.is_some(),
            "{:?} {:?}",
            found.model.fit,
            found.fit_of_plant
        );
        assert_eq!((found.won, found.runs.len()), (PemStart::Projection, 2));
    }
}

#[test]
fn the_nominal_model_is_a_second_start() {
    let bearing = Loop::new(0.1);
    let log = bearing.log(0.2, 1);
    let (signals, nominal) = (bearing.signals(&log), Some(bearing.nominal.as_slice()));
    let experiments = [log.experiment()];
    let found = hansen_pem(
        bearing.data(&signals),
        &Problem::new(&BearingStructure, &experiments, bearing.plant.time()),
        nominal,
        &options(),
    )
    .unwrap();
    let costs: Vec<f64> = found.runs.iter().map(|run| *run.cost.as_ref().unwrap()).collect();
    let starts: Vec<PemStart> = found.runs.iter().map(|run| run.start).collect();
    assert_eq!(starts, [PemStart::Projection, PemStart::Direct, PemStart::Nominal]);
    assert!(costs.iter().all(|cost| (cost / costs[0] - 1.0).abs() < 1e-6), "{costs:?}");
    assert_eq!((found.won, found.model.cost), (PemStart::Projection, costs[0]));
    assert!(found.runs[0].cost_at_start < found.runs[2].cost_at_start);
}

/// One lag per axis: `x' = rate (gain u - x)`.
struct Lags;

impl Structure for Lags {
    fn names(&self) -> Vec<String> {
        ["rate_h", "rate_v", "gain_h", "gain_v"].map(String::from).into()
    }
    fn model(&self, t: &[f64]) -> Result<StateSpace<Continuous>> {
        let diagonal = |d: [f64; 2]| Mat::from_fn(2, 2, |i, j| if i == j { d[i] } else { 0.0 });
        Ok(StateSpace::new(diagonal([-t[0], -t[1]]), diagonal([t[2], t[3]]), eye(2), Mat::zeros(2, 2), Continuous)?)
    }
    fn slopes(&self, _: &[f64], parameter: usize) -> Vec<Slope> {
        let (matrix, value) = if parameter < 2 { (Matrix::A, -1.0) } else { (Matrix::B, 1.0) };
        vec![Slope { matrix, row: parameter % 2, column: parameter % 2, value }]
    }
}

#[test]
fn a_structure_that_is_not_that_of_the_plant_is_seen() {
    let bearing = Loop::new(0.5);
    let log = bearing.log(0.2, 1);
    let signals = bearing.signals(&log);
    let found = hansen_pem(
        bearing.data(&signals),
        &Problem::new(&Lags, &[log.experiment()], bearing.plant.time()),
        None,
        &options(),
    )
    .unwrap();
    assert!(found.local_minimum_suspected(), "{:?} {:?}", found.model.fit, found.fit_of_plant);
    assert!(found.projections[0].misfit > 0.3, "{}", found.projections[0].misfit);
}

#[test]
fn records_that_do_not_fit_are_refused() {
    let bearing = Loop::new(0.5);
    let log = bearing.log(0.2, 1);
    let signals = bearing.signals(&log);
    let found = hansen(&bearing.design.factors, &signals, &options().hansen).unwrap();
    let short = [YoulaSignals::new(signals[0].alpha().subrows(0, 40), signals[0].beta().subrows(0, 40)).unwrap()];
    let target = projection_target(&bearing.design.factors, &found.deviation.model, &short, &options());
    assert!(
        matches!(target, Err(Error::Method(youla::Error::TooFewSamples { found: 40, needed: 64, .. }))),
        "{target:?}"
    );
    let few = HansenPemOptions { frequencies: 1, ..options() };
    let target = projection_target(&bearing.design.factors, &found.deviation.model, &signals, &few);
    assert!(matches!(target, Err(Error::Method(youla::Error::OutOfRange { .. }))));
}
