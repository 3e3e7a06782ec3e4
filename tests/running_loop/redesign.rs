//! A controller that is designed on an identified model meets the simulated rig: damping is measured before and after.

use crate::common::{self, rng};
use faer::Scale;
use std::cell::Cell;
use youla::control::{
    ChannelScales, LqrWeights, NoiseCovariance, RunningController, closed_loop, kalman, lqr, real_time_controller,
    with_input_port,
};
use youla::factor::{CoprimeFactors, loop_factors};
use youla::identify::Identified;
use youla::identify::likelihood::LikelihoodOptions;
use youla::identify::subspace::{Experiment, InitialState, Order, SubspaceMethod, SubspaceOptions, subspace};
use youla::linalg::eye;
use youla::lti::{Discrete, PeakOptions, StateSpace, hinf_norm};
use youla::signal::without_harmonics;
use youla::signal::{Channel, LoopRecord};
use youla::signal::{Excitation, SquareWaves};
use youla::{Mat, MatRef};
use youla_io::SystemMatrices;
use youla_io::export::{ExportedController, ObserverData};
use youla_loop::redesign::{
    Redesign, RedesignMethod, RedesignOptions, RedesignProblem, disturbance_response, least_damping, loop_modes,
    redesign,
};
use youla_twin::rig::{
    Bearing, BearingRig, ExperimentRecord, Fidelity, LoopController, ObserverLoop, RigParameters, SimulatedRig,
    bearing_at_speed, degraded, run_experiment,
};

const RPM: f64 = 2500.0;
const SAMPLES: usize = 120_000;
/// Samples at the start that are not used.
const SETTLE: usize = 1000;

/// An excitation at the plant input that the controller does not know of, as a disturbance is.
struct Disturbed<C> {
    controller: C,
    excitation: Cell<[f64; 2]>,
}

impl<C: LoopController> LoopController for Disturbed<C> {
    fn command(&self, y: [f64; 2], excitation: [f64; 2]) -> [f64; 2] {
        self.excitation.set(excitation);
        let u = self.controller.command(y, [0.0; 2]);
        [u[0] + excitation[0], u[1] + excitation[1]]
    }

    fn observe(&mut self, y: [f64; 2], applied: [f64; 2]) -> [f64; 2] {
        let v = self.excitation.get();
        self.controller.observe(y, [applied[0] - v[0], applied[1] - v[1]])
    }
}

/// `alpha = Q beta` around a controller: two orders, so that the types say it.
struct WithQ<const N: usize, const Q: usize> {
    inner: ObserverLoop<N>,
    q: youla_rt::Filter<f64, Q, 2, 2>,
    state: youla_rt::State<f64, Q>,
}

impl<const N: usize, const Q: usize> LoopController for WithQ<N, Q> {
    fn command(&self, y: [f64; 2], alpha: [f64; 2]) -> [f64; 2] {
        let own = self.q.output(&self.state, &[0.0; 2]);
        self.inner.command(y, [alpha[0] + own[0], alpha[1] + own[1]])
    }

    fn observe(&mut self, y: [f64; 2], applied: [f64; 2]) -> [f64; 2] {
        let beta = self.inner.observe(y, applied);
        self.q.step(&mut self.state, &beta);
        beta
    }
}

fn observer<const N: usize>(model: &StateSpace<Discrete>, f: MatRef<'_, f64>, l: MatRef<'_, f64>) -> ObserverLoop<N> {
    let controller = real_time_controller::<N, 2, 2>(model, f, l).unwrap();
    ObserverLoop { controller, state: youla_rt::State::at_rest() }
}

fn array<const R: usize, const K: usize>(m: MatRef<'_, f64>) -> [[f64; K]; R] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
}

/// A rig, its running controller and the excitation.
struct Bench {
    parameters: RigParameters,
    factors: CoprimeFactors<Discrete>,
    f: Mat<f64>,
    l: Mat<f64>,
}

