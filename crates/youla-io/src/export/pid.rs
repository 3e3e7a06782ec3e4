//! A PID for the machine that runs it: as a difference equation in IEC 61131-3 structured text and in C99, and its gains in the forms in which
//! they are typed in, each with its equation and units. Negative feedback throughout, `e = r - y`:
//!
//! ```text
//! i = i + i0 e + i1 e1          d = d1 d + d0 (e - e1)          v = kp e + i + d          e1 = e
//! each notch: o = b0 v + s1     s1 = b1 v - a1 o + s2           s2 = b2 v - a2 o          v = o
//! ```

use super::pid_tables::{Firmware, table};
use super::text::{PROGRAM, number, plain};
use crate::error::Result;
use std::fmt::Write;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;

/// A PID with notches, and what is known of its channels.
#[derive(Debug, Clone, PartialEq)]
pub struct PidExport {
    /// Name of its functions: `pid`, and `pid_2` for the second of several loops.
    pub name: String,
    /// The output of the plant.
    pub measured: Channel,
    /// The input of the plant.
    pub commanded: Channel,
    /// Sample time, seconds.
    pub ts: f64,
    /// Proportional gain.
    pub kp: f64,
    /// Integral gain, per second.
    pub ki: f64,
    /// Derivative gain, seconds.
    pub kd: f64,
    /// Time constant of the filter of the derivative, seconds.
    pub derivative_filter: f64,
    /// Tustin's rule; backward differences otherwise.
    pub tustin: bool,
    /// Coefficients `i0`, `i1` of the integral.
    pub integral: [f64; 2],
    /// Coefficients `d0`, `d1` of the derivative.
    pub derivative: [f64; 2],
    /// Frequency in Hz, width and depth of each notch, with `[b0, b1, b2]` and `[1, a1, a2]`.
    pub notches: Vec<([f64; 3], [[f64; 3]; 2])>,
    /// Dead time in samples that the machine has beside this code.
    pub delay: usize,
    /// Time constant of a filter of the reference that keeps the overshoot of a step to 10 %, seconds; zero for none.
    pub reference_filter: f64,
    /// The model, where it has one input and one output: on it a filter of another order is judged.
    pub plant: Option<StateSpace<Discrete>>,
    /// Weights of the reference in the proportional and in the derivative part with which this overshoot holds.
    pub reference_weights: [f64; 2],
    /// Where it comes from.
    pub origin: String,
}

/// The form in which a PID is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PidForm {
    /// C99 header.
    C,
    /// IEC 61131-3 structured text.
    StructuredText,
    /// Gains for parameter tables.
    Gains,
    /// Parameters of a firmware.
    Firmware(Firmware),
}

impl PidForm {
    /// All forms.
    pub const ALL: [PidForm; 7] = [
        PidForm::C,
        PidForm::StructuredText,
        PidForm::Gains,
        PidForm::Firmware(Firmware::Betaflight),
        PidForm::Firmware(Firmware::Px4),
        PidForm::Firmware(Firmware::ArduPilot),
        PidForm::Firmware(Firmware::Odrive),
    ];

    /// The word of `youla export --to`.
    pub fn key(self) -> &'static str {
        match self {
            PidForm::C => "c-pid",
            PidForm::StructuredText => "st",
            PidForm::Gains => "gains",
            PidForm::Firmware(firmware) => firmware.key(),
        }
    }

    /// Of its file.
    pub fn extension(self) -> &'static str {
        match self {
            PidForm::C => "h",
            PidForm::StructuredText => "st",
            PidForm::Gains | PidForm::Firmware(_) => "txt",
        }
    }
}

/// The text of a PID in a form.
///
/// # Errors
/// [`crate::Error::NotAModel`] for gains that a firmware cannot hold.
pub fn export_pid(pid: &PidExport, form: PidForm) -> Result<String> {
    Ok(match form {
        PidForm::C => c(pid),
        PidForm::StructuredText => structured_text(pid),
        PidForm::Gains => gains(pid),
        PidForm::Firmware(firmware) => table(pid, &head(pid), firmware)?,
    })
}

