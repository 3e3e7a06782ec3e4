//! Whether the records support the model, in the metric of the loop that ran: tests with a figure, a limit and three outcomes.
//!
//! | test | question | module |
//! |---|---|---|
//! | excitation | did anything but noise move the loop? | this one |
//! | controller | is the stated controller the one that ran? | `controller` |
//! | stability | does it stabilise the model, as it did the plant? | this one |
//! | indirect response | does the model explain what the excitation causes? | `witness`, `local_error` |
//! | information | does the excitation, not the noise, determine the model? | this one |
//! | repeatability | does the excitation show the same response in parts of the records? | `witness` |
//! | same model | do halves and fresh records ask for the same model? | `parts` |
//! | region | which part of the margin does the 95 % region take? | `loop_ratio` |
//! | nonlinearity, saturation | is what acts at the inputs nearly the inputs? | `nonlinear` |
//! | stationarity | is the residual of fresh records as large as before? | `parts` |
//!
//! A model is trusted where every required test is passed. Limits: `limits`.

mod beyond;
mod controller;
mod excess;
mod functions;
pub(crate) mod limits;
mod local_error;
pub(crate) mod loop_ratio;
mod nonlinear;
mod partition;
mod parts;
#[cfg(test)]
mod tests;
mod witness;

pub(crate) use controller::{explains, share_at_limit};
pub(crate) use excess::Excess;
pub use loop_ratio::LoopRatio;
pub(crate) use nonlinear::{NonlinearPart, nonlinear};
pub(crate) use parts::Parts;
pub(crate) use witness::Witness;

use crate::Result;
use crate::control::{closed_loop, with_input_port};
use crate::identify::likelihood::choose::loads::Nuisance;
use crate::identify::likelihood::choose::problem::{GROWTH, Problem, Solution};
use crate::identify::likelihood::data::spectra::{Sizes, Spectra};
use crate::identify::likelihood::deviation::region::Region;
use crate::identify::likelihood::deviation::response_error::ResponseError;
use crate::identify::likelihood::deviation::{Directions, grid};
use crate::identify::likelihood::{Evidence, LoopKnowledge, figure as figure_of};
use crate::linalg::TINY;
use crate::lti::{Discrete, StateSpace, frequency_response};
use crate::statistics::median;
use limits::{INFORMATION_RATIO, LARGEST_DEVIATION, LARGEST_LOOP_ERROR, LARGEST_RATIO_OF_LOOP, NO_INFORMATION};
use loop_ratio::{LoopAt, bands, judged_hz, valid};

/// What the verdict rests on.
pub(crate) struct Judged<'a> {
    /// The records and the searches on them.
    pub(crate) problem: &'a Problem<'a>,
    /// Their lines.
    pub(crate) spectra: &'a Spectra,
    /// The model.
    pub(crate) solution: &'a Solution,
    /// What is known of the loop.
    pub(crate) known: Option<&'a LoopKnowledge<'a>>,
    /// What the excitation says.
    pub(crate) witness: Option<&'a Witness>,
    /// Parts of the records.
    pub(crate) parts: &'a Parts,
    /// The plant in physical units.
    pub(crate) plant: &'a StateSpace<Discrete>,
    /// Its region.
    pub(crate) region: &'a Region,
    /// What acts at the inputs and is no linear function of them.
    pub(crate) nonlinear: Vec<Evidence>,
}

/// Tests, the region in the metric of the loop, and bands of validity.
pub(crate) struct Judgement {
    pub(crate) evidence: Vec<Evidence>,
    pub(crate) loop_ratio: Option<LoopRatio>,
    pub(crate) entry_bands: Vec<Vec<Vec<[f64; 2]>>>,
    pub(crate) bands: Vec<[f64; 2]>,
    /// Whether what the excitation moves suffices for the model; true where that was not asked.
    pub(crate) informed: bool,
}

/// The loop of a region: its plant in the feedback, at the frequencies at which it is judged.
struct Loops {
    at: Vec<LoopAt>,
}

