//! A small closed loop on disk, and the program run on it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Sample time of the log, seconds.
const TS: f64 = 0.01;

/// The run.toml of the small loop; its log is [`log`].
pub(crate) const SETTINGS: &str = r#"name = "loop"

[data]
time_column = "t"
inputs = [{ name = "u", unit = "V" }]
outputs = [{ name = "y", unit = "um" }]
input_excitation = [{ name = "d", unit = "V" }]
estimation = [{ file = "log.csv", take = 1200 }]
verification = [{ file = "log.csv", skip = 1200, name = "rest" }]

[nominal.transfer_function]
domain = "discrete"
numerator = [0.1]
denominator = [1.0, -0.9]

[controller.difference_equation]
feedback = "negative"
numerator = [2.0]
denominator = [1.0]

[hansen]
horizon = 10
order = 3

[direct]
horizon = 10
order = 2

[frequency_response]
window = 256
"#;

/// [`SETTINGS`] with one passage replaced, which must be there.
pub(crate) fn settings(passage: &str, replacement: &str) -> String {
    assert!(SETTINGS.contains(passage), "{passage}");
    SETTINGS.replacen(passage, replacement, 1)
}

/// Numbers from 0 to 1, uniform (Knuth, MMIX).
pub(crate) fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// 2000 rows `t, u, d, y` of `y+ = 1.5 y - 0.56 y- + 0.06 u`, `u = d - 2 (y + n)`.
pub(crate) fn log() -> Vec<[f64; 4]> {
    let mut random = uniform(1);
    let (mut y, mut before, mut d, mut hold) = (0.0, 0.0, 1.0, 0);
    (0..2000)
        .map(|k| {
            if hold == 0 {
                d = if random() < 0.5 { -1.0 } else { 1.0 };
                hold = 1 + (8.0 * random()) as usize;
            }
            hold -= 1;
            let measured = y + 0.05 * (random() - 0.5);
            let u = d - 2.0 * measured;
            (y, before) = (1.5 * y - 0.56 * before + 0.06 * u, y);
            [k as f64 * TS, u, d, measured]
        })
        .collect()
}

/// Rows as a text file with a line of names.
pub(crate) fn csv(rows: &[[f64; 4]]) -> String {
    let lines = rows.iter().map(|[t, u, d, y]| format!("{t:.2},{u:?},{d:?},{y:?}\n"));
    std::iter::once("t,u,d,y\n".to_owned()).chain(lines).collect()
}

/// The text of [`log`] with one line (counted from 1) replaced.
pub(crate) fn csv_with_line(number: usize, line: &str) -> String {
    let text = csv(&log());
    let mut lines: Vec<&str> = text.lines().collect();
    lines[number - 1] = line;
    lines.join("\n")
}

/// What the program did.
pub(crate) struct Outcome {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Runs a command that ends in the program.
pub(crate) fn outcome(command: &mut Command) -> Outcome {
    let output = command.output().expect("the program starts");
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).expect("UTF-8"),
        stderr: String::from_utf8(output.stderr).expect("UTF-8"),
    }
}

pub(crate) fn youla(folder: &Path, arguments: &[&str]) -> Outcome {
    outcome(Command::new(env!("CARGO_BIN_EXE_youla")).current_dir(folder).args(arguments))
}

/// An empty folder of its own for one test.
pub(crate) fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a temporary folder");
    folder
}

/// A folder with the small loop and the given files on top.
pub(crate) fn loop_folder(name: &str, files: &[(&str, &[u8])]) -> PathBuf {
    let folder = empty_folder(name);
    fs::write(folder.join("run.toml"), SETTINGS).expect("written");
    fs::write(folder.join("log.csv"), csv(&log())).expect("written");
    for (file, bytes) in files {
        fs::write(folder.join(file), bytes).expect("written");
    }
    folder
}

/// All paths below a folder.
pub(crate) fn listing(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).expect("readable") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            all.extend(listing(&path));
        }
        all.push(path);
    }
    all.sort();
    all
}

/// Asserts that the program refuses by one sentence with the evidence, prints nothing else and leaves nothing behind.
pub(crate) fn refused_by(command: &mut Command, folder: &Path, code: i32, evidence: &[&str]) {
    let before = listing(folder);
    let found = outcome(command.current_dir(folder));
    assert_eq!(found.code, Some(code), "{}", found.stderr);
    assert_eq!(found.stdout, "");
    assert!(found.stderr.starts_with("error: ") && found.stderr.lines().count() == 1, "{}", found.stderr);
    for word in evidence {
        assert!(found.stderr.contains(word), "{word:?} is not in: {}", found.stderr);
    }
    for noise in ["panicked", "RUST_BACKTRACE", "{ ", "Some("] {
        assert!(!found.stderr.contains(noise), "{noise:?} is in: {}", found.stderr);
    }
    assert_eq!(listing(folder), before, "something was left behind");
}

/// Asserts that `youla identify run.toml --out new/out` is refused as in [`refused_by`].
pub(crate) fn refused(folder: &Path, code: i32, evidence: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
    refused_by(command.args(["identify", "run.toml", "--out", "new/out"]), folder, code, evidence);
}

/// Asserts that settings are refused with code 2.
pub(crate) fn settings_refused(name: &str, settings: &str, evidence: &[&str]) {
    refused(&loop_folder(name, &[("run.toml", settings.as_bytes())]), 2, evidence);
}

/// The run folder of `youla demo --machine bearing`, made once for all tests.
pub(crate) fn demo() -> &'static Path {
    static DEMO: OnceLock<PathBuf> = OnceLock::new();
    DEMO.get_or_init(|| {
        let folder = empty_folder("demo");
        let found = youla(&folder, &["demo", "--machine", "bearing", "--out", "run", "--quiet"]);
        assert_eq!(found.code, Some(0), "{}", found.stderr);
        assert_eq!(found.stdout + &found.stderr, "", "--quiet prints nothing");
        folder.join("run")
    })
}

/// The folder with the measured data: `YOULA_DATA`, or `shared/data` beside the project.
pub(crate) fn data() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = std::env::var_os("YOULA_DATA").map_or_else(beside, PathBuf::from);
    path.canonicalize().unwrap_or_else(|e| panic!("the measured data: {}: {e}", path.display()))
}
