//! Frames that are signed, and a machine whose key a stranger does not have.

use super::station;
use crate::*;
use std::vec;
use std::vec::Vec;
use youla_rt::Phase;

fn key(bytes: &[u8]) -> Key {
    let mut whole = [0; 32];
    whole[..bytes.len()].copy_from_slice(bytes);
    Key::new(&whole)
}

fn request(host: u32, sequence: u32, request: Request<'_>) -> Vec<u8> {
    let (mut body, mut bytes) = ([0; 200], vec![0; LARGEST_FRAME]);
    let length = request.write(&mut body).unwrap();
    let schema = station().schema();
    let frame = Frame { kind: Kind::Request, schema, sequence, host, life: station().life(), body: &body[..length] };
    let length = frame.write(&mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

fn signed(key: &Key, frame: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; LARGEST_SIGNED];
    bytes[..frame.len()].copy_from_slice(frame);
    let length = key.sign(&mut bytes, frame.len()).unwrap();
    bytes.truncate(length);
    bytes
}

const START: Request<'_> = Request::Start { source: SequenceOrigin::Prbs { order: 7, hold: 2 }, amplitude: 0.1 };

/// RFC 4231, cases 1 to 4: their keys are shorter than 32 bytes, which zeros change in nothing.
#[test]
fn tags_are_those_of_rfc_4231() {
    let counted: Vec<u8> = (1..=25).collect();
    for (bytes, data, tag) in [
        (
            &[0x0b; 20][..],
            &b"Hi There"[..],
            [0xb034_4c61_d8db_3853_5ca8_afce_af0b_f12b_u128, 0x881d_c200_c983_3da7_26e9_376c_2e32_cff7],
        ),
        (
            b"Jefe",
            b"what do ya want for nothing?",
            [0x5bdc_c146_bf60_754e_6a04_2426_0895_75c7, 0x5a00_3f08_9d27_3983_9dec_58b9_64ec_3843],
        ),
        (
            &[0xaa; 20],
            &[0xdd; 50],
            [0x773e_a91e_3680_0e46_854d_b8eb_d091_81a7, 0x2959_098b_3ef8_c122_d963_5514_ced5_65fe],
        ),
        (&counted, &[0xcd; 50], [0x8255_8a38_9a44_3c0e_a4cc_8198_99f2_083a, 0x85f0_faa3_e578_f807_7a2e_3ff4_6729_665b]),
    ] {
        let bytes = signed(&key(bytes), data);
        assert_eq!(bytes, [b"YK", data, tag.map(u128::to_be_bytes).as_flattened()].concat());
    }
}

#[test]
fn a_signed_frame_is_read_by_all_and_verified_by_who_has_the_key() {
    let (own, other) = (key(b"own"), key(b"other"));
    let plain = request(3, 8, START);
    let bytes = signed(&own, &plain);
    assert_eq!(Frame::read(&bytes), Frame::read(&plain));
    assert_eq!(own.verify(&bytes), Frame::read(&plain));
    assert_eq!(other.verify(&bytes), Err(FrameError::Key));
    assert_eq!(own.verify(&plain), Err(FrameError::Unsigned));
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(own.verify(&damaged).is_err(), "bit {bit}");
    }
    for length in 0..bytes.len() {
        assert!(own.verify(&bytes[..length]).is_err(), "{length} bytes");
    }
    // A tag of another frame.
    let mixed = [&bytes[..bytes.len() - 32], &signed(&own, &request(3, 9, START))[bytes.len() - 32..]].concat();
    assert_eq!(own.verify(&mixed), Err(FrameError::Key));
    let mut short = vec![0; plain.len() + 33];
    short[..plain.len()].copy_from_slice(&plain);
    assert!(own.sign(&mut short, plain.len()).is_err());
    // The longest one passes a serial line.
    let body = [7; LARGEST_BODY];
    let mut longest = [0; LARGEST_SIGNED];
    let frame = Frame { kind: Kind::Reply, schema: 1, sequence: 2, host: 3, life: 4, body: &body };
    let length = frame.write(&mut longest).unwrap();
    let length = own.sign(&mut longest, length).unwrap();
    assert_eq!(length, LARGEST_SIGNED);
    let (mut packet, mut reader) = ([0; LARGEST_PACKET], PacketReader::new());
    let sent = write_packet(&longest, &mut packet).unwrap();
    let found = packet[..sent].iter().find_map(|byte| reader.push(*byte).map(|packet| packet.unwrap().to_vec()));
    assert_eq!(own.verify(&found.unwrap()), Ok(frame));
}

