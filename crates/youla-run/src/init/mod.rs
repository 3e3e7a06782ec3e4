//! A first run.toml for a log: what the user said of it in the form that `youla identify` reads, with comments, and with what is
//! still missing left out, so that nothing is run on a guess.

use crate::settings::Feedback;
use crate::{Error, Result};
use minijinja::value::Serde;
use minijinja::{Environment, context};
use serde::Serialize;
use std::path::{Path, PathBuf};
use youla::error::{Names, short};
use youla_io::{ChannelRef, CsvOptions, SurveyedColumn, unit_of_time};

const TEMPLATE: &str = include_str!("../../assets/run.toml.j2");

/// What is said of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// Name of the machine or experiment.
    pub name: String,
    /// The log, as run.toml is to name it.
    pub file: PathBuf,
    /// How it is read, where it is text.
    pub csv: CsvOptions,
    /// Sample time or time column.
    pub clock: DraftClock,
    /// Columns of the plant inputs.
    pub inputs: Vec<ChannelRef>,
    /// Columns of the plant outputs.
    pub outputs: Vec<ChannelRef>,
    /// Columns of the known excitation at the plant input; may be empty.
    pub input_excitation: Vec<ChannelRef>,
    /// Columns of the known reference; may be empty.
    pub reference: Vec<ChannelRef>,
    /// Sign of the feedback of the controller that ran; none where none ran.
    pub feedback: Option<Feedback>,
    /// Rows to identify from, from the first on; the rest verifies.
    pub estimated: usize,
}

/// Where the time comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum DraftClock {
    /// Sample time in seconds.
    SampleTime(f64),
    /// Column with the time in seconds.
    Column(ChannelRef),
}

impl Draft {
    /// What does not fit the columns of the log, in one sentence; `columns` are those of [`youla_io::survey`].
    pub fn problem(&self, columns: &[SurveyedColumn]) -> Option<String> {
        let clock = match &self.clock {
            DraftClock::Column(column) => Some(column),
            DraftClock::SampleTime(ts) if !(*ts > 0.0 && ts.is_finite()) => {
                return Some(format!("the sample time is {ts}, but must be a positive number of seconds"));
            }
            DraftClock::SampleTime(_) => None,
        };
        if self.inputs.is_empty() || self.outputs.is_empty() {
            return Some("a plant has at least one input and one output".into());
        }
        if let Some(problem) = clock.into_iter().chain(self.channels()).find_map(|c| column(c, columns).err()) {
            return Some(problem);
        }
        if let Some(problem) = clock.and_then(|c| in_another_unit(c, columns)) {
            return Some(problem);
        }
        let all: Vec<&ChannelRef> = clock.into_iter().chain(self.channels()).collect();
        let twice = all.iter().enumerate().find(|(k, c)| all[..*k].contains(c));
        if let Some((_, c)) = twice {
            return Some(format!("the column {:?} is named twice", c.to_string()));
        }
        let groups = [
            ("excitations", &self.input_excitation, "inputs", &self.inputs),
            ("references", &self.reference, "outputs", &self.outputs),
        ];
        for (what, given, of, needed) in groups {
            if !given.is_empty() && given.len() != needed.len() {
                let (found, wanted) = (given.len(), needed.len());
                return Some(format!("there must be as many {what} as {of} ({wanted}), but there are {found}"));
            }
        }
        let rows = self.rows(columns);
        (!(1..rows).contains(&self.estimated))
            .then(|| format!("{} rows are to be identified from, but the log has {rows}", self.estimated))
    }

    /// Rows of the first input.
    fn rows(&self, columns: &[SurveyedColumn]) -> usize {
        self.inputs.first().and_then(|c| column(c, columns).ok()).unwrap_or(0)
    }

    fn channels(&self) -> impl Iterator<Item = &ChannelRef> {
        [&self.inputs, &self.outputs, &self.input_excitation, &self.reference].into_iter().flatten()
    }

