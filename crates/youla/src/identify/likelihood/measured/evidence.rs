//! What the lines say of the model.

use super::choose::{Fitted, Problem};
use super::lines::WeighedLines;
use crate::identify::likelihood::Evidence;
use crate::statistics::f_deviations;

/// Lines of a group.
const GROUP: usize = 8;
/// Largest part of the outputs that the model may leave beyond chance.
const LARGEST_REST: f64 = 0.1;
/// Largest correlation of neighbouring residuals.
const LARGEST_CORRELATION: f64 = 0.3;
/// Degrees of freedom that stand for a variance without error.
const MANY: f64 = 1e9;

/// What the model leaves of the lines.
pub(super) fn of_lines(problem: &Problem<'_>, chosen: &Fitted) -> Evidence {
    let lines = problem.weighed(chosen);
    match problem.response().degrees {
        Some(degrees) => unexplained(&lines, chosen, degrees),
        None => correlation(&lines, chosen),
    }
}

/// The group of neighbouring lines in which the model leaves most beyond the stated variance.
fn unexplained(lines: &WeighedLines, chosen: &Fitted, degrees: f64) -> Evidence {
    let rows = lines.rows() as f64;
    let spent = rows / (rows - chosen.chart().parameters() as f64).max(1.0);
    let mut worst = (0.0, f64::NEG_INFINITY);
    for group in lines.lines.chunks(GROUP) {
        let (mut energy, mut count, mut rest, mut all) = (0.0, 0.0, 0.0, 0.0);
        for line in group {
            let g = chosen.model.response(line.z);
            for column in &line.columns {
                let left = column.rest(&g, lines.inputs);
                energy += column.whitened(&left).iter().map(|r| r.norm_sqr()).sum::<f64>();
                count += left.len() as f64 * if line.real { 1.0 } else { 2.0 };
                rest += left.iter().map(|r| r.norm_sqr()).sum::<f64>();
                all += column.y.iter().map(|y| y.norm_sqr()).sum::<f64>();
            }
        }
        let ratio = spent * energy / count;
        let of_scatter = if degrees.is_finite() { degrees * group.len() as f64 * lines.outputs as f64 } else { MANY };
        let beyond = f_deviations(ratio, count, of_scatter);
        let share = (rest * (1.0 - 1.0 / ratio).max(0.0) / all.max(f64::MIN_POSITIVE)).sqrt();
        if beyond > worst.1 {
            worst = (share, beyond);
        }
    }
    let question = "Part of the outputs that the model leaves beyond the variance of the lines, worst group of lines";
    Evidence::new(question, worst.0, LARGEST_REST).beyond_chance(worst.1)
}

/// Errors of neighbouring lines that agree are those of the model.
fn correlation(lines: &WeighedLines, chosen: &Fitted) -> Evidence {
    let residuals: Vec<_> = lines.lines.iter().map(|line| lines.residuals(line, &chosen.model).concat()).collect();
    let (mut sum, mut power, mut pairs) = (0.0, 0.0, 0.0);
    for pair in residuals.windows(2) {
        for (a, b) in pair[0].iter().zip(&pair[1]) {
            sum += (a * b.conj()).re;
            power += 0.5 * (a.norm_sqr() + b.norm_sqr());
            pairs += 1.0;
        }
    }
    let figure = if power > 0.0 { sum / power } else { 0.0 };
    let question = "Correlation of the residuals of neighbouring lines (missing dynamics)";
    // the real part of the mean product of independent complex numbers has the variance 1 / (2 n)
    let evidence = Evidence::new(question, figure, LARGEST_CORRELATION);
    let remedy = "state the errors of the response, as standard deviations or coherence: of one without noise only rounding is left, which counts as dynamics";
    evidence.beyond_chance(figure * (2.0_f64 * pairs).sqrt()).remedy(remedy)
}
