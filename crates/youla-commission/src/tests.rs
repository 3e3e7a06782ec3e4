//! The circle on the twin: on the host in every run, over seeds in QEMU on request.

mod changed_q;

use crate::bench::{Bench, RAMP};
use crate::parameter::parameter_of;
use crate::point::{Operator, Point, PointFiles};
use crate::{
    Campaign, CampaignSummary, DampingFigures, Error, OperatingPoint, PointRecord, PointStatus, QTable, commission,
};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use youla::control::{LqrWeights, NoiseCovariance, closed_loop, kalman, lqr, observer_controller, with_input_port};
use youla::linalg::eye;
use youla::lti::{Discrete, StateSpace, frequency_response};
use youla::{ErrorKind, Mat, MatRef};
use youla_io::export::ExportedController;
use youla_run::{ControllerSettings, Domain, Feedback, NominalModel};
use youla_twin::rig::{BearingRig, Fidelity, RigParameters, bearing_at_speed, degraded};
use youla_twin::{LockStep, LoopDescription, Q_STATES, RunningLoop, Target, TwinPlant, serve_loop};

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/commission")
}

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
    std::fs::create_dir_all(example()).unwrap();
    for (name, cross_coupling, weight) in [("weak.toml", 0.0, 1000.0), ("coupled.toml", 0.25, 10.0)] {
        let text = toml::to_string(&designed(cross_coupling, weight)).unwrap();
        std::fs::write(example().join(name), text).unwrap();
    }
}

/// A person who always gives the same answer, with what was said.
#[derive(Default)]
struct Person {
    agrees: bool,
    notes: Vec<String>,
}

impl Operator for Person {
    fn confirms(&mut self, _text: &str) -> bool {
        self.agrees
    }
    fn notes(&mut self, text: &str) {
        self.notes.push(text.into());
    }
}

