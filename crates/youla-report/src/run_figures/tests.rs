//! The numbers of a figure are those of the report.

use roxmltree::Document;

use super::choice::Chosen;
use super::pole_grid::{Plane, grid};
use super::*;
use crate::data::*;
use crate::figure::{Content, Curve, Drawn, MEASURED};
use crate::trace::{Timeline, Trace};
use crate::{Error, Result};
use crate::{Print, figure_csv, svg_for};
use youla::signal::Channel;

const TS: f64 = 0.01;

fn wave(samples: usize, phase: f64) -> Vec<f64> {
    (0..samples).map(|k| (0.3 * k as f64 + phase).sin() * (1.0 + 0.2 * (0.07 * k as f64).cos())).collect()
}

fn trace(phase: f64, clock: &Timeline) -> Trace {
    Trace::new("signal", &wave(clock.samples, phase), clock).unwrap()
}

/// Two outputs, one input, everything that a run may have.
fn report() -> ReportData {
    let clock = Timeline::new(TS, 500);
    let signal =
        |kind, name: &str, phase| Signal { kind, channel: Channel::new(name, "V"), trace: trace(phase, &clock) };
    let experiment = DrawnExperiment {
        name: "first".into(),
        clock: clock.clone(),
        signals: vec![
            signal(SignalKind::Input, "u", 0.0),
            signal(SignalKind::Output, "y 1", 0.5),
            signal(SignalKind::Alpha, "alpha u", 0.7),
            signal(SignalKind::Beta, "beta y", 0.9),
        ],
    };
    let prediction = |method: &str, phase| DrawnPrediction {
        method: method.into(),
        predicted: trace(phase, &clock),
        residual: trace(3.0 * phase, &clock),
    };
    let verified = |output| VerifiedOutput {
        output,
        measured: trace(0.1, &clock),
        predictions: vec![prediction("nominal", 0.4), prediction("hansen", 0.2)],
    };
    let correlation = |values: usize| Correlation::new(&wave(values, 1.0), 0.12);
    let test = |method: &str| DrawnResidualTest {
        record: "second".into(),
        method: method.into(),
        excitations: vec!["d".into()],
        auto: vec![correlation(26), correlation(26)],
        cross: vec![correlation(51), correlation(51)],
        ..DrawnResidualTest::default()
    };
    let hz: Vec<f64> = (1..=60).map(|k| 0.8 * f64::from(k)).collect();
    let model = |method: &str, output| ModelResponse {
        method: method.into(),
        output,
        input: 0,
        magnitude_db: hz.iter().map(|f| -0.4 * f).collect(),
        phase_deg: hz.iter().map(|f| -3.0 * f).collect(),
    };
    let indirect = |output| Indirect {
        output,
        input: 0,
        hz: hz.clone(),
        magnitude_db: hz.iter().map(|f| 0.5 - 0.4 * f).collect(),
        phase_deg: hz.iter().map(|f| 1.0 - 3.0 * f).collect(),
        coherence: hz.iter().map(|f| if *f < 30.0 { 0.95 } else { 0.3 }).collect(),
    };
    let band = |output| DrawnBand {
        method: "hansen".into(),
        output,
        input: 0,
        level: 0.95,
        low_db: hz.iter().map(|f| -2.0 - 0.4 * f).collect(),
        high_db: hz.iter().map(|f| 2.0 - 0.4 * f).collect(),
        region: hz.iter().flat_map(|_| [4e-4, 1e-4, 2e-4]).collect(),
    };
    let row = |order: usize| ReductionOrder {
        order,
        error_bound: Some(8.0 / order as f64),
        open_loop_relative: Some(0.5 / order as f64),
        closed_loop_relative: Some(0.3 / order as f64),
        stabilised_by_controller: order > 1,
        ..ReductionOrder::default()
    };
    ReportData {
        inputs: vec![Channel::new("u", "V")],
        outputs: vec![Channel::new("y 1", "um"), Channel::new("y/2", "um")],
        sample_time: Some(TS),
        methods: vec![DrawnMethod::nominal(), DrawnMethod::hansen(), DrawnMethod::hansen_reduced()],
        fits: vec![Fit { record: "second".into(), output: 0, method: "hansen".into(), fit: Some(91.25) }],
        experiments: vec![experiment],
        orders: vec![OrderChoice {
            method: "hansen".into(),
            label: "S from alpha to beta".into(),
            values: vec![4.0, 2.0, 0.1, 0.05],
            chosen: 2,
        }],
        verification: vec![Verification {
            record: "second".into(),
            prediction: "simulated".into(),
            clock: clock.clone(),
            outputs: vec![verified(0), verified(1)],
        }],
        residuals: Some(Residuals { tests: vec![test("nominal"), test("hansen")], ..Residuals::default() }),
        frequency: Some(DrawnResponses {
            hz: hz.clone(),
            models: vec![model("nominal", 0), model("hansen", 0), model("hansen", 1)],
            indirect: vec![indirect(0), indirect(1)],
            bands: vec![band(0), band(1)],
            lines: vec![LineLevels {
                hz: vec![1.0, 2.0],
                response_db: vec![3.0, 2.0],
                noise_db: vec![-40.0, -41.0],
                ..LineLevels::default()
            }],
            deviations: vec![DrawnDeviation {
                hz: vec![hz[0] / 2.0, hz[1], hz[2], hz[3], hz[4], hz[5]],
                total: vec![50.0, 20.0, 5.0, 4.0, 11.0, 3.0],
                parts: vec![DeviationPart { cause: "noise".into(), percent: vec![50.0, 12.0, 4.0, 4.0, 9.0, 3.0] }],
                limit: 10.0,
                bands: vec![[hz[2], hz[3]], [hz[5], hz[5]]],
                ..DrawnDeviation::default()
            }],
            singular: vec![SingularValue { method: "hansen".into(), place: 0, value_db: vec![3.0; hz.len()] }],
        }),
        poles: vec![Poles {
            method: "hansen".into(),
            poles: vec![[0.9, 0.3], [0.9, -0.3], [0.5, 0.0]],
            zeros: vec![[0.2, 0.0]],
        }],
        reduction: Some(DrawnReduction {
            label: "G(S) by balanced truncation".into(),
            hankel: vec![3.0, 1.0, 0.2],
            chosen: 2,
            plant_norm: Some(4.0),
            orders: vec![row(1), row(2), row(3)],
            ..DrawnReduction::default()
        }),
        ..ReportData::default()
    }
}

