//! Interpolation between samples of another clock.
//!
//! Lagrange's polynomial through the eight samples around an instant, in barycentric form (Berrut and Trefethen, SIAM Review 46, 2004):
//! in the middle of equal steps its gain differs from one by 0.5 % at a fifth of the sample rate and by 5 % at a third.

use youla::identify::likelihood::INTERPOLATION_POINTS;

/// An instant between samples that are farther apart than this many median steps has no value.
const GAP: f64 = 2.5;

/// Value at `at` of the samples around it, but for sample `without`; `None` outside of them, in a gap, or where stamps coincide.
pub(super) fn value(times: &[f64], values: &[f64], usual: f64, at: f64, without: Option<usize>) -> Option<f64> {
    let after = times.partition_point(|t| *t < at);
    if after == 0 || after >= times.len() {
        return times.get(after).filter(|t| **t == at).map(|_| values[after]);
    }
    let reach = if without.is_some() { 2.0 * GAP } else { GAP };
    let low = if without == Some(after - 1) { after.checked_sub(2)? } else { after - 1 };
    let high = if without == Some(after) { after + 1 } else { after };
    if times.get(high)? - times[low] > reach * usual {
        return None;
    }
    let first =
        after.saturating_sub(INTERPOLATION_POINTS / 2).min(times.len().saturating_sub(INTERPOLATION_POINTS + 1));
    let chosen = (first..times.len()).filter(|k| Some(*k) != without).take(INTERPOLATION_POINTS);
    let near: Vec<(f64, f64)> = chosen
        .map(|k| ((times[k] - at) / usual, values[k]))
        .filter(|(x, _)| x.abs() <= GAP * INTERPOLATION_POINTS as f64)
        .collect();
    lagrange(&near)
}

/// Value at zero of the polynomial through points.
fn lagrange(points: &[(f64, f64)]) -> Option<f64> {
    if let Some((_, y)) = points.iter().find(|(x, _)| *x == 0.0) {
        return Some(*y);
    }
    let (mut above, mut below) = (0.0, 0.0);
    for (i, (x, y)) in points.iter().enumerate() {
        let others = points.iter().enumerate().filter(|(k, _)| *k != i);
        let weight = 1.0 / (x * others.map(|(_, (other, _))| x - other).product::<f64>());
        above += weight * y;
        below += weight;
    }
    let found = above / below;
    found.is_finite().then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_degree_seven_is_met() {
        let times: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k) + 0.02 * f64::from(k * k % 7) / 7.0).collect();
        let f = |t: f64| (0..8).map(|k| (t - 2.0).powi(k)).sum::<f64>();
        let values: Vec<f64> = times.iter().map(|t| f(*t)).collect();
        for at in [0.05, 1.234, 2.0, 3.87] {
            let found = value(&times, &values, 0.1, at, None).unwrap();
            assert!((found - f(at)).abs() < 1e-9 * (1.0 + f(at).abs()), "{at}: {found} {}", f(at));
        }
        let found = value(&times, &values, 0.1, times[20], Some(20)).unwrap();
        assert!((found - values[20]).abs() < 1e-9, "{found}");
        assert!(value(&times, &values, 0.1, 4.2, None).is_none());
    }
}
