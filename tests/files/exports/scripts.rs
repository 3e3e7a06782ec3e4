//! Scripts and data in Python and Octave: the same numbers, bit by bit.

use super::{folder, named, output};
use crate::common::{TS, random_stable, random_system, rng};
use std::path::PathBuf;
use youla::lti::{Discrete, StateSpace};
use youla_io::export::{ModelFormat, export_model};

/// Compares what the files of one model hold with its JSON file.
const CHECK: &str = r#"
import json, sys
import numpy as np
model = json.load(open('hansen.json'))
n, m, p = len(model['a']), len(model['inputs']), len(model['outputs'])
shapes = dict(a=(n, n), b=(n, m), c=(p, n), d=(p, m))
want = {k: np.array(model[k], float).reshape(s) for k, s in shapes.items()}
def compare(what, found):
    for key, value in want.items():
        assert found[key].shape == value.shape, (what, key, found[key].shape)
        assert np.array_equal(found[key], value), (what, key)
    assert found['ts'] == model['ts'], what
if sys.argv[1] == 'npz':
    compare('npz', np.load('hansen.npz'))
elif sys.argv[1] == 'mat':
    import scipy.io
    mat = scipy.io.loadmat('hansen.mat')
    compare('mat', {**mat, 'ts': mat['ts'].item()})
    assert [str(c.item()) for c in mat['inputs'][0]] == [c['name'] for c in model['inputs']]
else:
    import hansen
    G = hansen.G
    compare('python', dict(a=G.A, b=G.B, c=G.C, d=G.D, ts=G.dt))
    assert G.name == 'hansen'
    assert G.input_labels == [c['name'] for c in model['inputs']], G.input_labels
    assert G.output_labels == [c['name'] for c in model['outputs']]
print('same', sys.argv[1])
"#;

/// The same of the MATLAB file and the script.
const OCTAVE: &str = r"
file = load('hansen.mat');
same = @(x, y) isequal(size(x), size(y)) && isequal(x, y);
if isempty(pkg('list', 'control')), error('octave has no package control'); end
hansen
assert(same(a, file.a) && same(b, file.b) && same(c, file.c) && same(d, file.d) && ts == file.ts);
[a, b, c, d, ts] = ssdata(G);
assert(same(a, file.a) && same(b, file.b) && same(c, file.c) && same(d, file.d));
% A gain has no sample time there.
assert(isempty(a) || ts == file.ts);
assert(isequal(get(G, 'inname')(:), file.inputs(:)));
disp('same octave');
";

fn models() -> [(&'static str, StateSpace<Discrete>); 3] {
    let (rng, time) = (&mut rng(5), Discrete::new(TS / 3.0).unwrap());
    [
        ("script-stable", random_stable(rng, (12, 2, 3), time)),
        ("script-unstable", random_system(rng, (1, 1, 1), 0.1, time)),
        ("script-gain", random_stable(rng, (0, 2, 1), time)),
    ]
}

/// All files of a model in a folder.
fn written(name: &str, system: &StateSpace<Discrete>) -> PathBuf {
    let folder = folder(name);
    for format in ModelFormat::ALL {
        let file = folder.join(format!("hansen.{}", format.extension()));
        std::fs::write(file, export_model(&named(system), format).unwrap()).unwrap();
    }
    folder
}

fn python() -> String {
    std::env::var("PYTHON").unwrap_or_else(|_| "python3".into())
}

#[test]
#[ignore = "needs python3 (or PYTHON) with numpy, scipy and control"]
fn python_sees_the_same_numbers() {
    for (name, system) in models() {
        let folder = written(name, &system);
        for what in ["npz", "mat", "python"] {
            let found = output(python(), &["-c", CHECK, what], &folder, "");
            assert_eq!(found.trim(), format!("same {what}"), "{name}");
        }
        let printed = output(python(), &["hansen.py"], &folder, "");
        assert!(printed.contains("hansen"), "{printed}");
    }
}

/// Prints the predictions of the script for the records of `record.json`.
const PREDICT: &str = r"
import json
import recommended
record = json.load(open('record.json'))
for row in recommended.predict(record['u'], record['y']):
    print(*[repr(float(v)) for v in row])
";

/// The script's one-step predictions are those of the library, `A - K C` driven by `[B - K D, K]`.
#[test]
#[ignore = "needs python3 (or PYTHON) with numpy, scipy and control"]
fn python_predicts_one_step_ahead() {
    let (rng, time) = (&mut rng(11), Discrete::new(TS).unwrap());
    let (n, m, p, samples) = (6, 2, 2, 300);
    let closed = random_stable(rng, (n, m + p, p), time);
    let (k, d) = (closed.b().subcols(m, p), closed.d().subcols(0, m));
    let (a, b) = (closed.a() + k * closed.c(), closed.b().subcols(0, m) + k * d);
    let rows = |x: youla::MatRef<'_, f64>| -> Vec<Vec<f64>> {
        (0..x.nrows()).map(|i| x.row(i).iter().copied().collect()).collect()
    };
    let none = vec![vec![0.0; p]; p];
    let mut model = named(&random_stable(rng, (4, m, p), time));
    model.details = serde_json::json!({ "predictor": {
        "a": rows(a.as_ref()), "b": rows(b.as_ref()), "c": rows(closed.c()), "d": rows(d), "k": rows(k), "covariance": none,
    }});
    let folder = folder("predict");
    std::fs::write(folder.join("recommended.py"), export_model(&model, ModelFormat::Python).unwrap()).unwrap();
    let record = youla::Mat::from_fn(samples, m + p, |i, j| ((i * (3 * j + 7)) as f64 * 0.37).sin());
    let text = serde_json::json!({ "u": rows(record.subcols(0, m)), "y": rows(record.subcols(m, p)) }).to_string();
    std::fs::write(folder.join("record.json"), text).unwrap();
    let mut seen = closed.d().to_owned();
    seen.subcols_mut(m, p).fill(0.0);
    let system =
        StateSpace::new(closed.a().to_owned(), closed.b().to_owned(), closed.c().to_owned(), seen, time).unwrap();
    let expected = youla::lti::simulate(&system, record.as_ref(), &vec![0.0; n]).unwrap();
    let printed = output(python(), &["-c", PREDICT], &folder, "");
    let numbers: Vec<f64> = printed.split_whitespace().map(|v| v.parse().unwrap()).collect();
    assert_eq!(numbers.len(), samples * p);
    let miss = numbers.iter().enumerate().fold(0.0_f64, |e, (k, v)| e.max((v - expected[(k / p, k % p)]).abs()));
    assert!(miss < 1e-11 * expected.norm_max(), "{miss:.1e}");
}

#[test]
#[ignore = "needs octave-cli with the package control"]
fn octave_sees_the_same_numbers() {
    for (name, system) in models() {
        let folder = written(&format!("{name}-octave"), &system);
        let found = output("octave-cli", &["--no-gui", "--norc", "--eval", OCTAVE], &folder, "");
        assert_eq!(found.trim(), "same octave", "{name}");
    }
}
