//! Machines and hosts with a key, without one, with another one.

use super::*;
use std::path::Path;

/// A file of a new key; the folder is removed with it.
struct KeyFile(PathBuf);

impl KeyFile {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("youla-{}-{name}.key", std::process::id()));
        let _ = std::fs::remove_file(&path);
        write_key(&path).unwrap();
        KeyFile(path)
    }

    fn key(&self) -> Key {
        read_key(&self.0).unwrap()
    }

    fn of(&self, served: &Served) -> String {
        format!("{},key={}", served.address, self.0.display())
    }
}

impl Drop for KeyFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

fn refused(address: &str) -> String {
    Rig::connect(address).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn each_mismatch_of_keys_has_its_sentence() {
    let (own, other) = (KeyFile::new("own"), KeyFile::new("other"));
    let pace = Pace::RealTime(Duration::from_micros(50));
    let served = Served::of(|| rotor(1).unwrap(), pace, Some(own.key()));
    for address in [served.address.clone(), other.of(&served)] {
        let refused = refused(&address);
        assert!(refused.contains("signed with its key only; put \",key=FILE\""), "{refused}");
    }
    assert_eq!(Rig::connect(&own.of(&served)).unwrap().description().name, "rotor");
    served.end();
    let open = Served::start(pace);
    let refused = refused(&own.of(&open));
    assert!(refused.contains("replies without the key") && refused.contains("leave out \",key=FILE\""), "{refused}");
    open.end();
}

#[test]
fn an_excitation_is_stopped_by_anybody_and_recorded_by_who_has_the_key() {
    let own = KeyFile::new("record");
    let served = Served::of(|| rotor(1).unwrap(), Pace::RealTime(Duration::from_micros(50)), Some(own.key()));
    let mut rig = Rig::connect(&own.of(&served)).unwrap();
    rig.ask(&Request::Arm).unwrap();
    rig.ask(&Request::Start { source: SequenceOrigin::Prbs { order: 15, hold: 4 }, amplitude: 0.1 }).unwrap();
    let path = file("keys");
    let mut recorder = Recorder::create(&path, rig.description(), rig.schema()).unwrap();
    for _ in 0..10 {
        rig.record(&mut recorder, Duration::from_millis(20)).unwrap();
        assert_eq!(rig.ask(&Request::Alive).unwrap().status.phase(), Phase::Exciting);
    }
    // A host without the key.
    let (stopper, answer) = Rig::stop(&served.address).unwrap();
    assert_eq!((answer.status.phase(), &stopper.description().name), (Phase::Idle, &served.address));
    let end = rig.ask(&Request::Alive).unwrap();
    assert_eq!(end.status.phase(), Phase::Idle);
    rig.record(&mut recorder, Duration::from_millis(50)).unwrap();
    let end = recorder.end(end.sample);
    let report = recorder.finish(end).unwrap();
    assert_eq!((report.foreign, report.damaged, report.parts.len()), (0, 0, 1), "{report:?}");
    whole(&samples(&path), &report);
    assert!(report.rows > 3000, "{report:?}");
    std::fs::remove_file(path).unwrap();
    served.end();
}

/// The machine keeps four hosts; the ones after them learn above which number they begin.
#[test]
fn each_of_many_hosts_is_heard() {
    let served = Served::start(Pace::RealTime(Duration::from_micros(50)));
    let mut hosts: Vec<Rig> = (0..9).map(|_| Rig::connect(&served.address).unwrap()).collect();
    for round in 0..3 {
        for (number, host) in hosts.iter_mut().enumerate() {
            let outcome = host.ask(&Request::ReleaseQ).map(|answer| answer.outcome);
            assert!(matches!(outcome, Ok(Outcome::Done)), "round {round}, host {number}: {outcome:?}");
        }
    }
    served.end();
}

#[test]
fn files_that_are_no_keys_are_named() {
    let own = KeyFile::new("file");
    let kept = std::fs::read_to_string(&own.0).unwrap();
    assert!(kept.trim_end().len() == 64 && kept.ends_with('\n'));
    let again = write_key(&own.0).unwrap_err().to_string();
    assert!(
        again.contains(".key: there is such a file already") && std::fs::read_to_string(&own.0).unwrap() == kept,
        "{again}"
    );
    #[cfg(unix)]
    assert_eq!(std::os::unix::fs::PermissionsExt::mode(&own.0.metadata().unwrap().permissions()) & 0o777, 0o600);
    // The same digits in upper case and in lines.
    std::fs::write(&own.0, kept.to_uppercase().replace('A', "A\r\n ")).unwrap();
    own.key();
    for (text, problem) in [
        (&kept[..60], "it has 60 digits"),
        ("", "it has 0 digits"),
        ("my password", "other characters than hexadecimal digits"),
        (&"ab".repeat(10_000), "it has 4096 digits"),
    ] {
        std::fs::write(&own.0, text).unwrap();
        let refused = read_key(&own.0).unwrap_err().to_string();
        assert!(refused.contains(problem) && refused.contains("`youla rig key FILE` makes one"), "{refused}");
    }
    std::fs::write(&own.0, [0xff, 0xfe]).unwrap();
    assert!(matches!(read_key(&own.0), Err(Error::Key { .. })));
    assert!(matches!(read_key(Path::new("no such file")), Err(Error::Key { .. })));
}
