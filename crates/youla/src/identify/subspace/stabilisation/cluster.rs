//! Clusters of the poles of a diagram: agglomerative, from the distance of poles and mode shapes.
//!
//! Two oscillatory poles are `d = |s1 - s2| / max(|s1|, |s2|) + 1 - MAC` apart (s in rad/s). Starting from single poles,
//! the nearest clusters are joined as long as they are no farther apart than the limit. With average and single linkage no
//! join brings a third cluster nearer than the nearer of the two was, so following nearest neighbours finds the same joins
//! in any order, in a time of the square of the number of poles (Murtagh, The Computer Journal 26, 354, 1983).

use super::{DiagramPole, Linkage, PoleStability, StabilisationOptions, modal_assurance};
use crate::lti::{Discrete, TimeDomain};
use crate::statistics::quantile;
use crate::{Mat, c64};

/// Poles of many orders that are close in frequency, damping ratio and mode shape: a mode of what was identified, as far as
/// noise does not repeat.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeCluster {
    /// Median of the natural frequencies, Hz.
    pub hz: f64,
    /// Median of the damping ratios.
    pub zeta: f64,
    /// Half the distance of the quartiles of the frequencies over the orders, Hz.
    pub hz_spread: f64,
    /// Half the distance of the quartiles of the damping ratios over the orders.
    pub zeta_spread: f64,
    /// Median of the standard deviations of the frequencies, Hz, where they were computed.
    pub hz_deviation: Option<f64>,
    /// Median of the standard deviations of the damping ratios, where they were computed.
    pub zeta_deviation: Option<f64>,
    /// Number of orders at which it appears.
    pub orders: usize,
    /// Number of orders at which it is settled.
    pub settled: usize,
    /// Mode shape of the pole that is nearest to all others.
    pub shape: Vec<c64>,
}

/// The clusters that are settled at enough orders, by frequency; the poles are told theirs.
pub(super) fn find(
    poles: &mut [DiagramPole],
    orders: &[usize],
    time: Discrete,
    options: &StabilisationOptions,
) -> Vec<ModeCluster> {
    let oscillatory: Vec<usize> = (0..poles.len()).filter(|k| poles[*k].pole.im > 0.0).collect();
    let distances = distances(poles, &oscillatory, time);
    let mut found: Vec<(ModeCluster, Vec<usize>)> = joined(&distances, options.linkage, options.distance)
        .into_iter()
        .map(|members| {
            let shape = poles[oscillatory[medoid(&distances, &members)]].shape.clone();
            let members: Vec<usize> = members.into_iter().map(|k| oscillatory[k]).collect();
            (summary(poles, &members, shape), members)
        })
        .filter(|(cluster, _)| cluster.settled as f64 >= options.share * orders.len() as f64)
        .collect();
    found.sort_by(|a, b| a.0.hz.total_cmp(&b.0.hz));
    for (place, (_, members)) in found.iter().enumerate() {
        members.iter().for_each(|k| poles[*k].cluster = Some(place));
    }
    found.into_iter().map(|(cluster, _)| cluster).collect()
}

fn distances(poles: &[DiagramPole], chosen: &[usize], time: Discrete) -> Mat<f64> {
    let s: Vec<c64> = chosen.iter().map(|k| time.continuous_pole(poles[*k].pole)).collect();
    let distance = |i: usize, j: usize| {
        let mac = modal_assurance(&poles[chosen[i]].shape, &poles[chosen[j]].shape);
        (s[i] - s[j]).norm() / s[i].norm().max(s[j].norm()) + 1.0 - mac
    };
    let mut all = Mat::zeros(chosen.len(), chosen.len());
    for (i, j) in (0..chosen.len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let d = distance(i, j);
        (all[(i, j)], all[(j, i)]) = (d, d);
    }
    all
}

/// Groups whose joins are no longer than `limit`, by chains of nearest neighbours.
fn joined(distances: &Mat<f64>, linkage: Linkage, limit: f64) -> Vec<Vec<usize>> {
    let count = distances.nrows();
    let mut between = distances.clone();
    let mut members: Vec<Vec<usize>> = (0..count).map(|k| vec![k]).collect();
    let mut active = vec![true; count];
    let mut chain: Vec<usize> = Vec::new();
    let mut next = 0;
    while next < count || !chain.is_empty() {
        let Some(&last) = chain.last() else {
            chain.extend(active[next].then_some(next));
            next += 1;
            continue;
        };
        let before = chain.len().checked_sub(2).map(|k| chain[k]);
        // On a tie the predecessor, so that every chain ends.
        let nearest = (0..count).filter(|k| active[*k] && *k != last).min_by(|a, b| {
            between[(last, *a)].total_cmp(&between[(last, *b)]).then((Some(*b) == before).cmp(&(Some(*a) == before)))
        });
        match nearest.filter(|k| between[(last, *k)] <= limit) {
            None => {
                active[last] = false;
                chain.pop();
            }
            Some(other) if Some(other) == before => {
                chain.truncate(chain.len() - 2);
                let (kept, gone) = (last.min(other), last.max(other));
                let sizes = [members[kept].len() as f64, members[gone].len() as f64];
                for k in (0..count).filter(|k| active[*k] && *k != kept && *k != gone) {
                    let (a, b) = (between[(kept, k)], between[(gone, k)]);
                    let d = match linkage {
                        Linkage::Average => (sizes[0] * a + sizes[1] * b) / (sizes[0] + sizes[1]),
                        Linkage::Single => a.min(b),
                    };
                    (between[(kept, k)], between[(k, kept)]) = (d, d);
                }
                let moved = std::mem::take(&mut members[gone]);
                members[kept].extend(moved);
                active[gone] = false;
                next = next.min(kept);
            }
            Some(other) => chain.push(other),
        }
    }
    members.retain(|group| !group.is_empty());
    members
}

