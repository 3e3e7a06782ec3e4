//! Several starts, and continuation behind an observer.

use super::{OpenLoop, open_loop, time, truth};
use crate::{
    BearingStructure, ContinuationOptions, GreyBoxOptions, Matrix, MultiStart, MultiStartOptions, Slope, Stop,
    Structure, greybox, greybox_continued, greybox_multi_start,
};
use crate::{Error, Result};
use youla::Mat;
use youla::identify::subspace::InitialState;
use youla::linalg::eye;
use youla::lti::{Continuous, StateSpace, simulate};
use youla_paper::rig::Bearing;

fn pem() -> GreyBoxOptions {
    GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() }
}

/// The bearing with a twentieth of its damping, 0.2 um of noise.
fn lightly_damped(samples: usize) -> (OpenLoop, Vec<f64>) {
    let mut bearing = Bearing::default();
    bearing.damping = bearing.damping.map(|row| row.map(|v| v / 20.0));
    let mut log = open_loop(samples, [0.0; 2], &[0.0; 6], 5);
    let plant = bearing.plant().unwrap().zoh(time()).unwrap();
    let noise = open_loop(samples, [0.2; 2], &[0.0; 6], 5).y - &log.y;
    log.y = simulate(&plant, log.u.as_ref(), &[0.0; 6]).unwrap() + noise;
    (log, BearingStructure::parameters(&bearing))
}

#[test]
fn several_starts_do_not_depend_on_the_number_of_threads() {
    let log = open_loop(600, [0.2; 2], &[0.0; 6], 3);
    let start: Vec<f64> = truth().iter().map(|v| 0.25 * v).collect();
    let options = MultiStartOptions { starts: 9, searched: Some(5), pem: pem(), ..Default::default() };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| greybox_multi_start(&BearingStructure, &start, &[log.experiment()], time(), &options)).unwrap()
    };
    let bits = |found: &MultiStart| {
        let costs = found.runs.iter().map(|r| r.cost_at_start.to_bits()).collect::<Vec<_>>();
        let ends =
            found.runs.iter().map(|r| r.end.as_ref()?.as_ref().ok().map(|e| e.cost.to_bits())).collect::<Vec<_>>();
        (found.won, found.model.parameters.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), costs, ends)
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(bits(&one), bits(&three));
    assert_eq!(one.runs[0].start, start);
    // The five searched ones are those with the lowest criterion, and the winner is the lowest of them.
    let highest = one.runs.iter().filter(|r| r.end.is_some()).map(|r| r.cost_at_start).fold(0.0, f64::max);
    assert!(one.runs.iter().filter(|r| r.end.is_none()).all(|r| r.cost_at_start >= highest));
    let end = |run: &crate::StartRun| run.end.as_ref().unwrap().as_ref().unwrap().cost;
    assert!(one.runs.iter().filter(|r| r.end.is_some()).all(|r| end(r) >= one.model.cost));
    assert_eq!(end(&one.runs[one.won]), one.model.cost);
}

#[test]
fn continuation_arrives_where_a_single_search_is_lost() {
    let (log, truth) = lightly_damped(3000);
    let start: Vec<f64> = truth.iter().map(|v| 0.5 * v).collect();
    let oracle = greybox(&BearingStructure, &truth, &[log.experiment()], time(), &pem()).unwrap();
    let single = greybox(&BearingStructure, &start, &[log.experiment()], time(), &pem()).unwrap();
    assert!(single.cost > 10.0 * oracle.cost, "single {} of {}", single.cost, oracle.cost);
    let options = ContinuationOptions { pem: pem(), ..Default::default() };
    let found = greybox_continued(&BearingStructure, &start, &[log.experiment()], time(), &options).unwrap();
    assert!((found.model.cost / oracle.cost - 1.0).abs() < 1e-6, "{} of {}", found.model.cost, oracle.cost);
    assert!(matches!(found.model.stop, Stop::Converged) && found.model.covariance.is_some());
    let rho: Vec<f64> = found.stages.iter().map(|stage| stage.noise).collect();
    assert!((rho[0] - 3.0).abs() < 1e-12 && (rho[6] - 0.003).abs() < 1e-12 && rho.len() == 7, "{rho:?}");
    // What the observer leaves to explain grows as it goes.
    let costs: Vec<f64> = found.stages.iter().map(|stage| stage.end.as_ref().unwrap().cost).collect();
    assert!(found.stages.iter().all(|stage| stage.end.is_ok()) && costs[6] < found.model.cost * 1.01, "{costs:?}");
}