impl Bench {
    /// The bearing at a speed with a share of cross-coupling, under LQG on the bearing at rest with `0.9 A`: a weak
    /// controller where the rotor is stable.
    fn new(cross_coupling: f64, input_weight: f64) -> Self {
        let mut parameters = RigParameters::shipped();
        parameters.rotation.cross_coupling.value = cross_coupling;
        let time = Discrete::new(2e-4).unwrap();
        let still = bearing_at_speed(&parameters, 0.0).unwrap();
        let nominal = degraded(&still.plant().unwrap(), 0.9, 1.0).unwrap().zoh(time).unwrap().balanced().unwrap();
        let weights =
            LqrWeights::on_outputs(&nominal, eye(2).as_ref(), (Scale(input_weight) * eye(2)).as_ref()).unwrap();
        let f = lqr(&nominal, &weights).unwrap().f;
        let noise = NoiseCovariance::at_inputs(&nominal, (Scale(0.25) * eye(2)).as_ref(), eye(2).as_ref()).unwrap();
        let l = kalman(&nominal, &noise).unwrap().l;
        let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref()).unwrap();
        Bench { parameters, factors, f, l }
    }

    fn rig(&self, seed: u64) -> BearingRig {
        BearingRig::new(&self.parameters, Fidelity::Rotating { rpm: RPM }, seed).unwrap()
    }

    fn running(&self) -> ObserverLoop<6> {
        observer(self.factors.nominal(), self.f.as_ref(), self.l.as_ref())
    }

    fn record(&self, controller: &mut impl LoopController, seed: u64) -> ExperimentRecord {
        let mut rig = self.rig(seed);
        let waves = SquareWaves { amplitude: 0.5, hold_min: 5, hold_max: 40 };
        let excitation = Excitation::SquareWaves(waves).generate(SAMPLES, 2, rig.time(), &mut rng(seed + 50)).unwrap();
        let log = run_experiment(&mut rig, controller, excitation.as_ref(), &self.parameters.safety).unwrap();
        assert_eq!((log.aborted, log.touched, log.saturated), (None, None, [0, 0]), "the experiment was not clean");
        log
    }

    /// Without the start and the harmonics of the speed.
    fn clean(&self, signal: MatRef<'_, f64>) -> Mat<f64> {
        let later = signal.subrows(SETTLE, signal.nrows() - SETTLE);
        without_harmonics(later, RPM / 60.0, 5, Discrete::new(2e-4).unwrap()).unwrap()
    }

    /// Six states, as the controllers of this test have: none of a dead time.
    fn identify(&self, seed: u64) -> (Identified, ExperimentRecord) {
        let log = self.record(&mut self.running(), seed);
        let [u, y, alpha] = [&log.u_applied, &log.y, &log.alpha].map(|signal| self.clean(signal.as_ref()));
        let record = LoopRecord::new(Discrete::new(2e-4).unwrap(), u, y).unwrap().with_alpha(alpha).unwrap();
        let nominal = self.factors.nominal();
        let controller = RunningController::observer(nominal, self.f.clone(), self.l.clone()).unwrap();
        let options = LikelihoodOptions { order: Some(6), dead_time: Some(vec![0, 0]), ..LikelihoodOptions::default() };
        (youla::identify(&[record], &[], &controller, Some(nominal), &options).unwrap(), log)
    }

    /// Figures of the loop from an experiment: an open-loop identification from a disturbance at the plant input to y.
    fn measured(&self, controller: impl LoopController, seed: u64, sizes: &[Vec<f64>; 2]) -> Measured {
        let mut disturbed = Disturbed { controller, excitation: Cell::new([0.0; 2]) };
        let log = self.record(&mut disturbed, seed);
        let (v, y) = (self.clean(log.alpha.as_ref()), self.clean(log.y.as_ref()));
        let options = SubspaceOptions {
            method: SubspaceMethod::Cva,
            horizon: 30,
            order: Order::Fixed(8),
            initial_state: InitialState::Estimated,
            ..Default::default()
        };
        let experiment = Experiment::new(v.as_ref(), y.as_ref());
        let found = subspace(&[experiment], Discrete::new(2e-4).unwrap(), &options).unwrap().model;
        let found = found.in_units(&sizes[0], &sizes[1]);
        let modes = found.shared_modes().unwrap();
        let matter = modes.iter().filter(|m| m.share >= 0.05 && m.mode.pole.im > 0.0);
        Measured {
            damping: matter.map(|m| m.mode.zeta).fold(1.0, f64::min),
            peak: hinf_norm(&found, &PeakOptions { tolerance: 1e-6 }).unwrap().value,
        }
    }
}

/// Least damping of the modes that matter, and peak of the response to a disturbance.
#[derive(Debug)]
struct Measured {
    damping: f64,
    peak: f64,
}

fn rms(m: &Mat<f64>) -> Vec<f64> {
    m.col_iter().map(|c| c.norm_l2() / (c.nrows() as f64).sqrt()).collect()
}

