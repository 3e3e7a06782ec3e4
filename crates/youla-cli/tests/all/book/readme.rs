//! What README.md takes for granted: a log of a drive with a resonance under its controller, and the controller.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// A difference equation of order two: coefficients of z^-1 and z^-2 in numerator and denominator, and the last two outputs.
struct Second {
    b: [f64; 2],
    a: [f64; 2],
    x: [f64; 2],
}

impl Second {
    /// The output after the inputs of the last two samples.
    fn next(&mut self, u: [f64; 2]) -> f64 {
        let y = self.b[0] * u[0] + self.b[1] * u[1] - self.a[0] * self.x[0] - self.a[1] * self.x[1];
        self.x = [y, self.x[0]];
        y
    }
}

/// Writes `log.csv` (two minutes at 2 kHz) and `K.json`.
pub(crate) fn write_scene(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).expect("written");
    let mut text = String::from("t,r,d,u,y\n");
    for (k, [r, d, u, y]) in log(240_000).into_iter().enumerate() {
        let _ = writeln!(text, "{},{r},{d},{u},{y}", k as f64 * 5e-4);
    }
    write("log.csv", text.as_bytes());

    write("K.json", controller().as_bytes());
}

/// The controller of README.md, `u = K (y - r)`: numerator less D times the denominator in the output matrix.
fn controller() -> String {
    let ([d, n1, n2], [a1, a2]) = ([-5.50311, -0.27062, 5.23249], [-1.14636, 0.41698]);
    let (c1, c2) = (n1 - d * a1, n2 - d * a2);
    format!(r#"{{"ts": 5e-4, "a": [[{}, {}], [1, 0]], "b": [[1], [0]], "c": [[{c1}, {c2}]], "d": [[{d}]]}}"#, -a1, -a2)
}

/// `250 / (s^2 + 2 zeta w s + w^2)`, w = 54.7 Hz, zeta = 0.03, sampled every 0.5 ms.
fn spring() -> Second {
    Second { b: [3.106_636e-5, 3.095_967e-5], a: [-1.960_435_47, 0.989_742_27], x: [0.0; 2] }
}

/// r, d, u, y of `2500 / (s^2 + 20 s)` and a spring beside it under the controller of README.md.
fn log(samples: usize) -> Vec<[f64; 4]> {
    let mut body = Second { b: [3.1146e-4, 3.1042e-4], a: [-1.990_049_83, 0.990_049_83], x: [0.0; 2] };
    let mut spring = spring();
    let (mut u, mut command, mut error) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let mut noise = uniform();
    (0..samples)
        .map(|k| {
            let y = body.next(u) + spring.next(u) + 1e-4 * noise();
            let r = if k / 4000 % 2 == 1 { 1.0 } else { 0.0 };
            let d = 0.5 * noise();
            let past = 1.14636 * command[0] - 0.41698 * command[1];
            let now = 5.50311 * (r - y) + 0.27062 * error[0] - 5.23249 * error[1] + past;
            (error, command) = ([r - y, error[0]], [now, command[0]]);
            u = [now + d, u[0]];
            [r, d, u[0], y]
        })
        .collect()
}

/// Numbers between -1 and 1, from the linear congruence of Knuth's MMIX.
fn uniform() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
