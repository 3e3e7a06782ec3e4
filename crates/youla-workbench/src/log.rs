//! The columns of a log, and the roles that their names suggest. A suggestion is shown and can be changed; nothing is computed from it
//! before the user has seen it.

use crate::refusal::{Refusal, Result};
use serde_json::{Value, json};
use std::path::Path;
use youla_io::{CsvOptions, DecimalSign, SurveyedColumn, unit_of_time};

/// Words of headings for each role, English and German, in the order in which they are tried; `time` needs even steps besides.
const WORDS: [(&str, &str); 5] = [
    ("time", "t time zeit timestamp seconds sec"),
    ("excitation", "d exc excitation dither inj injection injected added prbs chirp sweep noise anregung rauschen"),
    ("reference", "r ref reference setpoint sp target desired demand soll sollwert w"),
    (
        "input",
        "u in input cmd command torque force current voltage pwm duty valve strom spannung moment kraft stellgröße ventil",
    ),
    (
        "output",
        "y out output pos position angle theta speed velocity rate gyro acc accel temp temperature level pressure x q meas measured sensor \
         ist istwert lage weg winkel drehzahl temperatur druck",
    ),
];

/// The columns with their ranges and suggested roles; where no column can be read, with a decimal comma.
pub(crate) fn survey(file: &Path, csv: &CsvOptions) -> Result<Value> {
    let with_comma = CsvOptions { decimal: DecimalSign::Comma, ..csv.clone() };
    let (columns, csv) = match youla_io::survey(file, csv) {
        Ok(columns) if columns.iter().filter(|c| c.content.is_ok()).count() > 1 => (columns, csv.clone()),
        first => match youla_io::survey(file, &with_comma) {
            Ok(columns) => (columns, with_comma),
            Err(_) => (first?, csv.clone()),
        },
    };
    let mut clocks = 0;
    let described: Vec<Value> = columns.iter().map(|c| column(c, &mut clocks)).collect();
    Ok(json!({ "columns": described, "csv": csv }))
}

fn column(SurveyedColumn { from, content }: &SurveyedColumn, clocks: &mut usize) -> Value {
    let content = match content {
        Err(problem) => return json!({ "name": from, "problem": problem }),
        Ok(content) => content,
    };
    let mut role = suggested(from, content.step.is_some());
    *clocks += usize::from(role == "time");
    if role == "time" && *clocks > 1 || content.low == content.high {
        role = "";
    }
    let not_seconds = (role == "time").then(|| unit_of_time(from)).flatten();
    json!({
        "name": from, "rows": content.rows, "low": content.low, "high": content.high, "step": content.step, "role": role,
        "unit": unit(from), "to_seconds": not_seconds.map(|(_, factor)| factor),
    })
}

/// The role of the first group of words of which the heading holds one; empty where none fits.
fn suggested(heading: &str, even: bool) -> &'static str {
    let lower = heading.rsplit('.').next().unwrap_or(heading).to_lowercase();
    let words: Vec<&str> = lower
        .split(|c: char| !c.is_alphabetic())
        .map(|word| word.trim_matches(|c: char| c.is_ascii_digit()))
        .filter(|word| !word.is_empty())
        .collect();
    let fits = |(role, of): &&(&str, &str)| {
        of.split_whitespace().any(|known| words.contains(&known)) && (*role != "time" || even)
    };
    WORDS.iter().find(fits).map_or(if even { "time" } else { "" }, |(role, _)| role)
}

/// What stands in brackets behind a heading.
fn unit(heading: &str) -> &str {
    let bracketed = |open: char, close: char| heading.trim_end().strip_suffix(close)?.rsplit_once(open).map(|(_, u)| u);
    bracketed('[', ']').or_else(|| bracketed('(', ')')).filter(|u| !u.starts_with(':')).unwrap_or("")
}

/// Reads columns of a file as channels named by their places.
pub(crate) fn read(file: &Path, csv: &CsvOptions, columns: &[String]) -> Result<youla::signal::Record> {
    let channel = |name: &String| {
        let Ok(place) = name.parse();
        youla_io::ChannelSpec::from(name, place, "")
    };
    let source = youla_io::Source {
        path: file.to_owned(),
        format: youla_io::Format::Detect,
        time: youla_io::TimeSource::default(),
        channels: columns.iter().map(channel).collect(),
        csv: csv.clone(),
    };
    youla_io::read_rows(&source).map_err(Refusal::from)
}

#[cfg(test)]
mod tests {
    use super::{suggested, unit};

    #[test]
    fn headings_suggest_roles() {
        let of = |heading| suggested(heading, false);
        assert_eq!(suggested("time [s]", true), "time");
        assert_eq!(of("time"), "");
        assert_eq!([of("u1"), of("torque_cmd"), of("Data.signals.u")], ["input"; 3]);
        assert_eq!([of("y"), of("pos (mm)"), of("gyro[0]")], ["output"; 3]);
        assert_eq!([of("ref_pos"), of("Sollwert soll")], ["reference"; 2]);
        assert_eq!(of("d"), "excitation");
        assert_eq!([of("Strom"), of("Drehzahl"), of("Sollwert")], ["input", "output", "reference"]);
        assert_eq!(of("status"), "");
    }

    #[test]
    fn units_stand_in_brackets() {
        assert_eq!([unit("u [V]"), unit("pos (mm)"), unit("x(:,2)"), unit("y")], ["V", "mm", "", ""]);
    }
}