    /// The text of run.toml.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] naming the log for what [`Draft::problem`] finds.
    pub fn toml(&self, columns: &[SurveyedColumn]) -> Result<String> {
        let named = self.with_places(columns);
        named.as_ref().unwrap_or(self).text(columns)
    }

    /// Numbers of columns as the places of these columns, where columns of matrices are counted together, which no reader does.
    fn with_places(&self, columns: &[SurveyedColumn]) -> Option<Draft> {
        if !columns.iter().any(|c| c.from.contains("(:,")) {
            return None;
        }
        let place = |c: &ChannelRef| match c {
            ChannelRef::Column(number) => match number.checked_sub(1).and_then(|k| columns.get(k)) {
                Some(column) => ChannelRef::Name(column.from.clone()),
                None => c.clone(),
            },
            ChannelRef::Name(_) => c.clone(),
        };
        let places = |all: &[ChannelRef]| all.iter().map(place).collect::<Vec<_>>();
        Some(Draft {
            clock: match &self.clock {
                DraftClock::Column(column) => DraftClock::Column(place(column)),
                DraftClock::SampleTime(ts) => DraftClock::SampleTime(*ts),
            },
            inputs: places(&self.inputs),
            outputs: places(&self.outputs),
            input_excitation: places(&self.input_excitation),
            reference: places(&self.reference),
            ..self.clone()
        })
    }

    fn text(&self, columns: &[SurveyedColumn]) -> Result<String> {
        let refused =
            |problem: String| Error::File(youla_io::Error::Settings { path: self.file.clone(), at: None, problem });
        if let Some(problem) = self.problem(columns) {
            return Err(refused(problem));
        }
        let excitations = [
            ("input_excitation", "Known excitation, added at the plant input.", &self.input_excitation),
            ("reference", "Known reference r.", &self.reference),
        ];
        let excitations: Vec<_> = excitations
            .into_iter()
            .filter(|(_, _, channels)| !channels.is_empty())
            .map(|(key, meaning, channels)| context! { key, meaning, channels => Serde(entries(channels, key)) })
            .collect();
        let (time, sample_time) = match &self.clock {
            DraftClock::Column(column) => (Some(column.to_string()), None),
            DraftClock::SampleTime(ts) => (None, Some(format!("{ts:?}"))),
        };
        let stem = self.file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = stem.split('.').next().unwrap_or_default().to_owned();
        let (m, p) = (self.inputs.len(), self.outputs.len());
        let content = context! {
            name => self.name.clone(), file => self.file.display().to_string(), time, sample_time,
            inputs => Serde(entries(&self.inputs, "u")), outputs => Serde(entries(&self.outputs, "y")), excitations,
            csv => (self.csv != CsvOptions::default()).then_some(Serde(&self.csv)),
            rows => self.rows(columns), estimated => self.estimated,
            estimation => format!("{stem}-first"), verification => format!("{stem}-rest"),
            feedback => self.feedback.map(Serde),
            zero_controller => entries_of("[0.0]", m, p),
            plant => entries_of("[2500.0]", p, m), controller => entries_of("[5.5, 0.3, -5.2]", m, p),
        };
        let mut environment = Environment::new();
        environment.add_filter("toml", |text: String| toml::Value::String(text).to_string());
        environment
            .render_str(TEMPLATE, content)
            .map_err(|error| refused(format!("run.toml cannot be written: {error:#}")))
    }
}

/// Rows of a column that can be a channel, or what is wrong.
fn column(wanted: &ChannelRef, columns: &[SurveyedColumn]) -> std::result::Result<usize, String> {
    let found = match wanted {
        ChannelRef::Name(name) => columns.iter().find(|c| c.from == *name),
        ChannelRef::Column(number) => number.checked_sub(1).and_then(|k| columns.get(k)),
    };
    match found.map(|c| &c.content) {
        Some(Ok(content)) => Ok(content.rows),
        Some(Err(problem)) => {
            Err(format!("the column {:?} cannot be a channel: {problem}", short(&wanted.to_string())))
        }
        None => {
            let known: Vec<String> = columns.iter().map(|c| c.from.clone()).collect();
            Err(format!("there is no column {:?}; there are {}", short(&wanted.to_string()), Names(&known)))
        }
    }
}

