//! Every reader of what a user may hand in, as a function of bytes. The fuzz targets (`fuzz/`) and the tests share it. What a
//! reader says of its input does not matter here; that it says something does.

use std::path::Path;
use youla::identify::greybox::{Declaration, DeclaredStructure, Structure};
use youla::identify::subspace::SubspaceOptions;
use youla::record::{
    ChannelRef, CsvOptions, NpyStream, SampleStream, TimeSource, Variables, csv_from_bytes, mat_from_bytes,
    npz_from_bytes,
};
use youla::rig::RigParameters;
use youla::run::RunSettings;
use youla::study::{PaperSettings, Row};

/// A reader and its name, which is that of its fuzz target and of its folder of seeds.
pub(crate) type Reader = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const READERS: [Reader; 10] = [
    ("csv", csv),
    ("mat", mat),
    ("npz", npz),
    ("npy", npy),
    ("run_toml", run_toml),
    ("paper_toml", paper_toml),
    ("rig_toml", rig_toml),
    ("subspace_toml", subspace_toml),
    ("structure", structure),
    ("row", row),
];

fn path() -> &'static Path {
    Path::new("input")
}

/// Text, plain or gzip: with a sample time that is given, and with a time column.
pub(crate) fn csv(bytes: &[u8]) {
    for time in [TimeSource::ts(1e-3), TimeSource::column(ChannelRef::Column(1))] {
        let _ = csv_from_bytes(bytes, path(), &[], &time, &CsvOptions::default());
    }
}

/// A MATLAB file, and everything that is in it.
pub(crate) fn mat(bytes: &[u8]) {
    if let Ok(variables) = mat_from_bytes(bytes, path()) {
        look_at(&variables);
    }
}

/// A NumPy archive, and everything that is in it.
pub(crate) fn npz(bytes: &[u8]) {
    if let Ok(variables) = npz_from_bytes(bytes, path()) {
        look_at(&variables);
    }
}

fn look_at(variables: &Variables) {
    for path in variables.leaves() {
        let _ = variables.column(&path);
        let _ = variables.column(&format!("{path}(:,2)"));
        let _ = variables.matrix(&path);
    }
}

/// A NumPy array as a stream of samples, which reads from a file.
pub(crate) fn npy(bytes: &[u8]) {
    let file = std::env::temp_dir().join(format!("youla-fuzz-{}.npy", std::process::id()));
    std::fs::write(&file, bytes).expect("the folder of temporary files can be written");
    if let Ok(mut stream) = NpyStream::open(&file, &[ChannelRef::Column(1)], &[ChannelRef::Column(2)]) {
        let mut rows = youla::Mat::zeros(64, 2);
        let _ = stream.read(rows.as_mut());
    }
    let _ = std::fs::remove_file(file);
}

pub(crate) fn run_toml(bytes: &[u8]) {
    let _ = RunSettings::parse(&String::from_utf8_lossy(bytes), path());
}

pub(crate) fn paper_toml(bytes: &[u8]) {
    let _ = PaperSettings::parse(&String::from_utf8_lossy(bytes), path());
}

pub(crate) fn rig_toml(bytes: &[u8]) {
    let _ = RigParameters::parse(&String::from_utf8_lossy(bytes), path());
}

pub(crate) fn subspace_toml(bytes: &[u8]) {
    let _ = youla::run::parse_subspace_options(&String::from_utf8_lossy(bytes), path()).map(|o: SubspaceOptions| o);
}

/// A structure with its expressions, and its matrices at the start.
pub(crate) fn structure(bytes: &[u8]) {
    let Ok(declaration) = Declaration::parse(&String::from_utf8_lossy(bytes), path()) else { return };
    if let Ok(structure) = DeclaredStructure::new(&declaration) {
        let _ = structure.derived(&structure.start(), None);
    }
}

/// A line of the results of the study.
pub(crate) fn row(bytes: &[u8]) {
    let _ = Row::parse(&String::from_utf8_lossy(bytes));
}
