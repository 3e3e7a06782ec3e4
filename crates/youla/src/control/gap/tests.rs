use super::{ChannelScales, NuGap, coprime_margin, normalised_left_factors, normalised_right_factors, nu_gap};
use crate::control::{LqrWeights, NoiseCovariance, kalman, lqr, observer_controller};
use crate::linalg::eye;
use crate::lti::{Continuous, Discrete, StateSpace, TimeDomain, continuous_image, frequency_response};
use crate::{Error, Mat, c64};
use faer::Scale;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn draw(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Mat<f64> {
    Mat::from_fn(rows, columns, |_, _| StandardNormal.sample(rng))
}

/// Plants near to each other, stable or not, with 2 inputs and 3 outputs.
fn family<T: TimeDomain>(seed: u64, spread: f64, time: T) -> Vec<StateSpace<T>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let size = if time.sample_time().is_some() { 0.45 } else { 1.0 };
    let mut near = |centre: &Mat<f64>| centre + Scale(spread) * draw(centre.nrows(), centre.ncols(), &mut rng);
    let zero = |r: usize, c: usize| Mat::<f64>::zeros(r, c);
    let mut source = ChaCha8Rng::seed_from_u64(seed + 1000);
    let (a, b, c) = (draw(4, 4, &mut source), draw(4, 2, &mut source), draw(3, 4, &mut source));
    let d = if seed.is_multiple_of(2) { zero(3, 2) } else { draw(3, 2, &mut source) };
    (0..3).map(|_| StateSpace::new(Scale(size) * near(&a), near(&b), near(&c), near(&d), time).unwrap()).collect()
}

fn controller<T: TimeDomain>(plant: &StateSpace<T>) -> StateSpace<T> {
    let (m, p) = (plant.inputs(), plant.outputs());
    let f = lqr(plant, &LqrWeights::on_outputs(plant, eye(p).as_ref(), eye(m).as_ref()).unwrap()).unwrap().f;
    let noise = NoiseCovariance::at_inputs(plant, eye(m).as_ref(), eye(p).as_ref()).unwrap();
    observer_controller(plant, f.as_ref(), kalman(plant, &noise).unwrap().l.as_ref()).unwrap()
}

#[test]
fn factors_are_inner() {
    fn check<T: TimeDomain>(time: T) {
        for plant in (0..4).flat_map(|seed| family(seed, 0.1, time)) {
            let (right, left) = (normalised_right_factors(&plant).unwrap(), normalised_left_factors(&plant).unwrap());
            assert!(right.is_stable().unwrap() && left.is_stable().unwrap());
            let omega = [0.0, 0.1, 1.0, 2.5];
            let g = frequency_response(&plant, &omega).unwrap();
            let (r, l) = (frequency_response(&right, &omega).unwrap(), frequency_response(&left, &omega).unwrap());
            for k in 0..omega.len() {
                let (r, l) = (r.at(k), l.at(k));
                let inner = r.adjoint() * r - Mat::<c64>::identity(2, 2);
                let coinner = l * l.adjoint() - Mat::<c64>::identity(3, 3);
                assert!(inner.norm_max() < 1e-10 && coinner.norm_max() < 1e-10);
                let (m, n) = (r.subrows(0, 2), r.subrows(2, 3));
                let (m_t, n_t) = (l.subcols(0, 3), l.subcols(3, 2));
                assert!((g.at(k) * m - n).norm_max() < 1e-9 && (m_t * g.at(k) - n_t).norm_max() < 1e-9);
            }
        }
    }
    check(Continuous);
    check(Discrete::new(1.0).unwrap());
}

#[test]
fn the_gap_is_a_metric() {
    fn check<T: TimeDomain>(time: T) {
        let mut farthest = 0;
        for (seed, spread) in [(0, 0.01), (1, 0.05), (2, 0.1), (3, 0.2), (4, 0.5), (5, 1.0)] {
            let plants = family(seed, spread, time);
            let gap = |i: usize, j: usize| nu_gap(&plants[i], &plants[j]).unwrap().value;
            for i in 0..3 {
                assert!(gap(i, i) < 1e-10, "{}", gap(i, i));
                for j in 0..3 {
                    assert!((gap(i, j) - gap(j, i)).abs() < 1e-8);
                    assert!(gap(i, j) <= gap(i, 3 - i.max(1) - j.min(1)) + gap(3 - i.max(1) - j.min(1), j) + 1e-8);
                    farthest += usize::from(gap(i, j) == 1.0);
                }
            }
        }
        assert!(farthest < 30, "{farthest}");
    }
    check(Continuous);
    check(Discrete::new(1.0).unwrap());
}

