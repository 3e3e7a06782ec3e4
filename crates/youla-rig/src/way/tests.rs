//! A machine at the other end of a pseudo-terminal.

use super::*;
use crate::{Recorder, Request, Rig, rotor};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use youla_link::{LARGEST_FRAME, SequenceOrigin};
use youla_rt::Phase;

/// Serves a rotor in lock-step on a serial line: 20 rows for each request. Noise between the packets, as a plug makes it.
fn serve(port: SerialPort, over: &AtomicBool) {
    let mut twin = rotor(1).unwrap();
    let mut line = SerialLine { port, packets: PacketReader::new(), bytes: Vec::new(), begun: false };
    let send = |line: &SerialLine, frame: &[u8]| {
        let mut packet = [0; LARGEST_PACKET];
        let length = write_packet(frame, &mut packet).unwrap();
        line.port.write_all(&packet[..length]).unwrap();
    };
    let mut bytes = [0; LARGEST_FRAME];
    while !over.load(Ordering::Relaxed) {
        let Some(request) = line.receive(Duration::from_millis(5)).unwrap() else { continue };
        let Ok(Some(length)) = twin.station.receive(&request, &mut bytes) else { continue };
        send(&line, &bytes[..length]);
        line.port.write_all(&[17, 0, 99]).unwrap();
        loop {
            twin.sample();
            if let Some(length) = twin.station.frame(&mut bytes) {
                send(&line, &bytes[..length.unwrap()]);
                break;
            }
        }
    }
}

#[test]
fn rows_come_over_a_serial_line() {
    let (host, machine) = SerialPort::pair().unwrap();
    let over = Arc::new(AtomicBool::new(false));
    let end = over.clone();
    let thread = std::thread::spawn(move || serve(machine, &end));
    let mut rig = Rig::unknown(Way::serial(host), "serial:test").described().unwrap();
    assert_eq!(rig.description().name, "rotor");
    let path = std::env::temp_dir().join(format!("youla-rig-serial-{}.csv", std::process::id()));
    let mut recorder = Recorder::create(&path, rig.description(), rig.schema()).unwrap();
    rig.ask(&Request::Arm).unwrap();
    rig.ask(&Request::Start { source: SequenceOrigin::Prbs { order: 10, hold: 2 }, amplitude: 0.2 }).unwrap();
    for _ in 0..100 {
        rig.ask(&Request::Alive).unwrap();
    }
    let last = rig.ask(&Request::Alive).unwrap();
    assert_eq!(last.status.phase(), Phase::Exciting);
    rig.record(&mut recorder, Duration::from_millis(100)).unwrap();
    let largest = recorder.take_largest();
    assert!(largest.len() == 8 && largest[4] > 0.04 && recorder.take_largest() == [0.0; 8], "{largest:?}");
    let end = recorder.end(last.sample);
    let report = recorder.finish(end).unwrap();
    over.store(true, Ordering::Relaxed);
    thread.join().unwrap();
    assert_eq!((report.rows, report.missing, report.frames.lost), (104 * 20, 0, 0), "{report:?}");
    // Two pieces between the packets each time.
    assert_eq!(report.damaged, 2 * 104, "{report:?}");
    std::fs::remove_file(path).unwrap();
}

#[test]
fn an_address_that_cannot_be_used_is_named() {
    for (address, words) in [
        ("serial:/dev/no-such-line", "serial:/dev/no-such-line: "),
        ("serial:/dev/null@fast", "the speed is no number"),
        ("udp://no port", "give an address as udp://127.0.0.1:4000 or serial:/dev/ttyACM0"),
    ] {
        let error = Rig::connect(address).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
