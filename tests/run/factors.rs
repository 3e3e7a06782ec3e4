//! The factors of the demonstration's loop.

use std::path::Path;
use youla_run::{ControllerSettings, Feedback, RunSettings, declared_loop, factorise_run};
use youla_twin::{DemoMachine, demo};

/// Angular frequencies, logarithmic over four decades below Nyquist.
fn grid_to_nyquist(ts: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| std::f64::consts::PI / ts * 10f64.powf(-4.0 + 4.0 * k as f64 / count as f64)).collect()
}

/// States that span 1e6 (um, um/s, V) cost no digits of (15), because they are scaled first.
#[test]
fn states_are_scaled_before_factorising() {
    let demo = demo(DemoMachine::Bearing, 1).unwrap();
    let found = factorise_run(&demo.settings, &demo.records, Path::new(".")).unwrap();
    assert!(found.bezout_residual < 1e-13, "{:.1e}", found.bezout_residual);
    let declared = declared_loop(&demo.settings, &demo.records, Path::new(".")).unwrap();
    assert!(Some(found.factors.nominal()) != declared.nominal.as_ref());
}

/// One controller written down in three ways gives the same loop: observer gains, and its matrices with either sign.
#[test]
fn forms_and_signs_of_one_controller_agree() {
    let demo = demo(DemoMachine::Bearing, 1).unwrap();
    let observer = factorise_run(&demo.settings, &demo.records, Path::new(".")).unwrap();
    let k = &observer.factors.controller().unwrap();
    let rows = |m: youla::MatRef<'_, f64>, sign: f64| -> Vec<Vec<f64>> {
        (0..m.nrows()).map(|i| m.row(i).iter().map(|x| sign * x).collect()).collect()
    };
    for (feedback, sign) in [(Feedback::Positive, 1.0), (Feedback::Negative, -1.0)] {
        let controller = ControllerSettings::StateSpace {
            feedback,
            domain: None,
            hold: None,
            a: rows(k.a(), 1.0),
            b: rows(k.b(), 1.0),
            c: rows(k.c(), sign),
            d: rows(k.d(), sign),
            delay: 0,
        };
        let settings = RunSettings { controller, ..demo.settings.clone() };
        let found = factorise_run(&settings, &demo.records, Path::new(".")).unwrap();
        assert!(found.bezout_residual < 1e-12, "{feedback:?}: {:.1e}", found.bezout_residual);
        let omega = grid_to_nyquist(k.time().ts(), 50);
        let [x, y] =
            [k, &found.factors.controller().unwrap()].map(|k| youla::lti::frequency_response(k, &omega).unwrap());
        let miss = (0..50).map(|i| (x.at(i) - y.at(i)).norm_l2() / x.at(i).norm_l2()).fold(0.0, f64::max);
        assert!(miss < 1e-9, "{feedback:?}: {miss:.1e}");
    }
}