impl Loops {
    /// `None` without feedback.
    fn new(plant: &StateSpace<Discrete>, region: &Region, k: Option<&StateSpace<Discrete>>) -> Result<Option<Self>> {
        let Some(k) = k.filter(|k| !k.is_zero()) else { return Ok(None) };
        let mut poles = plant.poles()?;
        poles.extend(closed_loop(plant, &with_input_port(k)?)?.poles()?);
        let hz = judged_hz(region, &poles, plant.time().ts());
        Ok(Some(Loops { at: LoopAt::all(plant, k, &hz)? }))
    }

    /// The loop at the judged frequency next to one.
    fn near(&self, hz: f64) -> Option<&LoopAt> {
        let next = self.at.partition_point(|at| at.hz < hz);
        let around = self.at[next.saturating_sub(1)..(next + 1).min(self.at.len())].iter();
        around.min_by(|a, b| (a.hz - hz).abs().total_cmp(&(b.hz - hz).abs()))
    }
}

/// The judgement of a model from records.
///
/// # Errors
/// Ports of the controller; a loop that is not well posed.
pub(crate) fn judge(on: &Judged<'_>) -> Result<Judgement> {
    let ts = on.plant.time().ts();
    let feedback = on.known.and_then(|known| known.feedback);
    let loops = Loops::new(on.plant, on.region, feedback)?;
    let mut evidence = vec![excitation(on)];
    if let Some(known) = on.known {
        evidence.extend(controller::controller(known, on.plant)?);
    }
    evidence.extend(feedback.map(|k| stability((on.plant, on.region), k, on.spectra.samples())).transpose()?.flatten());
    let weigh = |share: f64, squares: &[f64]| in_loop(loops.as_ref(), on, share / ts, squares);
    if let Some(witness) = on.witness {
        evidence.push(indirect(on, witness, &weigh));
    }
    let confirmed = confirmed(on)?;
    let shown = of_region(on.plant, on.region, loops.as_ref(), &|share, i, j| confirmed(share, i, j))?;
    let (p, m, sizes) = (on.plant.outputs(), on.plant.inputs(), &on.problem.sizes.y);
    let each_shown = |hz: f64| (0..m).all(|j| (0..p).any(|i| confirmed(hz * ts, i, j)));
    let unseen = loops.as_ref().and_then(|loops| beyond::beyond(loops, each_shown, sizes));
    let information = on.witness.zip(loops.as_ref()).map(|(witness, loops)| information(on, witness, loops));
    let informed = information.as_ref().is_none_or(Evidence::holds);
    evidence.extend(information);
    let sensitivity = |share: f64| Some(loops.as_ref()?.near(share / ts)?.sensitivity(sizes));
    let seen = |share: f64| on.witness.is_none_or(|witness| witness.shows(share));
    evidence.extend(on.parts.evidence(ts, &sensitivity, &seen));
    if let Some(witness) = on.witness.filter(|witness| !witness.variation.is_empty()) {
        evidence.push(repeatability(on, witness, &weigh));
    }
    evidence.push(shown.0);
    evidence.extend(unseen);
    evidence.extend(on.nonlinear.clone());
    Ok(Judgement { evidence, informed, ..shown.1 })
}

/// The test of the region, and what it says of the loop and of bands.
///
/// # Errors
/// Frequencies on a pole.
pub(crate) fn of_response(
    plant: &StateSpace<Discrete>,
    region: &Region,
    feedback: Option<&StateSpace<Discrete>>,
) -> Result<Judgement> {
    let loops = Loops::new(plant, region, feedback)?;
    let (test, judgement) = of_region(plant, region, loops.as_ref(), &|_, _, _| true)?;
    let mut evidence: Vec<Evidence> =
        feedback.map(|k| stability((plant, region), k, usize::MAX)).transpose()?.flatten().into_iter().collect();
    evidence.push(test);
    Ok(Judgement { evidence, ..judgement })
}

