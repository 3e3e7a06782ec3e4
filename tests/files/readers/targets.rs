//! Every reader of what a user may hand in, as a function of bytes. The fuzz targets (`fuzz/`) and the tests share it. What a
//! reader says of its input does not matter here; that it says something does.

use std::path::{Path, PathBuf};
use youla::identify::subspace::SubspaceOptions;
use youla::lti::Discrete;
use youla_commission::{Campaign, QTable};
use youla_greybox::{Declaration, DeclaredStructure};
use youla_io::export::ExportedController;
use youla_io::{
    ChannelRef, CsvOptions, DecimalSign, TimeSource, Variables, csv_from_bytes, mat_from_bytes, npz_from_bytes,
};
use youla_link::{Frame, Kind, LARGEST_FRAME, PacketReader, Reply, Request, RowBlock};
use youla_paper::study::{PaperSettings, StudyRow};
use youla_report::{ReportData, html};
use youla_rig::{Description, Recorder, rotor};
use youla_run::{RunModelFile, RunSettings};
use youla_twin::rig::RigParameters;

/// A reader and its name, which is that of its fuzz target and of its folder of seeds.
pub(crate) type Reader = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const READERS: [Reader; 18] = [
    ("csv", csv),
    ("mat", mat),
    ("mat73", mat),
    ("model", model),
    ("npz", npz),
    ("run_toml", run_toml),
    ("paper_toml", paper_toml),
    ("rig_toml", rig_toml),
    ("subspace_toml", subspace_toml),
    ("structure", structure),
    ("row", row),
    ("check_toml", check_toml),
    ("report_json", report_json),
    ("model_json", model_json),
    ("controller_json", controller_json),
    ("q_table_json", q_table_json),
    ("campaign_toml", campaign_toml),
    ("link", link),
];

fn path() -> &'static Path {
    Path::new("input")
}

/// Text, plain or gzip: with a sample time that is given, and with a time column; with either decimal sign.
pub(crate) fn csv(bytes: &[u8]) {
    for time in [TimeSource::ts(1e-3), TimeSource::column(ChannelRef::Column(1))] {
        let _ = csv_from_bytes(bytes, path(), &[], &time, &CsvOptions::default());
        let comma = CsvOptions { decimal: DecimalSign::Comma, ..CsvOptions::default() };
        let _ = csv_from_bytes(bytes, path(), &[], &time, &comma);
    }
}

/// A MATLAB file of version 5 or 7.3, and everything that is in it.
pub(crate) fn mat(bytes: &[u8]) {
    if let Ok(variables) = mat_from_bytes(bytes, path()) {
        look_at(&variables);
    }
}

/// A model in any of its formats.
pub(crate) fn model(bytes: &[u8]) {
    let _ = youla_io::export::model_from_bytes(bytes, path());
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

/// A file for a reader that takes nothing else.
fn written(bytes: &[u8]) -> PathBuf {
    let file = std::env::temp_dir().join(format!("youla-readers-{}", std::process::id()));
    std::fs::write(&file, bytes).expect("the folder of temporary files can be written");
    file
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
    let _ = youla_run::parse_table::<SubspaceOptions>(&String::from_utf8_lossy(bytes), path(), "direct");
}

/// A structure with its expressions, and its matrices at the start.
pub(crate) fn structure(bytes: &[u8]) {
    let Ok(declaration) = Declaration::parse(&String::from_utf8_lossy(bytes)) else { return };
    if let Ok(structure) = DeclaredStructure::new(&declaration) {
        let _ = structure.derived(&structure.start(), None);
    }
}

/// A line of the results of the study.
pub(crate) fn row(bytes: &[u8]) {
    let _ = StudyRow::parse(&String::from_utf8_lossy(bytes));
}

/// The options of the check of data, which are read from a file.
pub(crate) fn check_toml(bytes: &[u8]) {
    let file = written(bytes);
    let _ = youla_run::read_check_options(&file);
    let _ = std::fs::remove_file(file);
}

/// The data of a report, and the page that `youla report` draws from it.
pub(crate) fn report_json(bytes: &[u8]) {
    if let Ok(report) = serde_json::from_slice::<ReportData>(bytes) {
        let _ = html(&report);
    }
}

/// A model as an artefact.
pub(crate) fn model_json(bytes: &[u8]) {
    let _ = serde_json::from_slice::<RunModelFile<SubspaceOptions>>(bytes);
}

/// A new controller, its system and its source.
pub(crate) fn controller_json(bytes: &[u8]) {
    let Ok(controller) = serde_json::from_slice::<ExportedController>(bytes) else { return };
    let _ = controller.rust();
    let _ = Discrete::new(controller.ts).map(|time| controller.controller.system(time));
}

/// A table of Q over speed, with a Q from each of its ways.
pub(crate) fn q_table_json(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(table) = QTable::parse(text, path()) {
        for pair in table.points.windows(2) {
            let _ = table.at(0.5 * (pair[0].rpm + pair[1].rpm), 2);
        }
    }
}

/// A campaign.
pub(crate) fn campaign_toml(bytes: &[u8]) {
    let _ = std::str::from_utf8(bytes).map(|text| Campaign::parse(text, path()));
}

/// The bytes of a line: as they come, and as the body of a frame that is whole, to the machine and to the host.
pub(crate) fn link(bytes: &[u8]) {
    let Ok(mut machine) = rotor(1) else { return };
    let mut reply = [0; LARGEST_FRAME];
    let Ok(description) = Description::parse(DESCRIPTION.as_bytes()) else { return };
    let _ = Description::parse(bytes);
    let mut recorder = Recorder::with(Vec::new(), path(), &description, machine.station.schema());
    let mut take = |frame: &[u8]| {
        let _ = machine.station.receive(frame, &mut reply);
        machine.sample();
        let _ = recorder.take(frame);
    };
    let mut packets = PacketReader::new();
    for byte in bytes {
        if let Some(Ok(frame)) = packets.push(*byte) {
            take(frame);
        }
    }
    let _ = (Request::read(bytes), Reply::read(bytes), RowBlock::read(bytes, description.shape()));
    // Each line of bytes as a body: mutations do not find checksums.
    let (schema, life) = rotor(1).map_or((0, 0), |machine| (machine.station.schema(), machine.station.life()));
    for (sequence, body) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        for kind in [Kind::Request, Kind::Rows, Kind::Reply] {
            let mut frame = [0; LARGEST_FRAME];
            let written = Frame { kind, schema, sequence, host: 1, life, body }.write(&mut frame);
            written.ok().and_then(|length| frame.get(..length)).into_iter().for_each(&mut take);
        }
    }
    let _ = recorder.finish(0);
}

/// Of a machine with the channels of the rotor.
const DESCRIPTION: &str = r#"name = "rotor"
sample_time = 5e-5
inputs = [{ name = "u_h" }, { name = "u_v" }]
outputs = [{ name = "y_h" }, { name = "y_v" }]
"#;
