//! Two hosts at one machine: findings of an attack, one test each.

use super::station;
use crate::*;
use std::vec::Vec;
use youla_rt::{Cause, Phase};

type Two = Station<'static, 2, 2, 2, 2>;

const START: Request<'_> = Request::Start { source: SequenceOrigin::Prbs { order: 7, hold: 2 }, amplitude: 0.1 };
/// Of `station`.
const LIFE: u32 = 9;

/// Outcome and life of the reply, which is for this host.
fn ask_in(station: &mut Two, (host, sequence): (u32, u32), life: u32, request: Request<'_>) -> (Outcome, u32) {
    let (mut body, mut bytes, mut answer) = ([0; 200], [0; LARGEST_FRAME], [0; LARGEST_FRAME]);
    let length = request.write(&mut body).unwrap();
    let schema = if request == Request::Describe { 0 } else { station.schema() };
    let frame = Frame { kind: Kind::Request, schema, sequence, host, life, body: &body[..length] };
    let length = frame.write(&mut bytes).unwrap();
    let length = station.receive(&bytes[..length], &mut answer).unwrap().unwrap();
    let frame = Frame::read(&answer[..length]).unwrap();
    assert_eq!(frame.host, host);
    let reply = Reply::read(frame.body).unwrap();
    assert_eq!(reply.request, sequence);
    (reply.outcome, frame.life)
}

fn ask(station: &mut Two, host: u32, sequence: u32, request: Request<'_>) -> Outcome {
    ask_in(station, (host, sequence), LIFE, request).0
}

fn excited_by(host: u32) -> Two {
    let mut station = station();
    assert_eq!(ask(&mut station, host, 1, Request::Arm), Outcome::Done);
    assert_eq!(ask(&mut station, host, 2, START), Outcome::Done);
    station
}

fn phase(station: &Two) -> Phase {
    station.running().status().phase()
}

fn sample(station: &mut Two) {
    let u = station.command();
    // Values that change: no sensor is stuck.
    let y = 1e-3 * station.running().sample() as f32;
    let _ = station.observe(&[y % 0.1, -y % 0.1], &u);
}

#[test]
fn a_stop_is_executed_whatever_its_numbers() {
    // The number of the last request of the other host, a lower one, that of the host itself, a host in its place.
    for (host, sequence) in [(2, 2), (2, 0), (1, 2), (1, 0), (0, u32::MAX)] {
        let mut station = excited_by(1);
        assert_eq!(ask(&mut station, host, sequence, Request::Stop), Outcome::Done);
        assert_eq!(phase(&station), Phase::Idle, "host {host}, number {sequence}");
        // A start from before it, late on the way.
        assert_ne!(ask(&mut station, 1, 3, START), Outcome::Done);
    }
    let mut station = excited_by(1);
    let mut bytes = [0; LARGEST_FRAME];
    let stop = Frame { kind: Kind::Request, schema: 77, sequence: 5, host: 3, life: 1, body: &[4] };
    let length = stop.write(&mut bytes).unwrap();
    assert!(is_stop(&bytes[..length]));
    let _ = station.receive(&bytes[..length], &mut [0; LARGEST_FRAME]).unwrap();
    assert_eq!(phase(&station), Phase::Idle, "a stop for another machine and another life");
}

#[test]
fn requests_of_one_host_make_no_other_late() {
    let mut station = excited_by(1);
    for sequence in 1_000_000..1_000_100 {
        assert_eq!(ask(&mut station, 2, sequence, Request::Alive), Outcome::Done);
    }
    assert_eq!(ask(&mut station, 1, 3, Request::BeginQ), Outcome::Done);
    // Hosts that change something take all places but that of the host that armed; a new one begins above those that are forgotten.
    for host in 10..30 {
        let first = ask(&mut station, host, 5 + host, Request::ReleaseQ);
        assert_eq!(first, Outcome::Done, "host {host}");
    }
    assert_eq!(ask(&mut station, 9, 5, Request::ReleaseQ), Outcome::Stale);
    assert_eq!(ask(&mut station, 1, 3, Request::BeginQ), Outcome::Done);
    assert_eq!(ask(&mut station, 1, 2, Request::BeginQ), Outcome::Stale);
    assert_eq!(ask(&mut station, 1, 4, Request::Stop), Outcome::Done);
    assert_eq!(phase(&station), Phase::Idle);
}

#[test]
fn only_the_host_that_started_is_a_sign_of_life() {
    let mut station = excited_by(1);
    for sequence in 0..60 {
        sample(&mut station);
        for request in [Request::Describe, Request::Alive, Request::ReleaseQ] {
            let _ = ask(&mut station, 2, 3 * sequence, request);
        }
        // Its old requests on their way twice are none either.
        let _ = ask(&mut station, 1, 2, START);
    }
    assert_eq!(station.running().status().trip().unwrap().cause, Cause::HostSilent);
    let mut station = excited_by(1);
    for sequence in 3..100 {
        sample(&mut station);
        assert_eq!(ask(&mut station, 1, sequence, Request::Alive), Outcome::Done);
    }
    assert_eq!(phase(&station), Phase::Exciting);
}

#[test]
fn only_the_host_that_armed_starts() {
    let mut station = station();
    assert_eq!(ask(&mut station, 1, 1, Request::Arm), Outcome::Done);
    assert_eq!(ask(&mut station, 2, 1, START), Outcome::NotArmed);
    assert_eq!(ask(&mut station, 1, 2, START), Outcome::Done);
}

#[test]
fn another_request_with_the_last_number_is_not_done() {
    let mut station = excited_by(1);
    assert_eq!(ask(&mut station, 1, 2, START), Outcome::Done);
    assert_eq!(ask(&mut station, 1, 2, Request::BeginQ), Outcome::Stale);
}

#[test]
fn requests_for_the_life_before_are_refused() {
    let mut station = station();
    for request in [Request::Alive, Request::Arm, START] {
        assert_eq!(ask_in(&mut station, (1, 1), 8, request), (Outcome::OtherLife, LIFE));
    }
    assert_eq!(ask_in(&mut station, (1, 1), 0, Request::Describe), (Outcome::Done, LIFE));
    assert_eq!(phase(&station), Phase::Idle);
}

/// A frame of version 1: header without host and life.
fn old(sequence: u32, body: &[u8]) -> Vec<u8> {
    let mut bytes = [b"YL\x01\x02".as_slice(), &[0; 4], &sequence.to_le_bytes(), body].concat();
    let mut checksum = youla_rt::Checksum::new();
    checksum.append(&bytes);
    bytes.extend(checksum.value().to_le_bytes());
    bytes
}

#[test]
fn a_host_of_version_1_is_told_so_and_stops() {
    let mut station = excited_by(1);
    let mut describe = [0; 32];
    let length = write_old_describe(&mut describe).unwrap();
    assert_eq!(describe[..length], old(1, &[0]));
    for (body, outcome, phase) in [(0, Outcome::NotUnderstood, Phase::Exciting), (4, Outcome::Done, Phase::Idle)] {
        let mut answer = [0; LARGEST_FRAME];
        let length = station.receive(&old(6, &[body]), &mut answer).unwrap().unwrap();
        assert_eq!(Frame::read(&answer[..length]), Err(FrameError::Version(1)));
        assert_eq!(answer[..4], *b"YL\x01\x03");
        let reply = Reply::read(&answer[12..length - 4]).unwrap();
        assert_eq!((reply.request, reply.outcome, reply.status.phase()), (6, outcome, phase));
    }
    assert!(is_stop(&old(6, &[4])) && !is_stop(&old(6, &[1])) && !is_stop(&old(6, &[4])[..16]));
}
