//! Records over the loopback, with rows that are lost; faults of the machine.

use crate::*;
use std::net::UdpSocket;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use youla_link::{Key, LARGEST_FRAME, Machine, Outcome, Request, SequenceOrigin, Station};
use youla_rt::{Cause, Controller, ExcitedLoop, Limits, Matrices, OUT_WITHIN, Phase, QCoefficients};

mod board;
mod faults;
mod keys;

/// A rotor that is served on a thread.
struct Served {
    address: String,
    over: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Served {
    fn start(pace: Pace) -> Self {
        Self::of(|| rotor(1).unwrap(), pace, None)
    }

    fn of<const N: usize, const M: usize, const P: usize, const K: usize, G: Plant<M, P> + 'static>(
        make: fn() -> Twin<'static, N, M, P, K, G>,
        pace: Pace,
        key: Option<Key>,
    ) -> Self {
        let socket = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
        let address = format!("udp://{}", socket.local_addr().unwrap());
        let over = Arc::new(AtomicBool::new(false));
        let end = over.clone();
        let thread = std::thread::spawn(move || {
            let mut twin = make();
            let port = Port { socket: &socket, key: key.as_ref() };
            serve(port, &mut twin, pace, || end.load(Ordering::Relaxed)).unwrap();
        });
        Served { address, over, thread }
    }

    fn end(self) {
        self.over.store(true, Ordering::Relaxed);
        self.thread.join().unwrap();
    }
}

fn file(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("youla-rig-{}-{name}.csv", std::process::id()))
}

/// Samples of the log by their times.
fn samples(path: &PathBuf) -> Vec<u64> {
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.starts_with("t,y_h,y_v,u_h,u_v,alpha_1,alpha_2,beta_1,beta_2,status\n"));
    let time = |line: &str| line.split(',').next().unwrap().parse::<f64>().unwrap();
    text.lines().skip(1).map(|line| (time(line) / 5e-5).round() as u64).collect()
}

/// Each sample from the first one to the last is in the log or in a gap of the report, once.
fn whole(samples: &[u64], report: &LogReport) {
    assert_eq!(samples.len() as u64, report.rows);
    assert!(samples.windows(2).all(|pair| pair[0] < pair[1]));
    let gaps: Vec<(u64, u64)> =
        samples.windows(2).filter(|p| p[1] > p[0] + 1).map(|p| (p[0] + 1, p[1] - p[0] - 1)).collect();
    assert!(report.gaps.starts_with(&gaps), "{gaps:?} {report:?}");
    assert_eq!(report.missing, report.gaps.iter().map(|(_, rows)| rows).sum::<u64>());
}

/// Records at 20 kHz in real time.
fn record(seconds: u64) {
    let served = Served::start(Pace::RealTime(Duration::from_micros(50)));
    let mut rig = Rig::connect(&served.address).unwrap();
    let path = file(&format!("real-time-{seconds}"));
    let mut recorder = Recorder::create(&path, rig.description(), rig.schema()).unwrap();
    rig.ask(&Request::Arm).unwrap();
    let start = Request::Start { source: SequenceOrigin::Prbs { order: 15, hold: 4 }, amplitude: 0.5 };
    rig.ask(&start).unwrap();
    let first = rig.ask(&Request::Alive).unwrap();
    assert_eq!(first.status.phase(), Phase::Exciting);
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(seconds) {
        rig.record(&mut recorder, Duration::from_millis(200)).unwrap();
        rig.ask(&Request::Alive).unwrap();
    }
    let last = rig.ask(&Request::Stop).unwrap();
    rig.record(&mut recorder, Duration::from_millis(100)).unwrap();
    let end = recorder.end(last.sample);
    let report = recorder.finish(end).unwrap();
    served.end();
    println!("{report:?}");
    whole(&samples(&path), &report);
    assert!(report.rows + report.missing >= last.sample - first.sample);
    assert!(report.rows > 10_000 * seconds, "{report:?}");
    assert_eq!((report.damaged, report.foreign, report.trips.len()), (0, 0, 0));
    std::fs::remove_file(path).unwrap();
}

#[test]
fn every_row_of_five_seconds_is_there_or_missing() {
    record(5);
}

#[test]
#[ignore = "takes 60 s"]
fn every_row_of_a_minute_is_there_or_missing() {
    record(60);
}

