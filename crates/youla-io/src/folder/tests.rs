//! What is replaced, what is kept, and numbers that are taken once.

use super::*;

/// A folder of its own, removed in the end.
struct Place(PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let place = std::env::temp_dir().join(format!("youla-folder-{name}-{}", std::process::id()));
        fs::create_dir_all(&place).unwrap();
        Place(place)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn write(target: &Path, replace: bool, names: &[&str]) -> Result<PathBuf> {
    let folder = RunFolder::create(target, replace)?;
    names.iter().try_for_each(|name| folder.text(name, name))?;
    folder.finish()
}

#[test]
fn only_files_of_a_run_are_replaced() {
    let place = Place::new("replace");
    let run = place.0.join("run");
    write(&run, false, &["run.toml", "summary.json", "1-record/a.mat", "2-old/b.mat"]).unwrap();
    assert!(matches!(write(&run, false, &["summary.json"]), Err(Error::OutputExists { .. })));
    write(&run, true, &["summary.json", "1-record/c.mat"]).unwrap();
    let expected = ["1-record/c.mat", "files.txt", "summary.json"].map(PathBuf::from);
    assert_eq!(files_below(&run).unwrap(), expected);
    for foreign in ["notes.txt", "1-record/mine.mat"] {
        fs::write(run.join(foreign), "mine").unwrap();
        let refused = write(&run, true, &["summary.json"]).unwrap_err().to_string();
        assert!(refused.contains(foreign) && refused.contains("no run wrote"), "{refused}");
        assert_eq!(fs::read_to_string(run.join(foreign)).unwrap(), "mine");
        fs::remove_file(run.join(foreign)).unwrap();
    }
    assert_eq!(fs::read_dir(&place.0).unwrap().count(), 1, "nothing is left beside it");
}

/// A model of an older run that the new one starts from would be lost.
#[test]
fn what_is_read_is_not_replaced() {
    let place = Place::new("read");
    let (run, log) = (place.0.join("run"), place.0.join("log.csv"));
    fs::write(&log, "t,u").unwrap();
    write(&run, false, &["6-model/model.json"]).unwrap();
    let next = RunFolder::create(&run, true).unwrap();
    assert!(next.require_unread(&[log.clone(), place.0.join("absent.json")]).is_ok());
    let refused = next.require_unread(&[log, run.join("6-model/../6-model/model.json")]).unwrap_err().to_string();
    assert!(refused.contains("the run reads") && refused.contains("model.json from it"), "{refused}");
}

/// What looks like a run but has no list is not one.
#[test]
fn a_folder_without_a_list_is_kept() {
    let place = Place::new("list");
    for name in ["run.toml", "summary.json", "thesis.tex"] {
        fs::write(place.0.join(name), name).unwrap();
    }
    assert!(matches!(RunFolder::check(&place.0, true), Err(Error::NotReplaced { .. })));
    assert_eq!(fs::read_dir(&place.0).unwrap().count(), 3);
}

#[test]
fn what_a_killed_run_left_is_removed() {
    let place = Place::new("killed");
    let left = place.0.join(".run.partial-4000000000");
    fs::create_dir_all(left.join("1-record")).unwrap();
    fs::write(left.join(LOCK), "held").unwrap();
    let run = place.0.join("run");
    let first = RunFolder::create(&run, false).unwrap();
    assert!(!left.exists() && first.partial.exists());
    drop(first);
    assert_eq!(fs::read_dir(&place.0).unwrap().count(), 0);
}

#[test]
fn numbers_are_taken_once() {
    let place = Place::new("numbers");
    // What a run of an earlier version left.
    fs::create_dir_all(place.0.join("runs/a-rig-001")).unwrap();
    // Earlier a folder was taken from a writer that had made its lock and not yet locked it, once in some hundred rounds.
    let round = |_| {
        let together = std::sync::Barrier::new(8);
        let claim = || {
            together.wait();
            RunFolder::numbered(&place.0, "A rig!").unwrap()
        };
        let claimed: Vec<RunFolder> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..8).map(|_| scope.spawn(claim)).collect();
            threads.into_iter().map(|thread| thread.join().unwrap()).collect()
        });
        assert!(claimed.iter().all(|folder| folder.partial.is_dir()));
        let targets: HashSet<&Path> = claimed.iter().map(RunFolder::target).collect();
        assert_eq!(targets.len(), 8);
        assert!(targets.iter().all(|p| p.to_string_lossy().contains("a-rig-00")));
        claimed
    };
    (0..300).map(round).for_each(drop);
    let mut claimed = round(300);
    let first = claimed.pop().unwrap();
    first.text("summary.json", "{}").unwrap();
    let kept = first.finish().unwrap();
    drop(claimed);
    let left: Vec<PathBuf> = fs::read_dir(place.0.join("runs")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(left.contains(&kept) && left.len() <= 2, "only the run and the empty folder are left: {left:?}");
}

/// Earlier both of two equal runs ended well and the second removed the result of the first.
#[test]
fn a_place_is_given_to_one_run() {
    let place = Place::new("two");
    let run = place.0.join("run");
    let first = RunFolder::create(&run, false).unwrap();
    for replace in [false, true] {
        let refused = RunFolder::create(&run, replace).unwrap_err();
        assert!(matches!(&refused, Error::BeingWritten { .. }), "{refused}");
    }
    // Another machine on a file system without locks.
    fs::create_dir(&run).unwrap();
    fs::write(run.join("summary.json"), "other").unwrap();
    first.text("summary.json", "first").unwrap();
    assert!(matches!(first.finish(), Err(Error::OutputExists { .. })));
    assert_eq!(fs::read_to_string(run.join("summary.json")).unwrap(), "other");
    assert_eq!(fs::read_dir(&place.0).unwrap().count(), 1);
}

/// Between two steps of its writer a folder has no lock.
#[test]
fn an_old_folder_without_a_lock_is_removed() {
    let place = Place::new("lockless");
    let left = place.0.join(".run.partial-4000000000");
    fs::create_dir(&left).unwrap();
    let run = place.0.join("run");
    let refused = RunFolder::create(&run, false).unwrap_err().to_string();
    assert!(refused.contains(".run.partial-4000000000") && refused.contains("remove"), "{refused}");
    let old = std::time::SystemTime::now() - std::time::Duration::from_secs(3600);
    fs::File::open(&left).unwrap().set_modified(old).unwrap();
    drop(RunFolder::create(&run, false).unwrap());
    assert!(!left.exists());
}