/// A new folder with the loops of the example.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("youla-commission-test-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for name in ["weak.toml", "coupled.toml"] {
            std::fs::copy(example().join(name), folder.join(name)).unwrap();
        }
        Place(folder)
    }

    fn run(&self, campaign: &Campaign, out: &str, agrees: bool) -> (crate::Result<CampaignSummary>, Person) {
        let file = self.0.join("campaign.toml");
        std::fs::write(&file, toml::to_string(campaign).unwrap()).unwrap();
        let mut person = Person { agrees, ..Person::default() };
        (commission(&file, &self.0.join(out), &mut person), person)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// The first point of the example on the host, with a record of 3 s.
fn short() -> Campaign {
    let mut campaign = Campaign::read(&example().join("campaign.toml")).unwrap();
    campaign.limits.duration = 3.0;
    campaign.points.truncate(1);
    Campaign { image: None, ..campaign }
}

#[test]
fn a_campaign_that_was_stopped_goes_on_and_keeps_what_is_done() {
    let place = Place::new("circle");
    // Over the region of this record the shares of two modes pass the least that counts: the damping is that of one pole, followed.
    let campaign = Campaign { seed: 30, ..short() };
    let refused = place.run(&campaign, "out", false).0.unwrap();
    let point = &refused.points[0];
    assert_eq!((point.status, point.switches, refused.done), (PointStatus::Stopped, 0, false));
    assert_eq!(point.reason.as_deref(), Some("the switch was not confirmed"));
    assert!(refused.damping.predicted.is_some() && refused.damping.reached.is_none());

    let summary = place.run(&campaign, "out", true).0.unwrap();
    let DampingFigures { before, predicted, reached } = summary.damping;
    let (before, predicted, reached) = (before.unwrap(), predicted.unwrap(), reached.unwrap());
    assert!(summary.done && summary.unstable_switches == 0 && summary.controller == "host");
    // The truth is 0.0863, and 0.2075 with the new controller and without hysteresis.
    assert!((before / 0.0863 - 1.0).abs() < 0.05, "{before}");
    assert!(reached > 2.0 * before && reached > predicted[0] && reached < 0.22, "{before} {predicted:?} {reached}");
    let out = place.0.join("out");
    for file in
        ["report.html", "0 rpm/log.csv", "0 rpm/verification.csv", "0 rpm/q.json", "0 rpm/identification/report.html"]
    {
        assert!(out.join(file).is_file(), "{file}");
    }
    let written: CampaignSummary =
        serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(written, summary);

    let (again, person) = place.run(&campaign, "out", false);
    assert_eq!((again.unwrap(), person.notes), (summary, vec!["0 rpm: done before".to_owned()]));
    let other = place.run(&Campaign { seed: 2, ..campaign }, "out", true).0.unwrap_err();
    assert_eq!(other.kind(), ErrorKind::BadInput);
    assert!(other.to_string().contains("holds another campaign"), "{other}");
}

/// A Q that destabilises, in place of the one that was designed: the guard ends it, and the loop is that of K again.
#[test]
fn a_switch_that_goes_wrong_is_taken_back() {
    let campaign = short();
    let running = RunningLoop::read(&example().join("weak.toml"), Discrete::new(2e-4).unwrap()).unwrap();
    let plant = BearingRig::new(&RigParameters::shipped(), Fidelity::Rotating { rpm: 0.0 }, 1).unwrap();
    let numbers = running.numbers(&[12.0, 12.0, 12.0, 12.0, 5.0, 5.0, 10.0, 10.0], [50, 50, RAMP]);
    let bench = LockStep::new(Target::start(None, &numbers).unwrap(), plant).unwrap();
    let bench = Bench::Twin(Box::new(bench));
    let mut point = Point::new(&campaign, &campaign.points[0], &running, bench);
    point.record.amplitude = 0.5;
    let mut proposal = point.recorded(&mut Person::default(), &mut PointFiles::default()).unwrap();
    proposal.new.q.system = proposal.new.q.system.map_output(&(faer::Scale(-20.0) * eye(2)));
    let ended = point.verified(&proposal, &mut Vec::new());
    let Err(Error::Refused { reason }) = ended else { panic!("{ended:?}") };
    assert!(reason.contains("guard"), "{reason}");
    assert_eq!((point.record.status, point.record.unstable_switches), (PointStatus::Fallback, 1));
    point.silence().unwrap();
    point.bench.take_rows();
    point.bench.run(1000).unwrap();
    let rows = point.bench.take_rows();
    assert!(rows.iter().all(|row| row[4] == 0.0 && row[5] == 0.0), "alpha is not zero");
    assert!(rows.iter().all(|row| row[0].abs() < 2.0 && row[1].abs() < 2.0), "the loop is not that of K");
}

/// K(Q) is the controller, to single precision; where it does not stabilise the nominal model there is no Q.
#[test]
fn a_new_controller_is_a_q_around_the_running_one() {
    let time = Discrete::new(2e-4).unwrap();
    let running = RunningLoop::read(&example().join("weak.toml"), time).unwrap();
    let g = &running.nominal;
    let weights = LqrWeights::on_outputs(g, eye(2).as_ref(), (faer::Scale(10.0) * eye(2)).as_ref()).unwrap();
    let f = lqr(g, &weights).unwrap().f;
    let new = observer_controller(g, f.as_ref(), running.l.as_ref()).unwrap();
    let q = parameter_of(&running, &new).unwrap();
    assert_eq!((q.system.order(), q.coefficients(Q_STATES).len()), (12, Q_STATES * (Q_STATES + 4)));
    let with_q = running.factors.controller_of(&q.system).unwrap();
    let omega: Vec<f64> = (1..60).map(|k| 250.0 * f64::from(k)).collect();
    let (found, expected) = (frequency_response(&with_q, &omega).unwrap(), frequency_response(&new, &omega).unwrap());
    let size = expected.iter().map(|g| g.norm_max()).fold(0.0, f64::max);
    let worst = found.iter().zip(expected.iter()).map(|(a, b)| (a - b).norm_max()).fold(0.0, f64::max);
    assert!(worst < 1e-4 * size, "{worst:.1e} of {size:.1e}");
    let wrong = observer_controller(g, (faer::Scale(-30.0) * f).as_ref(), running.l.as_ref()).unwrap();
    assert!(parameter_of(&running, &wrong).unwrap_err().to_string().contains("unstable Q"));
}

#[test]
fn a_campaign_that_cannot_be_run_is_refused_with_the_key() {
    let text = std::fs::read_to_string(example().join("campaign.toml")).unwrap();
    let place = Place::new("refused");
    let file = place.0.join("campaign.toml");
    for (from, to, words) in [
        ("input = 5.0", "input = -5.0", "[limits] input is -5, but must be a number above 0"),
        ("\"1250 rpm\"", "\"0 rpm\"", "two [[points]] have the same name"),
        ("\"1250 rpm\"", "\"../x\"", "cannot be the name of a folder"),
        ("residual", "residuum", "did you mean `residual`?"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&file, text.replacen(from, to, 1)).unwrap();
        let error = Campaign::read(&file).unwrap_err();
        assert!(error.to_string().contains(words) && error.kind() == ErrorKind::BadInput, "{error}");
    }
}

/// The same figures, to the last digit, on host and target.
#[test]
#[ignore = "needs qemu-system-arm and the target thumbv7em-none-eabihf"]
fn the_target_gives_what_the_host_gives() {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()));
    cargo.args(["build", "--release", "--locked"]).current_dir(example().join("../../firmware/mps2-an386"));
    // What concerns the host concerns not the target.
    cargo.env_remove("RUSTFLAGS").env("CARGO_TARGET_DIR", example().join("../../target/firmware"));
    assert!(cargo.status().unwrap().success());
    let place = Place::new("target");
    let host = place.run(&short(), "host", true).0.unwrap();
    let image = Campaign::read(&example().join("campaign.toml")).unwrap().image.map(|image| example().join(image));
    let target = place.run(&Campaign { image, ..short() }, "target", true).0.unwrap();
    assert_eq!((host.controller.as_str(), target.controller.as_str()), ("host", "qemu cortex-m4"));
    assert_eq!(host.points, target.points);
}