#[test]
fn a_controller_keeps_what_the_gap_promises() {
    fn check<T: TimeDomain>(time: T) -> usize {
        let mut promises = 0;
        for (seed, spread) in [(0, 0.003), (1, 0.01), (2, 0.01), (3, 0.02), (4, 0.02), (5, 0.05), (6, 0.05), (7, 0.1)] {
            let plants = family(seed, spread, time);
            let k = controller(&plants[0]);
            let margin = coprime_margin(&plants[0], &k).unwrap();
            assert!(margin > 0.0 && margin < 1.0);
            for other in &plants[1..] {
                let gap = nu_gap(&plants[0], other).unwrap().value;
                let promised = margin.asin() - gap.asin();
                let kept = coprime_margin(other, &k).unwrap();
                assert!(kept.asin() >= promised - 1e-8, "{kept} {margin} {gap}");
                promises += usize::from(promised > 0.0);
            }
        }
        promises
    }
    assert!(check(Continuous) > 3);
    assert!(check(Discrete::new(1.0).unwrap()) > 3);
}

#[test]
fn the_gap_does_not_know_the_time_domain() {
    for (seed, spread) in [(0, 0.1), (1, 0.3), (2, 0.6), (3, 1.0)] {
        let plants = family(seed, spread, Discrete::new(0.1).unwrap());
        let images: Vec<_> = plants.iter().map(|p| continuous_image(p).unwrap()).collect();
        let (discrete, continuous) = (nu_gap(&plants[0], &plants[1]).unwrap(), nu_gap(&images[0], &images[1]).unwrap());
        assert!((discrete.value - continuous.value).abs() < 1e-8, "{discrete:?} {continuous:?}");
        assert_eq!(discrete.winding, continuous.winding);
    }
}

fn lag(gain: f64, pole: f64) -> StateSpace<Continuous> {
    StateSpace::new(Scale(pole) * eye(1), eye(1), Scale(gain) * eye(1), Mat::zeros(1, 1), Continuous).unwrap()
}

#[test]
fn the_winding_number_decides() {
    // 0.1 / (s + 1) and 0.1 / (s - 1): near at every frequency, but no controller knows them for the same.
    let NuGap { value, pointwise, winding } = nu_gap(&lag(0.1, -1.0), &lag(0.1, 1.0)).unwrap();
    assert!((pointwise.value - 0.2 / 1.01).abs() < 1e-9);
    assert_eq!(value, 1.0);
    assert_eq!(winding.unwrap().abs(), 1);
    // With a gain of 100 they are near, and a count of unstable poles alone would deny it.
    let near = nu_gap(&lag(100.0, -1.0), &lag(100.0, 1.0)).unwrap();
    assert_eq!(near.winding, Some(0));
    assert!((near.value - 200.0 / 10001.0).abs() < 1e-9);
}

#[test]
fn an_integrator_is_a_plant_like_others() {
    let shift = 0.3f64;
    let gap = nu_gap(&lag(1.0, 0.0), &lag(1.0, -shift)).unwrap();
    assert!((gap.value - shift / (1.0 + shift * shift).sqrt()).abs() < 1e-9, "{gap:?}");
    let time = Discrete::new(1.0).unwrap();
    let walk = |pole: f64| StateSpace::new(Scale(pole) * eye(1), eye(1), eye(1), Mat::zeros(1, 1), time).unwrap();
    assert!((0.0..0.2).contains(&nu_gap(&walk(1.0), &walk(0.9)).unwrap().value));
    assert!((0.0..0.2).contains(&nu_gap(&walk(-1.0), &walk(-0.9)).unwrap().value));
    assert!(nu_gap(&walk(1.0), &walk(-1.0)).unwrap().value > 0.8);
}

#[test]
fn gains_and_empty_plants_have_gaps() {
    let gain = |x: f64| StateSpace::gain(Scale(x) * eye(2), Continuous).unwrap();
    assert!((nu_gap(&gain(2.0), &gain(-2.0)).unwrap().value - 0.8).abs() < 1e-9);
    assert_eq!(nu_gap(&gain(1.0), &gain(-1.0)).unwrap().value, 1.0);
    assert!(nu_gap(&gain(1.0), &gain(1.0)).unwrap().value < 1e-12);
    let none = StateSpace::gain(Mat::zeros(0, 0), Continuous).unwrap();
    assert_eq!(nu_gap(&none, &none).unwrap().value, 0.0);
    assert!(matches!(nu_gap(&gain(1.0), &lag(1.0, -1.0)), Err(Error::Ports { .. })));
}

#[test]
fn channels_in_other_units_are_the_same_loop() {
    let plants = family(2, 0.05, Discrete::new(1.0).unwrap());
    let k = controller(&plants[0]);
    let scales = ChannelScales::new(vec![2.0, 0.5], vec![1.0, 10.0, 0.1]).unwrap();
    let (scaled, k_scaled) = (scales.plant(&plants[0]).unwrap(), scales.controller(&k).unwrap());
    assert!(coprime_margin(&scaled, &k_scaled).unwrap() > 0.0);
    let back = ChannelScales::new(vec![0.5, 2.0], vec![1.0, 0.1, 10.0]).unwrap();
    let same = coprime_margin(&back.plant(&scaled).unwrap(), &back.controller(&k_scaled).unwrap()).unwrap();
    assert!((same - coprime_margin(&plants[0], &k).unwrap()).abs() < 1e-9);
    assert!(ChannelScales::new(vec![0.0], vec![1.0]).is_err());
    assert!(matches!(scales.plant(&k), Err(Error::Ports { .. })));
}
