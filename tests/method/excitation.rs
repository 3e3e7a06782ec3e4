//! What the description of an excitation says of signals whose spectrum is known.

use crate::common::rng;
use std::f64::consts::PI;
use youla::lti::Discrete;
use youla::signal::{Excitation, Multisine, Prbs, SquareWaves, Welch, persistency_order};
use youla::{Error, Mat};
use youla_paper::study::{ExcitationReport, ExcitationReportOptions, PowerBand, describe_excitation};

fn describe(
    signal: &Mat<f64>,
    wanted_order: usize,
    highest_order: usize,
    window: usize,
) -> youla_paper::Result<ExcitationReport> {
    let welch = Welch { window, remove_mean: false, ..Welch::default() };
    let options = ExcitationReportOptions { wanted_order, highest_order, welch };
    describe_excitation(signal.as_ref(), Discrete::new(0.01)?, &options)
}

/// The bits have the same power on every line but zero; holding them multiplies by `sin(h x) / sin(x)` squared, x = pi f ts.
/// In a window of four periods a line falls on every fourth frequency and the Hann window keeps them apart. The hold
/// takes h - 1 of the h P lines: order h P - (h - 1).
#[test]
fn a_prbs_has_flat_lines_below_its_clock() {
    for (hold, order) in [(1, 31), (4, 121)] {
        let prbs = Excitation::Prbs(Prbs { order: 5, hold, amplitude: 0.5 });
        let (clock, window) = (31, 4 * 31 * hold);
        let mut rng = rng(2);
        let signal = prbs.generate(3 * window, 1, Discrete::new(0.01).unwrap(), &mut rng).unwrap();
        let report = describe(&signal, order, 150, window).unwrap();
        let channel = &report.channels[0];
        assert_eq!((channel.crest, report.order, channel.order), (1.0, order, order));
        report.persistency.require("alpha").unwrap();
        assert!(describe(&signal, order + 1, 1, window).unwrap().persistency.require("alpha").is_err());
        let flat = |line: usize| {
            let x = PI * line as f64 / (clock * hold) as f64;
            channel.density[4 * line] / ((hold as f64 * x).sin() / x.sin()).powi(2)
        };
        for line in 1..=clock / 2 {
            assert!((flat(line) / flat(1) - 1.0).abs() < 1e-10, "hold {hold}, line {line}");
            assert!(channel.density[4 * line + 2] < 1e-20 * flat(1), "between the lines, hold {hold}, line {line}");
        }
    }
}

/// Of 30 equal lines 5 % are one and a half, so the band reaches from the second to the 29th.
#[test]
fn a_multisine_of_k_lines_has_order_2_k() {
    let sines = Excitation::Multisine(Multisine { period: 61, amplitude: 0.5, ..Multisine::default() });
    let mut rng = rng(2);
    let signal = sines.generate(10 * 61, 1, Discrete::new(0.01).unwrap(), &mut rng).unwrap();
    let report = describe(&signal, 70, 70, 4 * 61).unwrap();
    assert_eq!((report.order, report.channels[0].order, report.persistency.rank), (60, 60, 60));
    let channel = &report.channels[0];
    let power: f64 = channel.density.iter().sum::<f64>() / (4.0 * 61.0 * 0.01);
    assert!((power / channel.rms.powi(2) - 1.0).abs() < 1e-12, "{power}");
    let PowerBand { omega_min, omega_max } = channel.band;
    assert_eq!((omega_min, omega_max), (report.omega[4 * 2], report.omega[4 * 29]));
}

/// A square wave of one half period h has h lines, of one period or of many: order h, refused for a horizon s of which 2 s
/// is more. Half periods that vary are enough.
#[test]
fn a_square_wave_of_one_period_is_refused() {
    let squares = |hold_min, hold_max, samples| {
        let squares = Excitation::SquareWaves(SquareWaves { hold_min, hold_max, amplitude: 0.5 });
        squares.generate(samples, 1, Discrete::new(0.01).unwrap(), &mut rng(11)).unwrap()
    };
    for samples in [60, 6000] {
        let report = describe(&squares(30, 30, samples), 40, 50, 60).unwrap();
        assert_eq!(report.order, 30);
        let refusal = report.persistency.require("alpha").unwrap_err();
        assert!(matches!(refusal, Error::InsufficientExcitation { block_rows: 40, .. }), "{refusal}");
    }
    assert_eq!(persistency_order(squares(20, 40, 6000).as_ref(), 50).unwrap(), 50);
}

#[test]
fn a_channel_without_power_is_not_described() {
    let prbs = Excitation::Prbs(Prbs { order: 10, hold: 1, amplitude: 0.5 });
    let mut signal = prbs.generate(400, 2, Discrete::new(0.01).unwrap(), &mut rng(11)).unwrap();
    signal.col_mut(1).fill(0.0);
    let refusal = describe(&signal, 10, 10, 100).unwrap_err().to_string();
    assert!(refusal.contains("channel 2"), "{refusal}");
    assert_eq!(persistency_order(signal.as_ref(), 10).unwrap(), 0);
    assert!(describe(&Mat::zeros(0, 2), 10, 10, 100).is_err());
    assert!(describe(&Mat::zeros(400, 0), 10, 10, 100).unwrap().channels.is_empty());
}