/// The table of docs/commission.md: `SEEDS=20 cargo test --workspace --lib seeds -- --ignored --nocapture`.
#[test]
#[ignore = "takes ten minutes"]
fn seeds() {
    let number = |name: &str, default: u64| std::env::var(name).map_or(default, |text| text.parse().unwrap());
    let seeds = number("FIRST_SEED", 1)..=number("SEEDS", 20);
    let place = Place::new("seeds");
    let mut campaign = Campaign::read(&example().join("campaign.toml")).unwrap();
    campaign.image = campaign.image.map(|image| example().join(image));
    let mut points: Vec<Vec<PointRecord>> = vec![Vec::new(); campaign.points.len()];
    for seed in seeds {
        campaign.seed = seed;
        let begin = Instant::now();
        let summary = place.run(&campaign, &format!("{seed}"), true).0.unwrap();
        println!("seed {seed}: {}, {:.0} s", summary.controller, begin.elapsed().as_secs_f64());
        for way in &summary.between {
            let (evidence, reached) = (way.evidence.unwrap(), way.reached.unwrap().damping);
            println!(
                "  {} to {}: {:?}, gain {:.3}, room {:.2}, region {:.2}, change {:.2}, expected {:.4}, reached {reached:.4}",
                way.from,
                way.to,
                way.status,
                evidence.gain,
                evidence.room,
                evidence.region,
                evidence.change,
                way.expected.unwrap()
            );
            assert!(way.status == PointStatus::Done && evidence.holds(), "{seed} {way:?}");
        }
        for (at, (all, point)) in campaign.points.iter().zip(points.iter_mut().zip(summary.points)) {
            assert_eq!(point.status, PointStatus::Done, "{seed} {}: {:?}", point.name, point.reason);
            let (predicted, reached) = (point.predicted.unwrap(), point.reached.unwrap());
            println!("  {}: {:.4} {:?} {:.4}", point.name, predicted.damping, predicted.bounds, reached.damping);
            assert!(true_loop_is_stable(&place.0.join(format!("{seed}/{}/q.json", at.name)), at));
            all.push(point);
        }
    }
    for all in points.iter().filter(|all| !all.is_empty()) {
        let figures = |p: &PointRecord| (p.before.unwrap().damping, p.predicted.unwrap(), p.reached.unwrap().damping);
        let gain = |p: &PointRecord| figures(p).2 / figures(p).0;
        let least = all.iter().map(gain).fold(f64::INFINITY, f64::min);
        let within = |p: &&PointRecord| (figures(p).1.bounds[0]..=figures(p).1.bounds[1]).contains(&figures(p).2);
        let count = all.iter().filter(within).count();
        let range = |of: &dyn Fn(&PointRecord) -> f64| {
            let values = || all.iter().map(of);
            format!("{:.3} to {:.3}", values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max))
        };
        let width = all.iter().map(|p| 0.5 * (figures(p).1.bounds[1] - figures(p).1.bounds[0]) / figures(p).1.damping);
        println!(
            "| {} | {} | {} | {} | {:.1} % | {least:.2} | {count} of {} | {} |",
            all[0].name,
            range(&|p| figures(p).0),
            range(&|p| figures(p).1.damping),
            range(&|p| figures(p).2),
            100.0 * width.sum::<f64>() / all.len() as f64,
            all.len(),
            all.iter().map(|p| p.unstable_switches).sum::<usize>()
        );
        assert!(least >= 2.0 && all.iter().all(|p| p.unstable_switches == 0));
        assert!(10 * count >= 9 * all.len(), "{count}");
    }
}

