//! The contract on reduction, certificate, redesign and margins.

use super::{json, keys, numbers};
use crate::common::demo;
use serde_json::Value;
use std::fs;
use youla_io::export::ExportedController;
use youla_run::RunModelFile;

#[test]
fn the_reduction_is_measured_at_every_order() {
    let reduction = &json(&demo().join("summary.json"))["reduction"];
    let figures =
        ["closed_loop_relative", "error_bound", "failure", "kept", "method", "minimal_order", "open_loop_error"];
    let others =
        ["open_loop_relative", "order", "proposed_order", "stabilised_by_controller", "worst_closed_loop_pole"];
    assert_eq!(keys(reduction), [&figures[..], &others[..]].concat());
    assert_eq!((&reduction["order"], &reduction["minimal_order"]), (&Value::from(6), &Value::from(6)));
    assert_eq!(
        (&reduction["stabilised_by_controller"], &reduction["proposed_order"]),
        (&Value::Bool(true), &Value::Null)
    );
    // Nothing is left out: both are rounding.
    let figure = |key: &str| reduction[key].as_f64().expect("a number");
    assert!(figure("open_loop_error") <= figure("error_bound") + 1e-9, "{reduction}");
    let sweep = json(&demo().join("6-reduce/sweep.json"));
    let orders = sweep["orders"].as_array().expect("an array");
    assert_eq!(orders.len(), 6);
    assert_eq!(orders[5]["closed_loop_relative"], reduction["closed_loop_relative"]);
    assert_eq!(sweep["provenance"]["seed"], 1);
    let table = fs::read_to_string(demo().join("6-reduce/sweep.csv")).expect("readable");
    let header = "order,error_bound,open_loop_error,open_loop_relative,closed_loop_relative,stabilised_by_controller";
    assert!(table.starts_with(&format!("{header},worst_pole_re,worst_pole_im\n")), "{table}");
    assert_eq!(table.lines().count(), 7);
    let page = fs::read_to_string(demo().join("report.html")).expect("readable");
    assert!(page.contains("The controller stabilises the reduced model of order 6"));
}

/// The demonstration's controller stabilises the bearing with hardly any damping; the region is small.
#[test]
fn the_certificate_covers_the_region_of_the_plant() {
    let certificate = &json(&demo().join("summary.json"))["certificate"];
    let expected = ["band", "deviation_poles", "identity_residual", "margins", "stable"];
    assert_eq!(keys(certificate), expected);
    assert_eq!((&certificate["stable"], &certificate["band"]["holds"]), (&Value::Bool(true), &Value::Bool(true)));
    assert!(certificate["identity_residual"].as_f64().expect("a number") < 1e-9);
    let band = &certificate["band"];
    assert_eq!((band["models"].as_u64(), band["within"].as_u64()), (Some(500), Some(475)));
    let [low, high] = [0, 1].map(|k| numbers(&band["radius"]["bounds"])[k]);
    let estimate = band["radius"]["value"].as_f64().expect("a number");
    assert!(low < estimate && estimate < high && high < 1.0);
    let file = json(&demo().join("7-validate/certificate.json"));
    assert_eq!(file["band"], certificate["band"]);
}

#[test]
fn the_new_controller_is_exported_with_its_promise() {
    let redesign = &json(&demo().join("summary.json"))["redesign"];
    let damping = |of: &str| redesign[of]["least_damping"].as_f64().expect("a number");
    assert!(damping("predicted") > 5.0 * damping("present"), "{redesign}");
    assert_eq!(redesign["band"]["holds"], true);
    let text = fs::read_to_string(demo().join("8-redesign/controller.json")).expect("readable");
    let data: ExportedController = serde_json::from_str(&text).expect("the documented form");
    let model: RunModelFile =
        serde_json::from_str(&fs::read_to_string(demo().join("8-redesign/new_controller.json")).expect("readable"))
            .expect("a model");
    assert_eq!((&data.controller.a, &data.controller.c), (&model.matrices.a, &model.matrices.c));
    let observer = data.observer.expect("LQG has an observer form");
    assert_eq!((observer.model.a.len(), observer.f.len(), observer.l[0].len()), (6, 2, 2));
    let source = fs::read_to_string(demo().join("8-redesign/controller.rs")).expect("readable");
    assert!(source.contains("pub const OBSERVER: Matrices<f64, 6, 2, 2> = Matrices {"), "{source}");
    assert!(source.contains(&format!("{:?}", observer.f[0][0])), "{source}");
}

#[test]
fn summary_says_what_each_loop_can_bear() {
    let summary = json(&demo().join("summary.json"));
    let scales = &summary["channel_scales"];
    assert_eq!(keys(scales), ["basis", "inputs", "outputs"]);
    assert!(["inputs", "outputs"].iter().all(|s| numbers(&scales[s]).iter().all(|x| *x > 0.0)));
    let expected = [
        "coprime_margin",
        "delay_margin_s",
        "highest_gain",
        "input_disk_margin",
        "iso_14839_zone",
        "lowest_gain",
        "nu_gap_to_nominal",
        "nu_gap_to_recommended",
        "output_disk_margin",
        "output_peak_sensitivities",
        "peak_complementary_sensitivity",
        "peak_input_sensitivity",
        "peak_sensitivity",
        "phase_margin_deg",
        "refused",
    ];
    for model in ["/nominal", "/true_plant", "/methods/direct", "/methods/hansen", "/methods/hansen_reduced"] {
        let entry = summary.pointer(model).expect("there");
        let robustness = &entry["robustness"];
        assert_eq!(keys(robustness), expected, "{model}");
        let number = |key: &str| robustness[key].as_f64().expect("a number");
        for key in ["coprime_margin", "nu_gap_to_recommended", "nu_gap_to_nominal"] {
            assert!((0.0..=1.0).contains(&number(key)), "{model}: {key}");
        }
        if entry["stabilised_by_controller"] == false {
            assert!(robustness["refused"].as_str().expect("a reason").contains("unstable"));
            assert_eq!((number("coprime_margin"), &robustness["peak_sensitivity"]), (0.0, &Value::Null));
            continue;
        }
        assert_eq!(robustness["refused"], Value::Null, "{model}");
        let peaks = numbers(&robustness["output_peak_sensitivities"]);
        assert!(peaks.len() == 2 && peaks.iter().all(|p| *p <= number("peak_sensitivity") * (1.0 + 1e-6)), "{model}");
        assert!(["A", "B", "C", "D"].contains(&robustness["iso_14839_zone"].as_str().expect("a zone")));
        assert!(number("lowest_gain") < 1.0 && number("highest_gain") > 1.0);
        assert!(number("phase_margin_deg") > 0.0 && number("delay_margin_s") > 0.0);
        for disk in ["input_disk_margin", "output_disk_margin"] {
            assert_eq!(keys(&robustness[disk]), ["alpha", "highest_gain", "lowest_gain", "phase_deg"]);
            assert!(robustness[disk]["alpha"].as_f64().expect("a number") > 0.0);
        }
    }
    let gap = |pointer: &str| summary.pointer(pointer).and_then(Value::as_f64).expect("a number");
    assert!(gap("/nominal/robustness/nu_gap_to_nominal") < 1e-6);
    assert!(gap("/methods/likelihood/robustness/nu_gap_to_recommended") < 1e-6);
    let there = gap("/methods/likelihood/robustness/nu_gap_to_nominal");
    assert!((there - gap("/nominal/robustness/nu_gap_to_recommended")).abs() < 1e-6);
}