/// `b r - y` for a weight b of the reference.
pub fn weighted_error(weight: f64) -> String {
    match weight {
        0.0 => "-y".into(),
        1.0 => "r - y".into(),
        _ => format!("{} r - y", number(weight)),
    }
}

/// What every form says of itself, a line each.
fn head(pid: &PidExport) -> Vec<String> {
    let unit = |c: &Channel| if c.unit.is_empty() { "its unit".to_owned() } else { plain(&c.unit) };
    let mut lines = vec![
        format!(
            "PID from {} to {}, by {PROGRAM} from {}",
            plain(&pid.measured.name),
            plain(&pid.commanded.name),
            plain(&pid.origin)
        ),
        format!(
            "e = r - y in {}, u in {}, called every {} s",
            unit(&pid.measured),
            unit(&pid.commanded),
            number(pid.ts)
        ),
        format!("integral and derivative by {}", if pid.tustin { "Tustin's rule" } else { "backward differences" }),
        "no limit of u and no anti-windup in it: they are the machine's, and were not in the design".to_owned(),
    ];
    if pid.reference_filter > 0.0 {
        let by = number(pid.ts / (pid.ts + pid.reference_filter));
        lines.push(format!(
            "a filter of the reference, w = w + {by} (r - w) and w in the place of r, keeps the overshoot of a step to 10 %; it is not in this code"
        ));
    }
    let [b, c] = pid.reference_weights;
    if [b, c] != [1.0; 2] {
        lines.push(format!(
            "steps of the reference come out as promised where kp takes {} and kd {}, as in the running controller",
            weighted_error(b),
            weighted_error(c)
        ));
    }
    if pid.delay > 0 {
        lines.push(format!("the dead time of {} samples is the machine's and not in it", pid.delay));
    }
    lines
}

/// The assignments of a sample, `=` between the sides; names of states have a prefix.
fn statements(pid: &PidExport, state: &str) -> Vec<String> {
    let n = number;
    let [(i0, i1), (d0, d1)] = [pid.integral, pid.derivative].map(|[a, b]| (a, b));
    let mut lines = vec![
        format!("{state}i = {state}i + {} * e + {} * {state}e1", n(i0), n(i1)),
        format!("{state}d = {} * {state}d + {} * (e - {state}e1)", n(d1), n(d0)),
        format!("v = {} * e + {state}i + {state}d", n(pid.kp)),
        format!("{state}e1 = e"),
    ];
    for (k, (_, [b, a])) in pid.notches.iter().enumerate() {
        let [s1, s2] = [1, 2].map(|j| format!("{state}n{k}s{j}"));
        lines.extend([
            format!("o = {} * v + {s1}", n(b[0])),
            format!("{s1} = {} * v - {} * o + {s2}", n(b[1]), n(a[1])),
            format!("{s2} = {} * v - {} * o", n(b[2]), n(a[2])),
            "v = o".to_owned(),
        ]);
    }
    lines
}

/// The names of the states.
fn states(pid: &PidExport) -> Vec<String> {
    let notch = |k: usize| [1, 2].map(|j| format!("n{k}s{j}"));
    let own = ["i", "d", "e1"].map(str::to_owned).into_iter();
    own.chain((0..pid.notches.len()).flat_map(notch)).collect()
}

fn c(pid: &PidExport) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    for line in head(pid) {
        let _ = writeln!(text, "/* {line} */");
    }
    let names = states(pid).join(", ");
    let (name, guard) = (&pid.name, format!("YOULA_{}_H", pid.name.to_uppercase()));
    let _ = writeln!(
        text,
        "#ifndef {guard}\n#define {guard}\n#ifndef YOULA_REAL\n#define YOULA_REAL double\n#endif\n\n\
         /* All zero at the start. */\ntypedef struct {{ YOULA_REAL {names}; }} {name}_state;\n\n\
         static YOULA_REAL {name}_step({name}_state *s, YOULA_REAL r, YOULA_REAL y)\n{{\n    const YOULA_REAL e = r - y;"
    );
    text.push_str(if pid.notches.is_empty() { "    YOULA_REAL v;\n" } else { "    YOULA_REAL v, o;\n" });
    for line in statements(pid, "s->") {
        let _ = writeln!(text, "    {line};");
    }
    text.push_str("    return v;\n}\n#endif\n");
    text
}