/// A new controller on the identified plant, with the sizes of u and y.
fn designed(
    bench: &Bench,
    found: &Identified,
    log: &ExperimentRecord,
    options: &RedesignOptions,
) -> (Redesign, [Vec<f64>; 2]) {
    let sizes = [&log.u_applied, &log.y].map(|signal| rms(&bench.clean(signal.as_ref())));
    let problem = RedesignProblem {
        plant: &found.model.plant,
        model: &found.model.plant,
        factors: &bench.factors,
        region: Some(&found.model.region),
        input_size: &sizes[0],
        output_size: &sizes[1],
        delay: 0,
    };
    (redesign(&problem, options).unwrap(), sizes)
}

fn near(measured: f64, predicted: f64, tolerance: f64) {
    assert!((measured / predicted - 1.0).abs() < tolerance, "measured {measured:.4}, predicted {predicted:.4}");
}

/// The exact S of the bearing around `0.5 A`: what is exported is what was designed.
#[test]
fn exported_data_are_the_controller() {
    let bench = Bench::new(0.0, 30.0);
    let time = Discrete::new(2e-4).unwrap();
    let plant = Bearing::default().plant().unwrap().zoh(time).unwrap().balanced().unwrap();
    let problem = RedesignProblem {
        plant: &plant,
        model: &plant,
        factors: &bench.factors,
        region: None,
        input_size: &[0.5; 2],
        output_size: &[1.0; 2],
        delay: 0,
    };
    let channels =
        |name: &str, unit: &str| vec![Channel::new(format!("{name}_h"), unit), Channel::new(format!("{name}_v"), unit)];
    for method in [RedesignMethod::Lqg, RedesignMethod::Youla] {
        let new = redesign(&problem, &RedesignOptions { method, ..Default::default() }).unwrap();
        assert!(new.band.is_none() && new.gains_damping(), "{method:?}");
        let gains = new.controller.gains.as_ref();
        let data = ExportedController {
            method: method.key().into(),
            ts: time.ts(),
            measured: channels("y", "um"),
            commanded: channels("u", "V"),
            controller: SystemMatrices::new(&new.controller.system),
            observer: gains.map(|g| ObserverData::new(&g.model, g.f.as_ref(), g.l.as_ref())),
            q: new.controller.q.as_ref().map(SystemMatrices::new),
        };
        let text = serde_json::to_string(&data).unwrap();
        let read: ExportedController = serde_json::from_str(&text).unwrap();
        assert_eq!(read, data);
        let system = read.controller.system(time).unwrap();
        assert_eq!(system, new.controller.system);
        // The source holds the same numbers, bit by bit, in the same order.
        let source = read.rust();
        let of = |name: &str| -> Vec<f64> {
            let body = source.split(&format!("pub const {name}: ")).nth(1).unwrap().split(" = ").nth(1).unwrap();
            let body = body.split(';').next().unwrap();
            body.split(|c: char| "[], \n".contains(c)).filter_map(|word| word.parse().ok()).collect()
        };
        let rows: Vec<f64> = read.controller.a.iter().flatten().copied().collect();
        assert_eq!(of("CONTROLLER_A"), rows);
        let closed = |k: &StateSpace<Discrete>| {
            youla::control::closed_loop(&plant, &youla::control::with_input_port(k).unwrap()).unwrap()
        };
        assert!(closed(&system).is_stable().unwrap());
        match (method, read.observer, read.q) {
            (RedesignMethod::Lqg, Some(observer), None) => assert_eq!((observer.f.len(), observer.l.len()), (2, 6)),
            (RedesignMethod::Youla, None, Some(q)) => {
                let exact = new.exact.unwrap();
                assert!(exact.stable && exact.identity_residual < 1e-9, "{:.1e}", exact.identity_residual);
                // Q around the running controller is the new one.
                let with_q = bench.factors.controller_of(&q.system(time).unwrap()).unwrap();
                let omega: Vec<f64> = (1..60).map(|k| 250.0 * f64::from(k)).collect();
                assert!(common::distance(&with_q, &system, &omega) < 1e-9);
            }
            other => panic!("{:?}", other.0),
        }
    }
}

#[test]
fn damping_rises_as_predicted_at_2500_rpm() {
    let bench = Bench::new(0.0, 1000.0);
    let (found, log) = bench.identify(3);
    let (new, sizes) = designed(&bench, &found, &log, &RedesignOptions::default());
    let before = bench.measured(bench.running(), 11, &sizes);
    let gains = new.controller.gains.as_ref().unwrap();
    let after = bench.measured(observer::<6>(&gains.model, gains.f.as_ref(), gains.l.as_ref()), 12, &sizes);
    assert!(new.band.unwrap().holds());
    near(before.damping, new.present.least_damping, 0.05);
    near(before.peak, new.present.peak_response, 0.05);
    near(after.damping, new.predicted.least_damping, 0.15);
    near(after.peak, new.predicted.peak_response, 0.1);
    assert!(after.damping > 2.0 * before.damping);
}