fn drawn(kind: RunFigure, choice: &FigureChoice) -> Vec<RunDrawing> {
    run_drawings(&report(), kind, choice).unwrap()
}

fn curves(figure: &Figure, panel: usize) -> &[Curve] {
    match &figure.panels[panel].content {
        Content::Curves(curves) => curves,
        _ => &[],
    }
}

fn of<'a>(curves: &'a [Curve], method: &str) -> &'a Curve {
    curves.iter().find(|curve| curve.method == method).unwrap()
}

#[test]
fn every_figure_is_whole_in_every_size_and_always_the_same() {
    let data = report();
    let kinds = run_figures(&data).unwrap();
    let all_but_one = RunFigure::ALL.into_iter().filter(|kind| *kind != RunFigure::Redesign);
    assert_eq!(kinds, all_but_one.collect::<Vec<_>>());
    for kind in kinds {
        for RunDrawing { figure, methods } in run_drawings(&data, kind, &FigureChoice::default()).unwrap() {
            for width_cm in [17.0, 8.5] {
                let print = Print { width_cm, ..Print::default() };
                let file = svg_for(&figure, &methods, &print).unwrap();
                let document = Document::parse(&file).unwrap();
                assert_eq!(document.root_element().attribute("width"), Some(format!("{}mm", 10.0 * width_cm).as_str()));
                assert!(document.descendants().any(|node| node.attribute("data-method").is_some()), "{}", figure.key);
                assert!(file.contains("@font-face") && !file.contains("NaN"), "{}", figure.key);
                assert_eq!(file, svg_for(&figure, &methods, &print).unwrap());
            }
            assert!(figure_csv(&figure, &methods).lines().count() > 3, "{}", figure.key);
            assert!(!figure.title.is_empty() && !figure.caption.is_empty());
        }
    }
}

