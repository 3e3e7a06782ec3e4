//! The controller of `youla-rt` against the library: `J_K` (22) in closed loop, `beta = Mt y - Nt u` (28) under saturation.
//!
//! Distances are the largest difference relative to the largest value of a signal: 1e-12 in `f64`, 1e-5 in `f32`.

use crate::common::{TS, gains, normal, random_system, rng};
use faer::Scale;
use youla::control::real_time_controller;
use youla::factor::CoprimeFactors;
use youla::linalg::eye;
use youla::lti::{Discrete, Simulator, StateSpace};
use youla::signal::{Excitation, SquareWaves};
use youla::{Error, Mat, MatRef};
use youla_rt::{Controller, Real, State};
use youla_run::ControllerSettings;
use youla_twin::rig::{Bearing, degraded};
use youla_twin::{DemoMachine, demo};

const SAMPLES: usize = 1_000_000;
const EXACT: f64 = 1e-12;
const SINGLE: f64 = 1e-5;

/// A loop with its nominal model and gains.
struct Loop {
    plant: StateSpace<Discrete>,
    nominal: StateSpace<Discrete>,
    f: Mat<f64>,
    l: Mat<f64>,
}

/// What excites it, samples x m and samples x p.
struct Excitations {
    alpha: Mat<f64>,
    noise: Mat<f64>,
}

/// What it gives, `u` as applied.
struct Log {
    u: Mat<f64>,
    y: Mat<f64>,
    alpha: Mat<f64>,
    beta: Mat<f64>,
}

impl Loop {
    /// The bearing of the demonstration under its controller: all entries of A of the nominal model are halved.
    fn bearing() -> Self {
        let time = Discrete::new(TS).unwrap();
        let bearing = Bearing::default().plant().unwrap();
        let ControllerSettings::Observer { state_feedback, observer_gain, .. } =
            demo(DemoMachine::Bearing, 1).unwrap().settings.controller
        else {
            panic!("the demonstration has an observer-based controller")
        };
        let matrix = |rows: Vec<Vec<f64>>| Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j]);
        Loop {
            plant: bearing.zoh(time).unwrap(),
            nominal: degraded(&bearing, 0.5, 1.0).unwrap().zoh(time).unwrap(),
            f: matrix(state_feedback),
            l: matrix(observer_gain),
        }
    }

    /// A random plant of 5 states, 2 inputs and 3 outputs with feedthrough; nominal model and plant are the same.
    fn with_feedthrough() -> Self {
        let plant = random_system(&mut rng(3), (5, 2, 3), -0.05, Discrete::new(1.0).unwrap());
        assert!(plant.d().norm_max() > 0.1);
        let (f, l) = gains(&plant);
        Loop { nominal: plant.clone(), plant, f, l }
    }

    fn factors(&self) -> CoprimeFactors<Discrete> {
        CoprimeFactors::observer(&self.nominal, self.f.as_ref(), self.l.as_ref()).unwrap()
    }

    fn controller<const N: usize, const M: usize, const P: usize>(&self) -> Controller<f64, N, M, P> {
        real_time_controller(&self.nominal, self.f.as_ref(), self.l.as_ref()).unwrap()
    }

    fn excitations(&self, samples: usize, seed: u64) -> Excitations {
        let mut rng = rng(seed);
        let waves = Excitation::SquareWaves(SquareWaves { amplitude: 0.5, hold_min: 5, hold_max: 40 });
        let alpha = waves.generate(samples, self.plant.inputs(), self.plant.time(), &mut rng).unwrap();
        Excitations { alpha, noise: Scale(0.3) * normal(&mut rng, samples, self.plant.outputs()) }
    }

    /// The loop with a controller in two phases: `command(alpha)` gives u, `observe(y, alpha, u)` gives beta.
    fn run<C>(
        &self,
        excitations: Excitations,
        controller: &mut C,
        command: impl Fn(&mut C, &[f64]) -> Vec<f64>,
        limit: f64,
        observe: impl Fn(&mut C, &[f64], &[f64], &[f64]) -> Vec<f64>,
    ) -> Log {
        let Excitations { alpha, noise } = excitations;
        let simulator = Simulator::new(&self.plant);
        let mut plant = simulator.start(&vec![0.0; self.plant.order()]).unwrap();
        let zeros = |columns: usize| Mat::zeros(alpha.nrows(), columns);
        let (mut u, mut y, mut beta) = (zeros(alpha.ncols()), zeros(noise.ncols()), zeros(noise.ncols()));
        for k in 0..alpha.nrows() {
            let a: Vec<f64> = alpha.row(k).iter().copied().collect();
            let applied: Vec<f64> = command(controller, &a).iter().map(|u| u.clamp(-limit, limit)).collect();
            let output = simulator.step(&mut plant, &applied);
            let measured: Vec<f64> = output.iter().zip(noise.row(k).iter()).map(|(y, n)| y + n).collect();
            let residual = observe(controller, &measured, &a, &applied);
            for (record, values) in [(&mut u, &applied), (&mut y, &measured), (&mut beta, &residual)] {
                for (j, value) in values.iter().enumerate() {
                    record[(k, j)] = *value;
                }
            }
        }
        Log { u, y, alpha, beta }
    }

    /// With `J_K` of the library as the controller.
    fn with_j_k(&self, excitations: Excitations) -> Log {
        let p = self.plant.outputs();
        let m = self.plant.inputs();
        let j_k = self.factors().j_k().unwrap();
        let simulator = Simulator::new(j_k.system());
        let mut state = simulator.start(&vec![0.0; j_k.system().order()]).unwrap();
        self.run(
            excitations,
            &mut state,
            |state, alpha| simulator.output(state, &[&vec![0.0; p], alpha].concat())[..m].to_vec(),
            f64::INFINITY,
            |state, y, alpha, _| simulator.step(state, &[y, alpha].concat())[m..].to_vec(),
        )
    }

    /// With the controller of `youla-rt` in `f64` or `f32`.
    fn with_real_time<T: Real, const N: usize, const M: usize, const P: usize>(
        &self,
        excitations: Excitations,
        limit: f64,
        controller: &Controller<T, N, M, P>,
        from: fn(f64) -> T,
        to: fn(T) -> f64,
    ) -> Log {
        self.run(
            excitations,
            &mut State::at_rest(),
            |state, alpha| controller.command(state, &array(alpha, from)).map(to).to_vec(),
            limit,
            |state, y, _, u| controller.observe(state, &array(y, from), &array(u, from)).map(to).to_vec(),
        )
    }
}

