//! Tables of measured frequency responses, one row for each frequency.
//!
//! The columns say what was measured, d the excitation:
//!
//! | columns | hold |
//! |---|---|
//! | `hz` or `rad/s` | the frequencies |
//! | `y/u re`, `y/u im` for every output y and input u | the plant |
//! | `u/d re`, `u/d im`, `y/d re`, `y/d im` and so on | the loop, from which the plant is identified without a quotient |
//! | `abs`, `deg` or `dB`, `deg` in place of `re`, `im` | the same in polar form |
//! | `y/u sd`, `y/u coherence` and so on, for all entries | standard deviations, or coherences |
//!
//! Universal files of type 58 hold the same under the names of their nodes.

use crate::choose::ChannelSpec;
use crate::csv::CsvOptions;
use crate::error::{Error, Result};
use crate::source::{Format, Source, read_rows};
use crate::survey::survey;
use crate::time::TimeSource;
use crate::uff::{UffKind, is_uff, read_uff58};
use std::f64::consts::TAU;
use std::path::Path;
use youla::error::Names;
use youla::identify::likelihood::{ResponseTable, ResponseVariance};
use youla::lti::Discrete;
use youla::signal::{Channel, Record};
use youla::{Mat, c64};

/// Names of the signals in the columns of a response.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ResponseSignals {
    /// Plant inputs.
    pub inputs: Vec<String>,
    /// Plant outputs.
    pub outputs: Vec<String>,
    /// What excites the loop, one per input; empty where nothing is known.
    pub excitations: Vec<String>,
}

/// A response as it was read.
#[derive(Debug, Clone)]
pub struct ReadResponse {
    /// Frequencies, values and variances.
    pub table: ResponseTable,
    /// Whether it is that of the loop, from the excitation to inputs and outputs; else that of the plant.
    pub of_loop: bool,
}

/// Reads a response from a table or a universal file.
///
/// # Errors
/// Those of the reader; [`Error::NotAResponse`] for a table without the columns, which are listed; [`youla::Error::OutOfRange`] for a coherence
/// that is none.
pub fn read_response(path: impl AsRef<Path>, signals: &ResponseSignals, csv: &CsvOptions) -> Result<ReadResponse> {
    let path = path.as_ref();
    let columns = match is_uff(path)? {
        true => Columns::of_uff(path)?,
        false => Columns::Named(survey(path, csv)?.into_iter().map(|c| c.from).collect()),
    };
    let layout = Layout::of(signals, columns.names())
        .map_err(|problem| Error::NotAResponse { path: path.to_owned(), problem })?;
    let record = columns.record(path, csv, &layout.columns())?;
    Ok(ReadResponse { table: layout.table(&record)?, of_loop: layout.of_loop })
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
                return Err(Error::FormatNotRead { path, found, remedy });
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
                let (time, channels) = (TimeSource::default(), chosen.iter().map(ChannelSpec::named).collect());
                read_rows(&Source { path: path.to_owned(), format: Format::Detect, time, channels, csv: csv.clone() })
            }
            Columns::Read(names, values) => {
                let channels = names.iter().map(|name| Channel::new(name, "")).collect();
                Ok(Record::new("response", channels, values, Discrete::new(1.0)?)?)
            }
        }
    }
}