/// Whether an entry is within the frequencies at which the excitation shows it, given a share of the sample rate: beyond them a model continues what
/// it has, and a mode that is there is in no figure. Everywhere where the excitation is not known, or nowhere moves every input.
fn confirmed(on: &Judged<'_>) -> Result<impl Fn(f64, usize, usize) -> bool> {
    let (p, m, ts) = (on.plant.outputs(), on.plant.inputs(), on.plant.time().ts());
    let sizes = &on.problem.sizes;
    let ranges = on.witness.map(|witness| &witness.narrow).filter(|narrow| narrow.shows_all()).map(|narrow| {
        let shares: Vec<f64> = narrow.partition.middles().collect();
        let omega: Vec<f64> = shares.iter().map(|share| std::f64::consts::TAU * share / ts).collect();
        let g = frequency_response(on.plant, &omega)?;
        let power = |band: usize, entry: usize| {
            let (i, j) = (entry / m, entry % m);
            (g.at(band)[(i, j)].norm() * sizes.u[j] / sizes.y[i]).powi(2)
        };
        let of = |entry: usize| narrow.range_shown(entry, &|band| power(band, entry));
        Ok::<_, crate::Error>((0..p * m).map(of).collect::<Vec<_>>())
    });
    let ranges = ranges.transpose()?;
    Ok(move |share: f64, i: usize, j: usize| {
        ranges.as_ref().is_none_or(|ranges| ranges[i * m + j].is_some_and(|[low, high]| (low..=high).contains(&share)))
    })
}

/// `shown` says whether a band may reach a share of the sample rate, entry by entry.
fn of_region(
    plant: &StateSpace<Discrete>,
    region: &Region,
    loops: Option<&Loops>,
    shown: &dyn Fn(f64, usize, usize) -> bool,
) -> Result<(Evidence, Judgement)> {
    let omega: Vec<f64> = region.hz.iter().map(|hz| std::f64::consts::TAU * hz).collect();
    let g = frequency_response(plant, &omega)?;
    let ts = plant.time().ts();
    let within = |k: usize, i: usize, j: usize| {
        valid(region.absolute[k][(i, j)], g.at(k)[(i, j)]) && shown(region.hz[k] * ts, i, j)
    };
    let (p, m) = (plant.outputs(), plant.inputs());
    let of = |i: usize, j: usize| bands(&region.hz, |k| within(k, i, j));
    let entry_bands = (0..p).map(|i| (0..m).map(|j| of(i, j)).collect()).collect();
    let all = bands(&region.hz, |k| (0..p).all(|i| (0..m).all(|j| within(k, i, j))));
    let loop_ratio = loops.map(|loops| LoopRatio::new(&loops.at, |hz| region.at(hz)));
    let test = match &loop_ratio {
        Some(r) => {
            let question = "Part of the margin of the loop that the 95 % region takes, largest over frequency (region)";
            let seen = (0..p).all(|i| (0..m).all(|j| shown(r.largest_hz * ts, i, j)));
            let unseen = if seen { "" } else { ", where the excitation does not show the plant" };
            let [dominant, meaning] = dominant(region, r.largest_hz);
            let note = format!("mostly {dominant} there{unseen}{meaning}");
            Evidence::new(question, r.largest, LARGEST_RATIO_OF_LOOP).at([r.largest_hz; 2]).noted(note)
        }
        None => {
            let relative = |k: usize| region.absolute[k].norm_l2() / g.at(k).norm_l2().max(TINY);
            let question = "Stated standard deviation over the response, median over frequency (region)";
            Evidence::new(question, median((0..region.hz.len()).map(relative)), LARGEST_DEVIATION)
        }
    };
    let judgement = Judgement { evidence: Vec::new(), loop_ratio, entry_bands, bands: all, informed: true };
    Ok((test, judgement))
}

