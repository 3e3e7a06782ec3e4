//! Reports as files: complete, closed, small, and whole where parts of a run are missing.
//!
//! The pages are written to the folder of temporary files of the build, where a browser can open them.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod sample;
mod story;

use youla_report::data::{DrawnMethod, DrawnResponses, ReportData, SignalKind, UnlistedModes};
use youla_report::figure::{Content, Curve, Drawn, Figure, MEASURED};
use youla_report::html;

const FIVE_MEGABYTES: usize = 5_000_000;

fn written(name: &str, data: &ReportData) -> String {
    let page = html(data).unwrap();
    std::fs::write(format!("{}/{name}.html", env!("CARGO_TARGET_TMPDIR")), &page).unwrap();
    page
}

fn embedded(page: &str) -> Vec<Figure> {
    let start = "<script type=\"application/json\" id=\"report-data\">";
    let json = page.split_once(start).unwrap().1.split_once("</script>").unwrap().0;
    let mut data: serde_json::Value = serde_json::from_str(json).unwrap();
    serde_json::from_value(data["figures"].take()).unwrap()
}

/// The curve of a method in a panel of an embedded figure.
fn curve<'a>(figures: &'a [Figure], key: &str, panel: usize, method: &str) -> &'a Curve {
    let figure = figures.iter().find(|figure| figure.key == key).unwrap();
    let Content::Curves(curves) = &figure.panels[panel].content else { panic!("{key}") };
    curves.iter().find(|curve| curve.method == method).unwrap()
}

fn extremes(values: &[f64]) -> (f64, f64) {
    (values.iter().copied().fold(f64::MAX, f64::min), values.iter().copied().fold(f64::MIN, f64::max))
}

fn close(a: (f64, f64), b: (f64, f64)) -> bool {
    let size = b.0.abs().max(b.1.abs());
    (a.0 - b.0).abs() <= 1e-5 * size && (a.1 - b.1).abs() <= 1e-5 * size
}

#[test]
fn long_record_stays_small_and_keeps_its_outline() {
    let data = sample::flexible_drive();
    let page = written("report-flexible-drive", &data);
    assert!(page.len() < FIVE_MEGABYTES, "{} bytes", page.len());
    let output = &data.verification[0].outputs[0];
    let drawn = embedded(&page);
    let measured = drawn.iter().find(|figure| figure.key.starts_with("verification")).unwrap().key.clone();
    let measured = curve(&drawn, &measured, 0, MEASURED);
    assert_eq!(measured.y.len(), output.measured.values.len());
    assert!(close(extremes(&measured.y), extremes(&output.measured.values)));
    let signals = drawn.iter().find(|figure| figure.key == "data").unwrap();
    let shown = data.experiments[0].signals.iter().filter(|s| !matches!(s.kind, SignalKind::Alpha | SignalKind::Beta));
    assert_eq!(signals.panels.len(), shown.count());
}

#[test]
fn many_curves_are_thinned_to_keep_the_file_small() {
    let mut data = sample::flexible_drive();
    let record = data.verification[0].clone();
    data.verification = vec![record; 24];
    let page = html(&data).unwrap();
    assert!(page.len() < FIVE_MEGABYTES, "{} bytes", page.len());
    let drawn = embedded(&page);
    let figures: Vec<&Figure> = drawn.iter().filter(|figure| figure.key.starts_with("verification")).collect();
    assert_eq!(figures.len(), 24 * data.verification[0].outputs.len());
    let measured = curve(&drawn, &figures[7].key, 0, MEASURED);
    assert!(measured.y.len() < data.verification[7].outputs[0].measured.values.len());
    assert!(close(extremes(&measured.y), extremes(&data.verification[7].outputs[0].measured.values)));
}

#[test]
fn several_inputs_and_outputs_are_all_inside() {
    let data = sample::bearing();
    let page = written("report-bearing", &data);
    let figures = embedded(&page);
    let bodes: Vec<&Figure> = figures.iter().filter(|figure| figure.key.starts_with("bode")).collect();
    assert_eq!(bodes.len(), 4);
    for bode in bodes {
        let Content::Curves(curves) = &bode.panels[0].content else { panic!("{}", bode.key) };
        let lines = curves.iter().filter(|curve| curve.drawn == Drawn::Line).count();
        assert_eq!((lines, bode.panels.len()), (4, 3));
    }
    for text in [
        "Hansen reduced G_red(S)",
        "Gap to\u{a0}recommended",
        "y_x",
        "Can I trust it?",
        "3.1e−14",
        "Zone, ISO\u{a0}14839\u{2011}3",
        "2.314",
        "the loop is unstable",
    ] {
        assert!(page.contains(text), "{text} is missing");
    }
}