/// Of the linear part of the twin with the new controller, which the campaign does not know.
fn true_loop_is_stable(q: &Path, at: &OperatingPoint) -> bool {
    let exported: ExportedController = serde_json::from_str(&std::fs::read_to_string(q).unwrap()).unwrap();
    let time = Discrete::new(exported.ts).unwrap();
    is_stable_on_the_twin(at, &exported.controller.system(time).unwrap())
}

fn is_stable_on_the_twin(at: &OperatingPoint, controller: &StateSpace<Discrete>) -> bool {
    let mut parameters = RigParameters::shipped();
    parameters.rotation.cross_coupling.value = at.cross_coupling;
    let truth = BearingRig::new(&parameters, Fidelity::Rotating { rpm: at.rpm }, 1).unwrap().true_plant().unwrap();
    closed_loop(&truth, &with_input_port(controller).unwrap()).unwrap().is_stable().unwrap()
}

/// Two speeds far apart: the loop between them is certified, measured halfway, and stable on the twin at every speed between.
#[test]
fn q_over_speed() {
    let place = Place::new("speed");
    let mut campaign = short();
    campaign.points.push(OperatingPoint { name: "fast".into(), rpm: 2500.0, ..campaign.points[0].clone() });
    let summary = place.run(&campaign, "out", true).0.unwrap();
    let [way] = summary.between.as_slice() else { panic!("{:?}", summary.between) };
    assert!(summary.done && way.status == PointStatus::Done && summary.unstable_switches == 0, "{way:?}");
    let evidence = way.evidence.unwrap();
    assert!(evidence.holds() && evidence.room > 2.0 * evidence.change, "{evidence:?}");
    assert!(way.rpm == 1250.0 && way.reached.unwrap().damping >= way.expected.unwrap());
    let resonances = |point: &PointRecord| point.modes.iter().filter(|mode| mode.zeta < Some(0.5)).count();
    assert_eq!(summary.points.iter().map(resonances).collect::<Vec<_>>(), [2, 2]);

    let out = place.0.join("out");
    assert!(out.join("report.html").is_file() && out.join("0 rpm to fast/verification.csv").is_file());
    let table = QTable::read(&out.join("q_table.json")).unwrap();
    let running = RunningLoop::read(&example().join("weak.toml"), Discrete::new(2e-4).unwrap()).unwrap();
    for rpm in [0.0, 300.0, 1250.0, 2000.0, 2500.0] {
        let controller = running.factors.controller_of(&table.at(rpm, Q_STATES).unwrap()).unwrap();
        let at = OperatingPoint { rpm, ..campaign.points[0].clone() };
        assert!(is_stable_on_the_twin(&at, &controller), "{rpm}");
    }
    let beyond = table.at(2600.0, Q_STATES).unwrap_err().to_string();
    assert!(beyond.contains("the table holds 0 to 2500 rpm, not 2600 rpm"), "{beyond}");
    let small = table.at(1250.0, 1).unwrap_err().to_string();
    assert!(small.contains("1 states at most"), "{small}");
    assert!(QTable::read(&out.join("summary.json")).unwrap_err().to_string().contains("q_table.json"));

    let (again, person) = place.run(&campaign, "out", false);
    assert_eq!(again.unwrap(), summary);
    assert_eq!(person.notes, ["0 rpm: done before", "fast: done before", "0 rpm to fast: done before"]);
    changed_q::is_refused(&place, &campaign);
}

