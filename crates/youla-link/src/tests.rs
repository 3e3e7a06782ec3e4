//! Frames through a way that loses, doubles, swaps and damages them; readers against any bytes.

mod exploration;
mod firmware;
mod hosts;
mod keys;

use crate::*;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::vec::Vec;
use youla_rt::{Cause, Checksum, Controller, ExcitedLoop, Limits, Matrices, Phase, QCoefficients, Row};

const SHAPE: RowShape = RowShape { inputs: 2, outputs: 2 };

#[test]
fn checksum_is_that_of_the_crate_crc() {
    let reference = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let bytes: Vec<u8> = (0..2000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    for length in 0..bytes.len() {
        let mut checksum = Checksum::new();
        checksum.append(&bytes[..length / 3]);
        checksum.append(&bytes[length / 3..length]);
        assert_eq!(checksum.value(), reference.checksum(&bytes[..length]));
    }
}

fn row(sample: u64) -> Row<f32, 2, 2> {
    let s = sample as f32;
    Row {
        sample,
        y: [s, -s],
        u: [s + 0.5, 1.0],
        alpha: [0.25, s],
        beta: [f32::NAN, s],
        status: youla_rt::Status::from_bits(sample as u32),
    }
}

fn frames(rows: u64, of_each: u16) -> Vec<Vec<u8>> {
    let mut batch = RowBatch::<2, 2>::new(of_each);
    let mut sent = Vec::new();
    for sample in 0..rows {
        batch.push(&row(sample));
        if batch.is_full() || sample + 1 == rows {
            let mut buffer = [0; LARGEST_FRAME];
            let length = batch.take([7, 0, sent.len() as u32], &mut buffer).unwrap().unwrap();
            sent.push(buffer[..length].to_vec());
        }
    }
    assert!(batch.take([7, 0, 0], &mut [0; LARGEST_FRAME]).is_none());
    sent
}

/// A receiver: rows by their sample, each one tested against what was sent.
#[derive(Default)]
struct Host {
    tracker: Tracker,
    damaged: u64,
    rows: BTreeMap<u64, u32>,
}

impl Host {
    fn take(&mut self, bytes: &[u8]) {
        let Ok(frame) = Frame::read(bytes) else {
            self.damaged += 1;
            return;
        };
        assert_eq!((frame.kind, frame.schema), (Kind::Rows, 7));
        if matches!(self.tracker.receive(frame.sequence), Arrival::Doubled | Arrival::Stale) {
            return;
        }
        for view in RowBlock::read(frame.body, SHAPE).unwrap().rows() {
            let expected = row(view.sample);
            let values = expected.y.iter().chain(&expected.u).chain(&expected.alpha).chain(&expected.beta);
            assert!(view.values().map(f32::to_bits).eq(values.map(|value| value.to_bits())));
            assert_eq!(view.status, expected.status);
            *self.rows.entry(view.sample).or_default() += 1;
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Fate {
    Whole,
    Lost,
    Doubled,
    Swapped,
    Damaged(usize, u8),
}

/// 1 % each of lost, doubled, swapped and damaged frames.
fn fate() -> impl Strategy<Value = Fate> {
    prop_oneof![
        96 => Just(Fate::Whole),
        1 => Just(Fate::Lost),
        1 => Just(Fate::Doubled),
        1 => Just(Fate::Swapped),
        1 => (any::<usize>(), 1_u8..).prop_map(|(place, bits)| Fate::Damaged(place, bits)),
    ]
}

fn on_the_way(sent: &[Vec<u8>], fates: &[Fate]) -> Vec<Vec<u8>> {
    let mut received: Vec<Vec<u8>> = Vec::new();
    let mut held: Option<Vec<u8>> = None;
    for (bytes, fate) in sent.iter().zip(fates) {
        let later = held.take();
        match *fate {
            Fate::Whole => received.push(bytes.clone()),
            Fate::Lost => (),
            Fate::Doubled => received.extend([bytes.clone(), bytes.clone()]),
            Fate::Swapped => held = Some(bytes.clone()),
            Fate::Damaged(place, bits) => {
                let mut bytes = bytes.clone();
                let length = bytes.len();
                bytes[place % length] ^= bits;
                received.push(bytes);
            }
        }
        received.extend(later);
    }
    received.extend(held);
    received
}

/// Frames that the receiver must report, and those that reach it.
fn expected(fates: &[Fate]) -> [usize; 3] {
    let count = |test: fn(&Fate) -> bool| fates.iter().filter(|fate| test(fate)).count();
    [count(|f| *f == Fate::Lost), count(|f| *f == Fate::Doubled), count(|f| matches!(f, Fate::Damaged(..)))]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn nothing_on_the_way_goes_unnoticed(fates in prop::collection::vec(fate(), 500), serial in any::<bool>()) {
        let mut fates = fates;
        // What is before the first frame and after the last one cannot be seen.
        (fates[0], fates[499]) = (Fate::Whole, Fate::Whole);
        let sent = frames(500 * 5, 5);
        let received = on_the_way(&sent, &fates);
        let mut host = Host::default();
        if serial {
            let mut reader = PacketReader::new();
            for bytes in &received {
                let mut buffer = [0; LARGEST_PACKET];
                let length = write_packet(bytes, &mut buffer).unwrap();
                for byte in &buffer[..length] {
                    if let Some(frame) = reader.push(*byte) {
                        host.take(frame.unwrap());
                    }
                }
            }
        } else {
            received.iter().for_each(|bytes| host.take(bytes));
        }
        let [lost, doubled, damaged] = expected(&fates).map(|count| count as u64);
        prop_assert_eq!(host.damaged, damaged);
        prop_assert_eq!(host.tracker.doubled, doubled);
        prop_assert_eq!(host.tracker.lost, lost + damaged);
        prop_assert_eq!(host.tracker.taken, 500 - lost - damaged);
        // Every row once, or missing with its frame.
        prop_assert!(host.rows.values().all(|count| *count == 1));
        prop_assert_eq!(host.rows.len() as u64, 5 * host.tracker.taken);
    }

    /// Damage anywhere on a serial line costs the packets that it touches and none else.
    #[test]
    fn damaged_line(places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let sent = frames(200, 4);
        let mut line = Vec::new();
        for bytes in &sent {
            let mut buffer = [0; LARGEST_PACKET];
            let length = write_packet(bytes, &mut buffer).unwrap();
            line.extend_from_slice(&buffer[..length]);
        }
        for (place, value) in &places {
            let place = place.index(line.len());
            line[place] = *value;
        }
        let mut host = Host::default();
        let mut reader = PacketReader::new();
        for byte in line {
            match reader.push(byte) {
                Some(Ok(frame)) => host.take(frame),
                Some(Err(_)) => host.damaged += 1,
                None => (),
            }
        }
        prop_assert!(host.rows.len() >= 200 - 8 * places.len());
        prop_assert!(host.rows.values().all(|count| *count == 1));
    }

    /// No bytes make a reader panic; what is read is written back.
    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..1500), inputs in 0_usize..5, outputs in 0_usize..5) {
        let _ = Frame::read(&bytes);
        let shape = RowShape { inputs, outputs };
        if let Some(block) = RowBlock::read(&bytes, shape) {
            prop_assert!(block.rows().all(|row| row.values().count() == shape.values()));
        }
        let mut buffer = [0; 1500];
        if let Some(request) = Request::read(&bytes) {
            let length = request.write(&mut buffer).unwrap();
            prop_assert_eq!(&buffer[..length], &bytes[..]);
        }
        if let Some(reply) = Reply::read(&bytes) {
            prop_assert_eq!(reply.data.len() + 17, bytes.len());
        }
        let mut reader = PacketReader::new();
        for byte in &bytes {
            if let Some(Ok(frame)) = reader.push(*byte) {
                let _ = Frame::read(frame);
            }
        }
    }

    /// Short requests, all of them likely, in frames with a right checksum: a station answers each and its loop goes on.
    #[test]
    fn any_requests(requests in prop::collection::vec((0_u8..13, prop::collection::vec(any::<u8>(), 0..12)), 1..60)) {
        let mut station = station();
        for (sequence, (tag, rest)) in (0..).zip(&requests) {
            let body: Vec<u8> = [&[*tag][..], rest].concat();
            let reply = ask_bytes(&mut station, sequence, &body);
            prop_assert_eq!(reply.0, sequence);
            let u = station.command();
            let row = station.observe(&[0.0; 2], &u);
            prop_assert!(row.u.iter().all(|u| u.abs() <= 5.0));
        }
    }
}

#[test]
fn tracker_wraps_and_forgets() {
    let mut tracker = Tracker::new();
    assert_eq!(tracker.receive(u32::MAX), Arrival::New { missing: 0 });
    assert_eq!(tracker.receive(1), Arrival::New { missing: 1 });
    assert_eq!(tracker.receive(0), Arrival::Late);
    assert_eq!(tracker.receive(0), Arrival::Doubled);
    assert_eq!(tracker.receive(101), Arrival::New { missing: 99 });
    assert_eq!(tracker.receive(1), Arrival::Stale);
    assert_eq!((tracker.taken, tracker.lost, tracker.reordered), (4, 99, 1));
}

fn station() -> Station<'static, 2, 2, 2, 2> {
    let controller = Controller::new(Matrices {
        a: [[1.1_f32, 0.0], [0.0, 1.05]],
        b: [[1.0, 0.0], [0.0, 1.0]],
        c: [[1.0, 0.0], [0.0, 1.0]],
        d: [[0.0; 2]; 2],
        f: [[-0.6, 0.0], [0.0, -0.55]],
        l: [[-0.7, 0.0], [0.0, -0.65]],
    });
    let limits = Limits {
        y: [9.0; 2],
        beta: [9.0; 2],
        u: [5.0; 2],
        rate: [10.0; 2],
        clipped: 9,
        stuck: 0,
        host: 50,
        duration: 0,
    };
    let machine = Machine { description: "name = \"two\"", table: &[[1.0, 1.0], [-1.0, 1.0]], rows: 4, life: 9 };
    Station::new(ExcitedLoop::new(controller.unwrap(), limits, 4).unwrap(), machine)
}

fn ask_bytes(station: &mut Station<'static, 2, 2, 2, 2>, sequence: u32, body: &[u8]) -> (u32, Outcome, Vec<u8>) {
    let mut buffer = [0; LARGEST_FRAME];
    let frame = Frame { kind: Kind::Request, schema: station.schema(), sequence, host: 1, life: 9, body };
    let length = frame.write(&mut buffer).unwrap();
    let mut answer = [0; LARGEST_FRAME];
    let length = station.receive(&buffer[..length], &mut answer).unwrap().unwrap();
    let frame = Frame::read(&answer[..length]).unwrap();
    assert_eq!((frame.kind, frame.schema), (Kind::Reply, station.schema()));
    let reply = Reply::read(frame.body).unwrap();
    (reply.request, reply.outcome, reply.data.to_vec())
}

fn ask(station: &mut Station<'static, 2, 2, 2, 2>, sequence: u32, request: Request<'_>) -> (Outcome, Vec<u8>) {
    let mut body = [0; 200];
    let length = request.write(&mut body).unwrap();
    let (_, outcome, data) = ask_bytes(station, sequence, &body[..length]);
    (outcome, data)
}

#[test]
fn dialogue() {
    let mut station = station();
    let described = ask(&mut station, 0, Request::Describe);
    assert_eq!(described, (Outcome::Done, b"name = \"two\"".to_vec()));
    let start = Request::Start { source: SequenceOrigin::Prbs { order: 7, hold: 2 }, amplitude: 0.5 };
    assert_eq!(ask(&mut station, 1, start).0, Outcome::NotArmed);
    assert_eq!(ask(&mut station, 2, Request::Arm).0, Outcome::Done);
    let wrong = Request::Start { source: SequenceOrigin::Prbs { order: 8, hold: 2 }, amplitude: 0.5 };
    assert_eq!(ask(&mut station, 3, wrong).0, Outcome::Source);
    assert_eq!(ask(&mut station, 4, start).0, Outcome::Done);
    // The same request again is answered again.
    assert_eq!(ask(&mut station, 4, start).0, Outcome::Done);
    assert_eq!(station.running().status().phase(), Phase::Exciting);
    // An older one, late on the way, is not executed.
    assert_eq!(ask(&mut station, 3, Request::BeginQ).0, Outcome::Stale);
    assert_eq!(station.running().status().phase(), Phase::Exciting);

    let q = QCoefficients { a: [[0.5_f32, 0.0], [0.0, 0.25]], b: [[0.1; 2]; 2], c: [[0.2; 2]; 2] };
    let bytes: Vec<u8> = q.values().flat_map(f32::to_le_bytes).collect();
    assert_eq!(ask(&mut station, 5, Request::ReadQ { place: 0 }).0, Outcome::NoQ);
    assert_eq!(ask(&mut station, 6, Request::BeginQ).0, Outcome::Done);
    assert_eq!(ask(&mut station, 7, Request::WriteQ { place: 0, values: &bytes[..20] }).0, Outcome::Done);
    assert_eq!(ask(&mut station, 7, Request::WriteQ { place: 0, values: &bytes[..20] }).0, Outcome::Done);
    assert_eq!(ask(&mut station, 8, Request::WriteQ { place: 5, values: &bytes[20..] }).0, Outcome::Done);
    assert_eq!(ask(&mut station, 9, Request::CommitQ(q.checksum())).0, Outcome::Done);
    assert_eq!(ask(&mut station, 10, Request::SwitchQ).0, Outcome::Done);
    assert_eq!(ask(&mut station, 11, Request::ReadQ { place: 2 }), (Outcome::Done, bytes[8..].to_vec()));

    // The host falls silent: 50 samples later the excitation ends, and the rows say so.
    let mut statuses = Vec::new();
    for _ in 0..80 {
        let u = station.command();
        let _ = station.observe(&[0.1, -0.1], &u);
        let mut buffer = [0; LARGEST_FRAME];
        if let Some(length) = station.frame(&mut buffer) {
            let frame = Frame::read(&buffer[..length.unwrap()]).unwrap();
            statuses.extend(RowBlock::read(frame.body, SHAPE).unwrap().rows().map(|row| row.status));
        }
    }
    let tripped = statuses.iter().position(|status| status.trip().is_some());
    assert_eq!(tripped, Some(50));
    assert_eq!(statuses[50].trip().unwrap().cause, Cause::HostSilent);
    assert_eq!(ask(&mut station, 12, Request::SwitchQ).0, Outcome::Tripped);
    let mut unknown = [0; LARGEST_FRAME];
    let body = [1];
    let length = Frame { kind: Kind::Request, schema: 1, sequence: 13, host: 1, life: 9, body: &body }
        .write(&mut unknown)
        .unwrap();
    let mut answer = [0; LARGEST_FRAME];
    let length = station.receive(&unknown[..length], &mut answer).unwrap().unwrap();
    let frame = Frame::read(&answer[..length]).unwrap();
    assert_eq!(Reply::read(frame.body).unwrap().outcome, Outcome::OtherSchema);
}