/// The loop with Q has many modes near each other, which no experiment tells apart: the peak of the response falls instead.
#[test]
fn q_lowers_the_resonance_as_predicted_at_2500_rpm() {
    let bench = Bench::new(0.0, 1000.0);
    let (found, log) = bench.identify(3);
    let options = RedesignOptions { method: RedesignMethod::Youla, ..Default::default() };
    let (new, sizes) = designed(&bench, &found, &log, &options);
    let before = bench.measured(bench.running(), 11, &sizes);
    let q = new.controller.q.as_ref().unwrap();
    let filter = youla_rt::Filter::new(array(q.a()), array(q.b()), array(q.c()), array(q.d())).unwrap();
    let with_q = WithQ::<6, 12> { inner: bench.running(), q: filter, state: youla_rt::State::at_rest() };
    let after = bench.measured(with_q, 12, &sizes);
    assert!(new.band.unwrap().holds() && new.gains_damping());
    near(after.peak, new.predicted.peak_response, 0.1);
    assert!(after.peak < 0.8 * before.peak);
}

/// Cross-coupling of a quarter of the stiffness: without control the rotor whirls up.
#[test]
fn damping_rises_as_predicted_on_an_unstable_rotor() {
    let bench = Bench::new(0.25, 10.0);
    assert!(!bench.rig(0).true_plant().unwrap().is_stable().unwrap());
    let (found, log) = bench.identify(4);
    assert!(!found.model.plant.is_stable().unwrap(), "the identified rotor must be unstable as well");
    let (new, sizes) = designed(&bench, &found, &log, &RedesignOptions::default());
    let before = bench.measured(bench.running(), 11, &sizes);
    let gains = new.controller.gains.as_ref().unwrap();
    let after = bench.measured(observer::<6>(&gains.model, gains.f.as_ref(), gains.l.as_ref()), 12, &sizes);
    assert!(new.band.unwrap().holds());
    near(before.damping, new.present.least_damping, 0.1);
    near(after.damping, new.predicted.least_damping, 0.15);
    assert!(after.damping > 3.0 * before.damping);
}

/// A resonance behind a machine that delays the commands of its controller by three samples.
#[test]
fn the_delay_of_a_machine_is_designed_for() {
    let time = Discrete::new(1e-3).unwrap();
    let [of_plant, of_running] =
        [[vec![0.0, 0.05, 0.05], vec![1.0, -1.94, 0.98]], [vec![0.0, 0.0, 0.0, -0.02], vec![1.0]]]
            .map(|[b, a]| StateSpace::difference_equation(&vec![vec![b]], &vec![vec![a]], time).unwrap());
    let sizes = ChannelScales::new(vec![1.0], vec![1.0]).unwrap();
    let factors = loop_factors(&of_plant, &RunningController::new(of_running), &sizes).unwrap();
    let problem = |delay| RedesignProblem {
        plant: &of_plant,
        model: &of_plant,
        factors: &factors,
        region: None,
        input_size: &[1.0],
        output_size: &[1.0],
        delay,
    };
    let options = RedesignOptions { input_weights: vec![30.0], ..RedesignOptions::default() };
    let new = redesign(&problem(3), &options).unwrap();
    let behind = |k: &StateSpace<Discrete>| {
        let delayed = k.clone().delayed(3).unwrap();
        let poles = closed_loop(&of_plant, &with_input_port(&delayed).unwrap()).unwrap().poles().unwrap();
        poles.iter().map(|p| p.norm()).fold(0.0, f64::max)
    };
    assert_eq!(new.controller.system, new.controller.computed.clone().delayed(3).unwrap());
    assert!(new.gains_damping() && behind(&new.controller.computed) < 0.99, "{}", behind(&new.controller.computed));
    let of_plant_behind = |k: &StateSpace<Discrete>| {
        least_damping(&loop_modes(&disturbance_response(&of_plant, &k.clone().delayed(3).unwrap()).unwrap()).unwrap())
    };
    let promised = new.predicted.least_damping;
    assert!((of_plant_behind(&new.controller.computed) / promised - 1.0).abs() < 1e-6, "{promised}");
    // A design that knows nothing of the delay loses the damping that it promises.
    let blind = redesign(&problem(0), &options).unwrap();
    let kept = of_plant_behind(&blind.controller.computed);
    assert!(kept < 0.7 * blind.predicted.least_damping, "{kept} {}", blind.predicted.least_damping);
}
