//! Known disturbances of the outputs: exact without noise, the same by Gram and QR, for constant and changing speed.

use super::*;
use crate::lti::Discrete;

const WEIGHTS: [SubspaceMethod; 5] = [
    SubspaceMethod::Moesp,
    SubspaceMethod::N4sid,
    SubspaceMethod::Cva,
    SubspaceMethod::PbsidOpt,
    SubspaceMethod::Ssarx,
];

/// Two experiments with lines of 0.031 and 0.062 per sample, each with amplitudes of its own; `noise` on the outputs.
struct Disturbed {
    u: Vec<Mat<f64>>,
    y: Vec<Mat<f64>>,
    w: Vec<Mat<f64>>,
    coefficients: Vec<Mat<f64>>,
}

impl Disturbed {
    fn new(system: &StateSpace<Discrete>, w: impl Fn(usize) -> Mat<f64>, size: f64, noise: f64) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(7);
        let mut all = Disturbed { u: vec![], y: vec![], w: vec![], coefficients: vec![] };
        for samples in [1200, 500] {
            let u = uniform(samples, system.inputs(), rng);
            let (w, a) = (w(samples), size * uniform(4, system.outputs(), rng));
            let y = respond(system, &u, 0.4, None) + &w * &a + noise * uniform(samples, system.outputs(), rng);
            all.u.push(u);
            all.y.push(y);
            all.w.push(w);
            all.coefficients.push(a);
        }
        all
    }

    fn identify(&self, options: &SubspaceOptions) -> SubspaceModel {
        let experiments = [0, 1].map(|k| one(&self.u[k], &self.y[k])[0].with_disturbance(self.w[k].as_ref()));
        subspace(&experiments, clock(), options).unwrap()
    }
}

fn two_lines(samples: usize) -> Mat<f64> {
    lines(&[0.031, 0.062], samples, clock()).unwrap()
}

/// Speed and its double, the speed swinging by 20 %.
fn changing(samples: usize) -> Mat<f64> {
    let speed: Vec<f64> = (0..samples).map(|k| 0.031 * (1.0 + 0.2 * (k as f64 / 90.0).sin())).collect();
    harmonics(&speed, &[1, 2], clock()).unwrap()
}

#[test]
fn lines_are_taken_out_exactly() {
    let system = random_system(&[0.95, 0.8], 2, 2, true, 3);
    let data = Disturbed::new(&system, two_lines, 30.0, 0.0);
    for method in WEIGHTS {
        let found = data.identify(&SubspaceOptions { method, horizon: 7, past: Some(8), ..fixed(4, 7) });
        let error = distance(&found.model, &system);
        assert!(error < 1e-7, "{method:?}: {error:.1e}");
        for (one, other) in found.disturbances.iter().zip(&data.coefficients) {
            assert!((one - other).norm_max() < 1e-6, "{method:?}: {:.1e}", (one - other).norm_max());
        }
        assert!(found.fit.percent.iter().all(|fit| *fit > 99.9999), "{method:?}: {:?}", found.fit.percent);
        assert_eq!(found.columns, 1200 + 500 - 2 * 14 - 8);
    }
    // Without them four states go to the lines.
    let experiments: Vec<_> =
        data.u.iter().zip(&data.y).map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref())).collect();
    let options = SubspaceOptions { stability: Stability::Allow, ..fixed(4, 7) };
    let eaten = subspace(&experiments, clock(), &options).unwrap();
    let on_circle = eaten.poles().iter().filter(|z| (z.norm() - 1.0).abs() < 1e-3).count();
    assert!(on_circle >= 3, "{:?}", eaten.poles());
}

#[test]
fn unstable_systems_have_their_lines_found_by_prediction() {
    let system = random_system(&[1.01, 0.8], 1, 2, false, 4);
    let u = uniform(400, 1, &mut ChaCha8Rng::seed_from_u64(8));
    let w = changing(400);
    let a = uniform(4, 2, &mut ChaCha8Rng::seed_from_u64(9));
    let y = respond(&system, &u, 0.1, None) + &w * &a;
    for method in [SubspaceMethod::Moesp, SubspaceMethod::PbsidOpt] {
        let options = SubspaceOptions { method, stability: Stability::Allow, horizon: 7, past: Some(8), ..fixed(4, 7) };
        let found = subspace(&[one(&u, &y)[0].with_disturbance(w.as_ref())], clock(), &options).unwrap();
        assert_ne!(found.fit.by, InputFit::Simulation);
        assert!(distance(&found.model, &system) < 1e-5, "{method:?}: {:.1e}", distance(&found.model, &system));
        assert!((&found.disturbances[0] - &a).norm_max() < 1e-4);
    }
}

#[test]
fn gram_and_qr_agree_on_noisy_records_with_lines() {
    let system = random_system(&[0.95, 0.8], 2, 2, false, 5);
    // What is left of a changing speed is 1e-5 of its amplitude, by the choice of its span.
    for (w, leftover) in [(two_lines as fn(usize) -> Mat<f64>, 1e-6), (changing, 1e-4)] {
        let data = Disturbed::new(&system, w, 20.0, 0.1);
        let clean = Disturbed::new(&system, w, 0.0, 0.1);
        let with = |factorisation| SubspaceOptions { factorisation, feedthrough: Feedthrough::None, ..fixed(4, 7) };
        let [gram, qr] = [Factorisation::Gram, Factorisation::Qr].map(|by| data.identify(&with(by)));
        assert!(distance(&gram.model, &qr.model) < 1e-9, "{:.1e}", distance(&gram.model, &qr.model));
        assert_eq!(gram.columns, qr.columns);
        // The same as with lines of size zero: they leave nothing behind.
        let beside = distance(&clean.identify(&with(Factorisation::Qr)).model, &qr.model);
        assert!(beside < leftover, "{beside:.1e}");
        assert!(distance(&qr.model, &system) < 0.05, "{:.1e}", distance(&qr.model, &system));
    }
}

#[test]
fn amplitude_and_phase_of_a_line() {
    let w = lines(&[0.05], 300, clock()).unwrap();
    let y = Mat::from_fn(300, 1, |k, _| 2.0 * (std::f64::consts::TAU * 0.05 * k as f64 - 0.7).cos());
    let a = crate::linalg::least_squares("a line", w.as_ref(), y.as_ref()).unwrap().x;
    let line = amplitudes(a.as_ref())[0][0];
    assert!((line.amplitude - 2.0).abs() < 1e-12 && (line.phase - 0.7).abs() < 1e-12);
    assert!(lines(&[0.6], 300, clock()).is_err() && harmonics(&[0.2; 5], &[1, 3], clock()).is_err());
}

#[test]
fn unfit_disturbances_are_refused() {
    let system = random_system(&[0.9], 1, 1, false, 6);
    let data = Disturbed::new(&system, two_lines, 1.0, 0.1);
    let experiments = [0, 1].map(|k| one(&data.u[k], &data.y[k])[0]);
    let refused = |experiments: &[Experiment<'_>]| {
        subspace(experiments, clock(), &fixed(2, 5)).err().map(|e| e.to_string()).unwrap()
    };
    let short = refused(&[experiments[0].with_disturbance(data.w[1].as_ref())]);
    assert!(short.contains("the known disturbance of experiment 1"), "{short}");
    let one_only = refused(&[experiments[0].with_disturbance(data.w[0].as_ref()), experiments[1]]);
    assert!(one_only.contains("the known disturbance of experiment 2"), "{one_only}");
}
