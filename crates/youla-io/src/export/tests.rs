//! Round trips of models, and what their files must not do.

use super::*;
use crate::ModelFile;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use youla::Mat;

/// A random model, with entries over many decades.
pub(super) fn random(n: usize, m: usize, p: usize, seed: u64) -> NamedModel {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut entry = |_, _| rng.random_range(-1.0..1.0) * 10f64.powi(rng.random_range(-12..3));
    let (a, b, c, d) = (
        Mat::from_fn(n, n, &mut entry),
        Mat::from_fn(n, m, &mut entry),
        Mat::from_fn(p, n, &mut entry),
        Mat::from_fn(p, m, &mut entry),
    );
    let system = StateSpace::new(a, b, c, d, Discrete::new(1.0 / 3000.0).unwrap()).unwrap();
    let channels = |name: &str, count| (0..count).map(|k| Channel::new(format!("{name} {k}"), "µm/s²")).collect();
    NamedModel::new("hansen", system, (channels("a 'quoted' \"name\" \\ */", m), channels("y", p))).unwrap()
}

const SIZES: [(usize, usize, usize); 5] = [(1, 1, 1), (7, 2, 3), (12, 1, 2), (0, 2, 1), (40, 3, 3)];

#[test]
fn models_read_back_bit_by_bit() {
    for (seed, (n, m, p)) in SIZES.into_iter().enumerate() {
        let model = random(n, m, p, seed as u64);
        for format in [ModelFormat::Json, ModelFormat::Mat, ModelFormat::Npz] {
            let bytes = export_model(&model, format).unwrap();
            assert_eq!(bytes, export_model(&model, format).unwrap(), "{format:?} depends on the model only");
            let back = model_from_bytes(&bytes, "somewhere/hansen.file").unwrap();
            assert_eq!(back.system, model.system, "{format:?}, {n} states");
            assert_eq!((&back.name, back.origin.as_str()), (&model.name, "somewhere/hansen.file"));
            if format != ModelFormat::Npz {
                assert_eq!((back.inputs, back.outputs), (model.inputs.clone(), model.outputs.clone()), "{format:?}");
            }
        }
    }
}

/// A model with a predictor of two more states.
fn with_predictor() -> NamedModel {
    let mut model = random(3, 2, 2, 21);
    let of = |seed, rows: usize, columns: usize| {
        let m = random(rows.max(columns), 1, 1, seed).system;
        (0..rows).map(|i| (0..columns).map(|j| m.a()[(i, j)]).collect()).collect::<Vec<Vec<f64>>>()
    };
    model.details = serde_json::json!({ "predictor": {
        "a": of(1, 5, 5), "b": of(2, 5, 2), "c": of(3, 2, 5), "d": of(4, 2, 2), "k": of(5, 5, 2), "covariance": of(6, 2, 2),
    }});
    model
}

#[test]
fn the_predictor_reads_back_and_is_in_the_scripts() {
    let mut model = with_predictor();
    for format in [ModelFormat::Json, ModelFormat::Mat, ModelFormat::Npz] {
        let back = model_from_bytes(&export_model(&model, format).unwrap(), "x").unwrap();
        assert_eq!(back.details, model.details, "{format:?}");
    }
    let scripts = |model: &NamedModel| {
        [ModelFormat::Python, ModelFormat::Matlab].map(|f| String::from_utf8(export_model(model, f).unwrap()).unwrap())
    };
    let [python, matlab] = scripts(&model);
    assert!(python.contains("def predict(u, y):") && matlab.contains("lsim(predictor, [u y])"));
    // Without a gain nothing is promised.
    model.details["predictor"]["k"] = serde_json::Value::Null;
    let [python, matlab] = scripts(&model);
    assert!(!python.contains("predict") && !matlab.contains("predict"), "{python}");
    assert!(!python.contains('@') && !matlab.contains('@'));
}

#[test]
fn a_model_without_ports_reads_back_too() {
    let model = random(2, 0, 1, 3);
    for format in [ModelFormat::Mat, ModelFormat::Npz] {
        assert_eq!(model_from_bytes(&export_model(&model, format).unwrap(), "x").unwrap().system, model.system);
    }
    assert!(matches!(export_model(&model, ModelFormat::C), Err(Error::Method(youla::Error::OutOfRange { .. }))));
}

