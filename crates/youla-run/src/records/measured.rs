//! `[[data.response]]`: a measured response instead of estimation records.
//!
//! The columns say what was measured: `y/u re` and `y/u im` for every output y and input u are the response of the plant; `u/d re`,
//! `y/d re` and so on, d the excitation that [data] names, are that of the loop, from which the plant is identified without a quotient.

use crate::records::SourceFile;
use crate::settings::{DataFile, DataSettings};
use crate::{Error, Result};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use youla::identify::likelihood::{Evidence, MeasuredResponse, ResponseTable, ResponseVariance};
use youla::lti::{Discrete, FrequencyResponse, StateSpace, frequency_response};
use youla::signal::{Channel, IndirectResponse, Record};
use youla::{Mat, c64};
use youla_io::{ChannelSpec, CsvOptions, Source, TimeSource, UffKind, is_uff, read, read_uff58, sha256, survey};

/// Largest part of the inputs that the stated controller may leave, errors of the response included.
const LARGEST_REST: f64 = 0.1;

/// A response as it was read.
#[derive(Debug, Clone)]
pub struct MeasuredTable {
    /// Name in reports.
    pub name: String,
    /// Frequencies, values and variances.
    pub table: ResponseTable,
    /// Whether it is that of the loop, from the excitation to inputs and outputs; else that of the plant.
    pub of_loop: bool,
    /// Where it came from.
    pub source: SourceFile,
}

impl MeasuredTable {
    /// As the estimation takes it.
    ///
    /// # Errors
    /// Those of [`MeasuredResponse::of_plant`] and [`MeasuredResponse::of_loop`].
    pub fn response(&self, time: Discrete) -> Result<MeasuredResponse> {
        let made = match self.of_loop {
            true => MeasuredResponse::of_loop(&self.table, time),
            false => MeasuredResponse::of_plant(&self.table, time),
        };
        made.map_err(|e| Error::from(e).within(format!("[[data.response]] {}", self.source.path)))
    }

    /// Root mean square of each input and output over the frequencies, for excitations of size one.
    pub(crate) fn sizes(&self, inputs: usize) -> (Vec<f64>, Vec<f64>) {
        let rows = self.table.values.first().map_or(0, Mat::nrows);
        let size = |i: usize| {
            let power = |value: &Mat<c64>| value.row(i).squared_norm_l2();
            let mean = self.table.values.iter().map(power).sum::<f64>() / self.table.values.len().max(1) as f64;
            if mean > 0.0 { mean.sqrt() } else { 1.0 }
        };
        let all: Vec<f64> = (0..rows).map(size).collect();
        match self.of_loop {
            true => (all[..inputs].to_vec(), all[inputs..].to_vec()),
            false => (vec![1.0; inputs], all),
        }
    }

    /// Whether a controller explains the inputs of a loop whose excitation is added to them, `T_u = I + K T_y`.
    ///
    /// # Errors
    /// A pole of the controller at a frequency of the table.
    pub(crate) fn controller(&self, controller: &StateSpace<Discrete>) -> Result<Option<Evidence>> {
        if !self.of_loop {
            return Ok(None);
        }
        let k = frequency_response(controller, &self.table.omega)?;
        let (mut rest, mut all) = (0.0, 0.0);
        for (t, k) in self.table.values.iter().zip(k.iter()) {
            let (m, p) = (k.nrows(), k.ncols());
            let fed_back = t.subrows(0, m) - Mat::<c64>::identity(m, m);
            rest += (&fed_back - k * t.subrows(m, p)).squared_norm_l2();
            all += t.subrows(0, m).squared_norm_l2();
        }
        let question = "Part of the inputs that the stated controller does not explain (controller)";
        Ok(Some(Evidence::new(question, (rest / all.max(f64::MIN_POSITIVE)).sqrt(), LARGEST_REST)))
    }