/// The same bearing behind a socket, in lock-step: the figures are those of the campaign on the twin, but for the times of the requests.
#[test]
fn a_machine_over_its_link_is_commissioned() {
    let place = Place::new("link");
    let socket = std::net::UdpSocket::bind(("127.0.0.1", 0)).unwrap();
    let address = format!("udp://{}", socket.local_addr().unwrap());
    let over = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
    let (end, file) = (over.clone(), place.0.join("weak.toml"));
    let machine = std::thread::spawn(move || {
        let plant = TwinPlant::Bearing { fidelity: Fidelity::Rotating { rpm: 0.0 }, cross_coupling: 0.0 };
        serve_loop(youla_rig::Port { socket: &socket, key: None }, &file, &plant, (1, true), || {
            end.load(std::sync::atomic::Ordering::Relaxed)
        })
    });
    let campaign = Campaign { machine: Some(address.clone()), ..short() };
    let refused = place.run(&campaign, "refused", false).0.unwrap();
    assert_eq!(refused.points[0].reason.as_deref(), Some("the operating point was not confirmed"));
    let summary = place.run(&campaign, "out", true).0.unwrap();
    let point = &summary.points[0];
    assert!(summary.done && summary.controller == address, "{:?}", point.reason);
    let (before, reached) = (summary.damping.before.unwrap(), summary.damping.reached.unwrap());
    assert!((before / 0.0863 - 1.0).abs() < 0.05, "{before}");
    assert!(reached > 2.0 * before && reached < 0.22, "{before} {reached}");

    // Another loop in the file than in the machine.
    let weak = std::fs::read_to_string(place.0.join("weak.toml")).unwrap();
    let first = weak.split("observer_gain = [[").nth(1).unwrap().split(',').next().unwrap();
    std::fs::write(place.0.join("other.toml"), weak.replacen(first, "-3.0", 1)).unwrap();
    let points = vec![OperatingPoint { running: "other.toml".into(), ..campaign.points[0].clone() }];
    let other = place.run(&Campaign { points, ..campaign.clone() }, "other", true).0.unwrap();
    let reason = other.points[0].reason.as_deref().unwrap();
    assert!(reason.contains("does not run the loop of other.toml"), "{reason}");
    // A limit that the machine itself does not hold.
    let limits = crate::CampaignLimits { residual: 1e-3, ..campaign.limits };
    let tight = place.run(&Campaign { limits, ..campaign }, "tight", true).0.unwrap();
    assert!(tight.points[0].reason.as_deref().unwrap().contains("beta"), "{:?}", tight.points[0].reason);
    over.store(true, std::sync::atomic::Ordering::Relaxed);
    machine.join().unwrap().unwrap();
}
