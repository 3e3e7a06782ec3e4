//! Findings of an attack on the link, one test each.

use super::{Served, file};
use crate::*;
use std::net::UdpSocket;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use youla_link::{Frame, FrameError, Kind, LARGEST_FRAME};

const MACHINE: &str =
    "name = \"m\"\nsample_time = 1e-3\nq_order = 4\ninputs = [{ name = \"u\" }]\noutputs = [{ name = \"y\" }]\n";
/// Rows of a frame.
const ROWS: u64 = 20;

/// A frame of rows, each with its sample and a mark as y and u.
fn rows(life: u32, sequence: u32, first: u64, mark: f32) -> Vec<u8> {
    let row = |k: u64| [(first + k) as f32, mark, 0.0, 0.0].map(f32::to_le_bytes).concat().into_iter().chain([0; 4]);
    let body: Vec<u8> = first.to_le_bytes().into_iter().chain((0..ROWS).flat_map(row)).collect();
    let mut bytes = [0; LARGEST_FRAME];
    let frame = Frame { kind: Kind::Rows, schema: 7, sequence, host: 0, life, body: &body };
    let length = frame.write(&mut bytes).unwrap();
    bytes[..length].to_vec()
}

fn recorded(name: &str, frames: &[Vec<u8>]) -> (LogReport, PathBuf) {
    recorded_by(name, frames, false)
}

fn recorded_by(name: &str, frames: &[Vec<u8>], signed: bool) -> (LogReport, PathBuf) {
    let path = file(name);
    let machine = Description::parse(MACHINE.as_bytes()).unwrap();
    let mut recorder = Recorder::create(&path, &machine, 7).unwrap();
    recorder.signed = signed;
    frames.iter().for_each(|frame| recorder.take(frame).unwrap());
    (recorder.finish(0).unwrap(), path)
}

/// Marks of the rows of a log, which is removed.
fn marks(path: PathBuf) -> Vec<f32> {
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').nth(2).unwrap().parse().unwrap()).collect()
}

#[test]
fn a_restart_parts_the_log() {
    let of_life = |life: u32, frames: u32| (0..frames).map(move |k| rows(life, k, ROWS * u64::from(k), life as f32));
    // The second life passes the sample at which the first one ended.
    let (report, path) = recorded("restart", &of_life(1, 60).chain(of_life(2, 160)).collect::<Vec<_>>());
    let part = |life, rows| LogPart { first: 0, rows, life };
    assert_eq!(report.parts, [part(1, 60 * ROWS), part(2, 160 * ROWS)]);
    assert_eq!((report.missing, report.implausible, report.frames.lost), (0, 0, 0), "{report:?}");
    assert_eq!(marks(CsvLog::part_path(&path, 2)), vec![2.0; 160 * ROWS as usize]);
    assert_eq!(marks(path), vec![1.0; 60 * ROWS as usize]);
}

#[test]
fn one_forged_frame_costs_no_row() {
    let honest: Vec<Vec<u8>> = (0..200).map(|k| rows(1, k, ROWS * u64::from(k), 1.0)).collect();
    for (place, forged) in [
        (100, rows(1, 100, 1_000_000_000_000_000, 9.0)),
        (100, rows(1, 2_000_000_000, 2200, 9.0)),
        (100, rows(1, 2_000_000_000, 1_000_000_000_000_000, 9.0)),
        (100, rows(5, 100, 2000, 9.0)),
        (0, rows(1, 2_000_000_000, 1_000_000_000_000_000, 9.0)),
        (200, rows(1, 2_000_000_000, 1_000_000_000_000_000, 9.0)),
    ] {
        let mut frames = honest.clone();
        frames.insert(place, forged);
        let (report, path) = recorded("forged", &frames);
        assert_eq!((report.rows, report.missing, report.implausible), (200 * ROWS, 0, 1), "{report:?}");
        assert_eq!(report.parts.len(), 1);
        assert!(marks(path).iter().all(|mark| *mark == 1.0));
    }
}

/// Two that confirm each other are taken, as they cannot be told from the machine's; the rows after them are there all the same.
#[test]
fn forged_frames_do_not_end_a_log() {
    let mut frames: Vec<Vec<u8>> = (0..300).map(|k| rows(1, k, ROWS * u64::from(k), 1.0)).collect();
    let forged = [0, 1].map(|k| rows(1, 2_000_000_000 + k, 1_000_000_000_000 + ROWS * u64::from(k), 9.0));
    frames.splice(100..100, forged);
    let (report, path) = recorded("forged-pair", &frames);
    assert_eq!(report.parts.len(), 2, "{report:?}");
    // Up to 64 frames are taken for late ones first.
    assert!(report.parts[1].rows >= (200 - 66) * ROWS && report.frames.stale >= 64, "{report:?}");
    assert!(marks(CsvLog::part_path(&path, 2)).iter().all(|mark| *mark == 1.0));
    let _ = marks(path);
}

/// Frames that a stranger has heard and sends again while those of the machine do not arrive. Without signatures nobody can tell them from a machine whose samples
/// went back.
#[test]
fn signed_frames_that_come_again_are_no_part_of_the_log() {
    let honest = |from: u32, to: u32| (from..to).map(|k| rows(1, k, ROWS * u64::from(k), 1.0));
    let frames: Vec<Vec<u8>> = honest(0, 400).chain(honest(0, 200)).chain(honest(400, 500)).collect();
    let (report, path) = recorded_by("again", &frames, true);
    assert_eq!((report.rows, report.missing, report.parts.len()), (500 * ROWS, 0, 1), "{report:?}");
    assert_eq!(marks(path), vec![1.0; 500 * ROWS as usize]);
    let (report, path) = recorded("again-unsigned", &frames);
    assert!(report.parts.len() > 1, "{report:?}");
    let mut parts: Vec<PathBuf> = (2..=report.parts.len()).map(|number| CsvLog::part_path(&path, number)).collect();
    parts.push(path);
    parts.into_iter().for_each(|part| _ = marks(part));
}

