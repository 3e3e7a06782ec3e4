//! The header of a loop against `youla_rt::ExcitedLoop`, bit by bit, over random events on unstable plants.

use super::{folder, output};
use std::collections::BTreeSet;
use std::fmt::Write;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla::{Mat, MatRef};
use youla_io::export::{LoopExport, ObserverData, c_loop};
use youla_rt::{
    Cause, Controller, ExcitationSource, ExcitedLoop, Limits, LoopRefusal, Matrices, MultisineSource, PrbsSource,
    QCoefficients, QRefusal, TableSource, Tone,
};

const SAMPLES: usize = 200_000;
const ORDER_OF_Q: usize = 3;

pub(super) fn matrices() -> Matrices<f64, 3, 2, 3> {
    Matrices {
        a: [[1.1, 0.0, 0.0], [0.0, 1.05, 0.0], [0.05, 0.0, 0.4]],
        b: [[1.0, 0.0], [0.0, 1.0], [0.3, 0.2]],
        c: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.1, 0.0, 1.0]],
        d: [[0.0, 0.0], [0.0, 0.0], [0.01, -0.02]],
        f: [[-0.6, 0.0, 0.01], [0.0, -0.55, -0.1]],
        l: [[-0.7, 0.0, 0.0], [0.0, -0.65, 0.0], [0.0, 0.02, -0.2]],
    }
}

pub(super) fn header() -> String {
    let all = matrices();
    let of = |rows: &dyn Fn(usize, usize) -> f64, height, width| Mat::from_fn(height, width, rows);
    let model = StateSpace::new(
        of(&|i, j| all.a[i][j], 3, 3),
        of(&|i, j| all.b[i][j], 3, 2),
        of(&|i, j| all.c[i][j], 3, 3),
        of(&|i, j| all.d[i][j], 3, 2),
        Discrete::new(1e-3).unwrap(),
    );
    let (f, l) = (of(&|i, j| all.f[i][j], 2, 3), of(&|i, j| all.l[i][j], 3, 3));
    header_of(&model.unwrap(), f.as_ref(), l.as_ref())
}

pub(super) fn header_of(model: &StateSpace<Discrete>, f: MatRef<'_, f64>, l: MatRef<'_, f64>) -> String {
    let channels = |name: &str, count| (1..=count).map(|k| Channel::new(format!("{name}{k}"), "V")).collect();
    let export = LoopExport {
        name: "loop".into(),
        measured: channels("y", model.outputs()),
        commanded: channels("u", model.inputs()),
        observer: ObserverData::new(model, f, l),
        ts: 1e-3,
        origin: "a test".into(),
    };
    c_loop(&export).unwrap()
}

/// What the C header calls a refusal.
pub(super) fn code(done: Result<(), LoopRefusal>) -> u64 {
    match done {
        Ok(()) => 0,
        Err(LoopRefusal::Limits) => 1,
        Err(LoopRefusal::NotArmed) => 2,
        Err(LoopRefusal::Tripped) => 3,
        Err(LoopRefusal::Exciting) => 4,
        Err(LoopRefusal::Sensor) => 5,
        Err(LoopRefusal::Q(QRefusal::Fading)) => 6,
        Err(LoopRefusal::Q(QRefusal::NotFinite)) => 7,
        Err(LoopRefusal::Q(QRefusal::Count)) => 8,
        Err(LoopRefusal::Q(QRefusal::Checksum)) => 9,
        Err(LoopRefusal::Q(QRefusal::NotLoaded)) => 10,
    }
}

struct Hash(u64);

impl Hash {
    fn add(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / 2_f64.powi(53)
    }

    fn one_in(&mut self, count: f64) -> bool {
        self.next() * count < 1.0
    }
}

