//! Errors of bands by chance, beside a move, and in units of the response.

use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::Exp1;

/// Mean squares of bands of unequal chance, drawn without an error of the model: deviations beyond 3 are as rare as those of a normal
/// variable (1.35 of 1000), within the factor of two that the approximation of Wilson and Hilferty leaves at two degrees of freedom.
#[test]
fn chance_alone_exceeds_three_deviations_as_rarely_as_a_normal_variable() {
    let rng = &mut ChaCha8Rng::seed_from_u64(3);
    for means in [[1.0; 5], [1.0, 0.3, 3.0, 1.0, 10.0], [0.01, 1.0, 1.0, 1.0, 1.0]] {
        let drawn = |rng: &mut ChaCha8Rng| {
            let band = |(k, mean): (usize, &f64)| {
                let square = mean * rng.sample::<f64, _>(Exp1);
                let share = 0.1 + 1e-3 * k as f64;
                ExcessBand { share, squares: vec![square - mean], chance: vec![*mean], freedom: 1.0, power: Vec::new() }
            };
            Excess { bands: means.iter().enumerate().map(band).collect(), least: 3.0 }
        };
        let beyond = (0..100_000).filter(|_| drawn(rng).near(0.102, 1).0[0] > 0.0).count();
        assert!((70..=270).contains(&beyond), "{beyond} of 100000 with chances {means:?}");
    }
}

/// Errors of 30 % of a response that falls by 12 dB per octave are 30 % at each frequency in its units; as they are, the bands of least chance
/// above speak for the low ones.
#[test]
fn an_error_that_follows_the_response_is_found_in_its_units() {
    let response = |share: f64| vec![(0.01 / share).powi(4)];
    let band = |k: usize| {
        let share = 0.005 + 0.01 * k as f64;
        let power = response(share)[0];
        ExcessBand { share, squares: vec![0.09 * power], chance: vec![1e-4 * power], freedom: 1.0, power: Vec::new() }
    };
    let excess = Excess { bands: (0..50).map(band).collect(), least: 4.0 };
    for share in [0.006, 0.02, 0.1] {
        let power = response(share)[0];
        assert!((excess.near_in_units(share, &response).0[0] / (0.09 * power) - 1.0).abs() < 1e-12);
    }
    assert!(excess.near(0.006, 1).0[0] < 0.01 * 0.09 * response(0.006)[0]);
}

/// Of a first band over which the response falls by four decades, the error is that of the mean response over the power of the inputs.
#[test]
fn the_unit_of_the_first_band_is_a_mean_over_its_power() {
    let response = |share: f64| vec![(1e-6 / (share * share)).powi(2)];
    let lines = 80;
    let mean = (1..=lines).map(|k| response(k as f64 * 1e-4)[0].sqrt()).sum::<f64>() / lines as f64;
    let (u, x) = (vec![c64::ONE; 10 * lines], vec![c64::ONE; 10 * lines]);
    let v: Vec<c64> = (1..=10 * lines).map(|k| c64::from(0.01 * response(k as f64 * 1e-4)[0].sqrt())).collect();
    let channels = Channels { m: 1, p: 1, q: 1 };
    let share = 0.5 / (10 * lines) as f64;
    let found = LocalErrors::new(&[RecordLines { u: &u, v: &v, x: &x }], channels, &Partition::of_count(10), 0);
    let unit = found.excess().bands[0].units(&|s| response(s * 1e-4 / share))[0].sqrt();
    assert!((unit / mean - 1.0).abs() < 0.2, "{unit} {mean}");
    assert!((found.bands[0].as_ref().unwrap().error[0].re / (0.01 * unit) - 1.0).abs() < 0.2);
}

/// A move fills the first bands with 1e8 times the power of the excitation, which counts beside it in every band.
#[test]
fn an_excitation_counts_beside_a_move() {
    let rng = &mut ChaCha8Rng::seed_from_u64(5);
    let mut unit = || c64::new(rng.random::<f64>() - 0.5, rng.random::<f64>() - 0.5);
    let (mut u, mut v, mut x) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..400 {
        let moves = unit() * if k < 80 { 1e4 } else { 1e-2 };
        let excitation = unit();
        x.extend([moves, excitation]);
        u.push(moves + excitation);
        v.push((moves + excitation) * 0.1 + unit() * 1e-3);
    }
    let channels = Channels { m: 1, p: 1, q: 2 };
    let found = LocalErrors::new(&[RecordLines { u: &u, v: &v, x: &x }], channels, &Partition::of_count(5), 0);
    for band in &found.bands {
        let error = band.as_ref().unwrap().error[0];
        assert!((error - 0.1).norm() < 2e-3, "{error}");
    }
}