/// The member nearest to all others.
fn medoid(distances: &Mat<f64>, members: &[usize]) -> usize {
    let far = |k: usize| members.iter().map(|j| distances[(k, *j)]).sum::<f64>();
    members.iter().copied().min_by(|a, b| far(*a).total_cmp(&far(*b)).then(a.cmp(b))).unwrap_or(0)
}

fn summary(poles: &[DiagramPole], members: &[usize], shape: Vec<c64>) -> ModeCluster {
    let quartiles = |value: fn(&DiagramPole) -> f64| {
        let mut values: Vec<f64> = members.iter().map(|k| value(&poles[*k])).collect();
        values.sort_by(f64::total_cmp);
        [0.25, 0.5, 0.75].map(|part| quantile(&values, part))
    };
    let (hz, zeta) = (quartiles(|p| p.hz), quartiles(|p| p.zeta));
    let deviation = |value: fn(&DiagramPole) -> Option<f64>| {
        let mut values = members.iter().map(|k| value(&poles[*k])).collect::<Option<Vec<f64>>>()?;
        values.sort_by(f64::total_cmp);
        Some(quantile(&values, 0.5))
    };
    let count = |counts: &dyn Fn(&DiagramPole) -> bool| {
        let mut orders: Vec<usize> =
            members.iter().map(|k| &poles[*k]).filter(|p| counts(p)).map(|p| p.order).collect();
        orders.sort_unstable();
        orders.dedup();
        orders.len()
    };
    ModeCluster {
        hz: hz[1],
        zeta: zeta[1],
        hz_spread: 0.5 * (hz[2] - hz[0]),
        zeta_spread: 0.5 * (zeta[2] - zeta[0]),
        hz_deviation: deviation(|p| p.hz_deviation),
        zeta_deviation: deviation(|p| p.zeta_deviation),
        orders: count(&|_| true),
        settled: count(&|p| p.standing == PoleStability::Stable),
        shape,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Joins by exhaustive search of the nearest pair.
    fn greedy(distances: &Mat<f64>, linkage: Linkage, limit: f64) -> Vec<Vec<usize>> {
        let mut groups: Vec<Vec<usize>> = (0..distances.nrows()).map(|k| vec![k]).collect();
        loop {
            let between = |a: &[usize], b: &[usize]| {
                let all: Vec<f64> = a.iter().flat_map(|i| b.iter().map(|j| distances[(*i, *j)])).collect();
                match linkage {
                    Linkage::Average => all.iter().sum::<f64>() / all.len() as f64,
                    Linkage::Single => all.iter().copied().fold(f64::INFINITY, f64::min),
                }
            };
            let pairs = (0..groups.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
            let least = pairs
                .map(|(i, j)| (between(&groups[i], &groups[j]), i, j))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .filter(|(d, _, _)| *d <= limit);
            let Some((_, i, j)) = least else { break };
            let moved = groups.remove(i);
            groups[j].extend(moved);
        }
        groups
    }

    #[test]
    fn chains_of_neighbours_find_the_joins_of_the_exhaustive_search() {
        use rand::{RngExt, SeedableRng};
        let rng = &mut rand_chacha::ChaCha8Rng::seed_from_u64(7);
        for case in 0..40 {
            let points: Vec<[f64; 2]> = (0..3 + case).map(|_| [rng.random(), rng.random()]).collect();
            let distance = |i: usize, j: usize| f64::hypot(points[i][0] - points[j][0], points[i][1] - points[j][1]);
            let distances = Mat::from_fn(points.len(), points.len(), distance);
            for linkage in [Linkage::Average, Linkage::Single] {
                for limit in [0.0, 0.1, 0.3, 2.0] {
                    let sorted = |mut groups: Vec<Vec<usize>>| {
                        groups.iter_mut().for_each(|g| g.sort_unstable());
                        groups.sort();
                        groups
                    };
                    let (fast, slow) = (joined(&distances, linkage, limit), greedy(&distances, linkage, limit));
                    assert_eq!(sorted(fast), sorted(slow), "{linkage:?}, {limit}, {} points", points.len());
                }
            }
        }
    }
}
