//! The finding on a controller.

use super::{CONTAINED, Change, ControllerCheck, Parts};
use crate::check::finding::{Finding, Severity, Test, few};
use crate::check::options::CheckOptions;
use crate::error::Error;
use youla::signal::Channel;

/// Share of the input below which what the controller does not explain is rounding of a log with six digits.
/// Chosen, not measured.
const NO_EXCITATION: f64 = 1e-5;

/// What to do where a reference moves that may enter by a path of its own.
const PATH: &str = "If the reference enters by another path than the output (two degrees of freedom, feedforward), declare it: \
                    reference_numerator in [controller.difference_equation]";

/// Factors that are known from units: degrees and radians, revolutions, thousands.
const UNITS: [(f64, &str); 4] = [
    (57.295_779_513_082_32, "180 / pi, degrees against radians"),
    (std::f64::consts::TAU, "2 pi, revolutions against radians"),
    (1e3, "1000, milli"),
    (1e6, "1e6, micro"),
];

impl Change {
    fn words(&self, inputs: &[Channel], outputs: &[Channel]) -> String {
        let input = |i: usize| inputs.get(i).map_or("an input", |c| c.name.as_str());
        let name = |i: usize| outputs.get(i).map_or("an output", |c| c.name.as_str());
        let rows = |rows: isize| if rows > 0 { "later" } else { "earlier" };
        let unit = |gain: f64| {
            let of = |factor: f64| (gain / factor - 1.0).abs() < 0.02 || (gain * factor - 1.0).abs() < 0.02;
            UNITS.iter().find(|(factor, _)| of(*factor)).map_or(String::new(), |(_, text)| format!(" ({text}?)"))
        };
        match self {
            Change::Sign => {
                "the opposite sign: change `feedback` in [controller] between \"negative\" and \"positive\", or the sign of the outputs".into()
            }
            Change::Roles => format!("inputs and outputs exchanged: {} was measured and {} was applied", input(0), name(0)),
            Change::InputSign => "the opposite sign of the input".into(),
            Change::ExchangedInputs(i, j) => format!("{} and {} exchanged", input(*i), input(*j)),
            Change::Trend => "a linear trend of the outputs added: one of them drifts in the log".into(),
            Change::Shift(by) => {
                let delay = if *by > 0 { "larger" } else { "smaller" };
                let samples = if by.abs() == 1 { "one sample".into() } else { format!("{} samples", by.abs()) };
                format!("the outputs (and references) {samples} {} against the input, or `delay` {samples} {delay}", rows(*by))
            }
            Change::InputShift(by) => {
                let delay = if *by > 0 { "larger" } else { "smaller" };
                let only = "where no excitation enters at the input";
                format!("the input one sample {} against all other channels, or, {only}, `delay` one sample {delay}", rows(-*by))
            }
            Change::Gain(gain) => format!("{} times the gain{}", few(*gain), unit(*gain)),
            Change::ChannelGain(i, gain) => format!("{} times {}{}", few(*gain), name(*i), unit(*gain)),
            Change::ReferenceGain(i, gain) => format!("{} times the reference of {}{}", few(*gain), name(*i), unit(*gain)),
            Change::InputGain(i, gain) => format!("{} times {}{}", few(*gain), input(*i), unit(*gain)),
            Change::ExcitationGain(i, gain) => format!("{} times the excitation of {}{}", few(*gain), input(*i), unit(*gain)),
            Change::Part(key, value) => {
                // Of a PI a log shows ki times the sample time.
                let clock = if ["ki", "ti"].contains(&key.as_str()) { " (or, of a PI, `sample_time` by the same factor)" } else { "" };
                format!("{key} = {} in [controller]{clock}", few(*value))
            }
            Change::Exchanged(i, j) => format!("{} and {} exchanged", name(*i), name(*j)),
            Change::Saturation([low, high]) => format!("the input limited to {} ... {}", few(*low), few(*high)),
            Change::WithoutExcitation => "the excitation removed: the input was logged before it was added".into(),
            Change::ExcitationSign => "the opposite sign of the excitation".into(),
            Change::ReferenceAtInput => "the reference added at the input: declare it as input_excitation".into(),
            Change::ExcitationAtReference => "the excitation added at the output: declare it as reference".into(),
            Change::Reading(words) => words.clone(),
        }
    }

    /// Key in the numbers of a finding, with its value.
    fn number(&self) -> (&'static str, f64) {
        match self {
            Change::Sign => ("sign", -1.0),
            Change::InputSign => ("input_sign", -1.0),
            Change::Roles => ("exchanged_roles", 1.0),
            Change::ExchangedInputs(..) => ("exchanged_inputs", 1.0),
            Change::Trend => ("trend", 1.0),
            Change::Shift(rows) => ("shift", *rows as f64),
            Change::InputShift(rows) => ("input_shift", *rows as f64),
            Change::Gain(gain) => ("gain", *gain),
            Change::ChannelGain(_, gain) => ("channel_gain", *gain),
            Change::ReferenceGain(_, gain) => ("reference_gain", *gain),
            Change::InputGain(_, gain) => ("input_gain", *gain),
            Change::ExcitationGain(_, gain) => ("excitation_gain", *gain),
            Change::Part(_, value) => ("controller_gain", *value),
            Change::Exchanged(..) => ("exchanged", 1.0),
            Change::Saturation([_, high]) => ("saturation", *high),
            Change::WithoutExcitation => ("without_excitation", 1.0),
            Change::ExcitationSign => ("excitation_sign", -1.0),
            Change::ReferenceAtInput => ("reference_at_input", 1.0),
            Change::ExcitationAtReference => ("excitation_at_reference", 1.0),
            Change::Reading(_) => ("reading", 1.0),
        }
    }
}

