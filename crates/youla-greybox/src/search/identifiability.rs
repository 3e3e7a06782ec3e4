//! Which parameters the data do not determine, by name.
//!
//! With the Jacobian `J = U diag(sigma) V'` of the outputs, columns of unit length, a right singular vector v with sigma = 0
//! is a change of the parameters that the outputs do not show. Any basis of these directions would do; the one named here
//! is reduced to echelon form with the largest pivots, so that independent ambiguities are reported one by one. A parameter
//! whose own column is zero is named by itself. (Local identifiability: T. J. Rothenberg, Econometrica 39 (1971), 577.)

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

/// Directions in which the scaled Jacobian is shorter than this share of its longest one are not determined.
pub(crate) const RANK_TOLERANCE: f64 = 1e-10;
/// Parts of a direction below this share of its largest one are not named.
const SUBSTANTIAL: f64 = 0.05;

/// What the data do not determine; empty where they determine all parameters.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Undetermined {
    /// Parameters that have no effect on the outputs of these records.
    pub without_effect: Vec<String>,
    /// Changes of several parameters at once that have no effect, independent of each other.
    pub combinations: Vec<Combination>,
}

/// A change of several parameters that the outputs do not show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Combination {
    /// The parameters that take part.
    pub parts: Vec<Part>,
}

/// Share of one parameter in a combination.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its name.
    pub parameter: String,
    /// Its weight in units of the effect on the outputs; those of all parameters have unit length together.
    pub weight: f64,
    /// Its change relative to its value (to its typical size where that is zero), the largest of the combination being 1.
    pub change: f64,
}

impl Undetermined {
    /// Whether all parameters are determined.
    pub fn is_empty(&self) -> bool {
        self.without_effect.is_empty() && self.combinations.is_empty()
    }

    /// One sentence for each ambiguity.
    pub fn sentences(&self) -> Vec<String> {
        let alone = |name: &String| format!("the parameter {name} has no effect on the outputs of these records");
        self.without_effect.iter().map(alone).chain(self.combinations.iter().map(Combination::sentence)).collect()
    }

    /// From the Jacobian with columns of unit length, or zero where a parameter has no effect. `changes` are the relative
    /// changes of the parameters that belong to a unit of each column.
    pub(crate) fn new(unit: MatRef<'_, f64>, names: &[String], changes: &[f64]) -> Self {
        let (with, without): (Vec<usize>, Vec<usize>) = (0..names.len()).partition(|j| unit.col(*j).norm_max() > 0.0);
        let effective = Mat::from_fn(unit.nrows(), with.len(), |i, j| unit[(i, with[j])]);
        let combinations = null_space(effective.as_ref()).map_or_else(Vec::new, |directions| {
            let part = |j: usize, weight: f64| Part {
                parameter: names[with[j]].clone(),
                weight,
                change: weight * changes[with[j]],
            };
            directions
                .row_iter()
                .map(|row| Combination::new(row.iter().enumerate().map(|(j, w)| part(j, *w))))
                .collect()
        });
        Undetermined { without_effect: without.iter().map(|j| names[*j].clone()).collect(), combinations }
    }
}

impl Combination {
    fn new(parts: impl Iterator<Item = Part>) -> Self {
        let mut parts: Vec<Part> = parts.collect();
        let largest = parts.iter().map(|part| part.weight.abs()).fold(0.0, f64::max);
        parts.retain(|part| part.weight.abs() >= SUBSTANTIAL * largest);
        let length = parts.iter().map(|part| part.weight.powi(2)).sum::<f64>().sqrt();
        let change = parts.iter().map(|part| part.change).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        for part in &mut parts {
            part.weight /= length.copysign(change);
            part.change /= change;
        }
        Combination { parts }
    }