    /// The plant at its frequencies, as the figures show it; there is no coherence.
    ///
    /// # Errors
    /// Those of [`MeasuredTable::plant`].
    pub(crate) fn shown(&self) -> Result<IndirectResponse> {
        let response = self.plant()?;
        let (p, m) = (response.at(0).nrows(), response.at(0).ncols());
        let unknown = |columns: usize| Mat::from_fn(response.omega.len(), columns, |_, _| f64::NAN);
        Ok(IndirectResponse { coherence_y: unknown(p), coherence_u: unknown(m), segments: 0, response })
    }

    /// The plant, of a loop by the quotient `T_y T_u^-1`.
    ///
    /// # Errors
    /// [`youla::Error::Singular`] with the frequency at which the excitation does not reach all inputs.
    pub fn plant(&self) -> Result<FrequencyResponse> {
        Ok(self.table.plant(self.of_loop)?)
    }
}

/// How the columns of an entry hold its complex value.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    Cartesian,
    Magnitude,
    Decibel,
}

const FORMS: [(Form, [&str; 2]); 3] =
    [(Form::Cartesian, ["re", "im"]), (Form::Magnitude, ["abs", "deg"]), (Form::Decibel, ["dB", "deg"])];

impl Form {
    fn value(self, first: f64, second: f64) -> c64 {
        let polar = |size: f64| c64::from_polar(size, second.to_radians());
        match self {
            Form::Cartesian => c64::new(first, second),
            Form::Magnitude => polar(first),
            Form::Decibel => polar(10.0_f64.powf(first / 20.0)),
        }
    }
}

/// Reads the table; see the columns above.
///
/// # Errors
/// A file that cannot be read; a table without the columns, which are listed.
pub(crate) fn read_measured(settings: &DataSettings, folder: &Path, file: &DataFile) -> Result<MeasuredTable> {
    let path = folder.join(&file.file);
    let within = |e: youla_io::Error| match e {
        youla_io::Error::MissingFile { .. } => e.within("[[data.response]]".to_owned()),
        other => other,
    };
    let read = match is_uff(&path).map_err(within)? {
        true => Columns::of_uff(&path)?,
        false => Columns::Named(survey(&path, &settings.csv)?.into_iter().map(|c| c.from).collect()),
    };
    let layout = Layout::of(settings, read.names()).map_err(|problem| {
        let problem = format!("[[data.response]] {}: {problem}", file.file.display());
        Error::File(youla_io::Error::Settings { path: PathBuf::from("run.toml"), at: None, problem })
    })?;
    let record = read.record(&path, &settings.csv, &layout.columns())?;
    let column = |name: &str| record.column(name).map(<[f64]>::to_vec);
    let scale = if layout.frequency == "hz" { TAU } else { 1.0 };
    let omega = column(&layout.frequency)?.iter().map(|f| f * scale).collect();
    let stem = file.file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(MeasuredTable {
        name: file.name.clone().unwrap_or(stem),
        table: layout.table(omega, &column)?,
        of_loop: layout.of_loop,
        source: SourceFile {
            path: file.file.display().to_string(),
            purpose: "response".into(),
            sha256: sha256(&path)?,
        },
    })
}

/// The columns of a file.
enum Columns {
    /// Of a table, to be read where they are chosen.
    Named(Vec<String>),
    /// Of a universal file.
    Read(Vec<String>, Mat<f64>),
}