/// `x1' = x2, x2' = -k x1 - d x2 + u, y = gain x1 + through u`: parameters in C and D too.
struct Sensor;

impl Structure for Sensor {
    fn names(&self) -> Vec<String> {
        ["k", "d", "gain", "through"].map(String::from).into()
    }
    fn model(&self, t: &[f64]) -> Result<StateSpace<Continuous>> {
        let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [-t[0], -t[1]]][i][j]);
        let c = Mat::from_fn(1, 2, |_, j| [t[2], 0.0][j]);
        let b = eye(2).subcols(1, 1).to_owned();
        StateSpace::new(a, b, c, Mat::from_fn(1, 1, |_, _| t[3]), Continuous)
    }
    fn slopes(&self, _: &[f64], parameter: usize) -> Vec<Slope> {
        let (matrix, row, column, value) =
            [(Matrix::A, 1, 0, -1.0), (Matrix::A, 1, 1, -1.0), (Matrix::C, 0, 0, 1.0), (Matrix::D, 0, 0, 1.0)]
                [parameter];
        vec![Slope { matrix, row, column, value }]
    }
}

#[test]
fn parameters_of_the_sensor_and_of_the_direct_path_pass_the_observer() {
    let truth = [4e5, 20.0, 3e5, 0.4];
    let log = open_loop(1500, [0.0; 2], &[0.0; 6], 8);
    let u = log.u.subcols(0, 1).to_owned();
    let plant = Sensor.model(&truth).unwrap().zoh(time()).unwrap();
    let y = simulate(&plant, u.as_ref(), &[0.0; 2]).unwrap();
    let experiment = [youla::identify::subspace::Experiment { u: u.as_ref(), y: y.as_ref() }];
    let start = [1.2e5, 60.0, 2e5, 0.1];
    let options = ContinuationOptions { pem: pem(), ..Default::default() };
    let single = greybox(&Sensor, &start, &experiment, time(), &pem()).unwrap();
    let found = greybox_continued(&Sensor, &start, &experiment, time(), &options).unwrap();
    assert!(single.fit[0] < 60.0, "{:?}", single.fit);
    for (found, truth) in found.model.parameters.iter().zip(truth) {
        assert!((found / truth - 1.0).abs() < 1e-6, "{found} for {truth}");
    }
}

#[test]
fn options_without_meaning_are_refused() {
    let log = open_loop(300, [0.2; 2], &[0.0; 6], 3);
    let (theta, records) = (truth(), [log.experiment()]);
    let several =
        |options: MultiStartOptions| greybox_multi_start(&BearingStructure, &theta, &records, time(), &options);
    for bad in [
        MultiStartOptions { starts: 0, ..Default::default() },
        MultiStartOptions { searched: Some(0), ..Default::default() },
        MultiStartOptions { factor: 0.5, ..Default::default() },
        MultiStartOptions { factor: f64::NAN, ..Default::default() },
    ] {
        assert!(matches!(several(bad.clone()), Err(Error::Method(youla::Error::OutOfRange { .. }))), "{bad:?}");
    }
    let short = greybox_multi_start(&BearingStructure, &theta[1..], &records, time(), &MultiStartOptions::default());
    assert!(matches!(short, Err(Error::Method(youla::Error::Shape { .. }))));
    for (first, last) in [(0.0, 0.01), (10.0, f64::INFINITY)] {
        let options = ContinuationOptions { first, last, ..Default::default() };
        let refused = greybox_continued(&BearingStructure, &theta, &records, time(), &options);
        assert!(matches!(refused, Err(Error::Method(youla::Error::OutOfRange { .. }))));
    }
}