/// The largest part of the region at a frequency, and what it is where its name does not say so.
fn dominant(region: &Region, hz: f64) -> [&'static str; 2] {
    let k = region.hz.partition_point(|f| *f < hz).min(region.hz.len() - 1);
    let parts = region.parts.named();
    let largest = parts.iter().max_by(|a, b| a.1[k].norm_l2().total_cmp(&b.1[k].norm_l2()));
    let name = largest.map_or("noise", |part| part.0);
    let meaning = match name {
        "choice" => " (models of another order or dead time that the records do not tell apart)",
        "variation" => " (differences between records or parts of them)",
        "distortion" => " (what the excitation causes and the model does not explain)",
        _ => "",
    };
    [name, meaning]
}

/// Mean squares of entries in units of the channels as an error of the loop; relative to the response without a loop.
fn in_loop(loops: Option<&Loops>, on: &Judged<'_>, hz: f64, squares: &[f64]) -> f64 {
    let Sizes { u, y } = &on.problem.sizes;
    let physical = |(at, s): (usize, &f64)| s * (y[at / u.len()] / u[at % u.len()]).powi(2);
    let squares: Vec<f64> = squares.iter().enumerate().map(physical).collect();
    match loops.and_then(|loops| loops.near(hz)) {
        Some(at) => at.error(&ResponseError::of_entries(&squares, u.len())),
        None => {
            let g = frequency_response(on.plant, &[std::f64::consts::TAU * hz]);
            let size = g.map_or(0.0, |g| g.at(0).norm_l2());
            (squares.iter().sum::<f64>()).sqrt() / size.max(TINY)
        }
    }
}

fn excitation(on: &Judged<'_>) -> Evidence {
    let question = "Lack of a known external excitation in the estimation records (excitation; 1: none is known)";
    Evidence::new(question, if on.witness.is_some() { 0.0 } else { 1.0 }, 0.0)
}

/// Growth over the records, as a logarithm, that says nothing: one per cent.
const NO_GROWTH: f64 = 0.01;

/// Whether the controller stabilises the model, as it did the plant: the largest magnitude of a pole of the loop. One outside of the circle by less
/// than its standard deviation that grows by less than e^2 over the records is not shown to be outside.
fn stability(
    (plant, region): (&StateSpace<Discrete>, &Region),
    k: &StateSpace<Discrete>,
    samples: usize,
) -> Result<Option<Evidence>> {
    if k.is_zero() {
        return Ok(None);
    }
    let ports = with_input_port(k)?;
    let radius = |plant: &StateSpace<Discrete>| {
        let poles = closed_loop(plant, &ports)?.poles()?;
        Ok(vec![poles.iter().map(|p| p.norm()).fold(0.0, f64::max)])
    };
    let largest = radius(plant)?[0];
    let question = "Largest magnitude of a pole of the loop with the stated controller (stability)";
    let evidence = Evidence::new(question, largest, 1.0);
    if largest < 1.0 {
        return Ok(Some(evidence));
    }
    let deviation = region.intervals(0.95, radius)?[0].deviation;
    let size = format!("its standard deviation is {deviation:.1e}");
    // Neither the estimate nor growth in the records distinguishes it from one inside: two integrators of a law whose coefficients were rounded split by less.
    let growth = largest.ln() * samples as f64;
    let shown = growth > GROWTH || growth > NO_GROWTH && largest - 1.0 > deviation;
    if shown {
        return Ok(Some(evidence.noted(size)));
    }
    let note = format!("{size}: the records do not distinguish it from a pole inside of the unit circle");
    Ok(Some(evidence.by_chance(note)))
}

/// The difference between the responses that the excitation shows in groups of records, in the loop, largest over frequency.
fn repeatability(on: &Judged<'_>, witness: &Witness, weigh: &dyn Fn(f64, &[f64]) -> f64) -> Evidence {
    let question = "Difference of the responses that the excitation shows in parts of the records and in fresh ones, in the loop, largest over frequency (repeatability)";
    largest(
        on,
        &witness.variation,
        0.0,
        [question, "the machine changes from part to part, or acts otherwise than linearly"],
        weigh,
    )
}