impl Columns {
    /// Responses and coherences of a universal file, with the frequencies of the first.
    fn of_uff(path: &Path) -> Result<Self> {
        let functions = read_uff58(path)?;
        let first = &functions[0];
        let (mut names, mut columns) = (vec!["hz".to_owned()], vec![first.abscissa.clone()]);
        for function in &functions {
            let entry = format!("{}/{}", function.response, function.reference);
            if function.abscissa != first.abscissa {
                let (path, found) = (path.to_owned(), "a universal file whose functions have different frequencies");
                let remedy = "export functions with the same frequencies";
                return Err(youla_io::Error::FormatNotRead { path, found, remedy }.into());
            }
            let part = |of: &dyn Fn(&c64) -> f64| function.values.iter().map(of).collect::<Vec<_>>();
            match function.kind {
                UffKind::Response => {
                    names.extend([format!("{entry} re"), format!("{entry} im")]);
                    columns.extend([part(&|v| v.re), part(&|v| v.im)]);
                }
                UffKind::Coherence => {
                    names.push(format!("{entry} coherence"));
                    columns.push(part(&|v| v.re));
                }
                UffKind::Other(_) => {}
            }
        }
        let values = Mat::from_fn(first.abscissa.len(), columns.len(), |k, j| columns[j][k]);
        Ok(Columns::Read(names, values))
    }

    fn names(&self) -> &[String] {
        match self {
            Columns::Named(names) | Columns::Read(names, _) => names,
        }
    }

    /// The chosen columns; rows are frequencies, but a record needs a clock.
    fn record(self, path: &Path, csv: &CsvOptions, chosen: &[String]) -> Result<Record> {
        match self {
            Columns::Named(_) => {
                let time = TimeSource { ts: Some(1.0), ..TimeSource::default() };
                let channels = chosen.iter().map(ChannelSpec::named).collect();
                let format = Default::default();
                Ok(read(&Source { path: path.to_owned(), format, time, channels, csv: csv.clone() })?)
            }
            Columns::Read(names, values) => {
                let channels = names.iter().map(|name| Channel::new(name, "")).collect();
                Ok(Record::new("response", channels, values, Discrete::new(1.0)?)?)
            }
        }
    }
}

/// The columns of a table.
struct Layout {
    /// `hz` or `rad/s`.
    frequency: String,
    of_loop: bool,
    /// Outputs of the response, and of a loop the inputs before them.
    rows: Vec<String>,
    /// What excites.
    sources: Vec<String>,
    form: Form,
    /// Ending of the columns with the errors.
    errors: Option<&'static str>,
}

impl Layout {
    /// From the names of the columns; the error says which are missing.
    fn of(settings: &DataSettings, columns: &[String]) -> Result<Self, String> {
        let names =
            |channels: &[ChannelSpec]| -> Vec<String> { channels.iter().map(|c| c.source().to_string()).collect() };
        let (u, y) = (names(&settings.inputs), names(&settings.outputs));
        let has = |name: &str| columns.iter().any(|c| c == name);
        let frequency = ["hz", "rad/s"].into_iter().find(|name| has(name));
        let frequency = frequency.ok_or("no column is named hz or rad/s: it holds the frequencies")?.to_owned();
        let excitations = [&settings.input_excitation, &settings.alpha, &settings.reference];
        let known = excitations.into_iter().find(|channels| channels.len() == u.len()).map(|channels| names(channels));
        let pairs = [known.map(|d| ([u.clone(), y.clone()].concat(), d, true)), Some((y.clone(), u, false))];
        for (rows, sources, of_loop) in pairs.into_iter().flatten() {
            for (form, endings) in FORMS {
                let layout = Layout {
                    frequency: frequency.clone(),
                    of_loop,
                    rows: rows.clone(),
                    sources: sources.clone(),
                    form,
                    errors: None,
                };
                let all = layout.named(&endings);
                if let Some(missing) = all.iter().find(|name| !has(name)) {
                    if all.iter().any(|name| has(name))
                        && endings.iter().all(|e| layout.named(&[e]).iter().any(|n| has(n)))
                    {
                        return Err(format!("no column is named {missing:?}, but others of this response are there"));
                    }
                    continue;
                }
                let errors = ["sd", "coherence"].into_iter().find(|e| layout.named(&[e]).iter().any(|name| has(name)));
                if let Some(missing) = errors.and_then(|e| layout.named(&[e]).into_iter().find(|name| !has(name))) {
                    return Err(format!("no column is named {missing:?}, but others of its kind are there"));
                }
                return Ok(Layout { errors, ..layout });
            }
        }
        let (output, input) = (&y[0], settings.inputs[0].source().to_string());
        let d = [&settings.input_excitation, &settings.alpha]
            .into_iter()
            .flatten()
            .next()
            .map_or_else(|| "d".into(), |c| c.source().to_string());
        Err(format!(
            "the columns hold no response; the plant has \"{output}/{input} re\" and \"{output}/{input} im\" for every output and input, the \
             loop \"{input}/{d} re\", \"{output}/{d} re\" and so on with the excitation that [data] names; abs or dB with deg instead of re \
             with im. The columns are {}",
            columns.iter().map(|c| format!("{c:?}")).collect::<Vec<_>>().join(", ")
        ))
    }

