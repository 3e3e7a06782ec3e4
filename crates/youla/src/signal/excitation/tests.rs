use super::*;
use crate::signal::{persistency, persistency_order};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn generate(excitation: &Excitation, samples: usize) -> Result<Mat<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    excitation.generate(samples, 2, Discrete::new(0.01)?, &mut rng)
}

fn all() -> [Excitation; 4] {
    [
        Excitation::SquareWaves(SquareWaves { hold_min: 1, hold_max: 20, amplitude: 0.5 }),
        Excitation::Prbs(Prbs { order: 10, hold: 1, amplitude: 0.5 }),
        Excitation::Multisine(Multisine { period: 500, amplitude: 0.5, ..Multisine::default() }),
        Excitation::Chirp(Chirp { omega_start: 1.0, omega_end: 300.0, amplitude: 0.5 }),
    ]
}

#[test]
fn all_kinds_excite_two_channels_within_their_amplitude() {
    for kind in all() {
        let signal = generate(&kind, 4000).unwrap();
        let peak = signal.col_iter().flat_map(|c| c.iter()).fold(0.0_f64, |p, x| p.max(x.abs()));
        assert!((0.499..=0.5 + 1e-12).contains(&peak), "{kind:?}: {peak}");
        persistency(signal.as_ref(), 20).unwrap().require("alpha").unwrap();
        let (a, b) = (signal.col(0), signal.col(1));
        let correlation = (a.transpose() * b).abs() / (a.norm_l2() * b.norm_l2());
        assert!(correlation < 0.1, "{kind:?}: {correlation}");
        assert_eq!(signal, generate(&kind, 4000).unwrap());
    }
}

/// Two shifted sequences and two multisines are uncorrelated over a period to -1 / (2^n - 1) and to rounding.
#[test]
fn whole_periods_are_uncorrelated() {
    let inner = |kind: &Excitation, samples| {
        let signal = generate(kind, samples).unwrap();
        (signal.col(0).transpose() * signal.col(1)) / (signal.col(0).norm_l2() * signal.col(1).norm_l2())
    };
    let [_, prbs, multisine, _] = all();
    assert!((inner(&prbs, 1023) + 1.0 / 1023.0).abs() < 1e-12);
    assert!(inner(&multisine, 500).abs() < 1e-12);
}

/// Schroeder's phases reach a crest near 1.7 for a flat spectrum; equal phases would reach sqrt(2 I) = 15.8 here.
#[test]
fn a_multisine_has_a_low_crest() {
    let signal = generate(&all()[2], 500).unwrap();
    let crest = 0.5 / (signal.col(0).norm_l2() / 500f64.sqrt());
    assert!(crest < 2.0, "{crest}");
}

#[test]
fn holds_stay_within_their_range() {
    let squares = Excitation::SquareWaves(SquareWaves { hold_min: 3, hold_max: 5, amplitude: 1.0 });
    let signal = generate(&squares, 1000).unwrap();
    let changes: Vec<usize> = (1..1000).filter(|&k| signal[(k, 0)] != signal[(k - 1, 0)]).collect();
    let holds: Vec<usize> = changes.windows(2).map(|w| w[1] - w[0]).collect();
    assert!((3..=5).all(|hold| holds.contains(&hold)) && holds.iter().all(|hold| (3..=5).contains(hold)));
}

#[test]
fn options_without_a_meaning_are_refused() {
    for bad in [
        Excitation::SquareWaves(SquareWaves { hold_min: 0, ..SquareWaves::default() }),
        Excitation::SquareWaves(SquareWaves { hold_min: 9, hold_max: 8, amplitude: 1.0 }),
        Excitation::Prbs(Prbs { order: 21, ..Prbs::default() }),
        Excitation::Prbs(Prbs { hold: 0, ..Prbs::default() }),
        Excitation::Multisine(Multisine { period: 0, ..Multisine::default() }),
        Excitation::Multisine(Multisine { omega_min: 1.0, omega_max: Some(1.1), ..Multisine::default() }),
        Excitation::Chirp(Chirp { omega_start: 1.0, omega_end: 315.0, amplitude: 1.0 }),
        Excitation::Chirp(Chirp { omega_start: 1.0, omega_end: 2.0, amplitude: f64::NAN }),
    ] {
        assert!(matches!(generate(&bad, 100), Err(Error::OutOfRange { .. })), "{bad:?}");
    }
}

#[test]
fn configuration_names_the_kind() {
    let squares: Excitation = toml::from_str("kind = \"square-waves\"\nhold_max = 50").unwrap();
    assert!(matches!(squares, Excitation::SquareWaves(SquareWaves { hold_max: 50, .. })));
    assert!(toml::from_str::<Excitation>("kind = \"prbs\"\nhold_max = 50").is_err());
}

/// A ramp multiplies: 0 on the first and the last sample, k / 8 on the k-th from either end, 1 between.
#[test]
fn a_ramp_fades_every_kind_in_and_out() {
    let time = Discrete::new(0.01).unwrap();
    for excitation in all() {
        let full = generate(&excitation, 400).unwrap();
        let with = |ramp: f64| {
            let ramped = RampedExcitation { excitation: excitation.clone(), ramp };
            ramped.generate(400, 2, time, &mut ChaCha8Rng::seed_from_u64(11))
        };
        assert_eq!(with(0.0).unwrap(), full);
        let faded = with(0.08).unwrap();
        let share = |k: usize| (k.min(399 - k) as f64 / 8.0).min(1.0);
        assert_eq!(faded, Mat::from_fn(400, 2, |k, j| share(k) * full[(k, j)]), "{excitation:?}");
        assert_eq!(with(2.0).unwrap().row(399).norm_max(), 0.0);
        for bad in [-0.01, 2.01, f64::NAN, f64::INFINITY] {
            assert!(matches!(with(bad), Err(Error::OutOfRange { .. })), "{bad}");
        }
    }
}

#[test]
fn a_ramp_stands_beside_the_options_of_its_excitation() {
    let prbs = "kind = \"prbs\"\norder = 10\nhold = 1\namplitude = 0.5\n";
    let read = |text: &str| toml::from_str::<RampedExcitation>(text);
    let plain = read(prbs).unwrap();
    assert_eq!(plain, RampedExcitation { excitation: all()[1].clone(), ramp: 0.0 });
    assert_eq!(toml::to_string(&plain).unwrap(), toml::to_string(&plain.excitation).unwrap());
    let ramped = read(&format!("{prbs}ramp = 0.25")).unwrap();
    assert_eq!((ramped.ramp, read(&toml::to_string(&ramped).unwrap()).unwrap()), (0.25, ramped));
    assert!(read(&format!("{prbs}rampe = 0.25")).is_err());
}

/// Lines that crowd in a twentieth of the band have nearly dependent rows: the rank that rounding leaves is lower.
#[test]
fn crowded_lines_lose_order_to_rounding() {
    let omega_max = Some(5.0 * PI);
    let sines = Excitation::Multisine(Multisine { period: 1000, omega_max, ..Multisine::default() });
    let signal = generate(&sines, 4000).unwrap();
    let order = persistency_order(signal.as_ref().subcols(0, 1), 26).unwrap();
    assert!((4..20).contains(&order), "{order} of 26");
}