/// Plays events on the Rust loop; gives the script for C and what it must answer, with the causes and refusals that occurred.
macro_rules! played {
    ($real:ty) => {{
        let controller = Controller::new(matrices()).unwrap();
        let m = controller.matrices();
        let of = |x: f64| x as $real;
        let controller: Controller<$real, 3, 2, 3> = Controller::new(Matrices {
            a: m.a.map(|r| r.map(of)),
            b: m.b.map(|r| r.map(of)),
            c: m.c.map(|r| r.map(of)),
            d: m.d.map(|r| r.map(of)),
            f: m.f.map(|r| r.map(of)),
            l: m.l.map(|r| r.map(of)),
        })
        .unwrap();
        let limits = Limits {
            y: [50.0, 50.0, <$real>::INFINITY],
            beta: [3.0, 3.0, <$real>::INFINITY],
            u: [8.0; 2],
            rate: [6.0; 2],
            clipped: 3,
            stuck: 4,
            host: 20,
            duration: 60,
        };
        let mut running = ExcitedLoop::<$real, 3, 2, 3, ORDER_OF_Q>::new(controller, limits, 25).unwrap();
        let mut prbs: ExcitationSource<'_, $real, 2, 0> =
            ExcitationSource::Prbs(PrbsSource::new(10, 2, [1, 77], [0.5, 0.75]).unwrap());
        let angle = core::f64::consts::TAU * 3.0 / 50.0;
        let tone = Tone { cosine: of(angle.cos()), sine: of(angle.sin()), gains: [[0.5, 0.0], [0.0, 0.25]] };
        let mut multisine: ExcitationSource<'_, $real, 2, 1> =
            ExcitationSource::Multisine(MultisineSource::new([tone], 50));
        let rows = [[0.25, 0.0], [0.0, -0.125], [-0.25, 0.125]];
        let mut table: ExcitationSource<'_, $real, 2, 0> = ExcitationSource::Table(TableSource::new(&rows));
        let mut script = format!("{:x} {:x}\n", tone.cosine.to_bits(), tone.sine.to_bits());
        let (mut expected, mut seen) = (String::new(), BTreeSet::new());
        let (mut random, mut x) = (Random(7), [0.0_f64; 3]);
        let mut broken = [(0_u32, 0.0_f64); 3];
        for _ in 0..SAMPLES {
            let mut hash = Hash(0xcbf2_9ce4_8422_2325);
            let mut requests = Vec::new();
            let mut request = |text: String, answer: Option<Result<(), LoopRefusal>>| {
                if let Some(answer) = answer {
                    let code = code(answer);
                    hash.add(code);
                    seen.insert(("refusal", code));
                }
                requests.push(text);
            };
            if random.one_in(20.0) {
                request("1".into(), Some(running.arm()));
            }
            if random.one_in(30.0) {
                request("2".into(), Some(running.start()));
            }
            if random.one_in(200.0) {
                running.stop();
                request("3".into(), None);
            }
            if random.one_in(8.0) {
                running.heard();
                request("4".into(), None);
            }
            if random.one_in(150.0) {
                request("5".into(), Some(running.begin_q()));
                let kind = random.next();
                let value = |random: &mut Random, scale: f64| of((random.next() - 0.5) * scale);
                let q = QCoefficients::<$real, ORDER_OF_Q, 2, 3> {
                    a: core::array::from_fn(|_| core::array::from_fn(|_| value(&mut random, 0.6))),
                    b: core::array::from_fn(|_| core::array::from_fn(|_| value(&mut random, 0.3))),
                    c: core::array::from_fn(|_| core::array::from_fn(|_| value(&mut random, 0.3))),
                };
                let count = q.values().count();
                for (place, value) in q.values().enumerate() {
                    if kind < 0.1 && place + 1 == count {
                        break;
                    }
                    let value = if (0.1..0.2).contains(&kind) && place == 4 { <$real>::NAN } else { value };
                    request(format!("6 {:x}", value.to_bits()), Some(running.write_q(value)));
                }
                let checksum = if (0.2..0.3).contains(&kind) { q.checksum() ^ 1 } else { q.checksum() };
                request(format!("7 {checksum:x}"), Some(running.commit_q(checksum)));
            }
            if random.one_in(120.0) {
                request("8".into(), Some(running.switch_q()));
            }
            if random.one_in(400.0) {
                running.release_q();
                request("9".into(), None);
            }
            let off: [$real; 2] = core::array::from_fn(|_| if random.one_in(6000.0) { <$real>::NAN } else { 0.0 });
            let (a, b, c) = (prbs.advance(), multisine.advance(), table.advance());
            let wanted: [$real; 2] = core::array::from_fn(|j| a[j] + b[j] + c[j] + off[j]);
            let u = running.command(&wanted);
            let mut y: [$real; 3] = core::array::from_fn(|i| {
                let sum: f64 = (0..3).map(|j| m.c[i][j] * x[j]).sum();
                of(sum + 0.05 * (random.next() - 0.5))
            });
            for i in 0..3 {
                if random.one_in(1500.0) {
                    let last = f64::from(y[i] as f32);
                    broken[i] = (
                        1 + (random.next() * 8.0) as u32,
                        [f64::NAN, last, last, 60.0, f64::INFINITY][(random.next() * 5.0) as usize],
                    );
                }
                if broken[i].0 > 0 {
                    broken[i].0 -= 1;
                    y[i] = of(broken[i].1);
                    if broken[i].1.is_infinite() {
                        // The largest numbers, of either sign in turn, which overflow in the residual.
                        y[i] = if broken[i].0 % 2 == 0 { <$real>::MAX } else { <$real>::MIN };
                    }
                }
            }
            // What the actuators make of the command: all of it, a part, or nothing that is a number.
            let share: [$real; 2] = core::array::from_fn(|_| match random.next() {
                p if p < 0.9 => 1.0,
                p if p < 0.9995 => 0.75,
                _ => <$real>::NAN,
            });
            let applied: [$real; 2] = core::array::from_fn(|j| u[j] * share[j]);
            let row = running.observe(&y, &applied);
            let real = |value: $real| u64::from(value.to_bits());
            for j in 0..2 {
                hash.add(real(u[j]));
                hash.add(real(row.u[j]));
                hash.add(real(row.alpha[j]));
            }
            for i in 0..3 {
                hash.add(real(row.y[i]));
                hash.add(real(row.beta[i]));
            }
            hash.add(row.sample);
            seen.extend(row.status.trip().map(|trip| ("cause", trip.cause as u64)));
            let bits =
                |values: &[$real]| values.iter().map(|v| format!("{:x}", v.to_bits())).collect::<Vec<_>>().join(" ");
            let _ = writeln!(
                script,
                "{:x} {} {} {} {}",
                requests.len(),
                requests.join(" "),
                bits(&off),
                bits(&y),
                bits(&share)
            );
            let _ = writeln!(expected, "{:x} {:x}", row.status.bits(), hash.0);
            let next = |i: usize| {
                let of_x: f64 = (0..3).map(|j| 1.001 * m.a[i][j] * x[j]).sum();
                of_x + (0..2).map(|j| m.b[i][j] * f64::from(row.u[j] as f32)).sum::<f64>()
                    + 0.02 * (random.next() - 0.5)
            };
            let moved: Vec<f64> = {
                let mut next = next;
                (0..3).map(|i| next(i)).collect()
            };
            // A machine that has left its range is put back.
            let lost = moved.iter().any(|v| v.abs() > 200.0);
            x = core::array::from_fn(|i| if lost { 0.0 } else { moved[i] });
        }
        (script, expected, seen)
    }};
}