fn structured_text(pid: &PidExport) -> String {
    let mut text = String::new();
    for line in head(pid) {
        let _ = writeln!(text, "(* {} *)", line.replace("(*", "( *").replace("*)", "* )"));
    }
    let names = states(pid).join(", ");
    let _ = writeln!(
        text,
        "FUNCTION_BLOCK YOULA_{}\nVAR_INPUT\n    r, y : LREAL;\nEND_VAR\nVAR_OUTPUT\n    u : LREAL;\nEND_VAR\nVAR\n    {names}, e, v, o : LREAL;\nEND_VAR",
        pid.name.to_uppercase()
    );
    text.push_str("e := r - y;\n");
    for line in statements(pid, "") {
        let _ = writeln!(text, "{};", line.replacen(" = ", " := ", 1));
    }
    text.push_str("u := v;\nEND_FUNCTION_BLOCK\n");
    text
}

fn gains(pid: &PidExport) -> String {
    let PidExport { kp, ki, kd, derivative_filter: filter, ts, .. } = *pid;
    let mut text = head(pid).iter().map(|line| format!("# {line}\n")).collect::<String>();
    let mut section = |title: &str, equation: &str, values: &[(&str, f64, &str)]| {
        let _ = writeln!(text, "\n{title}\n  {equation}");
        for (name, value, unit) in values {
            let _ = writeln!(text, "  {name} = {} {unit}", number(*value));
        }
    };
    let parallel = [("kp", kp, ""), ("ki", ki, "1/s"), ("kd", kd, "s"), ("filter", filter, "s")];
    section("parallel", "u = kp e + ki integral of e + kd s/(1 + filter s) e", &parallel);
    if kp != 0.0 {
        let ideal = [
            ("kp", kp, ""),
            ("ti", kp / ki, "s (inf: no integral part)"),
            ("td", kd / kp, "s"),
            ("filter", filter, "s"),
        ];
        section("ideal", "u = kp (e + 1/ti integral of e + td s/(1 + filter s) e)", &ideal);
    }
    // kp = k (1 + td/ti), ki = k/ti, kd = k td; with the filter on the derivative alone the zeros are those without it.
    let root = kp * kp - 4.0 * ki * kd;
    if ki != 0.0 && filter == 0.0 && root >= 0.0 {
        let k = 0.5 * (kp + kp.signum() * root.sqrt());
        section(
            "series",
            "u = k (1 + 1/(ti s)) (1 + td s) e",
            &[("k", k, ""), ("ti", k / ki, "s"), ("td", kd / k, "s")],
        );
    }
    let method = if pid.tustin { "Trapezoidal" } else { "BackwardEuler" };
    let _ = writeln!(
        text,
        "\nMATLAB\n  C = pid({}, {}, {}, {}, {}, 'IFormula', '{method}', 'DFormula', '{method}')",
        number(kp),
        number(ki),
        number(kd),
        number(filter),
        number(ts)
    );
    let block = if pid.tustin { "Trapezoidal" } else { "Backward Euler" };
    let _ = writeln!(
        text,
        "\nSimulink, Discrete PID Controller, form Parallel, integrator and filter method {block}, sample time {}",
        number(ts)
    );
    let _ = writeln!(text, "  P = {}\n  I = {}\n  D = {}", number(kp), number(ki), number(kd));
    match filter > 0.0 {
        true => {
            let _ = writeln!(text, "  N = {} (1/filter)", number(1.0 / filter));
        }
        false => text.push_str("  filtered derivative: off\n"),
    }
    for ([hz, width, depth], [b, a]) in &pid.notches {
        let _ = writeln!(
            text,
            "\nnotch behind the PID at {} Hz, width {}, depth {}\n  numerator in z^-1 = {b:?}\n  denominator in z^-1 = {a:?}",
            number(*hz),
            number(*width),
            number(*depth)
        );
    }
    text
}
