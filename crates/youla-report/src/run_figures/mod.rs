//! The figures of a run for print: what its page shows, as [`Figure`]s.
//!
//! | file | figure |
//! |---|---|
//! | `time` | signals over time |
//! | `order` | singular values and Hankel singular values |
//! | `verification` | measured, predicted, residual |
//! | `residuals` | correlations with the band of noise |
//! | `bode`, `nyquist` | frequency responses |
//! | `deviation` | deviation of the recommended response by its causes |
//! | `levels` | response without a model, noise, distortion |
//! | `singular` | singular values over frequency |
//! | `poles`, `pole_grid` | pole map and its grid |
//! | `reduction` | error over order |
//! | `choice` | the part of a run that is drawn |

mod bode;
mod choice;
mod deviation;
mod levels;
mod nyquist;
mod order;
mod pole_grid;
mod poles;
mod reduction;
mod residuals;
mod singular;
#[cfg(test)]
mod tests;
mod time;
mod verification;

pub use choice::FigureChoice;

use choice::Chosen;

use super::data::{DrawnMethod, ReportData};
use super::figure::{Axis, Figure, OtherUnit};
use crate::Result;

/// A figure of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunFigure {
    /// Signals of the estimation records.
    Data,
    /// Alpha and beta.
    Signals,
    /// Singular values from which orders were chosen.
    Order,
    /// Measured against predicted.
    Verification,
    /// Correlations of the residuals.
    Residuals,
    /// Frequency responses.
    Bode,
    /// The same as loci.
    Nyquist,
    /// The response to a known excitation without a model, with noise and distortion.
    Levels,
    /// Singular values over frequency.
    SingularValues,
    /// Poles and zeros.
    Poles,
    /// Hankel singular values.
    Hankel,
    /// Error of the reduction over its order.
    Reduction,
    /// Present and new loop.
    Redesign,
}

impl RunFigure {
    /// All of them, in the order of the page.
    pub const ALL: [RunFigure; 13] = [
        RunFigure::Bode,
        RunFigure::Nyquist,
        RunFigure::Levels,
        RunFigure::SingularValues,
        RunFigure::Redesign,
        RunFigure::Verification,
        RunFigure::Residuals,
        RunFigure::Poles,
        RunFigure::Order,
        RunFigure::Hankel,
        RunFigure::Reduction,
        RunFigure::Data,
        RunFigure::Signals,
    ];

    /// Its name.
    pub fn key(self) -> &'static str {
        match self {
            RunFigure::Data => "data",
            RunFigure::Signals => "signals",
            RunFigure::Order => "order",
            RunFigure::Verification => "verification",
            RunFigure::Residuals => "residuals",
            RunFigure::Bode => "bode",
            RunFigure::Nyquist => "nyquist",
            RunFigure::Levels => "levels",
            RunFigure::SingularValues => "singular-values",
            RunFigure::Poles => "poles",
            RunFigure::Hankel => "hankel",
            RunFigure::Reduction => "reduction",
            RunFigure::Redesign => "redesign",
        }
    }

    /// What it can be drawn for alone: the fields of [`FigureChoice`] that it knows.
    pub fn chosen_by(self) -> &'static [&'static str] {
        match self {
            RunFigure::Data | RunFigure::Signals => &["record"],
            RunFigure::Order | RunFigure::SingularValues | RunFigure::Poles => &["methods"],
            RunFigure::Verification | RunFigure::Residuals => &["record", "output", "methods"],
            RunFigure::Bode | RunFigure::Nyquist | RunFigure::Levels => &["output", "input", "methods"],
            RunFigure::Hankel | RunFigure::Reduction | RunFigure::Redesign => &[],
        }
    }

    /// What it shows, in a few words.
    pub fn about(self) -> &'static str {
        match self {
            RunFigure::Data => "signals of the records from which the models were identified",
            RunFigure::Signals => "alpha and beta, from which S was identified",
            RunFigure::Order => "singular values from which orders were chosen",
            RunFigure::Verification => "measured, predicted and the residuals beneath",
            RunFigure::Residuals => "correlations of the residuals with the 99 % band of noise",
            RunFigure::Bode => {
                "magnitude with bands, phase, coherence of the indirect response, and deviation by its causes"
            }
            RunFigure::Nyquist => "the same responses as loci, with their regions",
            RunFigure::Levels => "response without a model, with the levels of noise and distortion",
            RunFigure::SingularValues => "singular values of the whole response over frequency",
            RunFigure::Poles => "poles and zeros with lines of constant frequency and damping ratio",
            RunFigure::Hankel => "Hankel singular values of the model that was reduced",
            RunFigure::Reduction => "error of the reduction over its order",
            RunFigure::Redesign => "the loop with the present and the new controller",
        }
    }
}

