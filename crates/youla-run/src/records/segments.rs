//! Parts of a file as records of their own: cut at gaps of the time column, and at the rows that the settings name.
//!
//! Nothing is joined across a cut: each part is an experiment with its own initial state, as if it were a file.

use crate::settings::DataFile;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::signal::Record;

/// A part of a file that became a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordSegment {
    /// Name of the record.
    pub record: String,
    /// The file, as given in run.toml.
    pub file: String,
    /// First and last row of the file, counted from 1.
    pub rows: [usize; 2],
}

/// A part of a file and where it is there.
pub(crate) struct Part {
    pub(crate) record: Record,
    /// Name in reports.
    pub(crate) name: String,
    /// First and last row, counted from 1.
    pub(crate) rows: [usize; 2],
    /// Whether the file was cut.
    pub(crate) cut: bool,
}

/// The parts of a file that the settings ask for, from its parts without gaps, named after `label`.
///
/// # Errors
/// [`youla::Error::OutOfRange`] for rows that the file does not have, and those of [`Record::trim`].
pub(crate) fn parts(file: &DataFile, label: &str, mut continuous: Vec<Record>) -> Result<Vec<Part>> {
    if continuous.len() == 1 && file.segments.is_empty() {
        let whole = continuous.remove(0);
        let record = if file.skip == 0 && file.take.is_none() { whole } else { whole.trim(file.skip, file.take)? };
        let rows = [file.skip + 1, file.skip + record.samples()];
        return Ok(vec![Part { record, name: label.to_owned(), rows, cut: false }]);
    }
    let samples: usize = continuous.iter().map(Record::samples).sum();
    let wanted = wanted(file, samples)?;
    let mut found = Vec::new();
    let mut before = 0;
    for record in &continuous {
        let last = before + record.samples();
        for [from, to] in &wanted {
            let (from, to) = ((*from).max(before + 1), (*to).min(last));
            if from <= to {
                found.push((record.trim(from - before - 1, Some(to + 1 - from))?, [from, to]));
            }
        }
        before = last;
    }
    if found.is_empty() {
        let what = format!("{}: the number of rows to use", file.file.display());
        return Err(Error::Method(youla::Error::OutOfRange { what, value: 0.0, must: "at least 1" }));
    }
    let several = found.len() > 1;
    let named = |(k, (record, rows)): (usize, (Record, [usize; 2]))| {
        let name = if several { format!("{label}-{}", k + 1) } else { label.to_owned() };
        Part { record, name, rows, cut: true }
    };
    Ok(found.into_iter().enumerate().map(named).collect())
}

/// Rows, counted from 1, first and last.
fn wanted(file: &DataFile, samples: usize) -> Result<Vec<[usize; 2]>> {
    let within = |what: &str, row: usize| {
        let what = format!("{}: {what} (file of {samples} rows)", file.file.display());
        if row <= samples {
            Ok(row)
        } else {
            Err(Error::Method(youla::Error::OutOfRange { what, value: row as f64, must: "a row of the file" }))
        }
    };
    if file.segments.is_empty() {
        let from = within("the first row after `skip`", file.skip.saturating_add(1))?;
        let to =
            file.take.map_or(Ok(samples), |take| within("the last row by `take`", file.skip.saturating_add(take)))?;
        return Ok(vec![[from, to]]);
    }
    file.segments.iter().map(|[from, to]| Ok([*from, within("the end of a segment", *to)?])).collect()
}

#[cfg(test)]
mod tests {
    use crate::{DataCheck, RunRecords, RunSettings, check_run, read_records};
    use std::fmt::Write;
    use std::path::{Path, PathBuf};
    use youla::identify::direct::direct;
    use youla::identify::subspace::{Order, SubspaceOptions};
    use youla_loop::check::Test;

