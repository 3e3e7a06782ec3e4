//! The refusal of a run in which no method gives a model: the reason of each candidate, and what would help.

use crate::Error;
use youla::ErrorKind;
use youla::lti::Discrete;

/// A candidate as the user calls it, and why it gives no model.
type Reason = (&'static str, Error);

/// No method gives a model.
#[derive(Debug)]
pub struct NoModel {
    reasons: Vec<Reason>,
    remedies: Vec<String>,
}

impl NoModel {
    /// From the reasons of all candidates; `direct` says whether direct identification was among them.
    pub(crate) fn new(reasons: Vec<Reason>, direct: bool, time: Discrete) -> Self {
        let roots = || reasons.iter().filter_map(|(_, reason)| reason.root());
        let samples = roots().filter_map(|e| match e {
            youla::Error::TooFewSamples { needed, .. } => Some(*needed),
            _ => None,
        });
        let block_rows = roots().filter_map(|e| match e {
            youla::Error::InsufficientExcitation { block_rows, .. } => Some(*block_rows),
            _ => None,
        });
        let constant = roots().any(|e| matches!(e, youla::Error::ConstantChannel { .. }));
        let nyquist = four_digits(0.5 / time.ts());
        let length =
            samples.max().map(|n| format!("record at least {n} samples ({} s)", four_digits(n as f64 * time.ts())));
        // A multisine excites two orders with each line.
        let lines = block_rows.max().map(|s| {
            let lines = s.div_ceil(2);
            format!("excite every input at {lines} frequencies or more below {nyquist} Hz (`youla excite` makes such a sequence)")
        });
        let moving =
            constant.then(|| "check that the columns are the right ones and that every input moves".to_owned());
        let declared = (!direct)
            .then(|| "declare [direct] to try identification from u and y, which needs no nominal model".to_owned());
        let remedies = [length, lines, moving, declared].into_iter().flatten().collect();
        NoModel { reasons, remedies }
    }

    /// Bad input where every candidate says so.
    pub fn kind(&self) -> ErrorKind {
        let bad = self.reasons.iter().all(|(_, reason)| reason.kind() == ErrorKind::BadInput);
        if bad { ErrorKind::BadInput } else { ErrorKind::Numerical }
    }
}

impl std::fmt::Display for NoModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let reasons: Vec<String> = self.reasons.iter().map(|(name, reason)| format!("{name}: {reason}")).collect();
        write!(f, "no method gives a model ({})", reasons.join("; "))?;
        self.remedies.iter().try_for_each(|remedy| write!(f, "; {remedy}"))
    }
}

/// A figure to four significant digits, without zeros at the end.
fn four_digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn few(found: usize, needed: usize) -> Error {
        Error::Method(youla::Error::TooFewSamples { what: "the longest record".into(), found, needed })
    }

    #[test]
    fn every_candidate_gives_its_reason_and_the_message_says_what_helps() {
        let poor = youla::Error::InsufficientExcitation { what: "alpha".into(), block_rows: 21, rank: 4, needed: 21 };
        let reasons = vec![
            ("the recommended model", few(60, 90).within("[recommended]")),
            ("the modified Hansen scheme", Error::Method(poor).within("[hansen]")),
        ];
        let error = NoModel::new(reasons, false, Discrete::new(0.01).unwrap());
        let text = error.to_string();
        for part in [
            "the recommended model: [recommended]: the longest record: 60 samples are too few",
            "the modified Hansen scheme: [hansen]: alpha does not excite enough",
            "record at least 90 samples (0.9 s)",
            "excite every input at 11 frequencies or more below 50 Hz",
            "declare [direct]",
        ] {
            assert!(text.contains(part), "{part:?} in {text}");
        }
        assert_eq!(error.kind(), ErrorKind::BadInput);
    }

    #[test]
    fn a_failed_computation_of_one_candidate_is_no_bad_input() {
        let failed = Error::Method(youla::Error::NoConvergence { what: "the poles".into(), iterations: 30 });
        let reasons = vec![("the recommended model", few(60, 90)), ("direct identification", failed)];
        let error = NoModel::new(reasons, true, Discrete::new(0.01).unwrap());
        assert_eq!(error.kind(), ErrorKind::Numerical);
        assert!(!error.to_string().contains("declare [direct]"), "{error}");
    }
}
