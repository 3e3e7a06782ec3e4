//! Notes of a run that must say what the record holds, and no more.

use crate::common::{SETTINGS, csv, log, loop_folder, settings, uniform, youla};

/// Of the variance of y the noise, uniform within 0.025, is 26.2 dB below; the loop amplifies it by a few dB. A model explains 99 % of y,
/// so that a ratio below 18 dB cannot be right. Notes that are alike are one.
#[test]
fn the_signal_to_noise_ratio_is_that_of_the_record() {
    let folder = loop_folder("ratio", &[]);
    let text = youla(&folder, &["check", "run.toml"]).stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    let (_, rest) = text.split_once("its signal-to-noise ratio is ").expect("the ratio");
    let ratio: f64 = rest.split_once(" dB").expect("a unit").0.parse().expect("a number");
    assert!((18.0..27.0).contains(&ratio), "{ratio} dB");
    assert_eq!(text.matches("its signal-to-noise ratio is").count(), 1, "{text}");
}

/// The log without noise: what is left of it is rounding, and a dependence of rounding on the excitation is no finding.
#[test]
fn a_residual_of_rounding_depends_on_nothing() {
    let (mut y, mut before) = (0.0, 0.0);
    let rows: Vec<[f64; 4]> = log()
        .into_iter()
        .map(|[t, _, d, _]| {
            let (u, now) = (d - 2.0 * y, y);
            (y, before) = (1.5 * y - 0.56 * before + 0.06 * u, y);
            [t, u, d, now]
        })
        .collect();
    let folder = loop_folder("rounding", &[("log.csv", csv(&rows).as_bytes()), ("run.toml", SETTINGS.as_bytes())]);
    let found = youla(&folder, &["identify", "run.toml", "--out", "out"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let text = (found.stdout + &found.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(!text.contains("depends on past excitation"), "{text}");
}

/// A log that is mostly noise has a fit below half: the terminal says that the noise is the reason. The log with little noise needs no such sentence.
#[test]
fn a_low_fit_has_its_reason_on_the_terminal() {
    let (mut y, mut before, mut random) = (0.0, 0.0, uniform(1));
    let rows: Vec<[f64; 4]> = log()
        .into_iter()
        .map(|[t, _, d, _]| {
            let measured = y + 1.5 * (random() - 0.5);
            let (u, now) = (d - 2.0 * measured, y);
            (y, before) = (1.5 * y - 0.56 * before + 0.06 * u, now);
            [t, u, d, measured]
        })
        .collect();
    let folder = loop_folder("low-fit", &[("noisy.csv", csv(&rows).as_bytes())]);
    std::fs::write(folder.join("noisy.toml"), SETTINGS.replace("log.csv", "noisy.csv")).expect("written");
    for (file, said) in [("noisy.toml", true), ("run.toml", false)] {
        let found = youla(&folder, &["identify", file]);
        let text = found.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(found.code, Some(0), "{}", found.stderr);
        assert_eq!(text.contains("What is left does not depend on past excitation: it is noise"), said, "{text}");
    }
}

/// The largest pole of the models in the region, and the interval of that of the plant, differ: the sentence says why.
#[test]
fn a_region_reaches_further_than_an_interval() {
    let folder = loop_folder("region", &[("run.toml", SETTINGS.as_bytes())]);
    assert_eq!(youla(&folder, &["identify", "run.toml", "--out", "out", "--quiet"]).code, Some(0));
    let report = std::fs::read_to_string(folder.join("out/report.json")).expect("written");
    let (_, sentence) = report.split_once("region of all parameters together; ").expect("the sentence");
    let sentence = sentence.split_once('"').expect("its end").0;
    assert!(sentence.contains("reaches further than the region at one frequency"), "{sentence}");
}

/// A time limit ends no search of an order that is fixed, and this is said before the run.
#[test]
fn a_time_limit_beside_a_fixed_order_is_no_promise() {
    let fixed = settings("[hansen]", "[recommended]\norder = 2\n\n[hansen]");
    let folder = loop_folder("time-limit", &[("fixed.toml", fixed.as_bytes())]);
    for (file, said) in [("fixed.toml", true), ("run.toml", false)] {
        let found = youla(&folder, &["identify", file, "--time-limit", "600"]);
        assert_eq!(
            (found.code, found.stderr.contains("order = 2 is fixed in [recommended]")),
            (Some(0), said),
            "{}",
            found.stderr
        );
    }
}

/// An AC-coupled sensor under an integrator: the loop has a pole next to 1, and the static gain, of -0.6 % of the rest, is not
/// known to a percent. Where the model has that pole outside of the circle, the table and the caution say that the records do not place it.
#[test]
fn a_pole_that_the_records_do_not_place_is_undecided() {
    let mut random = uniform(7);
    let (mut x, mut sum, mut before) = (0.0, 0.0, [0.0; 2]);
    let rows: Vec<[f64; 4]> = (0..4000)
        .map(|t| {
            x = 0.8 * x + 0.2 * (before[0] - 1.006 * before[1]);
            let y = x + 0.17 * (random() - 0.5);
            sum += 0.05 * y;
            let d = (random() - 0.5).signum();
            before = [d - sum, before[0]];
            [t as f64 * 0.001, before[0], d, y]
        })
        .collect();
    let files = [("log.csv", csv(&rows)), ("run.toml", AC_COUPLED.to_owned())];
    let folder = loop_folder("undecided", &files.each_ref().map(|(name, text)| (*name, text.as_bytes())));
    let found = youla(&folder, &["identify", "run.toml", "--out", "out"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let text = (found.stdout + &found.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("Trusted for this loop") && text.contains("stabilised by K undecided"), "{text}");
    assert!(text.contains("do not distinguish the largest pole of the loop of the recommended model"), "{text}");
}

const AC_COUPLED: &str = "name = \"coupled\"\n[data]\nsample_time = 0.001\ninputs = [{ name = \"u\" }]\n\
    outputs = [{ name = \"y\" }]\ninput_excitation = [{ name = \"d\" }]\nestimation = [{ file = \"log.csv\", take = 2500 }]\n\
    verification = [{ file = \"log.csv\", skip = 2500 }]\n[controller.difference_equation]\nfeedback = \"negative\"\n\
    numerator = [0.05]\ndenominator = [1.0, -1.0]\n";
