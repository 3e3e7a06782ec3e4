//! Files that cannot be used: which file, which line, row, column or byte.

use crate::common::{csv, csv_with_line, log, loop_folder, refused, settings, settings_refused};
use std::fs;
use std::path::Path;
use youla_io::{Packing, Value, Variable, write_mat};

fn log_refused(name: &str, log: &[u8], evidence: &[&str]) {
    refused(&loop_folder(name, &[("log.csv", log)]), 2, evidence);
}

#[test]
fn missing_files_and_channels() {
    let missing = settings("\"log.csv\", take", "\"lag.csv\", take");
    settings_refused("missing-log", &missing, &["lag.csv: no such file"]);
    let unknown = settings("name = \"y\",", "name = \"yy\",");
    settings_refused("unknown-channel", &unknown, &["log.csv has no \"yy\"", "mean \"y\"", "known: t, u, d, y"]);
    let time = settings("time_column = \"t\"", "time_column = \"tt\"");
    settings_refused("unknown-time", &time, &["log.csv has no \"tt\"", "known: t, u, d, y"]);
}

#[test]
fn bad_cells_and_rows() {
    let cases: [(&str, &[&str]); 5] = [
        ("0.09,1.0,NaN,2.0", &["line 11", "column d", "\"NaN\""]),
        ("0.09,1.0,1.0,abc", &["line 11", "column y", "\"abc\""]),
        ("0.09,1.0,1.0,", &["line 11", "column y", "\"\""]),
        ("0.09,1.0,1.0", &["line 11", "3 fields", "has 4"]),
        ("0.095,1.0,1.0,2.0", &["time is not uniform", "row 10", "0.015 s", "the sample time is 0.01 s"]),
    ];
    for (line, evidence) in cases {
        log_refused("bad-cell", csv_with_line(11, line).as_bytes(), &[&["log.csv"], evidence].concat());
    }
}

#[test]
fn files_without_samples() {
    log_refused("zero-bytes", b"", &["log.csv: the file is empty (0 bytes)"]);
    log_refused("header-only", b"t,u,d,y\n", &["log.csv: there is no line with data"]);
}

#[test]
fn files_of_another_kind() {
    let hdf5 = [b"\x89HDF\r\n\x1a\n".as_slice(), &[0; 600]].concat();
    log_refused("hdf5", &hdf5, &["log.csv, byte 0", "a readable HDF5 file"]);
    let utf16: Vec<u8> = csv(&log()).encode_utf16().flat_map(u16::to_le_bytes).collect();
    log_refused("utf-16", &utf16, &["log.csv", "zero bytes", "UTF-8"]);
}

#[test]
fn damaged_gzip() {
    let text = csv(&log()[..1400]);
    let text = &text.as_bytes()[..60_000.min(text.len())];
    let whole = gzip(text);
    log_refused("cut-gzip", &whole[..30_000], &["log.csv, after line"]);
    // A changed cell shows as a bad number first, but the checksum is what is wrong.
    let mut changed = whole;
    changed[20_000] = b'x';
    log_refused("changed-gzip", &changed, &["log.csv, after line", "checksum"]);
}

/// A gzip file of one stored block, RFC 1951 and 1952; its checksum is left at zero.
fn gzip(text: &[u8]) -> Vec<u8> {
    let length = u16::try_from(text.len()).expect("one block");
    let mut out = vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255, 1];
    out.extend(length.to_le_bytes());
    out.extend((!length).to_le_bytes());
    out.extend(text);
    out.extend([0; 4]);
    out.extend(u32::from(length).to_le_bytes());
    out
}

#[test]
fn damaged_matlab_files() {
    let toml = settings("time_column = \"t\"", "sample_time = 0.01").replace("log.csv", "log.mat");
    let folder = loop_folder("damaged-mat", &[("run.toml", toml.as_bytes())]);
    let path = folder.join("log.mat");
    for packing in [Packing::Plain, Packing::Zlib] {
        matlab_log(&path, packing);
        let whole = fs::read(&path).expect("written");
        fs::write(&path, &whole[..whole.len() / 2]).expect("written");
        refused(&folder, 2, &["log.mat, byte "]);
        if packing == Packing::Zlib {
            let mut changed = whole.clone();
            let middle = changed.len() / 2;
            changed[middle..middle + 8].fill(0xaa);
            fs::write(&path, changed).expect("written");
            refused(&folder, 2, &["log.mat, byte "]);
        }
        fs::write(&path, &whole[..60]).expect("written");
        refused(&folder, 2, &["log.mat", "version 5"]);
    }
    fs::write(&path, b"").expect("written");
    refused(&folder, 2, &["log.mat: the file is empty (0 bytes)"]);
    fs::write(&path, [b"\x89HDF\r\n\x1a\n".as_slice(), &[0; 600]].concat()).expect("written");
    refused(&folder, 2, &["log.mat, byte 0", "a readable HDF5 file"]);
}

fn matlab_log(path: &Path, packing: Packing) {
    let rows = log();
    let column = |j: usize| Value::Real { dims: vec![rows.len(), 1], data: rows.iter().map(|r| r[j]).collect() };
    let variables = [("u", 1), ("d", 2), ("y", 3)].map(|(name, j)| Variable { name: name.into(), value: column(j) });
    write_mat(path, &variables, packing).expect("written");
}