/// White noise beside a sweep whose band from 0.2 to 0.45 of the sample rate lies in the middle of the record: mean square of the errors over their
/// stated variances, over 40 records. With a variance for an excitation that is spread over the record it was 1.39, and a right model of such a
/// record was refused in 6 of 12.
#[test]
fn a_sweep_in_the_middle_of_a_record_is_no_error_by_chance() {
    use crate::identify::likelihood::data::spectra::lines_of;
    let (rng, n) = (&mut ChaCha8Rng::seed_from_u64(6), 4000);
    let sweep = |k: usize| {
        // From 0.0005 to 0.45 in half of the record, twice.
        let (low, ratio, half) = (5e-4, 900.0_f64.ln(), n as f64 / 2.0);
        let at = (k % (n / 2)) as f64 / half;
        (std::f64::consts::TAU * half * low / ratio * ((at * ratio).exp() - 1.0)).sin()
    };
    let (mut squares, mut count) = (0.0, 0.0);
    for _ in 0..40 {
        let mut noise = || rng.sample::<f64, _>(rand_distr::StandardNormal);
        let u = Mat::from_fn(n, 1, |k, _| sweep(k));
        let v = Mat::from_fn(n, 1, |_, _| noise());
        let [x, v] = [&u, &v].map(|signal| hann(&lines_of(signal.as_ref(), 0), 1));
        let found = LocalErrors::new(
            &[RecordLines { u: &x, v: &v, x: &x }],
            Channels { m: 1, p: 1, q: 1 },
            &Partition::of_count(50),
            0,
        );
        for band in found.bands.iter().flatten().filter(|b| (0.2..0.45).contains(&b.share)) {
            squares += band.error[0].norm_sqr() / band.variance[0];
            count += 1.0;
        }
    }
    let mean: f64 = squares / count;
    assert!((0.85..1.12).contains(&mean), "{mean} of {count}");
}

/// Excitation moves the inputs along (1, 1) and 100 times less along (1, -1), noise does as well: both directions are shown, and an error of
/// the model along the weak one is found.
#[test]
fn a_weak_direction_counts_beside_the_noise_along_it() {
    let rng = &mut ChaCha8Rng::seed_from_u64(7);
    let mut unit = || c64::new(rng.random::<f64>() - 0.5, rng.random::<f64>() - 0.5);
    let (mut u, mut v, mut x) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..800 {
        let excitation = [unit(), unit()];
        let strong = excitation[0] + unit() * 0.05;
        let weak = (excitation[1] + unit() * 0.05) * 0.01;
        x.extend(excitation);
        u.extend([strong + weak, strong - weak]);
        v.push(weak * 0.2 + unit() * 1e-5);
    }
    let channels = Channels { m: 2, p: 1, q: 2 };
    let found = LocalErrors::new(&[RecordLines { u: &u, v: &v, x: &x }], channels, &Partition::of_count(4), 0);
    for band in &found.bands {
        let error = &band.as_ref().unwrap().error;
        assert!((error[0] - 0.1).norm() < 0.01 && (error[1] + 0.1).norm() < 0.01, "{error:?}");
    }
}

/// Of an excitation between 0.01 and 0.1 of the sample rate, with noise a tenth of what it moves and no input elsewhere but noise, the range is that
/// of the excitation within a sixth of an octave; of a response 1000 times smaller there is none.
#[test]
fn a_band_ends_where_the_excitation_does() {
    let rng = &mut ChaCha8Rng::seed_from_u64(8);
    let mut unit = || c64::new(rng.random::<f64>() - 0.5, rng.random::<f64>() - 0.5);
    let lines = 4000;
    let excited = |k: usize| (80..800).contains(&k);
    let x: Vec<c64> = (0..lines).map(|k| if excited(k) { unit() } else { unit() * 1e-6 }).collect();
    let u: Vec<c64> = x.iter().map(|x| x + unit() * 1e-2).collect();
    let v: Vec<c64> = (0..lines).map(|_| unit() * 0.1).collect();
    let channels = Channels { m: 1, p: 1, q: 1 };
    let partition = Partition::narrow(lines, 1, channels);
    let found = LocalErrors::new(&[RecordLines { u: &u, v: &v, x: &x }], channels, &partition, 0);
    let [low, high] = found.range_shown(0, &|_| 1.0).unwrap();
    assert!((0.0088..0.0105).contains(&low) && (0.095..0.114).contains(&high), "{low} {high}");
    assert!(found.range_shown(0, &|_| 1e-6).is_none());
}

/// Bands of a record of 12 000 samples: eight lines at first, 40 in the end, and no wider than an eighth of their frequency between.
#[test]
fn bands_are_narrow_at_low_frequency() {
    let (lines, channels) = (6000, Channels { m: 1, p: 1, q: 1 });
    let partition = Partition::narrow(lines, 1, channels);
    let first = |partition: &Partition| (partition.first() * lines as f64).round();
    assert_eq!(first(&partition), 8.0);
    let middles: Vec<f64> = partition.middles().map(|share| 2.0 * share * lines as f64).collect();
    let steps = || middles.windows(2).take(middles.len() - 2).map(|pair| (pair[1] - pair[0], pair[1]));
    assert!(steps().all(|(step, at)| step <= (0.125 * at).max(8.0) + 1.0 && step < 40.5));
    assert!(steps().any(|(step, _)| step > 39.5));
    assert!(middles.iter().enumerate().all(|(k, at)| partition.of(at / lines as f64) == k));
    // Of many records a band holds three lines of each.
    assert_eq!(first(&Partition::narrow(lines, 10, channels)), 30.0);
}