#[test]
fn an_outage_is_a_gap() {
    let frames: Vec<Vec<u8>> = (0..50).chain(5000..5050).map(|k| rows(1, k, ROWS * u64::from(k), 1.0)).collect();
    let (report, path) = recorded("outage", &frames);
    assert_eq!((report.rows, report.parts.len(), report.implausible), (100 * ROWS, 1, 0), "{report:?}");
    assert_eq!((report.gaps.as_slice(), report.frames.lost), (&[(50 * ROWS, 4950 * ROWS)][..], 4950));
    let _ = marks(path);
}

#[test]
fn descriptions_that_cannot_be_used_are_refused_by_field() {
    let long = "x".repeat(500);
    for (from, to, words) in [
        ("\"y\"", "\"a,b\"", "machine \"m\": outputs, channel 1, name = \"a,b\": a name has no comma"),
        ("\"y\"", "\"a\\nb\"", "outputs, channel 1, name = \"a\\nb\": it has a line break"),
        ("\"y\"", "\"a\\\"b\"", "a name has no comma, semicolon or quote"),
        ("\"y\"", "\"\"", "a name is not empty"),
        ("\"y\"", "\"t\"", "a channel's name = \"t\": it is a column of the log already"),
        ("\"y\"", "\"u\"", "a channel's name = \"u\""),
        ("\"y\"", "\"alpha_1\"", "a channel's name = \"alpha_1\""),
        ("\"m\"", "\"m\\u001b[2J\"", "name = \"m\\u{1b}[2J\": it has a line break"),
        ("{ name = \"u\" }", "{ name = \"u\", unit = \"V\\n\" }", "inputs, channel 1, unit = \"V\\n\""),
        ("q_order = 4", "q_order = 100000", "q_order = \"100000\": the link carries 65535 coefficients at most"),
        ("q_order = 4", "q_order = 9000000000000000000", "q_order = \"9000000000000000000\""),
        ("1e-3", "nan", "sample_time = \"NaN s\": it must be above 0"),
    ] {
        let text = MACHINE.replacen(from, to, 1);
        let refused = Description::parse(text.as_bytes()).unwrap_err().to_string();
        assert!(refused.contains(words) && refused.len() < 300, "{refused}");
    }
    let refused = Description::parse(MACHINE.replace("\"y\"", &format!("\"{long},\"")).as_bytes()).unwrap_err();
    assert!(refused.to_string().len() < 300, "{refused}");
    let many: Vec<String> = (0..200).map(|k| format!("{{ name = \"y{k}\" }}")).collect();
    let text = MACHINE.replace("{ name = \"y\" }", &many.join(","));
    assert!(Description::parse(text.as_bytes()).unwrap_err().to_string().contains("a frame has no room"));
    assert!(Description::parse(MACHINE.replace("q_order = 4", "q_order = 254").as_bytes()).is_ok());
}

/// A stop of another host, beside a host that asks as fast as it can with numbers of its own.
#[test]
fn a_stop_succeeds_beside_a_host_that_asks_fast() {
    let served = Served::start(Pace::RealTime(Duration::from_micros(50)));
    let mut first = Rig::connect(&served.address).unwrap();
    let (over, address, schema) = (Arc::new(AtomicBool::new(false)), served.address.clone(), first.schema());
    let life = first.ask(&Request::Alive).unwrap().life;
    let end = over.clone();
    let fast = std::thread::spawn(move || {
        let socket = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
        socket.connect(address.trim_start_matches("udp://")).unwrap();
        let mut bytes = [0; LARGEST_FRAME];
        for sequence in 1_000_000.. {
            if end.load(Ordering::Relaxed) {
                return;
            }
            let frame = Frame { kind: Kind::Request, schema, sequence, host: 99, life, body: &[1] };
            let length = frame.write(&mut bytes).unwrap();
            let _ = socket.send(&bytes[..length]);
            std::thread::sleep(Duration::from_micros(200));
        }
    });
    for _ in 0..3 {
        // Until the ramp of the stop before is out.
        while matches!(first.ask(&Request::Arm), Err(Error::Refused { outcome: Outcome::Exciting, .. })) {}
        let start = Request::Start { source: SequenceOrigin::Prbs { order: 15, hold: 4 }, amplitude: 0.1 };
        first.ask(&start).unwrap();
        let (_, stopped) = Rig::stop(&served.address).unwrap();
        assert_eq!(stopped.status.phase(), Phase::Idle);
        assert_eq!(first.ask(&Request::Alive).unwrap().status.phase(), Phase::Idle);
    }
    over.store(true, Ordering::Relaxed);
    fast.join().unwrap();
    served.end();
}

/// A machine of version 1 answers requests of that version only.
#[test]
fn a_machine_of_version_1_is_named() {
    let socket = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
    let address = format!("udp://{}", socket.local_addr().unwrap());
    let machine = std::thread::spawn(move || {
        let mut bytes = [0; LARGEST_FRAME];
        loop {
            let (length, from) = socket.recv_from(&mut bytes).unwrap();
            if Frame::read(&bytes[..length]) == Err(FrameError::Version(1)) {
                return socket.send_to(&bytes[..length], from).unwrap();
            }
        }
    });
    let refused = Rig::connect(&address).map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("speaks version 1 of the link, this program version 2"), "{refused}");
    machine.join().unwrap();
}