    /// A folder of its own with files, removed in the end.
    struct Folder(PathBuf);

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    impl Folder {
        fn new(name: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("youla-segments-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&folder).unwrap();
            Folder(folder)
        }

        /// Rows of a record at the given samples; `y(k) = 0.8 y(k-1) + u(k-1)` without interruption.
        fn write(&self, name: &str, samples: impl Iterator<Item = usize>) {
            let u = |k: usize| ((k * k) as f64 * 0.37).sin();
            let mut y = vec![0.0; 1000];
            (1..1000).for_each(|k| y[k] = 0.8 * y[k - 1] + u(k - 1));
            let mut text = String::from("t,u,y\n");
            samples.for_each(|k| writeln!(text, "{},{:?},{:?}", k as f64 * 0.5, u(k), y[k]).unwrap());
            std::fs::write(self.0.join(name), text).unwrap();
        }

        fn read(&self, data: &str) -> crate::Result<RunRecords> {
            read_records(&Folder::settings(data)?.data, &self.0)
        }

        fn settings(data: &str) -> crate::Result<RunSettings> {
            let text = format!(
                "name = \"test\"\n[data]\ntime_column = \"t\"\ninputs = [{{ name = \"u\" }}]\noutputs = [{{ name = \"y\" }}]\n\
                 detrend = \"none\"\n{data}\n[nominal.transfer_function]\ndomain = \"discrete\"\nnumerator = [1.0]\n\
                 denominator = [1.0, -0.5]\n[controller.state_space]\nfeedback = \"positive\"\na = []\nb = []\nc = [[]]\n\
                 d = [[0.0]]\n"
            );
            RunSettings::parse(&text, Path::new("run.toml"))
        }
    }

    fn hole() -> impl Iterator<Item = usize> {
        (0..400).chain(437..1000)
    }

    #[test]
    fn a_record_with_a_hole_is_two_records() {
        let folder = Folder::new("hole");
        folder.write("whole.csv", hole());
        folder.write("one.csv", 0..400);
        folder.write("two.csv", 437..1000);
        let cut = folder.read("gaps = \"split\"\nestimation = [{ file = \"whole.csv\" }]").unwrap();
        let apart = folder.read("estimation = [{ file = \"one.csv\" }, { file = \"two.csv\" }]").unwrap();
        assert_eq!(cut.segments.iter().map(|s| s.rows).collect::<Vec<_>>(), [[1, 400], [401, 963]]);
        assert_eq!(cut.estimation.iter().map(|r| r.name()).collect::<Vec<_>>(), ["whole-1", "whole-2"]);
        assert!(apart.segments.is_empty() && apart.sources.len() == 2 && cut.sources.len() == 1);
        let options = SubspaceOptions { horizon: 4, order: Order::Fixed(1), ..SubspaceOptions::default() };
        let model = |records: &RunRecords| direct(&records.experiments(), records.time, &options).unwrap().model;
        assert_eq!(model(&cut), model(&apart));
        assert!((model(&cut).a()[(0, 0)] - 0.8).abs() < 1e-9);
        let refused = folder.read("estimation = [{ file = \"whole.csv\" }]").unwrap_err().to_string();
        assert!(refused.contains("row 401"), "{refused}");
    }

    /// The check sees the records of the run, and no gap where the run has none.
    #[test]
    fn the_check_splits_where_the_run_does() {
        let folder = Folder::new("checked");
        folder.write("whole.csv", hole());
        let checked = |data: &str| check_run(&Folder::settings(data).unwrap(), &folder.0).unwrap();
        let split = checked("gaps = \"split\"\nestimation = [{ file = \"whole.csv\" }]");
        let rows: Vec<_> = split.records.iter().map(|r| (&r.record[..], r.rows)).collect();
        assert_eq!(rows, [("whole-1", [1, 400]), ("whole-2", [401, 963])]);
        let timing = |found: &DataCheck| found.findings.iter().filter(|f| f.test == Test::Timing).count();
        assert_eq!((timing(&split), timing(&checked("estimation = [{ file = \"whole.csv\" }]"))), (0, 1));
    }

    #[test]
    fn parts_of_one_file_need_no_names() {
        let folder = Folder::new("unnamed");
        folder.write("whole.csv", 0..1000);
        folder.write("other.csv", 0..500);
        let found = folder
            .read(
                "estimation = [{ file = \"whole.csv\", take = 600 }, { file = \"other.csv\", take = 200 }]\n\
                 verification = [{ file = \"whole.csv\", skip = 600, take = 100 }, { file = \"whole.csv\", skip = 700, name = \"rest\" }]",
            )
            .unwrap();
        let names: Vec<&str> = found.estimation.iter().chain(&found.verification).map(|r| r.name()).collect();
        assert_eq!(names, ["whole-1", "other", "whole-2", "rest"]);
    }

    /// Rows that identify verify nothing, also under another name of the file.
    #[test]
    fn rows_of_the_estimation_do_not_verify() {
        let folder = Folder::new("overlap");
        folder.write("whole.csv", 0..1000);
        folder.write("copy.csv", 0..1000);
        for (estimation, verification) in [
            ("file = \"whole.csv\", take = 600", "file = \"whole.csv\", name = \"v\""),
            ("file = \"whole.csv\", take = 600", "file = \"whole.csv\", name = \"v\", skip = 599"),
            ("file = \"whole.csv\", segments = [[1, 100], [500, 600]]", "file = \"copy.csv\", skip = 599, take = 9"),
        ] {
            let refused =
                folder.read(&format!("estimation = [{{ {estimation} }}]\nverification = [{{ {verification} }}]"));
            let refused = refused.unwrap_err().to_string();
            assert!(refused.contains("to 600, from which the models are identified"), "{refused}");
        }
        let apart =
            "estimation = [{ file = \"whole.csv\", take = 600 }]\nverification = [{ file = \"copy.csv\", skip = 600 }]";
        assert!(folder.read(apart).is_ok());
    }

    /// Rows that identify twice would count twice: both records and the rows are named.
    #[test]
    fn estimation_records_do_not_overlap() {
        let folder = Folder::new("twice");
        folder.write("whole.csv", 0..1000);
        folder.write("copy.csv", 0..1000);
        for second in [
            "file = \"whole.csv\", name = \"b\", skip = 300",
            "file = \"copy.csv\", name = \"b\", skip = 300, take = 400",
        ] {
            let both = format!("estimation = [{{ file = \"whole.csv\", name = \"a\", take = 600 }}, {{ {second} }}]");
            let refused = folder.read(&both).unwrap_err().to_string();
            assert!(refused.contains("the records \"a\" and \"b\" share rows 301 to 600 of"), "{refused}");
            assert!(refused.contains("skip = 600"), "{refused}");
        }
        let apart = "estimation = [{ file = \"whole.csv\", take = 600 }, { file = \"copy.csv\", skip = 600 }]";
        assert_eq!(folder.read(apart).unwrap().estimation.len(), 2);
    }

    #[test]
    fn stretches_are_chosen_by_rows() {
        let folder = Folder::new("rows");
        folder.write("whole.csv", hole());
        let files = "gaps = \"split\"\nestimation = [{ file = \"whole.csv\", segments = [[10, 300], [350, 500]] }]";
        let found = folder.read(files).unwrap();
        assert_eq!(found.segments.iter().map(|s| s.rows).collect::<Vec<_>>(), [[10, 300], [350, 400], [401, 500]]);
        assert_eq!(found.estimation.iter().map(|r| r.samples()).collect::<Vec<_>>(), [291, 51, 100]);
        let verified = "gaps = \"split\"\nestimation = [{ file = \"whole.csv\", take = 300 }]\n\
                        verification = [{ file = \"whole.csv\", name = \"rest\", skip = 300 }]";
        let found = folder.read(verified).unwrap();
        assert_eq!((found.estimation.len(), found.verification.len()), (1, 2));
        assert_eq!(found.estimation[0].name(), "whole");
        for (data, words) in [
            ("estimation = [{ file = \"whole.csv\", segments = [[1, 20], [20, 30]] }]", "without overlap"),
            ("estimation = [{ file = \"whole.csv\", segments = [[0, 20]] }]", "counted from 1"),
            ("estimation = [{ file = \"whole.csv\", skip = 2, segments = [[1, 20]] }]", "give one of them"),
            ("gaps = \"split\"\nestimation = [{ file = \"whole.csv\", segments = [[1, 2000]] }]", "a row of the file"),
            (
                "gaps = \"split\"\nestimation = [{ file = \"whole.csv\", skip = 9 }, { file = \"whole.csv\", name = \"whole-1\", take = 9 }]",
                "two records are named \"whole-1\"",
            ),
        ] {
            let refused = folder.read(data).unwrap_err().to_string();
            assert!(refused.contains(words), "{refused}");
        }
    }
}