#[test]
fn json_keeps_what_came_with_the_model() {
    let mut model = random(2, 1, 1, 9);
    model.details = serde_json::json!({"order": 2});
    let provenance =
        serde_json::json!({"schema": 1, "program": "youla 0", "seed": null, "sources": [], "options": {"horizon": 3}});
    model.provenance = provenance.clone();
    let text = export_model(&model, ModelFormat::Json).unwrap();
    let file: ModelFile<serde_json::Value> = serde_json::from_slice(&text).unwrap();
    assert_eq!((file.poles.len(), &file.provenance["options"]["horizon"]), (2, &serde_json::json!(3)));
    assert_eq!(model_from_bytes(&text, "x.json").unwrap().provenance, provenance);
}

#[test]
fn what_is_not_a_model_is_refused_with_the_reason() {
    let sentence = |text: &str| model_from_bytes(text.as_bytes(), "m.json").unwrap_err().to_string();
    assert_eq!(
        sentence("{\"refused\": \"too few samples\"}"),
        "m.json: there is no model; it was refused: too few samples"
    );
    assert!(sentence("{}").starts_with("m.json: this is not a model as JSON: missing field `ts`"));
    assert!(sentence("").starts_with("m.json: this is not a model as JSON"));
    let matrices = |b: &str| format!("{{\"ts\": 0.1, \"a\": [[0.5]], \"b\": {b}, \"c\": [[1]], \"d\": [[0]]}}");
    assert!(model_from_bytes(matrices("[[1]]").as_bytes(), "m.json").is_ok());
    assert_eq!(sentence(&matrices("[[1], [2]]")), "m.json: the matrix B is 2 x 1, but must be 1 x 1");
    assert!(sentence(&matrices("[[1, 2]]")).contains("row 1 of B"));
    let named = matrices("[[1]]").replace("\"ts\"", "\"inputs\": [], \"ts\"");
    assert!(sentence(&named).contains("the number of names of inputs of the model \"m\""));
    assert!(sentence(&matrices("[[1]]").replace("0.1", "-1")).contains("sample time"));
}

#[test]
fn comments_cannot_be_left() {
    let hostile = text::plain("*/ int x; \"\"\" \\ ??\n%{ \u{202e}@p@ µ");
    assert_eq!(hostile, "_/ int x; ___ _ _____ __p_ µ");
    assert_eq!((text::identifier("G red"), text::identifier("2x")), ("G_red".into(), "model_2x".into()));
}

#[test]
fn an_existing_file_stays() {
    let file = crate::scratch::scratch("npz");
    write_export(file.path(), b"first", false).unwrap();
    assert!(matches!(write_export(file.path(), b"second", false), Err(Error::FileExists { .. })));
    assert_eq!(std::fs::read(file.path()).unwrap(), b"first");
    write_export(file.path(), b"second", true).unwrap();
    assert_eq!(std::fs::read(file.path()).unwrap(), b"second");
    assert!(matches!(write_export(Path::new("/nowhere/at/all.npz"), b"x", false), Err(Error::Io { .. })));
}

#[test]
fn single_precision_is_rounded_after_every_operation() {
    let (mut sum, a, x) = ([0.1_f32, -3.0], [[1.1_f32, 2.7], [1e-3, 1e8]], [0.3_f32, 0.7]);
    for i in 0..2 {
        (0..2).for_each(|j| sum[i] += a[i][j] * x[j]);
    }
    let matrix = Mat::from_fn(2, 2, |i, j| f64::from(a[i][j]));
    let mut emulated = [f64::from(0.1_f32), -3.0];
    precision::add(&mut emulated, matrix.as_ref(), &x.map(f64::from), precision::SINGLE);
    assert_eq!(emulated, sum.map(f64::from));
    assert_eq!((precision::samples_for(1.0), precision::samples_for(1.1), precision::samples_for(1e9)), (1000, 72, 2));
}
