//! Which modes of two models are the same one: by frequency, damping and residue, each mode once.

use super::data::DrawnMode;

/// Largest ratio of the frequencies.
const FREQUENCY: f64 = 1.1;
/// Largest difference of the damping ratios: this much and half of the larger one.
const DAMPING: f64 = 0.02;
/// Damping ratio from which a pair is as good as two real poles.
const REAL: f64 = 0.99;
/// Least modal assurance of the residues: 0 for orthogonal ones, 1 for equal directions.
const ASSURANCE: f64 = 0.5;
/// Largest ratio of the sizes of the residues.
const SIZE: f64 = 10.0;

/// For each of `modes` the place of the same mode among `others`; the nearest pairs first, each mode in one pair only.
///
/// Two modes are the same where both are real poles or both are pairs, within 10 % of frequency, within 0.02 and half of the larger
/// damping ratio, and, where residues are known, with a modal assurance of at least 0.5 and sizes within a factor of 10. These limits
/// are chosen, not measured.
pub fn match_modes(modes: &[&DrawnMode], others: &[&DrawnMode]) -> Vec<Option<usize>> {
    let pairs = modes
        .iter()
        .enumerate()
        .flat_map(|(i, mode)| others.iter().enumerate().map(move |(k, other)| (i, k, mode, other)));
    let mut near: Vec<(f64, usize, usize)> =
        pairs.filter_map(|(i, k, mode, other)| Some((distance(mode, other)?, i, k))).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found = vec![None; modes.len()];
    for (_, i, k) in near {
        if found[i].is_none() && !found.contains(&Some(k)) {
            found[i] = Some(k);
        }
    }
    found
}

/// How far two modes are from each other in the limits of all criteria; nothing where they are not the same.
fn distance(a: &DrawnMode, b: &DrawnMode) -> Option<f64> {
    // An integrator has no frequency, and no damping ratio.
    let real = |mode: &DrawnMode| mode.hz == 0.0 || mode.zeta.abs() >= REAL;
    let frequency = if a.hz == b.hz { 0.0 } else { (a.hz / b.hz).ln().abs() / FREQUENCY.ln() };
    let damping = (a.zeta - b.zeta).abs() / (DAMPING + 0.5 * a.zeta.abs().max(b.zeta.abs()));
    let [shape, size] = residues(&a.residue, &b.residue);
    let parts = [frequency, damping, shape, size];
    (real(a) == real(b) && parts.iter().all(|part| *part <= 1.0)).then(|| parts.iter().sum())
}

/// Differences of direction and size of the residues in their limits; zero where one is not known.
fn residues(a: &[[f64; 2]], b: &[[f64; 2]]) -> [f64; 2] {
    let square = |r: &[[f64; 2]]| r.iter().map(|[re, im]| re * re + im * im).sum::<f64>();
    let (size_a, size_b) = (square(a), square(b));
    if a.len() != b.len() || !(size_a > 0.0 && size_b > 0.0) {
        return [0.0; 2];
    }
    let product = a
        .iter()
        .zip(b)
        .fold([0.0; 2], |[re, im], (a, b)| [re + a[0] * b[0] + a[1] * b[1], im + a[0] * b[1] - a[1] * b[0]]);
    let assurance = square(&[product]) / (size_a * size_b);
    [(1.0 - assurance) / (1.0 - ASSURANCE), 0.5 * (size_a / size_b).ln().abs() / SIZE.ln()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(hz: f64, zeta: f64, residue: &[[f64; 2]]) -> DrawnMode {
        DrawnMode { method: String::new(), hz, zeta, deviation: None, residue: residue.to_vec() }
    }

    fn matched(modes: &[DrawnMode], others: &[DrawnMode]) -> Vec<Option<usize>> {
        match_modes(&modes.iter().collect::<Vec<_>>(), &others.iter().collect::<Vec<_>>())
    }

    #[test]
    fn no_mode_is_matched_twice_and_the_nearest_pair_comes_first() {
        let (modes, others) = ([mode(54.0, 0.01, &[]), mode(55.0, 0.01, &[])], [mode(55.2, 0.01, &[])]);
        assert_eq!(matched(&modes, &others), [None, Some(0)]);
        assert_eq!(matched(&others, &modes), [Some(1)]);
    }

    #[test]
    fn damping_and_residue_count_beside_frequency() {
        let light = mode(54.0, 0.01, &[[1.0, 0.0], [0.0, 0.0]]);
        assert_eq!(matched(&[mode(54.5, 0.012, &[[0.9, 0.1], [0.1, 0.0]])], std::slice::from_ref(&light)), [Some(0)]);
        let others = [
            mode(54.5, 0.3, &[[1.0, 0.0], [0.0, 0.0]]),
            mode(54.5, 1.0, &[]),
            mode(54.0, 0.01, &[[0.0, 0.0], [1.0, 0.0]]),
            mode(54.0, 0.01, &[[1e-3, 0.0], [0.0, 0.0]]),
            mode(61.0, 0.01, &[[1.0, 0.0], [0.0, 0.0]]),
        ];
        for other in others {
            assert_eq!(matched(std::slice::from_ref(&other), std::slice::from_ref(&light)), [None], "{other:?}");
        }
    }

    #[test]
    fn horizontal_and_vertical_modes_of_one_frequency_are_told_apart_by_their_residues() {
        let (h, v) = ([[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]]);
        let modes = [mode(210.0, 0.1, &h), mode(210.0, 0.1, &v)];
        assert_eq!(matched(&modes, &[mode(209.0, 0.1, &v), mode(209.5, 0.1, &h)]), [Some(1), Some(0)]);
    }
}