#[test]
fn deviations_have_a_style_for_each_cause_and_are_filled_in_their_bands_only() {
    let figure = &drawn(RunFigure::Bode, &FigureChoice::default())[0].figure;
    let deviation = curves(figure, 3);
    let keys: Vec<&str> = deviation.iter().map(|curve| curve.method.as_str()).collect();
    assert_eq!(keys, ["deviation, all causes", "deviation, noise"]);
    assert_eq!(deviation[0].y, [20.0, 5.0, 4.0, 11.0, 3.0]);
    let filled: Vec<bool> = figure.panels[3].regions[0].high.iter().map(|high| *high == 10.0).collect();
    assert_eq!(filled, [false, true, true, false, true]);
    assert!(
        figure.caption.contains("filled in the bands of validity")
            && figure.caption.contains("noise: the noise of the")
    );

    let mut doubted = report();
    doubted.frequency.iter_mut().flat_map(|of| &mut of.deviations).for_each(|of| of.bands.clear());
    let figure = &run_drawings(&doubted, RunFigure::Bode, &FigureChoice::default()).unwrap()[0].figure;
    assert!(figure.panels[3].regions.is_empty() && !figure.caption.contains("bands of validity"));
}

/// A point a thousand times as far out as the models is not in the first view of a locus.
#[test]
fn a_stray_point_does_not_decide_the_view_of_a_locus() {
    let mut data = report();
    let view = |data: &ReportData| {
        let figure = run_drawings(data, RunFigure::Nyquist, &FigureChoice::default()).unwrap().remove(0).figure;
        (figure.panels[0].x.range.unwrap(), figure.panels[0].y.range.unwrap())
    };
    let first = |data: &mut ReportData, coherence: f64, decibels: f64| {
        let measured = &mut data.frequency.as_mut().unwrap().indirect[0];
        measured.coherence[0] = coherence;
        measured.magnitude_db[0] += decibels;
    };
    first(&mut data, 0.0, 0.0);
    let before = view(&data);
    first(&mut data, 1.0, 60.0);
    assert_eq!(view(&data), before);
}

#[test]
fn responses_are_those_of_the_report() {
    let data = report();
    let frequency = data.frequency.as_ref().unwrap();
    let bode = drawn(RunFigure::Bode, &FigureChoice::default());
    let keys: Vec<&str> = bode.iter().map(|drawing| drawing.figure.key.as_str()).collect();
    assert_eq!(keys, ["bode-y-1-from-u", "bode-y-2-from-u"]);
    let figure = &bode[0].figure;
    let hansen = of(curves(figure, 0), "hansen");
    assert_eq!((&hansen.x, &hansen.y), (&frequency.hz, &frequency.models[1].magnitude_db));
    assert_eq!(of(curves(figure, 1), "hansen").y, frequency.models[1].phase_deg);
    assert_eq!(curves(figure, 2)[0].y, frequency.indirect[0].coherence);
    let region = &figure.panels[0].regions[0];
    assert_eq!((&region.low, &region.high), (&frequency.bands[0].low_db, &frequency.bands[0].high_db));
    let points: Vec<&Curve> = curves(figure, 0).iter().filter(|curve| curve.method == "indirect").collect();
    assert_eq!(points.iter().map(|curve| curve.x.len()).collect::<Vec<_>>(), [37, 23]);
    assert_eq!(figure.panels[0].shades.len(), 1);
    assert_eq!(bode[1].figure.panels.len(), 3);

    let nyquist = &drawn(RunFigure::Nyquist, &FigureChoice::default())[0].figure;
    assert!(nyquist.panels[0].equal);
    let locus = curves(nyquist, 0).iter().find(|curve| curve.method == "hansen" && curve.note.is_empty()).unwrap();
    assert_eq!(locus.along, frequency.hz);
    for (k, (re, im)) in locus.x.iter().zip(&locus.y).enumerate() {
        let (db, deg) = (20.0 * re.hypot(*im).log10(), im.atan2(*re).to_degrees());
        assert!((db - frequency.models[1].magnitude_db[k]).abs() < 1e-9);
        let turns = (deg - frequency.models[1].phase_deg[k]) / 360.0;
        assert!((turns - turns.round()).abs() < 1e-9);
    }
    // Every point of an ellipse has d' V^-1 d = 1, V = [4 1; 1 2] 1e-4.
    let region = curves(nyquist, 0).iter().find(|curve| curve.note == "95 %").unwrap();
    for ((x, y), hz) in region.x.iter().zip(&region.y).zip(&region.along).filter(|((_, y), _)| y.is_finite()) {
        let k = locus.along.iter().position(|f| f == hz).unwrap();
        let (a, b) = (x - locus.x[k], y - locus.y[k]);
        let size = (2.0 * a * a - 2.0 * a * b + 4.0 * b * b) / 7.0 / 1e-4;
        assert!((size - 1.0).abs() < 1e-9, "{size}");
    }
    let singular = &drawn(RunFigure::SingularValues, &FigureChoice::default())[0].figure;
    assert_eq!(curves(singular, 0)[0].y, frequency.singular[0].value_db);
    let levels = drawn(RunFigure::Levels, &FigureChoice::default());
    assert_eq!((levels.len(), &curves(&levels[0].figure, 0).last().unwrap().y), (1, &frequency.lines[0].noise_db));
}

