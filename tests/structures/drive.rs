//! A physical structure of a measured machine: the flexible drive with two inertias, estimated in its loop, against the scheme that
//! knows nothing of its physics. The data are not part of this project.

use crate::common::data;
use std::path::Path;
use youla::lti::Mode;
use youla::lti::modes::mode;
use youla_greybox::ModeBand;
use youla_run::{Identification, Method, RunSettings, StageClock, identify, read_records};

fn run() -> Identification {
    data("flexible_drive");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/flexible-drive/two-inertia.toml");
    let (settings, folder) = (RunSettings::read(&path).unwrap(), path.parent().unwrap());
    let records = read_records(&settings.data, folder).unwrap();
    identify(settings, records, folder, &mut StageClock::new(&mut |_| ())).unwrap()
}

/// Whether a mode is lightly damped and within a range of frequencies, Hz.
fn between(mode: &Mode, from: f64, to: f64) -> bool {
    (from..to).contains(&mode.hz) && mode.zeta.abs() < 0.2
}

/// Resonance and anti-resonance lie within 53 to 56.5 Hz and 39 to 43 Hz, where the indirect frequency response has them. With 7
/// parameters the structure predicts fresh records within 2 points of G(S) of order 10, 20 above the rigid body, and has its
/// resonance within 1 % and its anti-resonance within 4 % of those of G(S). It is not the plant: its residuals are coloured and depend on past inputs, and the run says so (stick-slip friction, docs/grey-box.md).
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
    let plant = &found.scheme().unwrap().plant;
    let zeros: Vec<Mode> = plant.zeros().unwrap().into_iter().map(|z| mode(plant.time(), z)).collect();
    for (what, of_structure, of_plant, from, to, tolerance) in [
        ("resonance", known.modes().unwrap(), plant.modes().unwrap(), 53.0, 56.5, 0.01),
        ("anti-resonance", known.zeros().unwrap(), zeros, 39.0, 43.0, 0.04),
    ] {
        let one: ModeBand = *of_structure.iter().find(|b| between(&b.mode, from, to)).unwrap();
        let other = *of_plant.iter().find(|m| between(m, from, to)).unwrap();
        println!("{what}: {:.2} Hz {:.2?}, of G(S) {:.2} Hz", one.mode.hz, one.hz, other.hz);
        assert!(one.hz[0] > from && one.hz[1] < to, "{what}: {one:?}");
        assert!((one.mode.hz / other.hz - 1.0).abs() < tolerance, "{what}: {one:?}, G(S) {other:?}");
        assert!(one.hz_deviation > 0.0 && one.hz_deviation < 0.01 * one.mode.hz, "{one:?}");
    }
    let fits =
        |method: Method| found.validation.of(method).unwrap().records.iter().map(|r| r.fit[0]).collect::<Vec<_>>();
    let (structure, scheme, rigid) = (fits(Method::GreyBox), fits(Method::Hansen), fits(Method::Nominal));
    println!("fits {structure:.1?}, G(S) {scheme:.1?}, nominal {rigid:.1?}");
    for ((structure, scheme), rigid) in structure.iter().zip(scheme).zip(rigid) {
        assert!(*structure > scheme - 2.0 && *structure > rigid + 20.0, "{structure}, G(S) {scheme}, nominal {rigid}");
    }
    assert!(found.validation.of(Method::GreyBox).unwrap().certificate.stable);
    assert!(known.coloured && !known.residuals.independent() && known.colour[0] > 2.0, "{:?}", known.colour);
    let [with_lag, without] = &grey.compared[..] else { panic!("{:?}", grey.compared) };
    assert!(with_lag.bic == Some(0.0) && without.bic.unwrap() > 1000.0, "{:?}", grey.compared);
}
