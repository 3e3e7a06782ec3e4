//! Frequency responses as magnitude and phase, with the bands of the magnitude, and the coherence of the indirect response.

use super::choice::Chosen;
use super::deviation;
use super::verification::channel;
use super::{RunFigure, axis, choice, frequency_in_both_units, key, logarithmic, span};
use crate::data::{DrawnBand, DrawnDeviation, DrawnResponses, Indirect, LineLevels, ModelResponse};
use crate::figure::{Area, Axis, Content, Curve, Drawn, Figure, Panel};
use crate::pretty_unit;

/// Coherence below which a point of the indirect response is said to carry little.
pub(super) const FADED: f64 = 0.6;
const FADED_NOTE: &str = "coherence below 0.6";

/// One output and one input and their responses.
pub(super) struct Pair<'a> {
    pub(super) title: String,
    pub(super) key: String,
    /// `um/V`, empty where a unit is not known.
    pub(super) unit: String,
    pub(super) hz: &'a [f64],
    pub(super) models: Vec<&'a ModelResponse>,
    pub(super) indirect: Vec<&'a Indirect>,
    pub(super) bands: Vec<&'a DrawnBand>,
    pub(super) lines: Option<&'a LineLevels>,
    deviation: Option<&'a DrawnDeviation>,
}

/// All pairs of a run that have a response, by output, then by input.
pub(super) fn pairs(chosen: &Chosen, figure: RunFigure) -> Vec<Pair<'_>> {
    let Some(response) = &chosen.data.frequency else { return Vec::new() };
    let DrawnResponses { hz, models, indirect, bands, lines, deviations, .. } = response;
    let mut places: Vec<(usize, usize)> = models.iter().map(|m| (m.output, m.input)).collect();
    places.extend(indirect.iter().map(|m| (m.output, m.input)));
    places.sort_unstable();
    places.dedup();
    let several = chosen.data.outputs.len() * chosen.data.inputs.len() > 1;
    let pair = |place: (usize, usize)| {
        let (output, input) = (channel(&chosen.data.outputs, place.0), channel(&chosen.data.inputs, place.1));
        let unit = match (output.unit.as_str(), input.unit.as_str()) {
            ("", _) | (_, "") => String::new(),
            (one, other) => format!("{}/{}", pretty_unit(one), pretty_unit(other)),
        };
        Pair {
            title: format!("{} from {}", output.name, input.name),
            key: key(figure, &[(&output.name, several), ("from", several), (&input.name, several)]),
            unit,
            hz,
            models: models.iter().filter(|m| (m.output, m.input) == place).collect(),
            indirect: indirect.iter().filter(|m| (m.output, m.input) == place).collect(),
            bands: bands.iter().filter(|b| (b.output, b.input) == place).collect(),
            lines: lines.iter().find(|l| (l.output, l.input) == place),
            deviation: deviations.iter().find(|d| (d.output, d.input) == place),
        }
    };
    places.into_iter().map(pair).collect()
}

/// One figure per pair.
pub(super) fn figures(chosen: &Chosen) -> Vec<Figure> {
    pairs(chosen, RunFigure::Bode).iter().map(|pair| figure(chosen, pair)).collect()
}

fn figure(chosen: &Chosen, pair: &Pair) -> Figure {
    let shades: Vec<[f64; 2]> = pair.indirect.iter().flat_map(|measured| low_coherence(measured)).collect();
    let gain = if pair.unit.is_empty() { "dB".into() } else { format!("dB re {}", pair.unit) };
    let x = logarithmic("Frequency", "Hz");
    let panel = |y: Axis, curves: Vec<Curve>, height| {
        let content = Content::Curves(curves);
        Panel { x: x.clone(), y, content, shades: shades.clone(), height, ..Panel::default() }
    };
    let magnitude = Axis { range: seen(pair), ..axis("Magnitude", gain) };
    let mut panels = vec![
        Panel {
            x: frequency_in_both_units(),
            regions: pair.bands.iter().map(|band| region(pair, band)).collect(),
            ..panel(magnitude, curves(pair, Part::Magnitude), None)
        },
        panel(axis("Phase", "deg"), curves(pair, Part::Phase), Some(0.75)),
    ];
    if coherent(pair) {
        let y = Axis { range: Some([0.0, 1.04]), ..axis("Coherence", "") };
        let line = |measured: &&Indirect| Curve { drawn: Drawn::Line, ..points(measured, Part::Coherence, |_| true) };
        panels.push(panel(y, pair.indirect.iter().map(line).collect(), Some(0.4)));
    }
    let ends = span(pair.hz.iter().copied()).unwrap_or([0.0, f64::INFINITY]);
    panels.extend(pair.deviation.map(|of| Panel { x: x.clone(), ..deviation::panel(of, ends) }));
    Figure {
        key: pair.key.clone(),
        title: format!("Frequency response, {}", pair.title),
        caption: caption(chosen, pair),
        choice: choice(&[("View", "Bode"), ("Response of", &pair.title)]),
        panels,
        ..Figure::default()
    }
}