#[test]
fn nine_pairs_stay_within_five_megabytes() {
    let page = written("report-three-by-three", &sample::three_by_three());
    assert!(page.len() < FIVE_MEGABYTES, "{} bytes", page.len());
}

#[test]
fn the_page_asks_for_nothing() {
    let page = html(&sample::bearing()).unwrap();
    assert!(page.contains("default-src 'none'"));
    for fetch in ["src=", "@import", "url(http", "fetch(", "XMLHttpRequest", "<link rel=\"stylesheet\""] {
        assert!(!page.contains(fetch), "{fetch}");
    }
}

#[test]
fn text_of_the_user_cannot_leave_its_place() {
    let evil = "</script><!--<script>alert(1)</script>";
    let mut data = sample::bearing();
    data.title = evil.into();
    data.settings = evil.into();
    data.verdict.iter_mut().for_each(|line| line.text = evil.into());
    data.findings.iter_mut().for_each(|finding| finding.what = evil.into());
    data.outputs[0].name = evil.into();
    data.methods.push(DrawnMethod::new("other", evil, youla_report::data::MethodRole::Other));
    let page = written("report-hostile", &data);
    assert!(!page.contains("alert(1)</script>") && !page.contains("<!--"));
    assert_eq!(page.matches("</script>").count(), 3);
    assert!(embedded(&page).iter().any(|figure| figure.caption.contains(evil)));
}

/// The result, then the evidence, then the data.
#[test]
fn the_result_comes_first_and_the_data_last() {
    let page = html(&sample::bearing()).unwrap();
    let sections = ["trust", "frequency", "modes", "fits", "verification", "poles", "order", "data", "run"];
    let place = |key: &&str| page.find(&format!("<section id=\"{key}\"")).unwrap_or_else(|| panic!("no {key}"));
    assert!(sections.iter().map(place).is_sorted());
}

#[test]
fn modes_that_are_left_out_are_counted() {
    let mut data = sample::bearing();
    let unlisted = UnlistedModes { method: "hansen".into(), cancelled: 4, above_nyquist: 1 };
    assert!(!html(&data).unwrap().contains("nearly cancelled"));
    data.unlisted.push(unlisted);
    let page = html(&data).unwrap();
    assert!(page.contains("4 nearly cancelled by zeros, 1 at or above the Nyquist frequency."));
}

#[test]
fn missing_parts_are_left_out() {
    let empty = written("report-empty", &ReportData::default());
    let mut data = sample::bearing();
    data.verification.clear();
    data.fits.clear();
    data.reduction = None;
    data.frequency = data.frequency.map(|response| DrawnResponses { indirect: Vec::new(), ..response });
    data.certificates[0].worst_closed_loop_pole = None;
    let partial = written("report-partial", &data);
    for (part, in_partial) in [("verification", false), ("reduction", false), ("frequency", true), ("poles", true)] {
        let figure = format!("data-figure=\"{part}\"");
        assert_eq!((empty.contains(&figure), partial.contains(&figure)), (false, in_partial), "{part}");
    }
}

#[test]
fn diverged_predictions_are_said_and_leave_gaps() {
    let mut data = sample::bearing();
    data.fits[1].fit = None;
    let values = &mut data.verification[0].outputs[0].predictions[1].predicted.values;
    values.iter_mut().skip(2000).for_each(|value| *value = f64::INFINITY);
    let page = written("report-diverged", &data);
    assert!(page.contains("diverged"));
    let figures = embedded(&page);
    let figure = figures.iter().find(|figure| figure.key.starts_with("verification")).unwrap();
    let method = &data.verification[0].outputs[0].predictions[1].method;
    let drawn = curve(&figures, &figure.key, 0, method);
    assert!(drawn.y[3000].is_nan() && drawn.y[1000].is_finite());
}
