use super::*;
use crate::lti::{StateSpace, frequency_response, simulate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn noise(samples: usize, channels: usize, seed: u64) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Mat::from_fn(samples, channels, |_, _| StandardNormal.sample(&mut rng))
}

fn respond(d: &Mat<f64>, u: &Mat<f64>, y: &Mat<f64>, time: Discrete, welch: &Welch) -> Result<IndirectResponse> {
    indirect_response(&[ExcitedRecord { d: d.as_ref(), u: u.as_ref(), y: y.as_ref() }], time, welch)
}

#[test]
fn a_sine_has_its_power() {
    let (ts, amplitude) = (0.01, 3.0);
    let y = Mat::from_fn(1024, 1, |k, _| amplitude * (TAU * 16.0 * k as f64 / 256.0 + 0.4).sin());
    let welch = Welch { window: 256, ..Welch::default() };
    let spectrum = cross_spectrum(y.as_ref(), y.as_ref(), Discrete::new(ts).unwrap(), &welch).unwrap();
    let power: f64 = spectrum.density.entry(0, 0).iter().map(|s| s.re / (256.0 * ts)).sum();
    assert!((power - amplitude * amplitude / 2.0).abs() < 1e-12, "{power}");
}

/// `y = G u + v`, `u = K y + d` with two inputs and outputs: the indirect estimate converges to G although v is fed back.
#[test]
fn two_channels_in_a_noisy_loop() {
    let time = Discrete::new(1.0).unwrap();
    let (n, gain) = (1 << 17, -0.4);
    let mat = |rows: [[f64; 2]; 2]| Mat::from_fn(2, 2, |i, j| rows[i][j]);
    let (a, b) = (mat([[0.7, 0.2], [-0.2, 0.6]]), mat([[1.0, 0.3], [0.0, 0.5]]));
    let plant = StateSpace::new(a.clone(), b.clone(), Mat::identity(2, 2), Mat::zeros(2, 2), time).unwrap();
    // Closed loop u = gain (x + v) + d: x^+ = (A + gain B) x + B d + gain B v.
    let closed_b = block(&[&[b.as_ref(), (&b * faer::Scale(gain)).as_ref()]]);
    let closed_a = &a + &b * faer::Scale(gain);
    let closed = StateSpace::new(closed_a, closed_b, Mat::identity(2, 2), Mat::zeros(2, 4), time).unwrap();
    let (d, v) = (noise(n, 2, 1), noise(n, 2, 2));
    let x = simulate(&closed, block(&[&[d.as_ref(), v.as_ref()]]).as_ref(), &[0.0; 2]).unwrap();
    let y = &x + &v;
    let u = &y * faer::Scale(gain) + &d;
    let welch = Welch { window: 128, ..Welch::default() };
    let found = respond(&d, &u, &y, time, &welch).unwrap();
    let exact = frequency_response(&plant, &found.response.omega).unwrap();
    let worst = |estimate: &FrequencyResponse| {
        let errors = estimate.iter().zip(exact.iter()).skip(1).map(|(e, g)| (e - g).norm_l2() / g.norm_l2());
        errors.fold(0.0, f64::max)
    };
    assert!(worst(&found.response) < 0.2, "{}", worst(&found.response));
    // The direct quotient is biased by the noise that the loop feeds back.
    let direct = respond(&u, &u, &y, time, &welch).unwrap();
    assert!(worst(&direct.response) > 0.6, "{}", worst(&direct.response));
}

#[test]
fn coherence_of_half_noise_is_a_half() {
    let time = Discrete::new(1.0).unwrap();
    let (d, v) = (noise(1 << 16, 1, 3), noise(1 << 16, 1, 4));
    let y = &d + &v;
    let welch = Welch { window: 64, ..Welch::default() };
    let found = respond(&d, &d, &y, time, &welch).unwrap();
    let mean = found.coherence_y.col(0).iter().sum::<f64>() / found.coherence_y.nrows() as f64;
    assert!((mean - 0.5).abs() < 0.01, "{mean}");
    assert!(found.coherence_u.col(0).iter().all(|c| (c - 1.0).abs() < 1e-12));
    let still = Mat::zeros(1 << 16, 1);
    let error = respond(&still, &d, &y, time, &welch).unwrap_err();
    assert!(matches!(error, Error::Singular { .. }), "{error}");
}

/// Without overlap the segments of two records are those of the two halves of one.
#[test]
fn records_are_averaged_without_crossing_their_ends() {
    let time = Discrete::new(1.0).unwrap();
    let (d, v) = (noise(4096, 1, 6), noise(4096, 1, 7));
    let y = &d * faer::Scale(2.0) + &v;
    let welch = Welch { window: 128, overlap: 0.0, ..Welch::default() };
    let part = |first| {
        let [d, y] = [&d, &y].map(|z| z.as_ref().subrows(first, 2048));
        ExcitedRecord { d, u: d, y }
    };
    let whole = respond(&d, &d, &y, time, &welch).unwrap();
    let halves = indirect_response(&[part(0), part(2048)], time, &welch).unwrap();
    assert_eq!(halves.segments, whole.segments);
    assert_eq!(halves.response.entry(0, 0), whole.response.entry(0, 0));
    assert!(indirect_response(&[], time, &welch).is_err());
}

#[test]
fn threads_do_not_change_a_bit() {
    let z = noise(20_000, 2, 5);
    let time = Discrete::new(1.0).unwrap();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let welch = Welch { window: 256, ..Welch::default() };
        let spectrum = pool.install(|| cross_spectrum(z.as_ref(), z.as_ref(), time, &welch)).unwrap();
        spectrum.density.iter().flat_map(|s| entries(s).collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    assert_eq!(run(1), run(3));
}