    fn sentence(&self) -> String {
        let names: Vec<&str> = self.parts.iter().map(|part| part.parameter.as_str()).collect();
        let changes: Vec<String> =
            self.parts.iter().map(|part| format!("{} by {:+.3} %", part.parameter, part.change)).collect();
        format!(
            "the parameters {} cannot be distinguished: changing {} together leaves the outputs as they are",
            listed(&names),
            listed(&changes)
        )
    }
}

/// `a, b and c`.
fn listed<T: AsRef<str>>(items: &[T]) -> String {
    let items: Vec<&str> = items.iter().map(AsRef::as_ref).collect();
    match items.split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => String::new(),
    }
}

/// Rows that span the directions in which a matrix is zero, in echelon form; `None` where there are none.
fn null_space(matrix: MatRef<'_, f64>) -> Option<Mat<f64>> {
    let columns = matrix.ncols();
    if columns == 0 {
        return None;
    }
    let svd = matrix.svd().ok()?;
    let sigma = svd.S().column_vector();
    let largest = sigma.iter().copied().fold(0.0, f64::max);
    let rank = sigma.iter().filter(|s| **s > RANK_TOLERANCE * largest).count();
    (rank < columns).then(|| echelon(svd.V().subcols(rank, columns - rank).transpose().to_owned()))
}

/// Gauss-Jordan elimination with complete pivoting: each row has a column that is zero in all others.
fn echelon(mut rows: Mat<f64>) -> Mat<f64> {
    let (count, columns) = (rows.nrows(), rows.ncols());
    for done in 0..count {
        let places = (done..count).flat_map(|i| (0..columns).map(move |j| (i, j)));
        let Some((row, column)) = places.max_by(|a, b| rows[*a].abs().total_cmp(&rows[*b].abs())) else { break };
        let pivot = rows[(row, column)];
        for j in 0..columns {
            let value = rows[(row, j)] / pivot;
            rows[(row, j)] = rows[(done, j)];
            rows[(done, j)] = value;
        }
        for i in (0..count).filter(|i| *i != done) {
            let share = rows[(i, column)];
            (0..columns).for_each(|j| rows[(i, j)] -= share * rows[(done, j)]);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns k, m of one line, c alone, p, q of another line, and one of zeros.
    #[test]
    fn independent_ambiguities_are_told_one_by_one() {
        let value = |i: usize, j: usize| match j {
            0 | 1 => (1.3 * i as f64).sin(),
            2 => (0.7 * i as f64).cos(),
            3 => (2.1 * i as f64 + 0.3).cos(),
            4 => -(2.1 * i as f64 + 0.3).cos(),
            _ => 0.0,
        };
        let names = ["k", "m", "c", "p", "q", "z"].map(String::from);
        let j = Mat::from_fn(20, 6, value);
        let unit = Mat::from_fn(20, 6, |i, k| if k < 5 { j[(i, k)] / j.col(k).norm_l2() } else { 0.0 });
        let found = Undetermined::new(unit.as_ref(), &names, &[1.0, 2.0, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(found.without_effect, ["z"]);
        let named: Vec<Vec<&str>> =
            found.combinations.iter().map(|c| c.parts.iter().map(|p| p.parameter.as_str()).collect()).collect();
        assert_eq!(named.len(), 2);
        assert!(named.contains(&vec!["k", "m"]) && named.contains(&vec!["p", "q"]), "{named:?}");
        let pair = found.combinations.iter().find(|c| c.parts[0].parameter == "k").unwrap();
        let half = 0.5f64.sqrt();
        assert!((pair.parts[0].weight + half).abs() < 1e-12 && (pair.parts[1].weight - half).abs() < 1e-12);
        assert!((pair.parts[0].change + 0.5).abs() < 1e-12 && pair.parts[1].change == 1.0, "{pair:?}");
        assert_eq!(
            pair.sentence(),
            "the parameters k and m cannot be distinguished: changing k by -0.500 % and m by +1.000 % together leaves the \
             outputs as they are"
        );
    }
}