/// A figure with the methods that give it colours and names.
#[derive(Debug, Clone, PartialEq)]
pub struct RunDrawing {
    /// The figure; its key names its files.
    pub figure: Figure,
    /// As [`super::svg()`] and [`super::figure_csv`] take them.
    pub methods: Vec<DrawnMethod>,
}

/// The figures that a run has.
///
/// ```
/// use youla_report::{ReportData, run_figures};
/// assert!(run_figures(&ReportData::default())?.is_empty());
/// # Ok::<(), youla_report::Error>(())
/// ```
///
/// # Errors
/// Those of [`run_drawings`].
pub fn run_figures(data: &ReportData) -> Result<Vec<RunFigure>> {
    let chosen = FigureChoice::default().of(data)?;
    Ok(RunFigure::ALL.into_iter().filter(|kind| !drawings(&chosen, *kind).is_empty()).collect())
}

/// The drawings of one figure: one per record, output or pair of output and input, as far as they are chosen.
///
/// What a figure does not distinguish is not chosen in it: a pole map has no outputs. Keys distinguish the drawings and do not
/// depend on the choice.
///
/// # Errors
/// [`youla::Error::UnknownChannel`] for an output, input, record or method that the run does not have, with those it has.
pub fn run_drawings(data: &ReportData, kind: RunFigure, choice: &FigureChoice) -> Result<Vec<RunDrawing>> {
    Ok(drawings(&choice.of(data)?, kind))
}

fn drawings(chosen: &Chosen, kind: RunFigure) -> Vec<RunDrawing> {
    let methods = chosen.data.methods.clone();
    let figures = match kind {
        RunFigure::Data => time::data(chosen),
        RunFigure::Signals => time::signals(chosen),
        RunFigure::Order => order::singular_values(chosen),
        RunFigure::Verification => verification::figures(chosen),
        RunFigure::Residuals => residuals::figures(chosen),
        RunFigure::Bode => bode::figures(chosen),
        RunFigure::Nyquist => nyquist::figures(chosen),
        RunFigure::Levels => levels::figures(chosen),
        RunFigure::SingularValues => singular::figure(chosen),
        RunFigure::Poles => poles::figure(chosen),
        RunFigure::Hankel => order::hankel(chosen),
        RunFigure::Reduction => reduction::figure(chosen),
        RunFigure::Redesign => return redesign(chosen),
    };
    with_own_keys(figures).into_iter().map(|figure| RunDrawing { figure, methods: methods.clone() }).collect()
}

fn redesign(chosen: &Chosen) -> Vec<RunDrawing> {
    let drawing = |new: &super::data::DrawnRedesign| RunDrawing {
        figure: Figure { key: RunFigure::Redesign.key().into(), ..new.figure.clone() },
        methods: new.loops.clone(),
    };
    chosen.data.redesign.iter().map(drawing).collect()
}

/// Names that differ in signs only may give the same key.
fn with_own_keys(mut figures: Vec<Figure>) -> Vec<Figure> {
    for k in 1..figures.len() {
        let own = figures[k].key.clone();
        let taken = |key: &str| figures[..k].iter().any(|figure| figure.key == key);
        let key = (2..).map(|n| format!("{own}-{n}")).find(|key| !taken(key));
        figures[k].key = if taken(&own) { key.unwrap_or(own) } else { own };
    }
    figures
}

/// The name of a figure and those of its parts that the run has more than one of, as a name of files.
fn key(figure: RunFigure, parts: &[(&str, bool)]) -> String {
    let safe = |c: char| if c.is_alphanumeric() || c == '_' { c } else { '-' };
    let parts =
        parts.iter().filter(|(_, several)| *several).map(|(name, _)| name.chars().map(safe).collect::<String>());
    std::iter::once(figure.key().to_owned()).chain(parts).collect::<Vec<_>>().join("-")
}

/// The choices that lead to a figure.
fn choice(parts: &[(&str, &str)]) -> Vec<(String, String)> {
    parts.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
}

fn axis(label: impl Into<String>, unit: impl Into<String>) -> Axis {
    Axis { label: label.into(), unit: unit.into(), ..Axis::default() }
}

fn logarithmic(label: impl Into<String>, unit: impl Into<String>) -> Axis {
    Axis { log: true, ..axis(label, unit) }
}

/// Frequency in Hz, at the opposite edge in rad/s.
fn frequency_in_both_units() -> Axis {
    let also = OtherUnit { label: "Angular frequency".into(), unit: "rad/s".into(), factor: std::f64::consts::TAU };
    Axis { also: Some(also), ..logarithmic("Frequency", "Hz") }
}

/// Smallest and largest of the finite values, nothing where there are none.
fn span(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let finite = values.filter(|value| value.is_finite());
    let [low, high] = finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
    (low <= high).then_some([low, high])
}
