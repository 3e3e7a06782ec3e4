//! Tests.

use crate::running::LoopDescription;
use std::path::Path;
use youla::control::{LqrWeights, NoiseCovariance, kalman, lqr};
use youla::linalg::eye;
use youla::lti::Discrete;
use youla::{Mat, MatRef};
use youla_paper::rig::{RigParameters, bearing_at_speed, degraded};
use youla_run::{ControllerSettings, Domain, Feedback, NominalModel};

fn rows(m: MatRef<'_, f64>) -> Vec<Vec<f64>> {
    (0..m.nrows()).map(|i| m.row(i).iter().copied().collect()).collect()
}

/// LQG on 0.9 A of the bearing at rest.
fn designed(cross_coupling: f64, input_weight: f64) -> LoopDescription {
    let mut parameters = RigParameters::shipped();
    parameters.rotation.cross_coupling.value = cross_coupling;
    let time = Discrete::new(2e-4).unwrap();
    let still = bearing_at_speed(&parameters, 0.0).unwrap();
    let nominal = degraded(&still.plant().unwrap(), 0.9, 1.0).unwrap().zoh(time).unwrap().balanced().unwrap();
    let r = Mat::from_fn(2, 2, |i, j| if i == j { input_weight } else { 0.0 });
    let f = lqr(&nominal, &LqrWeights::on_outputs(&nominal, eye(2).as_ref(), r.as_ref()).unwrap()).unwrap().f;
    let q = Mat::from_fn(2, 2, |i, j| if i == j { 0.25 } else { 0.0 });
    let l = kalman(&nominal, &NoiseCovariance::at_inputs(&nominal, q.as_ref(), eye(2).as_ref()).unwrap()).unwrap().l;
    LoopDescription {
        nominal: NominalModel::StateSpace {
            domain: Domain::Discrete,
            a: rows(nominal.a()),
            b: rows(nominal.b()),
            c: rows(nominal.c()),
            d: None,
        },
        controller: ControllerSettings::Observer {
            feedback: Feedback::Positive,
            state_feedback: rows(f.as_ref()),
            observer_gain: rows(l.as_ref()),
        },
    }
}

/// The files of the example: the weak controller, and the one for the unstable setting.
#[test]
#[ignore = "writes the files of examples/commission"]
fn example_files() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/commission");
    std::fs::create_dir_all(&folder).unwrap();
    for (name, cross_coupling, weight) in [("weak.toml", 0.0, 1000.0), ("coupled.toml", 0.25, 10.0)] {
        let text = toml::to_string(&designed(cross_coupling, weight)).unwrap();
        std::fs::write(folder.join(name), text).unwrap();
    }
}

struct Yes;

impl crate::Operator for Yes {
    fn confirms(&mut self, _text: &str) -> bool {
        true
    }
    fn notes(&mut self, _text: &str) {}
}

#[test]
#[ignore = "measurement"]
fn seeds() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/commission");
    let base = std::env::temp_dir().join(format!("youla-seeds-{}", std::process::id()));
    std::fs::create_dir_all(&base).unwrap();
    for name in ["weak.toml", "coupled.toml"] {
        std::fs::copy(folder.join(name), base.join(name)).unwrap();
    }
    let campaign = crate::Campaign::read(&folder.join("campaign.toml")).unwrap();
    let last: u64 = std::env::var("SEEDS").map_or(3, |s| s.parse().unwrap());
    for seed in 1..=last {
        for point in &campaign.points {
            let one = crate::Campaign { seed, image: std::env::var_os("HOST").map_or_else(|| Some(folder.join(campaign.image.clone().unwrap())), |_| None), points: vec![point.clone()], ..campaign.clone() };
            let file = base.join("campaign.toml");
            std::fs::write(&file, toml::to_string(&one).unwrap()).unwrap();
            let out = base.join(format!("{seed}-{}", point.name));
            let summary = crate::commission(&file, &out, &mut Yes).unwrap();
            let p = &summary.points[0];
            println!("LINE {seed} {} {} {:?} {:.1}s a {:.3} before {:?} pred {:?} {:?} reached {:?} {:?} {}", summary.controller, p.name, p.status, p.seconds, p.amplitude,
                p.before.map(|x| x.damping), p.predicted.map(|x| x.damping), p.predicted.map(|x| x.bounds), p.reached.map(|x| x.damping), p.reason, p.unstable_switches);
        }
    }
    std::fs::remove_dir_all(&base).unwrap();
}