/// How two columns hold a complex value: their endings and the value.
type Form = ([&'static str; 2], fn(f64, f64) -> c64);

const FORMS: [Form; 3] = [
    (["re", "im"], c64::new),
    (["abs", "deg"], |size, degrees| c64::from_polar(size, degrees.to_radians())),
    (["dB", "deg"], |decibel, degrees| c64::from_polar(10.0_f64.powf(decibel / 20.0), degrees.to_radians())),
];

/// The columns of a table.
struct Layout {
    /// `hz` or `rad/s`.
    frequency: &'static str,
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
    fn of(signals: &ResponseSignals, columns: &[String]) -> std::result::Result<Self, String> {
        let ResponseSignals { inputs: u, outputs: y, excitations: d } = signals;
        let has = |name: &String| columns.contains(name);
        let frequency = ["hz", "rad/s"].into_iter().find(|name| columns.iter().any(|c| c == name));
        let frequency = frequency.ok_or("no column is named hz or rad/s: it holds the frequencies")?;
        let of_loop = (!d.is_empty()).then(|| ([&u[..], y].concat(), d.clone(), true));
        for (rows, sources, of_loop) in of_loop.into_iter().chain([(y.clone(), u.clone(), false)]) {
            for form in FORMS {
                let (rows, sources) = (rows.clone(), sources.clone());
                let layout = Layout { frequency, of_loop, rows, sources, form, errors: None };
                let all = layout.named(&form.0);
                if let Some(missing) = all.iter().find(|name| !has(name)) {
                    if form.0.iter().all(|ending| layout.named(&[ending]).iter().any(has)) {
                        return Err(format!("no column is named {missing:?}, but others of this response are there"));
                    }
                    continue;
                }
                let errors = ["sd", "coherence"].into_iter().find(|e| layout.named(&[e]).iter().any(has));
                if let Some(missing) = errors.and_then(|e| layout.named(&[e]).into_iter().find(|name| !has(name))) {
                    return Err(format!("no column is named {missing:?}, but others of its kind are there"));
                }
                return Ok(Layout { errors, ..layout });
            }
        }
        let (output, input, d) = (&y[0], &u[0], d.first().map_or("d", String::as_str));
        Err(format!(
            "the columns hold no response; the plant has \"{output}/{input} re\" and \"{output}/{input} im\" for every output and input, the \
             loop \"{input}/{d} re\", \"{output}/{d} re\" and so on with the excitation that [data] names; abs or dB with deg instead of re \
             with im. The columns are {}",
            Names(columns)
        ))
    }

    /// The names of all entries with each ending, entry by entry.
    fn named(&self, endings: &[&str]) -> Vec<String> {
        let entries = self.rows.iter().flat_map(|row| self.sources.iter().map(move |source| (row, source)));
        entries.flat_map(|(row, source)| endings.iter().map(move |ending| format!("{row}/{source} {ending}"))).collect()
    }

    fn columns(&self) -> Vec<String> {
        let errors = self.errors.map(|e| self.named(&[e])).unwrap_or_default();
        [vec![self.frequency.to_owned()], self.named(&self.form.0), errors].concat()
    }

    fn table(&self, record: &Record) -> Result<ResponseTable> {
        let read = |ending: &str| -> Result<Vec<Vec<f64>>> {
            self.named(&[ending]).iter().map(|name| Ok(record.column(name)?.to_vec())).collect()
        };
        let scale = if self.frequency == "hz" { TAU } else { 1.0 };
        let omega: Vec<f64> = record.column(self.frequency)?.iter().map(|f| f * scale).collect();
        let (endings, value) = self.form;
        let (first, second) = (read(endings[0])?, read(endings[1])?);
        let values = self.matrices(omega.len(), |at, k| value(first[at][k], second[at][k]));
        let variance = match self.errors {
            None => ResponseVariance::Unknown,
            Some("sd") => {
                let sd = read("sd")?;
                // A negative deviation has a negative variance, which is refused.
                ResponseVariance::Known(self.matrices(omega.len(), |at, k| sd[at][k] * sd[at][k].abs()))
            }
            Some(ending) => {
                let coherence = read(ending)?;
                self.check_coherence(&coherence, &omega)?;
                let size = |at: usize, k: usize| value(first[at][k], second[at][k]).norm_sqr();
                // (1 - c) / (2 n c) of the square, n the number of averages (Bendat and Piersol); 1 is rounded.
                let share = |c: f64| (1.0 - c).max(1e-6) / c;
                ResponseVariance::Proportional(
                    self.matrices(omega.len(), |at, k| share(coherence[at][k]) * size(at, k)),
                )
            }
        };
        Ok(ResponseTable { omega, values, variance })
    }

    /// A matrix for each frequency from its entries, row by row.
    fn matrices<T>(&self, frequencies: usize, of: impl Fn(usize, usize) -> T) -> Vec<Mat<T>> {
        let (rows, sources) = (self.rows.len(), self.sources.len());
        (0..frequencies).map(|k| Mat::from_fn(rows, sources, |i, j| of(i * sources + j, k))).collect()
    }

    fn check_coherence(&self, coherence: &[Vec<f64>], omega: &[f64]) -> Result<()> {
        for (name, column) in self.named(&["coherence"]).iter().zip(coherence) {
            if let Some(k) = column.iter().position(|c| !(*c > 0.0 && *c <= 1.0)) {
                let (what, value) = (format!("{name} at {} Hz", omega[k] / TAU), column[k]);
                return Err(Error::Method(youla::Error::OutOfRange { what, value, must: "above 0 and at most 1" }));
            }
        }
        Ok(())
    }
}