/// Frames of a way that loses, doubles, swaps and damages 1 % each.
#[test]
fn log_over_a_bad_way() {
    let mut twin = rotor(3).unwrap();
    let machine = Description::parse(description(&mut twin).as_bytes()).unwrap();
    let path = file("bad-way");
    let mut recorder = Recorder::create(&path, &machine, twin.station.schema()).unwrap();
    let (mut held, mut fates) = (None, [0_u64; 4]);
    for sample in 0..200_000_u64 {
        twin.sample();
        let mut bytes = [0; LARGEST_FRAME];
        let Some(length) = twin.station.frame(&mut bytes) else { continue };
        let mut frame = bytes[..length.unwrap()].to_vec();
        let fate = (sample / 20).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
        let edge = !(2000..199_000).contains(&sample);
        match fate % 100 {
            0 if !edge => fates[0] += 1,
            1 if !edge => {
                fates[1] += 1;
                recorder.take(&frame).unwrap();
                recorder.take(&frame).unwrap();
            }
            2 if !edge && held.is_none() => {
                fates[2] += 1;
                held = Some(frame);
                continue;
            }
            3 if !edge => {
                fates[3] += 1;
                let place = fate as usize % frame.len();
                frame[place] ^= 0x10;
                recorder.take(&frame).unwrap();
            }
            _ => recorder.take(&frame).unwrap(),
        }
        if let Some(late) = held.take() {
            recorder.take(&late).unwrap();
        }
    }
    let report = recorder.finish(200_000).unwrap();
    assert!(fates.iter().all(|count| *count > 60), "{fates:?}");
    assert_eq!(report.frames.lost, fates[0] + fates[3]);
    assert_eq!(report.frames.doubled, fates[1]);
    assert_eq!(report.damaged, fates[3]);
    assert_eq!(report.missing, 20 * (fates[0] + fates[3]));
    assert_eq!(report.rows + report.missing, 200_000);
    whole(&samples(&path), &report);
    std::fs::remove_file(path).unwrap();
}

fn description(twin: &mut Twin<'static, 4, 2, 2, 4>) -> String {
    let (outcome, data) = ask(twin, 1, &Request::Describe);
    assert_eq!(outcome, Outcome::Done);
    String::from_utf8(data).unwrap()
}

/// A request without a way in between.
fn ask(twin: &mut Twin<'static, 4, 2, 2, 4>, sequence: u32, request: &Request<'_>) -> (Outcome, Vec<u8>) {
    use youla_link::{Frame, Kind, Reply};
    let (mut body, mut bytes, mut answer) = ([0; 200], [0; LARGEST_FRAME], [0; LARGEST_FRAME]);
    let length = request.write(&mut body).unwrap();
    let (schema, life) = (twin.station.schema(), twin.station.life());
    let frame = Frame { kind: Kind::Request, schema, sequence, host: 1, life, body: &body[..length] };
    let length = frame.write(&mut bytes).unwrap();
    let length = twin.station.receive(&bytes[..length], &mut answer).unwrap().unwrap();
    let reply = Reply::read(Frame::read(&answer[..length]).unwrap().body).unwrap();
    (reply.outcome, reply.data.to_vec())
}

#[test]
fn lock_step_and_q_over_udp() {
    let served = Served::start(Pace::LockStep);
    let mut rig = Rig::connect(&served.address).unwrap();
    let path = file("lock-step");
    let mut recorder = Recorder::create(&path, rig.description(), rig.schema()).unwrap();
    let before = rig.ask(&Request::Alive).unwrap();
    let mut q = QCoefficients::<f32, 4, 2, 2>::zero();
    (q.a[0][0], q.b[0][0], q.c[0][0]) = (0.5, 0.1, -0.2);
    let coefficients: Vec<f32> = q.values().collect();
    assert!(matches!(rig.ask(&Request::SwitchQ), Err(Error::Refused { outcome: Outcome::NoQ, .. })));
    rig.load_q(&coefficients).unwrap();
    rig.ask(&Request::SwitchQ).unwrap();
    let read = rig.ask(&Request::ReadQ { place: 0 }).unwrap();
    assert_eq!(read.data, coefficients.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
    for _ in 0..50 {
        rig.ask(&Request::Alive).unwrap();
    }
    let after = rig.ask(&Request::Alive).unwrap();
    // One frame of 20 rows for each request: BeginQ, WriteQ, CommitQ, two SwitchQ, ReadQ, 51 Alive.
    assert_eq!(after.sample - before.sample, 20 * 57);
    assert_eq!(after.status.bank(), 1);
    rig.record(&mut recorder, Duration::from_millis(50)).unwrap();
    let end = recorder.end(after.sample);
    let report = recorder.finish(end).unwrap();
    assert_eq!(report.missing, 0);
    whole(&samples(&path), &report);
    served.end();
    std::fs::remove_file(path).unwrap();
    assert!(matches!(Rig::connect("udp://127.0.0.1:1"), Err(Error::Silent { .. })));
    assert!(matches!(Rig::connect("udp://nowhere"), Err(Error::Address { .. })));
}

/// An unstable mass on a spring that hardens: one channel, not linear.
struct Hardening([f64; 2]);

impl Plant<1, 1> for Hardening {
    fn measure(&mut self) -> [f32; 1] {
        [self.0[0] as f32]
    }

    fn apply(&mut self, u: &[f32; 1]) {
        let [x, v] = self.0;
        let force = x - 0.2 * x.powi(3) + f64::from(u[0]);
        self.0 = [x + 0.01 * v, v + 0.01 * force];
    }
}

fn hardening() -> Twin<'static, 2, 1, 1, 1, Hardening> {
    let nominal = Matrices {
        a: [[1.0, 0.01], [0.01, 1.0]],
        b: [[0.0], [0.01]],
        c: [[1.0, 0.0]],
        d: [[0.0]],
        f: [[-3.0, -2.0]],
        l: [[-0.2], [-1.0]],
    };
    let controller = Controller::new(nominal).unwrap();
    let (clipped, stuck, host, duration) = (0, 0, 0, 0);
    let limits = Limits { y: [10.0], beta: [10.0], u: [50.0], rate: [50.0], clipped, stuck, host, duration };
    let description = "name = \"mass\"\nsample_time = 0.01\ninputs = [{ name = \"u\" }]\noutputs = [{ name = \"y\" }]";
    let running = ExcitedLoop::new(controller, limits, 0).unwrap();
    Twin {
        station: Station::new(running, Machine { description, table: &[], rows: 10, life: 5 }),
        plant: Hardening([0.5, 0.0]),
    }
}