    fn named(&self, endings: &[&str]) -> Vec<String> {
        let entries = || self.rows.iter().flat_map(|row| self.sources.iter().map(move |source| (row, source)));
        entries()
            .flat_map(|(row, source)| endings.iter().map(move |ending| format!("{row}/{source} {ending}")))
            .collect()
    }

    fn endings(&self) -> [&'static str; 2] {
        FORMS.iter().find(|(form, _)| *form == self.form).map_or(["re", "im"], |(_, endings)| *endings)
    }

    fn columns(&self) -> Vec<String> {
        let errors = self.errors.map(|e| self.named(&[e])).unwrap_or_default();
        [vec![self.frequency.clone()], self.named(&self.endings()), errors].concat()
    }

    fn table(&self, omega: Vec<f64>, column: &dyn Fn(&str) -> youla::Result<Vec<f64>>) -> Result<ResponseTable> {
        let read = |ending: &str| -> Result<Vec<Vec<f64>>> {
            self.named(&[ending]).iter().map(|name| Ok(column(name)?)).collect()
        };
        let (first, second) = (read(self.endings()[0])?, read(self.endings()[1])?);
        let (rows, sources) = (self.rows.len(), self.sources.len());
        let matrix = |of: &dyn Fn(usize, usize) -> c64| -> Vec<Mat<c64>> {
            (0..omega.len()).map(|k| Mat::from_fn(rows, sources, |i, j| of(i * sources + j, k))).collect()
        };
        let values = matrix(&|at, k| self.form.value(first[at][k], second[at][k]));
        let real = |of: &dyn Fn(usize, usize) -> f64| -> Vec<Mat<f64>> {
            (0..omega.len()).map(|k| Mat::from_fn(rows, sources, |i, j| of(i * sources + j, k))).collect()
        };
        let variance = match self.errors {
            None => ResponseVariance::Unknown,
            Some("sd") => {
                let sd = read("sd")?;
                // a negative deviation has a negative variance, which is refused
                ResponseVariance::Known(real(&|at, k| sd[at][k] * sd[at][k].abs()))
            }
            Some(ending) => {
                let coherence = read(ending)?;
                self.check_coherence(&coherence, &omega)?;
                let size = |at: usize, k: usize| values[k][(at / sources, at % sources)].norm_sqr();
                // (1 - c) / (2 n c) of the square, n the number of averages (Bendat and Piersol); 1 is rounded
                let share = |c: f64| (1.0 - c).max(1e-6) / c;
                ResponseVariance::Proportional(real(&|at, k| share(coherence[at][k]) * size(at, k)))
            }
        };
        Ok(ResponseTable { omega, values, variance })
    }

    fn check_coherence(&self, coherence: &[Vec<f64>], omega: &[f64]) -> Result<()> {
        let names = self.named(&["coherence"]);
        for (name, column) in names.iter().zip(coherence) {
            if let Some(k) = column.iter().position(|c| !(*c > 0.0 && *c <= 1.0)) {
                let what = format!("{name} at {} Hz", omega[k] / TAU);
                return Err(Error::Method(youla::Error::OutOfRange {
                    what,
                    value: column[k],
                    must: "above 0 and at most 1",
                }));
            }
        }
        Ok(())
    }
}