impl ControllerCheck {
    pub(in crate::check) fn finding(
        &self,
        (record, first_row): (&str, usize),
        inputs: &[Channel],
        outputs: &[Channel],
        options: &CheckOptions,
    ) -> Option<Finding> {
        if !self.excited && !self.guided && self.residual < NO_EXCITATION {
            let what = format!(
                "the declared controller explains all but {} of the input: nothing but the controller moves the loop",
                few(self.residual)
            );
            let advice = "Excite the loop at the plant input or by a reference, and log it again: no plant can be told from such a log";
            let finding = Finding::new(Test::Excitation, Severity::Defect, record, what);
            return Some(finding.number("residual", self.residual).advice(advice));
        }
        if self.residual <= options.controller_caution && self.change.is_none() {
            let what = if self.residual < NO_EXCITATION {
                "the declared controller agrees with the log to rounding".to_owned()
            } else {
                let left = few(100.0 * self.residual);
                format!("the declared controller agrees with the log: it explains all but {left} % of the input")
            };
            return Some(
                Finding::new(Test::Controller, Severity::Note, record, what).number("residual", self.residual),
            );
        }
        let percent = if self.residual > 10.0 { "more than 1000".to_owned() } else { few(100.0 * self.residual) };
        if let Some(parts) = &self.parts {
            let [what, advice] = parts.words(first_row, &percent);
            // A controller that did run as declared, but not always, spoils no result.
            let severe = self.residual > options.controller_defect && matches!(parts, Parts::Scheduled(_));
            let severity = if severe { Severity::Defect } else { Severity::Caution };
            return Some(
                Finding::new(Test::Controller, severity, record, what)
                    .number("residual", self.residual)
                    .advice(&advice),
            );
        }
        let (severity, what) = match (&self.change, self.excited) {
            _ if self.residual.is_infinite() => (
                Severity::Defect,
                "the declared controller is not the one that ran: by itself it is unstable".to_owned(),
            ),
            (None, false) => {
                // What a declared reference leaves is a description that is not whole; without one the loop was moved by something else.
                let severe = self.guided && self.residual > options.controller_defect;
                let severity = if severe { Severity::Caution } else { Severity::Note };
                let path = if self.guided { "the reference enters by another path, " } else { "" };
                let what = format!(
                    "the declared controller does not explain {percent} % of the logged input: {path}an excitation is not declared, \
                     or the controller differs"
                );
                (severity, what)
            }
            _ => {
                let severe = self.residual > options.controller_defect;
                let severity = if severe { Severity::Defect } else { Severity::Caution };
                (severity, format!("the declared controller does not explain {percent} % of the logged input"))
            }
        };
        let advice = match &self.change {
            Some((change, left)) => {
                format!("The unexplained part falls to {} % with {}", few(100.0 * left), change.words(inputs, outputs))
            }
            None if self.contained.is_some_and(|share| share < CONTAINED) => format!(
                "The declared excitation is another signal than the one in the input: it explains {} % of what the controller leaves. \
                 Choose the column that is added to the input",
                few(100.0 * self.contained.unwrap_or(0.0))
            ),
            None if self.excited => format!(
                "Check for {}saturation, a delay, a different sample time or a different controller; no single change of sign, \
                 gain, shift or channel order explains it",
                if self.guided { "" } else { "a reference that is not declared, " }
            ),
            None if self.guided => "Log what else is added to the input".into(),
            None => "Log the excitation; without it the controller cannot be checked".into(),
        };
        let own_path = self.change.is_none() && self.guided;
        let advice = if own_path { format!("{advice}. {PATH}") } else { advice };
        let mut finding = Finding::new(Test::Controller, severity, record, what);
        if self.residual.is_finite() {
            finding = finding.number("residual", self.residual);
        }
        if let Some((change, left)) = &self.change {
            let (key, value) = change.number();
            finding = finding.number("residual_after", *left).number(key, value);
        }
        Some(finding.advice(&advice))
    }
}

/// The finding for a controller that could not be simulated.
pub(in crate::check) fn not_simulated(record: &str, error: &Error) -> Finding {
    let what = format!("the declared controller cannot be compared with the logged input: {error}");
    Finding::new(Test::Controller, Severity::Note, record, what)
        .advice("`youla identify` compares it with the log without simulating it (test of the controller). A pole next to 1 in place of an integrator \
             is the rounding of its coefficients: state more digits, or [controller.state_space]")
}