#[test]
fn a_machine_with_a_key_executes_nothing_of_a_stranger_but_a_stop() {
    let (own, other) = (key(b"own"), key(b"other"));
    let values = [0; 16];
    for asked in [
        Request::Describe,
        Request::Alive,
        Request::Arm,
        START,
        Request::BeginQ,
        Request::WriteQ { place: 0, values: &values },
        Request::CommitQ(7),
        Request::SwitchQ,
        Request::ReleaseQ,
        Request::ReadQ { place: 0 },
    ] {
        let plain = request(1, 5, asked);
        for forged in [plain.clone(), signed(&other, &plain)] {
            assert!(own.verify(&forged).is_err(), "{asked:?}");
            let (mut machine, mut reply) = (excited(), [0; LARGEST_FRAME]);
            let books = machine.books();
            let length = machine.receive_unsigned(&forged, &mut reply).unwrap().unwrap();
            let frame = Frame::read(&reply[..length]).unwrap();
            let read = Reply::read(frame.body).unwrap();
            assert_eq!((frame.host, read.request, read.outcome), (1, 5, Outcome::Key));
            assert_eq!((machine.running().status().phase(), machine.books()), (Phase::Exciting, books));
            assert!(length <= forged.len() + 16, "an answer that is no means to flood somebody");
        }
        assert!(own.verify(&signed(&own, &plain)).is_ok());
    }
    let stop = request(77, 5, Request::Stop);
    for stop in [stop.clone(), signed(&other, &stop)] {
        let (mut machine, mut reply) = (excited(), [0; LARGEST_FRAME]);
        let length = machine.receive_unsigned(&stop, &mut reply).unwrap().unwrap();
        assert_eq!(Reply::read(Frame::read(&reply[..length]).unwrap().body).unwrap().outcome, Outcome::Done);
        assert_eq!(machine.running().status().phase(), Phase::Idle);
    }
    assert!(is_stop(&signed(&own, &stop)));
    assert!(excited().receive_unsigned(b"YK", &mut [0; 64]).is_err());
}

/// Host 1 has armed and started.
fn excited() -> Station<'static, 2, 2, 2, 2> {
    let mut machine = station();
    for (number, asked) in [(1, Request::Arm), (2, START)] {
        let _ = machine.receive(&request(1, number, asked), &mut [0; LARGEST_FRAME]).unwrap();
    }
    machine
}

/// Stops without a signature that carry the number of a host and its sequence moved by half of the range twice: the old start of that host would be new again, or
/// its next request late.
#[test]
fn forged_stops_move_no_numbers() {
    let mut machine = excited();
    let mut answer = [0; LARGEST_FRAME];
    let books = machine.books();
    let half = u32::MAX / 2;
    for sequence in [2 + half, 2_u32.wrapping_add(2 * half), 0, u32::MAX] {
        let _ = machine.receive_unsigned(&request(1, sequence, Request::Stop), &mut answer).unwrap();
    }
    assert_eq!((machine.running().status().phase(), machine.books()), (Phase::Idle, books));
    for (number, asked) in [(1, Request::Arm), (2, START)] {
        let _ = machine.receive(&request(1, number, asked), &mut answer).unwrap();
        assert_eq!(machine.running().status().phase(), Phase::Idle, "{asked:?}");
    }
    let length = machine.receive(&request(1, 3, Request::BeginQ), &mut answer).unwrap().unwrap();
    let reply = Reply::read(Frame::read(&answer[..length]).unwrap().body).unwrap();
    assert_eq!(reply.outcome, Outcome::Done);
}

/// Whoever has heard every frame of a machine's life sends them again, in any order and at any time: no request is executed twice, though the machine keeps the
/// last request of four hosts only.
#[test]
fn nothing_that_was_heard_is_executed_again() {
    let mut station = station();
    let mut answer = [0; LARGEST_FRAME];
    let mut ask = |station: &mut Station<'static, 2, 2, 2, 2>, bytes: &[u8]| {
        let length = station.receive(bytes, &mut answer).unwrap().unwrap();
        let reply = Reply::read(Frame::read(&answer[..length]).unwrap().body).unwrap();
        (reply.outcome, reply.data.try_into().ok().map(u32::from_le_bytes))
    };
    let mut heard: Vec<Vec<u8>> = Vec::new();
    for host in 1..=12_u32 {
        let mut number = 0;
        for asked in [Request::Arm, START, Request::Stop] {
            number += 1;
            let mut bytes = request(host, number, asked);
            let mut outcome = ask(&mut station, &bytes);
            if let (Outcome::Stale, Some(above)) = outcome {
                assert!(asked == Request::Arm && host > 5 && above >= number, "host {host}: {asked:?} {above}");
                number = above + 1;
                bytes = request(host, number, asked);
                outcome = ask(&mut station, &bytes);
            }
            assert_eq!(outcome.0, Outcome::Done, "host {host}: {asked:?}");
            heard.push(bytes);
        }
        // The ramp ends.
        while station.running().is_excited() {
            let u = station.command();
            let y = 1e-3 * station.running().sample() as f32;
            let _ = station.observe(&[y % 0.1, -y % 0.1], &u);
        }
        for (first, second) in heard.iter().flat_map(|first| heard.iter().map(move |second| (first, second))) {
            for bytes in [first, second] {
                let _ = ask(&mut station, bytes);
                assert_eq!(station.running().status().phase(), Phase::Idle, "after host {host}");
            }
        }
    }
}