fn compare(name: &str, flags: &[&str], (script, expected, seen): (String, String, BTreeSet<(&str, u64)>)) {
    let folder = folder(name);
    std::fs::write(folder.join("loop.h"), header()).unwrap();
    std::fs::write(folder.join("main.c"), include_str!("c_loop.c")).unwrap();
    let warnings =
        ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2", "-ffp-contract=off", "-DYOULA_Q_ORDER=3"];
    output("gcc", &[&warnings[..], flags, &["main.c", "-o", "program"]].concat(), &folder, "");
    let found = output(folder.join("program"), &[], &folder, &script);
    let first = found.lines().zip(expected.lines()).position(|(found, expected)| found != expected);
    assert_eq!(first, None, "{name}: first difference at this sample");
    assert_eq!(found.lines().count(), SAMPLES, "{name}");
    // The script reaches every cause, and every refusal but the one of `init`.
    let causes = (1..=10).map(|cause| ("cause", cause));
    let refusals = [0].into_iter().chain(2..=10).map(|code| ("refusal", code));
    assert_eq!(seen, causes.chain(refusals).collect(), "{name}");
    assert_eq!(Cause::StateNotFinite as u64, 10);
}

#[test]
#[ignore = "needs gcc"]
fn the_header_of_a_loop_is_the_loop_bit_by_bit() {
    compare("loop-double", &[], played!(f64));
    compare("loop-single", &["-DYOULA_REAL=float"], played!(f32));
}

/// A compiler for firmware takes it as well, without a library.
#[test]
#[ignore = "needs gcc"]
fn the_header_of_a_loop_compiles_as_free_standing_code() {
    let folder = folder("loop-freestanding");
    std::fs::write(folder.join("loop.h"), header()).unwrap();
    std::fs::write(folder.join("part.c"), "#include \"loop.h\"\nint order(void) { return loop_states; }\n").unwrap();
    let flags = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-pedantic",
        "-ffreestanding",
        "-DYOULA_REAL=float",
        "-c",
        "part.c",
    ];
    output("gcc", &flags, &folder, "");
}
