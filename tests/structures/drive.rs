//! A physical structure of a measured machine: the flexible drive with two inertias, estimated in its loop, against the scheme that
//! knows nothing of its physics. The data are not part of this project.

use crate::common::data;
use std::path::Path;
use youla::identify::subspace::{ModeBand, Uncertainty};
use youla_run::{Identification, Method, RunSettings, StageClock, identify, read_records};

fn run() -> Identification {
    data("flexible_drive");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/flexible-drive/two-inertia.toml");
    let (settings, folder) = (RunSettings::read(&path).unwrap(), path.parent().unwrap());
    let records = read_records(&settings.data, folder).unwrap();
    identify(settings, records, folder, &mut StageClock::new(&mut |_| ())).unwrap()
}

/// The lightly damped one within a range of frequencies, Hz.
fn between(all: &[ModeBand], from: f64, to: f64) -> ModeBand {
    *all.iter().find(|b| (from..to).contains(&b.mode.hz) && b.mode.zeta.abs() < 0.2).unwrap()
}

/// Resonance and anti-resonance lie within 53 to 56.5 Hz and 39 to 43 Hz, where the indirect frequency response has them. With 7
/// parameters the structure predicts fresh records within 2 points of G(S) of order 10, 20 above the rigid body, and has its
/// resonance within 1 % and its anti-resonance within 4 % of those of G(S). It is not the plant: it lies outside of the intervals of
/// G(S), its residuals are coloured and depend on past inputs, and the run says so (stick-slip friction, docs/grey-box.md).
#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn two_inertias_of_the_flexible_drive() {
    let found = run();
    let grey = found.grey_box.as_ref().unwrap().as_ref().unwrap();
    let known = grey.intervals.as_ref().unwrap();
    for p in &known.parameters {
        println!("{} {:.5} +- {:.2e}", p.name, p.value, p.deviation);
    }
    println!("{}", known.verdict());
    let Some(Uncertainty::Delta(plant)) = &found.scheme().unwrap().hansen.uncertainty else {
        panic!("no uncertainty of G(S)")
    };
    for (what, of_structure, of_plant, from, to, tolerance) in [
        ("resonance", known.modes().unwrap(), plant.modes().unwrap(), 53.0, 56.5, 0.01),
        ("anti-resonance", known.zeros().unwrap(), plant.zeros().unwrap(), 39.0, 43.0, 0.04),
    ] {
        let (one, other) = (between(&of_structure, from, to), between(&of_plant, from, to));
        println!("{what}: {:.2} Hz {:.2?}, of G(S) {:.2} Hz {:.2?}", one.mode.hz, one.hz, other.mode.hz, other.hz);
        assert!(one.hz[0] > from && one.hz[1] < to, "{what}: {one:?}");
        assert!((one.mode.hz / other.mode.hz - 1.0).abs() < tolerance, "{what}: {one:?}, G(S) {other:?}");
        assert!(one.hz_deviation > 0.0 && one.hz_deviation < 0.01 * one.mode.hz, "{one:?}");
    }
    let fits = |method: Method| found.verdict.of(method).unwrap().records.iter().map(|r| r.fit[0]).collect::<Vec<_>>();
    let (structure, scheme, rigid) = (fits(Method::GreyBox), fits(Method::Hansen), fits(Method::Nominal));
    println!("fits {structure:.1?}, G(S) {scheme:.1?}, nominal {rigid:.1?}");
    for ((structure, scheme), rigid) in structure.iter().zip(scheme).zip(rigid) {
        assert!(*structure > scheme - 2.0 && *structure > rigid + 20.0, "{structure}, G(S) {scheme}, nominal {rigid}");
    }
    assert!(found.verdict.of(Method::GreyBox).unwrap().certificate.stable);
    assert!(known.coloured && !known.residuals.independent() && known.colour[0] > 2.0, "{:?}", known.colour);
    let [with_lag, without] = &grey.compared[..] else { panic!("{:?}", grey.compared) };
    assert!(with_lag.bic == Some(0.0) && without.bic.unwrap() > 1000.0, "{:?}", grey.compared);
}