#[test]
fn signals_and_residuals_are_those_of_the_report() {
    let data = report();
    let figure = &drawn(RunFigure::Verification, &FigureChoice::default())[1].figure;
    assert_eq!(figure.key, "verification-y-2");
    let output = &data.verification[0].outputs[1];
    let measured = of(curves(figure, 0), MEASURED);
    assert_eq!(measured.y, output.measured.values);
    assert!(measured.x.iter().enumerate().all(|(k, t)| (t - k as f64 * TS).abs() < 1e-12));
    assert_eq!(of(curves(figure, 1), "hansen").y, output.predictions[1].residual.values);
    let fits = &drawn(RunFigure::Verification, &FigureChoice::default())[0].figure;
    assert_eq!(of(curves(fits, 0), "hansen").note, "91.2 %");

    let figure = &drawn(RunFigure::Residuals, &FigureChoice::default())[0].figure;
    let test = &data.residuals.as_ref().unwrap().tests[1];
    let cross = of(curves(figure, 0), "hansen");
    assert_eq!((cross.x[0], cross.x[50], &cross.y), (-25.0, 25.0, &test.cross[0].values));
    assert_eq!(of(curves(figure, 1), "hansen").y, test.auto[0].values);
    assert_eq!(figure.panels[0].regions[0].high, [0.12; 2]);

    let figure = &drawn(RunFigure::Data, &FigureChoice::default())[0].figure;
    assert_eq!((figure.key.as_str(), figure.panels.len()), ("data", 2));
    assert_eq!(curves(figure, 1)[0].y, data.experiments[0].signals[1].trace.values);
}

#[test]
fn orders_poles_and_errors_are_those_of_the_report() {
    let order = &drawn(RunFigure::Order, &FigureChoice::default())[0].figure;
    let [kept, left] = curves(order, 0) else { panic!("two clouds") };
    assert_eq!((kept.drawn, &kept.y[..]), (Drawn::Dots, &[4.0, 2.0][..]));
    assert_eq!((left.drawn, &left.x[..], &left.y[..]), (Drawn::Marks, &[3.0, 4.0][..], &[0.1, 0.05][..]));
    let reduction = &drawn(RunFigure::Reduction, &FigureChoice::default())[0].figure;
    assert_eq!(of(curves(reduction, 0), "bound").y, [2.0, 1.0, 8.0 / 3.0 / 4.0]);
    assert_eq!(of(curves(reduction, 0), "hansen_reduced").y, [0.3, 0.15, 0.3 / 3.0]);
    assert_eq!(reduction.panels[0].shades, [[0.5, 1.5]]);
    let poles = &drawn(RunFigure::Poles, &FigureChoice::default())[0].figure;
    let [zeros, own] = curves(poles, 0) else { panic!("zeros and poles") };
    assert_eq!((&own.x[..], &own.y[..]), (&[0.9, 0.9, 0.5][..], &[0.3, -0.3, 0.0][..]));
    assert_eq!((zeros.note.as_str(), &zeros.x[..]), ("zeros", &[0.2][..]));
}

