//! `youla demo`: direct identification fails on the levitated mass, the Hansen scheme does not.

use crate::common::{empty_folder, youla};
use serde_json::Value;

/// exp(w Ts) of the levitated mass, w = 40 rad/s, Ts = 1 ms.
const POLE: f64 = 1.040_811;

fn summary(seed: u64) -> Value {
    let folder = empty_folder(&format!("levitation-{seed}"));
    let found = youla(&folder, &["demo", "--seed", &seed.to_string(), "--out", "run", "--json"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    serde_json::from_str(&found.stdout).expect("JSON")
}

/// Magnitudes of the poles outside of the unit circle.
fn unstable(method: &Value) -> Vec<f64> {
    let poles = method["poles"].as_array().expect("poles").iter();
    let part = |pole: &Value, k: usize| pole[k].as_f64().expect("a number");
    poles.map(|pole| part(pole, 0).hypot(part(pole, 1))).filter(|magnitude| *magnitude > 1.0).collect()
}

#[test]
fn only_the_scheme_finds_the_unstable_pole() {
    for seed in 1..=3 {
        let methods = &summary(seed)["methods"];
        let (direct, hansen) = (&methods["direct"], &methods["hansen"]);
        assert!(unstable(direct).is_empty(), "seed {seed}: the direct model {:?}", unstable(direct));
        let pole = unstable(hansen);
        assert!(pole.len() == 1 && (pole[0] - POLE).abs() < 2e-3, "seed {seed}: G(S) {pole:?}");
        let fit = |method: &Value| method["fit"]["verification"][0].as_f64().unwrap_or(f64::NEG_INFINITY);
        assert!(fit(hansen) > 65.0 && fit(direct) < 0.0, "seed {seed}: {} and {}", fit(hansen), fit(direct));
        assert_eq!(hansen["stabilised_by_controller"], true, "seed {seed}");
    }
}
