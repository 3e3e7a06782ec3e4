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
    fs::write(left.join(LOCK), "").unwrap();
    let run = place.0.join("run");
    let first = RunFolder::create(&run, false).unwrap();
    assert!(!left.exists() && first.partial.exists());
    drop(first);
    assert_eq!(fs::read_dir(&place.0).unwrap().count(), 0);
}

#[test]
fn numbers_are_taken_once() {
    let place = Place::new("numbers");
    let claimed: Vec<PathBuf> = std::thread::scope(|scope| {
        let claim = || NumberedFolder::claim(&place.0, "A rig!").unwrap();
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(claim)).collect();
        let all: Vec<NumberedFolder> = threads.into_iter().map(|t| t.join().unwrap()).collect();
        write(all[0].path(), false, &["summary.json"]).unwrap();
        all.iter().map(|f| f.path().to_owned()).collect()
    });
    assert_eq!(claimed.iter().collect::<HashSet<_>>().len(), 8);
    assert!(claimed.iter().all(|p| p.to_string_lossy().contains("a-rig-00")));
    // Those that stayed empty are gone.
    assert_eq!(fs::read_dir(place.0.join("runs")).unwrap().count(), 1);
}
