//! The numbers of firmware/nucleo-f446re, which needs a board to run, on the host.

#[path = "../../../../firmware/nucleo-f446re/src/machine.rs"]
mod machine;

use crate::Description;
use machine::{MIDDLE, RATE, ROOM, code, rig, volts};
use youla_link::{Frame, Kind, Reply, Request};
use youla_rt::Phase;

/// The reply of the board to a request, both as frames.
fn ask(board: &mut machine::Rig, sequence: u32, request: &Request<'_>) -> Vec<u8> {
    let mut body = [0; 64];
    let length = request.write(&mut body).unwrap();
    let mut bytes = [0; ROOM];
    let (schema, life) = (board.schema(), board.life());
    let frame = Frame { kind: Kind::Request, schema, sequence, host: 1, life, body: &body[..length] };
    let length = frame.write(&mut bytes).unwrap();
    let mut reply = [0; ROOM];
    let length = board.receive(&bytes[..length], &mut reply).unwrap().unwrap();
    reply[..length].to_vec()
}

fn entry(table: &toml::Table, path: [&str; 3], row: usize, column: usize) -> f32 {
    let value = &table[path[0]][path[1]][path[2]][row][column];
    value.as_float().or(value.as_integer().map(|whole| whole as f64)).unwrap() as f32
}

#[test]
fn description_states_the_numbers_that_run() {
    assert_eq!(machine::KEY, None, "a key that is published is none");
    let mut board = rig(5).unwrap();
    let reply = ask(&mut board, 1, &Request::Describe);
    let description = Description::parse(Reply::read(Frame::read(&reply).unwrap().body).unwrap().data).unwrap();
    assert_eq!(description.sample_time, 1.0 / f64::from(RATE));
    assert_eq!((description.inputs.len(), description.outputs.len(), description.q_order), (1, 1, Some(4)));
    let stated = |table, name, key| entry(&description.further, [table, name, key], 0, 0);
    let model = |key| stated("nominal", "state_space", key);
    let gain = |key| stated("controller", "observer", key);
    let runs = board.running().controller().matrices();
    assert_eq!([model("a"), model("b"), model("c"), model("d")], [runs.a, runs.b, runs.c, runs.d].map(|m| m[0][0]));
    assert_eq!([gain("state_feedback"), gain("observer_gain")], [runs.f[0][0], runs.l[0][0]]);
}

#[test]
fn codes_saturate_and_round() {
    assert_eq!([-10.0, 0.0, 10.0].map(code), [0, MIDDLE, 4095]);
    for u in [-1.5_f32, -0.1234, 0.0004, 1.5] {
        assert!((volts(code(u)) - u).abs() <= 0.51 * volts(MIDDLE + 1), "{u}");
    }
}

/// The low-pass of the file with an error of 10 % in its time constant, through converters of 12 bits.
#[test]
fn loop_of_the_low_pass_runs_excited() {
    let mut board = rig(5).unwrap();
    let mut buffer = [0; ROOM];
    let (mut y, mut largest) = (0.0_f32, 0.0_f32);
    let pole = (-1.0_f32 / 11.0).exp();
    for sample in 0..10 * RATE {
        let applied = board.command().map(code).map(volts);
        let row = board.observe(&[volts(code(y))], &applied);
        y = pole * y + (1.0 - pole) * applied[0];
        largest = largest.max(row.beta[0].abs());
        if let Some(written) = board.frame(&mut buffer) {
            written.unwrap();
        }
        let request = match sample {
            10 => Request::Arm,
            11 => Request::Start { source: crate::SequenceOrigin::Own, amplitude: 0.5 },
            // A sign of life each 0.1 s.
            _ if sample % 500 == 0 => Request::Alive,
            _ => continue,
        };
        ask(&mut board, sample + 1, &request);
    }
    assert_eq!(board.running().status().phase(), Phase::Exciting);
    assert!(largest > 0.0 && largest < 0.1, "{largest}");
}