fn array<T: Real, const K: usize>(values: &[f64], from: fn(f64) -> T) -> [T; K] {
    std::array::from_fn(|i| from(values[i]))
}

fn double(x: f64) -> f64 {
    x
}

fn distance(x: MatRef<'_, f64>, reference: MatRef<'_, f64>) -> f64 {
    (x - reference).norm_max() / reference.norm_max()
}

fn same(log: &Log, reference: &Log, tolerance: f64) {
    for (name, x, y) in [("u", &log.u, &reference.u), ("y", &log.y, &reference.y), ("beta", &log.beta, &reference.beta)]
    {
        let error = distance(x.as_ref(), y.as_ref());
        println!("{name}: {error:.1e}");
        assert!(error <= tolerance, "{name} misses by {error:.1e}");
    }
}

#[test]
fn bearing_agrees_with_j_k_over_a_million_samples() {
    let bearing = Loop::bearing();
    let controller = bearing.controller::<6, 2, 2>();
    let reference = bearing.with_j_k(bearing.excitations(SAMPLES, 1));
    let log = bearing.with_real_time(bearing.excitations(SAMPLES, 1), f64::INFINITY, &controller, double, double);
    same(&log, &reference, EXACT);
    let single = controller.to_f32().unwrap();
    let log = bearing.with_real_time(bearing.excitations(SAMPLES, 1), f64::INFINITY, &single, |x| x as f32, f64::from);
    same(&log, &reference, SINGLE);
}

#[test]
fn plant_with_feedthrough_agrees_with_j_k() {
    let l = Loop::with_feedthrough();
    let reference = l.with_j_k(l.excitations(20_000, 2));
    let log = l.with_real_time(l.excitations(20_000, 2), f64::INFINITY, &l.controller::<5, 2, 3>(), double, double);
    same(&log, &reference, EXACT);
}

/// Under saturation beta is that of the input as applied, and alpha is lessened by what saturation took.
fn saturation<const N: usize, const M: usize, const P: usize>(l: &Loop, limit: f64) {
    let controller = l.controller::<N, M, P>();
    let log = l.with_real_time(l.excitations(20_000, 4), limit, &controller, double, double);
    let saturated = (0..20_000).filter(|k| log.u.row(*k).norm_max() == limit).count();
    assert!((1000..19_000).contains(&saturated), "{saturated} samples are saturated");
    let signals = l.factors().signals(log.u.as_ref(), log.y.as_ref()).unwrap();
    let error = distance(log.beta.as_ref(), signals.beta());
    println!("beta: {error:.1e}, {saturated} of 20000 samples saturated");
    assert!(error <= EXACT, "beta misses by {error:.1e}");
    assert!(distance(log.alpha.as_ref(), signals.alpha()) > 0.1);

    // An observer that believes in its own command has another beta.
    let mut state = State::at_rest();
    let mut deaf = log.beta.clone();
    for k in 0..20_000 {
        let row = |record: &Mat<f64>| record.row(k).iter().copied().collect::<Vec<f64>>();
        let output = controller.step(&mut state, &array(&row(&log.y), double), &array(&row(&log.alpha), double));
        output.beta.iter().enumerate().for_each(|(j, value)| deaf[(k, j)] = *value);
    }
    let error = distance(deaf.as_ref(), signals.beta());
    assert!(error > 0.01, "without the applied input beta misses by {error:.1e} only");
}

#[test]
fn saturated_bearing_keeps_its_residual() {
    saturation::<6, 2, 2>(&Loop::bearing(), 0.5);
}

#[test]
fn saturated_plant_with_feedthrough_keeps_its_residual() {
    saturation::<5, 2, 3>(&Loop::with_feedthrough(), 0.5);
}

#[test]
fn sizes_and_values_are_checked() {
    let Loop { nominal, mut f, l, .. } = Loop::bearing();
    let shape = real_time_controller::<4, 2, 2>(&nominal, f.as_ref(), l.as_ref());
    assert!(matches!(shape, Err(Error::Shape { expected: (4, 4), found: (6, 6), .. })));
    let shape = real_time_controller::<6, 1, 2>(&nominal, f.as_ref(), l.as_ref());
    assert!(matches!(shape, Err(Error::Shape { expected: (6, 1), found: (6, 2), .. })));
    let shape = real_time_controller::<6, 2, 2>(&nominal, eye(2).as_ref(), l.as_ref());
    assert!(matches!(shape, Err(Error::Shape { expected: (2, 6), found: (2, 2), .. })));
    f[(1, 4)] = f64::NAN;
    let value = real_time_controller::<6, 2, 2>(&nominal, f.as_ref(), l.as_ref());
    assert!(matches!(value, Err(Error::NotFinite { row: 2, column: 5, .. })));
}