/// What is wrong with a time column whose name states another unit than the second.
fn in_another_unit(clock: &ChannelRef, columns: &[SurveyedColumn]) -> Option<String> {
    let name = match clock {
        ChannelRef::Name(name) => name,
        ChannelRef::Column(number) => &columns.get(number.checked_sub(1)?)?.from,
    };
    let (unit, to_seconds) = unit_of_time(name)?;
    Some(format!(
        "the time column {:?} is in {unit} by its name, but times are read in seconds; state the sample time by --sample-time in place \
         of it, or compute seconds in run.toml: seconds = \"'{}' {to_seconds}\" in [data.computed]",
        short(name),
        short(name)
    ))
}

/// A channel of run.toml.
#[derive(Debug, Clone, Serialize)]
struct Entry {
    name: String,
    /// Its place, where the name is not the place.
    from: Option<String>,
    /// The unit that its heading states, else empty.
    unit: String,
}

/// `speed [rad/s]` or `speed (rad/s)` as name and unit; the whole heading where it states none, or nothing but one.
fn heading(text: &str) -> (&str, &str) {
    let split = |open: char, close: char| {
        let (name, unit) = text.trim_end().strip_suffix(close)?.rsplit_once(open)?;
        let (name, unit) = (name.trim_end(), unit.trim());
        // x(2) and x[2] are elements of an array.
        let is_unit =
            !unit.is_empty() && (unit.contains('/') || !unit.starts_with(|c: char| c.is_ascii_digit() || c == ':'));
        (!name.is_empty() && is_unit).then_some((name, unit))
    };
    split('[', ']').or_else(|| split('(', ')')).unwrap_or((text, ""))
}

/// Names without the path that leads to them, where these differ; `letter` and a number where columns have no names.
fn entries(channels: &[ChannelRef], letter: &str) -> Vec<Entry> {
    let short = |c: &ChannelRef| {
        let text = c.to_string();
        let text = heading(&text).0.to_owned();
        let last = text.rsplit('.').next().unwrap_or_default();
        // A path leads to a name; "y.1" and "speed [1/min.]" are names of columns themselves.
        if last.starts_with(char::is_alphabetic) { last.to_owned() } else { text }
    };
    let named = |(k, c): (usize, &ChannelRef)| {
        let full = c.to_string();
        if matches!(c, ChannelRef::Column(_)) {
            let number = if channels.len() > 1 { (k + 1).to_string() } else { String::new() };
            return Entry { name: format!("{letter}{number}"), from: Some(full), unit: String::new() };
        }
        let unit = heading(&full).1.to_owned();
        let name = short(c);
        let unique = channels.iter().filter(|other| short(other) == name).count() == 1;
        let name = if unique { name } else { full.clone() };
        Entry { from: (name != full).then_some(full), name, unit }
    };
    channels.iter().enumerate().map(named).collect()
}

/// The matrix of equal polynomials as TOML, a plain list for one input and one output.
fn entries_of(polynomial: &str, rows: usize, columns: usize) -> String {
    if (rows, columns) == (1, 1) {
        return polynomial.into();
    }
    let row = format!("[{}]", vec![polynomial; columns].join(", "));
    format!("[{}]", vec![row; rows].join(", "))
}

/// The log as run.toml in `folder` should name it: as it is where it is absolute or `folder` is the present one, else absolute.
///
/// # Errors
/// [`youla_io::Error::Io`] where the present folder cannot be found out.
pub fn path_from(folder: &Path, file: &Path) -> Result<PathBuf> {
    if file.is_absolute() || folder.as_os_str().is_empty() || folder == Path::new(".") {
        return Ok(file.to_owned());
    }
    std::path::absolute(file).map_err(|source| Error::File(youla_io::Error::Io { path: file.to_owned(), source }))
}

#[cfg(test)]
mod tests;
