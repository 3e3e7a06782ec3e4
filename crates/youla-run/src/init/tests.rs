//! What `youla init` writes, read again.

use super::*;
use crate::RunSettings;
use youla_io::ColumnContent;

fn columns() -> Vec<SurveyedColumn> {
    let content = ColumnContent { rows: 900, low: -1.0, high: 1.0, step: None, rises: false };
    let of = |from: &str| SurveyedColumn { from: from.into(), content: Ok(content) };
    let mut all = ["t", "Data.signals.u", "Data.signals.y", "d", "odd \"name\""].map(of).to_vec();
    all.push(SurveyedColumn { from: "mode".into(), content: Err("line 2: not a number".into()) });
    all
}

fn draft(feedback: Option<Feedback>) -> Draft {
    let name = |text: &str| ChannelRef::Name(text.into());
    Draft {
        name: "a \"rig\"".into(),
        file: "log.csv".into(),
        csv: CsvOptions::default(),
        clock: DraftClock::Column(name("t")),
        inputs: vec![name("Data.signals.u")],
        outputs: vec![name("Data.signals.y")],
        input_excitation: vec![name("d")],
        reference: Vec::new(),
        feedback,
        estimated: 600,
    }
}

#[test]
fn without_a_controller_it_is_complete() {
    let text = draft(None).toml(&columns()).unwrap();
    let settings = RunSettings::parse(&text, Path::new("run.toml")).unwrap();
    assert_eq!(settings.name, "a \"rig\"");
    assert_eq!(settings.data.inputs[0].name, "u");
    assert_eq!(settings.data.inputs[0].source(), ChannelRef::Name("Data.signals.u".into()));
    assert_eq!((settings.data.estimation[0].take, settings.data.verification[0].skip), (Some(600), 600));
}

#[test]
fn with_a_controller_what_is_missing_is_named_with_its_line() {
    for feedback in [Feedback::Negative, Feedback::Positive] {
        let text = draft(Some(feedback)).toml(&columns()).unwrap();
        let error = RunSettings::parse(&text, Path::new("run.toml")).unwrap_err().to_string();
        assert!(error.starts_with("run.toml:") && error.ends_with("lacks `numerator`"), "{error}");
        let filled = text.replacen("# numerator", "numerator", 1).replacen("# denominator", "denominator", 1);
        RunSettings::parse(&filled, Path::new("run.toml")).unwrap();
    }
}

#[test]
fn several_channels_and_columns_by_number() {
    let mut several = draft(None);
    several.inputs = vec![ChannelRef::Column(2), ChannelRef::Column(4)];
    several.outputs = vec![ChannelRef::Column(3), ChannelRef::Name("odd \"name\"".into())];
    several.input_excitation.clear();
    several.clock = DraftClock::SampleTime(5e-4);
    let settings = RunSettings::parse(&several.toml(&columns()).unwrap(), Path::new("run.toml")).unwrap();
    assert_eq!(settings.data.sample_time, Some(5e-4));
    assert_eq!(settings.data.inputs[1].source(), ChannelRef::Column(4));
    assert_eq!(settings.data.inputs[1].name, "u2");
    assert_eq!(settings.data.outputs[1].name, "odd \"name\"");
}

/// Columns of the matrices of a MATLAB file, chosen by number.
#[test]
fn columns_of_matrices_have_places() {
    let content = ColumnContent { rows: 900, low: -1.0, high: 1.0, step: None, rises: false };
    let of = |from: &str| SurveyedColumn { from: from.into(), content: Ok(content) };
    let columns = ["u(:,1)", "u(:,2)", "y"].map(of);
    let mut numbered = draft(None);
    numbered.clock = DraftClock::SampleTime(1e-3);
    numbered.inputs = vec![ChannelRef::Column(1), ChannelRef::Column(2)];
    numbered.outputs = vec![ChannelRef::Column(3)];
    numbered.input_excitation.clear();
    let text = numbered.toml(&columns).unwrap();
    let settings = RunSettings::parse(&text, Path::new("run.toml")).unwrap();
    let places: Vec<String> = settings.data.inputs.iter().map(|c| c.source().to_string()).collect();
    assert_eq!(places, ["u(:,1)", "u(:,2)"]);
    assert_eq!(settings.data.outputs[0].source(), ChannelRef::Name("y".into()));
}

#[test]
fn units_of_headings_are_taken() {
    for (text, found) in [
        ("speed [rad/s]", ("speed", "rad/s")),
        ("x(um)", ("x", "um")),
        ("x(2)", ("x(2)", "")),
        ("x(:,2)", ("x(:,2)", "")),
        ("[V]", ("[V]", "")),
        ("u", ("u", "")),
        ("rate [1/s]", ("rate", "1/s")),
    ] {
        assert_eq!(heading(text), found, "{text}");
    }
    let mut all = columns();
    all[1].from = "voltage [V]".into();
    let mut draft = draft(None);
    draft.inputs = vec![ChannelRef::Name("voltage [V]".into())];
    let settings = RunSettings::parse(&draft.toml(&all).unwrap(), Path::new("run.toml")).unwrap();
    let u = &settings.data.inputs[0];
    assert_eq!((u.name.as_str(), u.unit.as_str()), ("voltage", "V"));
    assert_eq!(u.source(), ChannelRef::Name("voltage [V]".into()));
}

#[test]
fn the_template_has_the_size_of_the_plant() {
    let mut several = draft(Some(Feedback::Negative));
    several.inputs.push(ChannelRef::Name("odd \"name\"".into()));
    several.input_excitation.clear();
    let text = several.toml(&columns()).unwrap();
    assert!(text.contains("# numerator = [[[2500.0], [2500.0]]]"), "{text}");
    let filled = text.replacen("# numerator", "numerator", 1).replacen("# denominator", "denominator", 1);
    RunSettings::parse(&filled, Path::new("run.toml")).unwrap();
}

#[test]
fn what_does_not_fit_the_log_is_said() {
    let check = |change: fn(&mut Draft), says: &str| {
        let mut draft = draft(None);
        change(&mut draft);
        let error = draft.toml(&columns()).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    };
    check(|d| d.inputs = vec![ChannelRef::Name("v".into())], "no column \"v\"; there are t, Data.signals.u");
    check(|d| d.outputs = vec![ChannelRef::Name("mode".into())], "cannot be a channel: line 2");
    check(|d| d.outputs = d.inputs.clone(), "named twice");
    check(|d| d.outputs.clear(), "at least one input");
    check(|d| d.reference = vec![ChannelRef::Name("t".into())], "named twice");
    check(|d| d.reference = vec![ChannelRef::Column(5), ChannelRef::Column(6)], "cannot be a channel");
    check(|d| d.input_excitation = Vec::from(["d", "t"].map(|c| ChannelRef::Name(c.into()))), "named twice");
    check(|d| d.inputs.push(ChannelRef::Column(5)), "as many excitations as inputs (2)");
    check(|d| d.estimated = 900, "the log has 900");
    check(|d| d.clock = DraftClock::SampleTime(0.0), "positive number of seconds");
}
