//! Reports as files: complete, closed, small, and whole where parts of a run are missing.
//!
//! The pages are written to the folder of temporary files of the build, where a browser can open them.

mod sample;
mod story;

use youla_report::data::{FrequencyResponse, Method, ReportData};
use youla_report::html;

const FIVE_MEGABYTES: usize = 5_000_000;

fn written(name: &str, data: &ReportData) -> String {
    let page = html(data).unwrap();
    std::fs::write(format!("{}/{name}.html", env!("CARGO_TARGET_TMPDIR")), &page).unwrap();
    page
}

fn embedded(page: &str) -> ReportData {
    let start = "<script type=\"application/json\" id=\"report-data\">";
    let json = page.split_once(start).unwrap().1.split_once("</script>").unwrap().0;
    serde_json::from_str(json).unwrap()
}

#[test]
fn long_record_stays_small_and_keeps_its_outline() {
    let data = sample::flexible_drive();
    let page = written("report-flexible-drive", &data);
    assert!(page.len() < FIVE_MEGABYTES, "{} bytes", page.len());
    let drawn = embedded(&page);
    assert_eq!(drawn.verification, data.verification);
    assert_eq!(drawn.experiments, data.experiments);
}

#[test]
fn many_curves_are_thinned_to_keep_the_file_small() {
    let mut data = sample::flexible_drive();
    let record = data.verification[0].clone();
    data.verification = vec![record; 24];
    let page = html(&data).unwrap();
    assert!(page.len() < FIVE_MEGABYTES, "{} bytes", page.len());
    let extremes = |data: &ReportData| {
        let values = &data.verification[7].outputs[0].measured.values;
        (values.iter().copied().fold(f64::MAX, f64::min), values.iter().copied().fold(f64::MIN, f64::max))
    };
    assert_eq!(extremes(&embedded(&page)), extremes(&data));
}

#[test]
fn several_inputs_and_outputs_are_all_inside() {
    let data = sample::bearing();
    let page = written("report-bearing", &data);
    let response = embedded(&page).frequency.unwrap();
    assert_eq!((response.models.len(), response.indirect.len()), (16, 4));
    for text in [
        "Hansen reduced G_red(S)",
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
    data.outputs[0].name = evil.into();
    data.methods.push(Method::new("other", evil, youla_report::data::Role::Other));
    let page = written("report-hostile", &data);
    assert!(!page.contains("alert(1)</script>") && !page.contains("<!--"));
    assert_eq!(page.matches("</script>").count(), 3);
    assert_eq!(embedded(&page).title, evil);
}

#[test]
fn missing_parts_are_left_out() {
    let empty = written("report-empty", &ReportData::default());
    let mut data = sample::bearing();
    data.verification.clear();
    data.fits.clear();
    data.reduction = None;
    data.frequency = data.frequency.map(|response| FrequencyResponse { indirect: Vec::new(), ..response });
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
    assert!(embedded(&page).verification[0].outputs[0].predictions[1].predicted.values[3000].is_nan());
}