#[test]
fn a_constant_channel_is_said_and_not_drawn() {
    let mut data = report();
    let (clock, signals) = (data.experiments[0].clock.clone(), &mut data.experiments[0].signals);
    signals[0].trace = Trace::new("signal", &[0.5; 500], &clock).unwrap();
    let figure = &run_drawings(&data, RunFigure::Data, &FigureChoice::default()).unwrap()[0].figure;
    assert_eq!(figure.panels.len(), 1);
    assert!(figure.caption.ends_with("Not drawn, because constant: u."), "{}", figure.caption);
}

#[test]
fn the_grid_has_the_frequencies_and_damping_ratios_that_it_says() {
    for sample_time in [Some(TS), None] {
        let reach = if sample_time.is_some() { 1.1 } else { 300.0 };
        let guides = grid(&Plane { sample_time }, [[-reach, reach]; 2]);
        let to_s = |x: f64, y: f64| match sample_time {
            Some(ts) => [x.hypot(y).ln() / ts, y.atan2(x) / ts],
            None => [x, y],
        };
        let (mut rays, mut arcs) = (0, 0);
        for guide in guides.iter().filter(|guide| !guide.label.is_empty()) {
            let middle = guide.x.len() / 3;
            let [re, im] = to_s(guide.x[middle], guide.y[middle]);
            match guide.label.strip_prefix("ζ ") {
                Some(zeta) => {
                    assert!((-re / re.hypot(im) - zeta.parse::<f64>().unwrap()).abs() < 1e-9, "{}", guide.label);
                    rays += 1;
                }
                None => {
                    let hz = re.hypot(im) / std::f64::consts::TAU;
                    assert!((hz - guide.label.parse::<f64>().unwrap()).abs() < 1e-9, "{} {hz}", guide.label);
                    arcs += 1;
                }
            }
        }
        assert!(rays >= 2 && arcs >= 4, "{rays} {arcs}");
    }
}

#[test]
fn what_is_chosen_is_drawn_and_what_is_not_there_is_named() -> Result<()> {
    let choice = FigureChoice {
        output: Some("y/2".into()),
        methods: Some(vec!["hansen".into()]),
        record: Some("second".into()),
        ..FigureChoice::default()
    };
    for (kind, count) in [
        (RunFigure::Bode, 1),
        (RunFigure::Verification, 1),
        (RunFigure::Residuals, 1),
        (RunFigure::Poles, 1),
        (RunFigure::Data, 0),
    ] {
        let drawings = drawn(kind, &choice);
        assert_eq!(drawings.len(), count, "{kind:?}");
        assert!(drawings.iter().all(|d| curves(&d.figure, 0).iter().all(|c| c.method != "nominal")));
    }
    assert_eq!(drawn(RunFigure::Bode, &choice)[0].figure.key, "bode-y-2-from-u");
    for (choice, known) in [
        (FigureChoice { output: Some("y".into()), ..FigureChoice::default() }, "y/2"),
        (FigureChoice { input: Some("v".into()), ..FigureChoice::default() }, "u"),
        (FigureChoice { record: Some("third".into()), ..FigureChoice::default() }, "second"),
        (FigureChoice { methods: Some(vec!["pem".into()]), ..FigureChoice::default() }, "hansen"),
    ] {
        let error = run_drawings(&report(), RunFigure::Bode, &choice).unwrap_err();
        assert!(
            matches!(&error, Error::Method(youla::Error::UnknownChannel { known: k, .. }) if k.contains(&known.to_owned())),
            "{error}"
        );
    }
    let chosen: Chosen = FigureChoice::default().of(&report())?;
    assert!(!chosen.several_verifications && chosen.output.is_none());
    Ok(())
}

#[test]
fn names_that_give_one_key_get_numbers() {
    let figure = |key: &str| Figure { key: key.into(), ..Figure::default() };
    let keys: Vec<String> =
        with_own_keys(["a", "a", "b", "a"].map(figure).into()).into_iter().map(|figure| figure.key).collect();
    assert_eq!(keys, ["a", "a-2", "b", "a-3"]);
}