/// A plant that is not linear, of another size: the log over UDP has the bits of the loop without a way in between.
#[test]
fn any_plant_over_udp() {
    let served = Served::of(hardening, Pace::LockStep, None);
    let mut rig = Rig::connect(&served.address).unwrap();
    let path = file("hardening");
    let mut recorder = Recorder::create(&path, rig.description(), rig.schema()).unwrap();
    for _ in 0..100 {
        rig.ask(&Request::Alive).unwrap();
    }
    rig.record(&mut recorder, Duration::from_millis(50)).unwrap();
    let report = recorder.finish(0).unwrap();
    served.end();
    assert_eq!((report.missing, report.damaged, report.foreign), (0, 0, 0));
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    let mut direct = hardening();
    let rows: Vec<_> = (0..2000).map(|_| direct.sample()).collect();
    let mut compared = 0;
    for line in text.lines().skip(1) {
        let values: Vec<f64> = line.split(',').map(|value| value.parse().unwrap()).collect();
        let row = &rows[(values[0] / 0.01).round() as usize];
        assert_eq!((values[1] as f32, values[2] as f32), (row.y[0], row.u[0]), "{line}");
        compared += 1;
    }
    assert!(compared >= 1000, "{compared} rows");
    assert!(rows[0].y[0] == 0.5 && rows[999].y[0].abs() < 1e-3, "the controller does not hold it: {:?}", rows[999]);
}

#[test]
fn settings_take_what_the_machine_states() {
    let mut twin = rotor(1).unwrap();
    let machine = Description::parse(description(&mut twin).as_bytes()).unwrap();
    let run: toml::Table = settings(&machine, "log.csv", 1000, None).unwrap().parse().unwrap();
    assert_eq!(run["name"].as_str(), Some("rotor"));
    assert_eq!(run["data"]["estimation"][0]["take"].as_integer(), Some(750));
    assert_eq!(run["data"]["alpha"][1]["name"].as_str(), Some("alpha_2"));
    assert!(run["controller"]["observer"].is_table() && run["nominal"]["state_space"].is_table());
    let base = "name = \"mine\"\n[data]\ndetrend = \"none\"\n[hansen]\norder = 4\n";
    let run: toml::Table = settings(&machine, "log.csv", 1000, Some(base)).unwrap().parse().unwrap();
    assert_eq!((run["name"].as_str(), run["hansen"]["order"].as_integer()), (Some("mine"), Some(4)));
    assert_eq!(run["data"]["gaps"].as_str(), Some("split"));
    assert!(matches!(settings(&machine, "log.csv", 1, Some("[")), Err(Error::Description(_))));
    assert!(Description::parse(b"name = \"x\"\nsample_time = 0\ninputs = []\noutputs = []").is_err());
}