/// Whether a coherence is known.
fn coherent(pair: &Pair) -> bool {
    pair.indirect.iter().any(|measured| measured.coherence.iter().any(|c| !c.is_nan()))
}

fn caption(chosen: &Chosen, pair: &Pair) -> String {
    let mut text = format!("Frequency response, {}.", pair.title);
    if coherent(pair) {
        text += &format!(
            " Points: indirect non-parametric response, estimated with the external excitation and without any model. Outlined \
             and in shaded parts: coherence below {FADED}, where the points say little."
        );
    } else if !pair.indirect.is_empty() {
        text += " Points: the response that was measured.";
    }
    text += &pair.deviation.map_or_else(String::new, deviation::caption);
    if let Some(band) = pair.bands.first() {
        let name = |band: &&DrawnBand| {
            let found = chosen.data.methods.iter().find(|method| method.key == band.method);
            found.map_or_else(|| band.method.clone(), |method| method.label.clone())
        };
        let names: Vec<String> = pair.bands.iter().map(name).collect();
        text += &format!(
            " Filled: where the magnitude of {} lies with a probability of {} at each frequency.",
            names.join(" and of "),
            percent(band.level)
        );
        if pair.bands.iter().any(open_below) {
            text += " Down to the axis: the bounds include magnitude zero.";
        }
    }
    text
}

/// A probability in percent.
pub(super) fn percent(level: f64) -> String {
    let text = format!("{:.2}", 100.0 * level);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

/// Whether the lower bound is magnitude zero somewhere.
fn open_below(band: &&DrawnBand) -> bool {
    band.low_db.iter().zip(&band.high_db).any(|(low, high)| low.is_nan() && high.is_finite())
}

fn region(pair: &Pair, band: &DrawnBand) -> Area {
    Area {
        method: band.method.clone(),
        note: percent(band.level),
        x: pair.hz.to_vec(),
        low: band.low_db.clone(),
        high: band.high_db.clone(),
    }
}

#[derive(Clone, Copy)]
enum Part {
    Magnitude,
    Phase,
    Coherence,
}

fn curves(pair: &Pair, part: Part) -> Vec<Curve> {
    let faded = pair
        .indirect
        .iter()
        .map(|measured| Curve { note: FADED_NOTE.into(), ..points(measured, part, |coherence| !is_clear(coherence)) });
    let clear = pair.indirect.iter().map(|measured| points(measured, part, is_clear));
    let model = |model: &&ModelResponse| Curve {
        method: model.method.clone(),
        x: pair.hz.to_vec(),
        y: match part {
            Part::Phase => model.phase_deg.clone(),
            _ => model.magnitude_db.clone(),
        },
        ..Curve::default()
    };
    clear.chain(faded).filter(|curve| !curve.x.is_empty()).chain(pair.models.iter().map(model)).collect()
}

/// Whether a point of this coherence says something; a response without coherence is taken as it is.
pub(super) fn is_clear(coherence: f64) -> bool {
    coherence.is_nan() || coherence >= FADED
}

fn points(measured: &Indirect, part: Part, wanted: impl Fn(f64) -> bool) -> Curve {
    let values = match part {
        Part::Magnitude => &measured.magnitude_db,
        Part::Phase => &measured.phase_deg,
        Part::Coherence => &measured.coherence,
    };
    let all = measured.hz.iter().zip(values).zip(&measured.coherence);
    let (x, y) = all.filter(|(_, coherence)| wanted(**coherence)).map(|((hz, value), _)| (*hz, *value)).unzip();
    Curve { method: "indirect".into(), drawn: Drawn::Points, x, y, ..Curve::default() }
}

/// The range of models and clear points, wider by a tenth: points that say little do not decide it.
fn seen(pair: &Pair) -> Option<[f64; 2]> {
    let models = pair.models.iter().flat_map(|model| &model.magnitude_db).copied();
    let clear = |measured: &&&Indirect| points(measured, Part::Magnitude, is_clear).y;
    let all = models.chain(pair.indirect.iter().map(|m| clear(&m)).collect::<Vec<_>>().concat());
    let [low, high] = span(all)?;
    let room = 0.06 * if high > low { high - low } else { 10.0 };
    Some([low - room, high + room])
}

/// Ranges of at least three neighbouring points of low coherence.
fn low_coherence(measured: &Indirect) -> Vec<[f64; 2]> {
    let places: Vec<usize> = (0..measured.hz.len().min(measured.coherence.len())).collect();
    let runs = places.chunk_by(|a, b| !is_clear(measured.coherence[*a]) && !is_clear(measured.coherence[*b]));
    let low = |run: &&[usize]| run.len() >= 3;
    runs.filter(low).map(|run| [measured.hz[run[0]], measured.hz[run[run.len() - 1]]]).collect()
}