/// The error of the response that the excitation shows, in the loop, largest over frequency.
fn indirect(on: &Judged<'_>, witness: &Witness, weigh: &dyn Fn(f64, &[f64]) -> f64) -> Evidence {
    let question = "Error of the model against the response that the excitation shows, in the loop, largest over frequency (indirect response)";
    if witness.distortion.is_empty() {
        return Evidence::untested(question, LARGEST_LOOP_ERROR, "the excitation does not reach every input");
    }
    let significance = witness.whole.significance.unwrap_or(0.0);
    largest(on, &witness.distortion, significance, [question, "the model is likely wrong there"], weigh)
}

/// The largest excess over frequency as the loop weighs it, with the band around it in which it is beyond its limit, and the response there.
fn largest(
    on: &Judged<'_>,
    excess: &Excess,
    significance: f64,
    [question, cause]: [&str; 2],
    weigh: &dyn Fn(f64, &[f64]) -> f64,
) -> Evidence {
    let (ts, entries) = (on.plant.time().ts(), on.spectra.inputs * on.spectra.outputs);
    let shares = grid(on.spectra.samples());
    let found: Vec<(Vec<f64>, f64)> = shares.iter().map(|share| excess.near(*share, entries)).collect();
    let figures: Vec<f64> = shares.iter().zip(&found).map(|(share, (squares, _))| weigh(*share, squares)).collect();
    let significance = found.iter().map(|(_, deviations)| *deviations).fold(significance, f64::max);
    let worst = (0..figures.len()).max_by(|a, b| figures[*a].total_cmp(&figures[*b])).unwrap_or(0);
    let figure = figures.get(worst).copied().unwrap_or(0.0);
    let evidence = Evidence::new(question, figure, LARGEST_LOOP_ERROR).beyond_chance(significance);
    if evidence.holds() {
        return evidence.at([shares.get(worst).map_or(0.0, |share| share / ts); 2]);
    }
    let beyond = |k: &usize| figures[*k] > LARGEST_LOOP_ERROR;
    let low = (0..worst).rev().take_while(beyond).last().unwrap_or(worst);
    let high = (worst..figures.len()).take_while(beyond).last().unwrap_or(worst);
    let hz = shares[worst] / ts;
    let evidence = evidence.at([shares[low] / ts, shares[high] / ts]);
    let Ok(g) = frequency_response(on.plant, &[std::f64::consts::TAU * hz]) else { return evidence };
    let Sizes { u, y } = &on.problem.sizes;
    let physical = |(at, s): (usize, &f64)| s * (y[at / u.len()] / u[at % u.len()]).powi(2);
    let difference = found[worst].0.iter().enumerate().map(physical).sum::<f64>().sqrt();
    let part = 100.0 * difference / g.at(0).norm_l2().max(TINY);
    let times =
        if part > 1000.0 { format!("{} times", figure_of(part / 100.0)) } else { format!("{} % of", figure_of(part)) };
    let size = format!("{times} the model's response at {} Hz", figure_of(hz));
    evidence.noted(format!("{size}; {cause}"))
}

/// The region from what the excitation alone moves at the inputs: a model that rests on the noise that the feedback brings to the inputs
/// rests on the model of that noise.
fn information(on: &Judged<'_>, witness: &Witness, loops: &Loops) -> Evidence {
    let question = "Part of the margin of the loop that the region takes where only what the excitation moves counts (information)";
    let Some(excited) = witness.excited(on.spectra) else {
        return Evidence::untested(question, INFORMATION_RATIO, "the excitation does not reach every input");
    };
    let alone = Solution { rivals: Vec::new(), unseen: None, ..on.solution.clone() };
    let directions = Directions::new(&excited, &alone, (1.0, &Nuisance::default()), None);
    // The ratio asks for its own frequencies: no deviations are stated anywhere.
    let region = Region::new(on.problem.sizes.clone(), on.plant.time(), &[], directions);
    let r = LoopRatio::new(&loops.at, |hz| region.at(hz));
    let evidence = Evidence::new(question, r.largest.min(NO_INFORMATION), INFORMATION_RATIO).at([r.largest_hz; 2]);
    evidence.remedy("excite the loop there, or longer")
}
