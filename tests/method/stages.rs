//! The whole chain on the simulated bearing: seeded statistics and independence of the number of threads.

use std::path::Path;
use youla_run::{Identification, Method, StageClock, identify};
use youla_twin::{DemoMachine, demo};

fn run_demo(seed: u64) -> Identification {
    let demo = demo(DemoMachine::Bearing, seed).unwrap();
    let mut silent = |_| ();
    identify(demo.settings, demo.records, Path::new("."), &mut StageClock::new(&mut silent)).unwrap()
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

/// `G(S)` from a nominal model with half of every entry of A comes within 3 points of the fit of the plant itself on the
/// same noisy verification record, on each of 20 seeds and both axes, the recommended model within half a point; the nominal model
/// is useless there.
#[test]
fn hansen_reaches_the_true_plant_on_20_seeds() {
    for seed in 1..=20 {
        let found = run_demo(seed);
        let fit = |method: Method| found.validation.of(method).unwrap().records[0].fit.clone();
        let (truth, hansen, reduced) = (fit(Method::TruePlant), fit(Method::Hansen), fit(Method::HansenReduced));
        let recommended = fit(Method::Likelihood);
        for axis in 0..2 {
            let (t, h, r) = (truth[axis], hansen[axis], reduced[axis]);
            assert!((t - h).abs() < 3.0, "seed {seed}, axis {axis}: G(S) {h:.2} against {t:.2}");
            assert!((t - recommended[axis]).abs() < 0.5, "seed {seed}, axis {axis}: {recommended:?} against {t:.2}");
            assert!((t - r).abs() < 3.0, "seed {seed}, axis {axis}: G_red(S) {r:.2} against {t:.2}");
            assert!(fit(Method::Nominal)[axis] < 10.0, "the nominal model must be poor for the test to mean anything");
        }
        let stability = &found.scheme().unwrap().deviation.stability;
        assert!(stability.stable && stability.moved.is_empty());
        assert!(found.validation.of(Method::Hansen).unwrap().certificate.stable);
        assert!(found.filtered.as_ref().unwrap().factorisation.bezout_residual < 1e-12);
        assert!(found.controller_mismatch().unwrap() < 1e-10, "alpha is what was injected");
    }
}

/// Both methods give the same bits on 1 and 2 threads.
#[test]
fn models_do_not_depend_on_the_number_of_threads() {
    let models = |threads: usize| {
        on_threads(threads, || {
            let found = run_demo(3);
            let direct = found.direct.unwrap().unwrap();
            let scheme = found.hansen.unwrap().unwrap();
            let models = (scheme.deviation.model, scheme.plant, direct.model, found.recommended.unwrap().plant);
            let reduced = found.reduction.unwrap().unwrap().found;
            (models, (reduced.reduction.model, reduced.sweep))
        })
    };
    assert_eq!(models(1), models(2));
}

/// The resonances of the identified bearing are those of eqs (9)-(12): 209.7 Hz and 217.6 Hz, damping 0.102 and 0.082.
#[test]
fn modes_of_the_bearing_are_found() {
    let found = run_demo(1);
    let truth = found.validation.of(Method::TruePlant).unwrap();
    for published in [(209.7, 0.102), (217.6, 0.082)] {
        let near = |hz: f64, zeta: f64| (hz / published.0 - 1.0).abs() < 1e-3 && (zeta - published.1).abs() < 1e-3;
        assert!(truth.modes.iter().any(|m| near(m.hz, m.zeta)), "{:?}", truth.modes);
    }
    let hansen = found.validation.of(Method::Hansen).unwrap();
    let resonant: Vec<_> = hansen.modes.iter().filter(|m| (200.0..230.0).contains(&m.hz) && m.zeta < 0.2).collect();
    assert_eq!(resonant.len(), 2, "{:?}", hansen.modes);
}

/// A declared structure in a run: from a nominal model with half of A and without any initial value in use, the projection of
/// G(S) and the prediction-error method reach the fit of the plant itself, and its 14 parameters within four deviations.
#[test]
fn a_declared_structure_is_estimated_from_the_scheme_on() {
    use youla_greybox::hansen_pem::PemStart;
    use youla_greybox::{Declaration, Template};
    use youla_run::GreyBoxSettings;
    use youla_twin::BearingStructure;
    let mut demo = demo(DemoMachine::Bearing, 2).unwrap();
    let structure = Declaration { template: Some(Template::Bearing), ..Default::default() };
    demo.settings.grey_box = Some(GreyBoxSettings { start_from_initial: false, ..GreyBoxSettings::new(structure) });
    let mut silent = |_| ();
    let found = identify(demo.settings, demo.records, Path::new("."), &mut StageClock::new(&mut silent)).unwrap();
    let run = found.grey_box.as_ref().unwrap().as_ref().unwrap();
    assert!(run.found.won == PemStart::Projection && !run.found.local_minimum_suspected);
    let fit = |method: Method| found.validation.of(method).unwrap().records[0].fit.clone();
    for (grey, truth) in fit(Method::GreyBox).iter().zip(fit(Method::TruePlant)) {
        assert!((grey - truth).abs() < 0.1, "{grey} against {truth}");
    }
    let truth = BearingStructure::parameters(&youla_twin::rig::Bearing::default());
    let deviations = run.found.model.standard_deviations().unwrap();
    for ((value, deviation), truth) in run.found.model.parameters.iter().zip(deviations).zip(truth) {
        assert!((value - truth).abs() < 4.0 * deviation, "{value} against {truth}, deviation {deviation}");
    }
    let folder = std::env::temp_dir().join(format!("youla-grey-box-{}", std::process::id()));
    let written = youla_run::write_run(&found, &folder, false, &mut StageClock::new(&mut |_| ()));
    std::fs::remove_dir_all(&folder).ok();
    written.unwrap();
}
