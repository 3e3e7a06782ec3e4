//! Two degrees of freedom: the path from the reference, where it is another than that from the output.
//!
//! ```text
//! R u = T r - S y + R d = S (r - y) + (T - S) r + R d        negative feedback
//! ```
//! `(T - S) / R r` is one more known signal at the plant input: a computed channel beside the excitation d. A root at 1 that T - S and R
//! share is left out, so that an integrator does not ramp.

use super::RunSettings;
use super::controller::{ControllerSettings, cascade_path};
use super::data::DataSettings;
use super::feedback::Feedback;
use youla_io::ChannelSpec;

/// Sum of coefficients over the sum of their magnitudes that is zero but for rounding.
const ROUNDING: f64 = 1e-9;

/// Name of the computed excitation of the first input.
const EXCITATION: &str = "reference_path_1";

const KEY: &str = "[controller.difference_equation] reference_numerator";

impl RunSettings {
    /// The same settings with the path from the reference as a known excitation of the inputs.
    ///
    /// # Errors
    /// What the path lacks, in a sentence.
    pub(super) fn with_reference_path(mut self) -> Result<Self, String> {
        self.state_cascade()?;
        let ControllerSettings::DifferenceEquation { feedback, numerator, denominator, delay, reference_numerator } =
            &mut self.controller
        else {
            return Ok(self);
        };
        let data = &mut self.data;
        let Some(path) = reference_numerator.clone().filter(|_| !data.has_reference_path()) else { return Ok(self) };
        let (m, p) = numerator.shape();
        if path.shape() != (m, p) {
            let (rows, columns) = path.shape();
            return Err(format!("{KEY} has {rows} x {columns} entries, but numerator has {m} x {p}"));
        }
        if data.reference.len() != p || data.inputs.len() != m {
            let (r, u) = (data.reference.len(), data.inputs.len());
            return Err(format!(
                "{KEY} has {m} x {p} entries, but [data] has {u} inputs and {r} reference channels: name a reference for each output"
            ));
        }
        if !data.input_excitation.is_empty() && data.input_excitation.len() != m {
            return Err(format!("{KEY} needs as many input_excitation channels as inputs, {m}, or none"));
        }
        let (own, other, common) = (numerator.spread(m, p), path.spread(m, p), denominator.spread(m, p));
        // With positive feedback K (y - r) the reference enters with the other sign.
        let sign = if *feedback == Feedback::Negative { -1.0 } else { 1.0 };
        let mut excitation = Vec::with_capacity(m);
        for j in 0..m {
            let mut terms = Vec::new();
            for i in 0..p {
                let (b, a) = filter(&other[j][i], &own[j][i], &common[j][i], sign)
                    .ok_or_else(|| format!("{KEY} and numerator have other sums of their coefficients from reference {} to input {}, and the denominator has an integrator: the signal from the reference alone would ramp. Make the sums equal, as they are in a controller whose output settles", i + 1, j + 1))?;
                if b.iter().any(|b| *b != 0.0) {
                    let name = format!("reference_path_{}_{}", j + 1, i + 1);
                    let b = [vec![0.0; *delay], b].concat();
                    let text = format!("filter('{}', {b:?}, {a:?})", data.reference[i].source());
                    data.computed.insert(name.clone(), text);
                    terms.push(name);
                }
            }
            let logged = data.input_excitation.get(j);
            terms.extend(logged.map(|d| format!("'{}'", d.source())));
            let (name, unit) = match logged {
                Some(d) => (format!("{} and path of the reference", d.name), d.unit.clone()),
                None => (format!("path of the reference to {}", data.inputs[j].name), data.inputs[j].unit.clone()),
            };
            let sum = format!("reference_path_{}", j + 1);
            let text = if terms.is_empty() { "0".into() } else { terms.join(" + ") };
            data.computed.insert(sum.clone(), text);
            excitation.push(ChannelSpec::from(name, youla_io::ChannelRef::Name(sum), unit));
        }
        data.input_excitation = excitation;
        Ok(self)
    }

    /// A cascade with a reference as the difference equation that it is.
    fn state_cascade(&mut self) -> Result<(), String> {
        let ControllerSettings::Cascade(cascade) = &self.controller else { return Ok(()) };
        let (u, y, r) = (self.data.inputs.len(), self.data.outputs.len(), self.data.reference.len());
        if (u, y) != (1, 1) || r > 1 {
            return Err(format!(
                "[controller.cascade] is from one position to one input, but [data] has {u} inputs, {y} outputs and {r} reference channels"
            ));
        }
        if r == 0 {
            return Ok(());
        }
        let ts = self.data.sample_time.filter(|ts| *ts > 0.0 && ts.is_finite()).ok_or(
            "[data] has no sample_time, on which the path from the reference of [controller.cascade] depends: state it, \
             in seconds, beside time_column",
        )?;
        if let Some(problem) = cascade.problem() {
            return Err(problem);
        }
        self.controller = cascade_path(cascade, ts, true);
        Ok(())
    }
}

impl DataSettings {
    /// Whether the path from the reference is an excitation of the inputs already.
    pub(super) fn has_reference_path(&self) -> bool {
        self.computed.contains_key(EXCITATION)
    }
}