/// The sample of the fault, of the first zero after the trip, and the cause; the log is kept.
fn fault(number: u64) -> Result<(), String> {
    let mut twin = rotor(number).unwrap();
    let mut sequence = 0;
    let mut next = || {
        sequence += 1;
        sequence
    };
    let described = description(&mut twin);
    let machine = Description::parse(described.as_bytes()).unwrap();
    let path = file(&format!("fault-{number}"));
    let mut recorder = Recorder::create(&path, &machine, twin.station.schema()).unwrap();
    next();
    assert_eq!(ask(&mut twin, next(), &Request::Arm).0, Outcome::Done);
    let start = Request::Start { source: SequenceOrigin::Prbs { order: 15, hold: 4 }, amplitude: 1.0 };
    assert_eq!(ask(&mut twin, next(), &start).0, Outcome::Done);
    let at = 600 + 37 * number;
    let channel = (number / 6 % 2) as usize;
    let (cause, delay) = match number % 6 {
        0 => (Cause::SensorNotFinite, 0),
        1 => (Cause::SensorStuck, 4),
        2 => (Cause::OutputLimit, 0),
        3 => (Cause::HostSilent, 20_100),
        4 => (Cause::QRefused, 0),
        _ => (Cause::ResidualLimit, 20_000),
    };
    let (mut tripped, mut largest) = (None, 0.0_f32);
    for sample in 0..at + delay + 4000 {
        if sample == at {
            match cause {
                Cause::SensorNotFinite => twin.plant.fault = Some(PlantFault::SensorNotFinite(channel)),
                Cause::SensorStuck => twin.plant.fault = Some(PlantFault::SensorStuck(channel)),
                Cause::OutputLimit => twin.plant.push([30.0, 0.0, 0.0, 0.0]),
                Cause::QRefused => {
                    assert_eq!(ask(&mut twin, next(), &Request::BeginQ).0, Outcome::Done);
                    let good = QCoefficients::<f32, 4, 2, 2>::zero();
                    let mut bytes: Vec<u8> = good.values().flat_map(f32::to_le_bytes).collect();
                    bytes[(number as usize * 5) % 128] ^= 1 << (number % 8);
                    let write = Request::WriteQ { place: 0, values: &bytes };
                    let written = ask(&mut twin, next(), &write).0;
                    let commit = ask(&mut twin, next(), &Request::CommitQ(good.checksum())).0;
                    assert!(written != Outcome::Done || commit == Outcome::Checksum, "{written:?} {commit:?}");
                }
                Cause::ResidualLimit => twin.plant.fault = Some(PlantFault::ActuatorGain(0.5)),
                _ => (),
            }
        }
        if cause != Cause::HostSilent && sample % 1000 == 0 {
            ask(&mut twin, next(), &Request::Alive);
        }
        let row = twin.sample();
        let mut bytes = [0; LARGEST_FRAME];
        if let Some(length) = twin.station.frame(&mut bytes) {
            recorder.take(&bytes[..length.unwrap()]).unwrap();
        }
        if let (None, Some(trip)) = (tripped, row.status.trip()) {
            tripped = Some((sample, trip));
        }
        if let Some((when, _)) = tripped {
            let out = row.alpha == [0.0; 2];
            if sample >= when + u64::from(OUT_WITHIN) && !out {
                return Err(format!("{cause:?}: alpha is {:?} {} samples after the trip", row.alpha, sample - when));
            }
            largest = largest.max(row.u[0].abs()).max(row.u[1].abs());
        }
    }
    let (when, trip) = tripped.ok_or(format!("{cause:?} was not detected"))?;
    let expected_channel = matches!(cause, Cause::SensorNotFinite | Cause::SensorStuck);
    if trip.cause != cause || expected_channel && usize::from(trip.channel) != channel + 1 {
        return Err(format!("{cause:?}: {trip:?}"));
    }
    if when < at && cause != Cause::HostSilent || when > at + delay {
        return Err(format!("{cause:?} at {at}, detected at {when}"));
    }
    let size = twin.plant.state().iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    if size > 2.0 || largest > 10.0 {
        return Err(format!("{cause:?}: the state is {size} in the end, the largest input {largest}"));
    }
    let end = recorder.end(twin.station.running().sample());
    let report = recorder.finish(end).unwrap();
    whole(&samples(&path), &report);
    std::fs::remove_file(path).unwrap();
    (report.missing == 0 && report.trips == [(when, trip)]).then_some(()).ok_or(format!("{report:?}"))
}

/// Six faults at different samples and channels: the excitation is zero within 10 samples of the detection, the loop stays stable, the log is whole.
#[test]
fn a_hundred_faults_end_safely() {
    let failed: Vec<String> = (0..100).filter_map(|number| fault(number).err()).collect();
    assert!(failed.is_empty(), "{} of 100: {failed:#?}", failed.len());
}