/// `(T + sign S) / R` without the roots at 1 that both share; `None` where R has one that is left.
fn filter(t: &[f64], s: &[f64], r: &[f64], sign: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let at = |c: &[f64], k: usize| c.get(k).copied().unwrap_or(0.0);
    let mut b: Vec<f64> = (0..t.len().max(s.len())).map(|k| at(t, k) + sign * at(s, k)).collect();
    let mut a = r.to_vec();
    let size = |c: &[f64]| c.iter().map(|c| c.abs()).sum::<f64>();
    let scale = size(t) + size(s);
    let vanishes = |c: &[f64], scale: f64| c.iter().sum::<f64>().abs() <= ROUNDING * scale;
    while a.len() > 1 && vanishes(&a, size(&a)) {
        if !vanishes(&b, scale) {
            return None;
        }
        (a, b) = (without_root(&a), without_root(&b));
    }
    if size(&b) <= ROUNDING * scale {
        b = vec![0.0];
    }
    Some((b, a))
}

/// The quotient by `1 - z^-1`.
fn without_root(c: &[f64]) -> Vec<f64> {
    let sums = c.iter().scan(0.0, |sum, c| {
        *sum += c;
        Some(*sum)
    });
    let quotient: Vec<f64> = sums.take(c.len().saturating_sub(1)).collect();
    if quotient.is_empty() { vec![0.0] } else { quotient }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::records_in_memory;
    use std::path::Path;
    use youla::Mat;
    use youla::lti::Discrete;
    use youla::signal::{Channel, Record};

    fn text_of(keys: &str) -> String {
        format!(
            "name = \"rst\"\n[data]\nsample_time = 0.1\ninputs = [{{ name = \"u\" }}]\noutputs = [{{ name = \"y\" }}]\n\
             reference = [{{ name = \"r\" }}]\n[[data.estimation]]\nfile = \"log.csv\"\n\
             [nominal.transfer_function]\ndomain = \"discrete\"\nnumerator = [1.0]\ndenominator = [1.0, -0.9]\n\
             [controller.difference_equation]\nfeedback = \"negative\"\n{keys}"
        )
    }

    fn settings(keys: &str) -> crate::Result<RunSettings> {
        RunSettings::parse(&text_of(keys), Path::new("run.toml"))
    }

    /// `u = I(r - y) + P (b r - y)`: the integrator cancels, and the known signal is `P (b - 1) r`.
    #[test]
    fn the_weight_of_a_set_point_is_a_known_signal_that_does_not_ramp() {
        let keys = "numerator = [2.3, -2.0]\ndenominator = [1.0, -1.0]\nreference_numerator = [0.9, -0.6]\n";
        let chosen = settings(keys).unwrap();
        let column = |values: [f64; 20]| values.to_vec();
        let r: Vec<f64> = (0..20).map(|k| if k < 5 { 0.0 } else { 1.0 }).collect();
        let all = [column([0.0; 20]), column([0.0; 20]), r.clone()];
        let data = Mat::from_fn(20, 3, |k, j| all[j][k]);
        let channels = ["u", "y", "r"].map(|name| Channel::new(name, "")).to_vec();
        let log = Record::new("log", channels, data, Discrete::new(0.1).unwrap()).unwrap();
        let mut none = chosen.data.clone();
        none.detrend = youla::signal::Detrend::None;
        let records = records_in_memory(&none, vec![log]).unwrap();
        let d = records.estimation[0].input_excitation().unwrap();
        for k in 0..20 {
            assert!((d[(k, 0)] + 1.4 * r[k]).abs() < 1e-12, "row {k}: {}", d[(k, 0)]);
        }
        // Checked once more they stay as they are.
        assert_eq!(chosen.clone().checked().unwrap(), chosen);
    }

    /// A cascade with integrators in both loops has a known signal that does not ramp; without a sample time its path is refused.
    #[test]
    fn a_cascade_is_a_difference_equation_with_a_path_of_the_reference() {
        let keys = "discretisation = \"backward-euler\"\nposition = { kp = 8.0, ki = 1.0 }\nvelocity = { kp = 0.5, ki = 3.0 }\n\
                    velocity_feedforward = 0.5\n";
        let form = |text: &str| text.replace("difference_equation", "cascade");
        let text = form(&text_of(keys));
        let chosen = RunSettings::parse(&text, Path::new("run.toml")).unwrap();
        assert!(matches!(chosen.controller, ControllerSettings::DifferenceEquation { .. }));
        // T - S = Bv Ap (0.5 - 1) (1 - q), the denominator is Ap Av ts, Ap = Av = 1 - q: what is left is -0.5 Bv / ts.
        let path = &chosen.data.computed["reference_path_1_1"];
        let inside = path.strip_prefix("filter('r', [").and_then(|p| p.strip_suffix("])")).unwrap();
        let numbers: Vec<f64> = inside.replace("], [", ", ").split(", ").map(|c| c.parse().unwrap()).collect();
        let expected = [-0.4, 0.25, 0.0, 0.0, 0.1, 0.0];
        assert!(numbers.iter().zip(expected).all(|(c, e)| (c - e).abs() < 1e-13), "{path}");
        let without = text.replace("sample_time = 0.1", "time_column = \"t\"");
        let error = RunSettings::parse(&without, Path::new("run.toml")).unwrap_err().to_string();
        assert!(error.contains("sample_time") && error.contains("[controller.cascade]"), "{error}");
    }

    #[test]
    fn a_path_that_would_ramp_is_refused_by_name() {
        let keys = "numerator = [2.3, -2.0]\ndenominator = [1.0, -1.0]\nreference_numerator = [0.9, -0.7]\n";
        let error = settings(keys).unwrap_err().to_string();
        assert!(error.contains("reference_numerator") && error.contains("would ramp"), "{error}");
    }
}
