//! Flags that say what the columns of a log mean, for the verbs that work without a run.toml.

mod dialect;

pub(crate) use dialect::Dialect;

use clap::{Args, ValueEnum};
use youla_io::{ChannelRef, ChannelSpec};
use youla_run::Feedback;

/// Channels and clock of a log.
#[derive(Debug, Args)]
pub(crate) struct LogFlags {
    /// Inputs, by name or as #3 for the third column, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',', requires = "output")]
    pub(crate) input: Vec<ChannelRef>,
    /// Outputs, as the inputs.
    #[arg(long, value_name = "NAME", value_delimiter = ',', requires = "input")]
    pub(crate) output: Vec<ChannelRef>,
    /// Known excitation added at the plant input, one per input.
    #[arg(long, value_name = "NAME", value_delimiter = ',', requires = "input")]
    pub(crate) excitation: Vec<ChannelRef>,
    /// Known reference, one per output.
    #[arg(long, value_name = "NAME", value_delimiter = ',', requires = "input")]
    pub(crate) reference: Vec<ChannelRef>,
    /// Sample time in seconds.
    #[arg(long, value_name = "S", requires = "input", allow_negative_numbers = true)]
    pub(crate) sample_time: Option<f64>,
    /// Column with the time in seconds.
    #[arg(long, value_name = "NAME", requires = "input")]
    pub(crate) time: Option<ChannelRef>,
    #[command(flatten)]
    pub(crate) dialect: Dialect,
}

/// The places as they were meant: the comma of `u(:,1)` is none between two places.
pub(crate) fn places(given: &[ChannelRef]) -> Vec<ChannelRef> {
    let mut whole: Vec<ChannelRef> = Vec::new();
    let mut open: Option<String> = None;
    for part in given.iter().map(ChannelRef::to_string) {
        let text = open.take().map_or(part.clone(), |before| format!("{before},{part}"));
        if text.matches('(').count() > text.matches(')').count() {
            open = Some(text);
        } else {
            let Ok(place) = text.parse();
            whole.push(place);
        }
    }
    whole.extend(open.map(ChannelRef::Name));
    whole
}

/// Channels under the names by which they were given.
pub(crate) fn specs(chosen: &[ChannelRef]) -> Vec<ChannelSpec> {
    ChannelSpec::chosen(&places(chosen))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_comma_of_a_column_divides_nothing() {
        let given = |text: &str| text.split(',').map(|t| t.parse().unwrap()).collect::<Vec<ChannelRef>>();
        let names = |text: &str| places(&given(text)).iter().map(ChannelRef::to_string).collect::<Vec<_>>();
        assert_eq!(names("u(:,1),u(:,2),#3,y"), ["u(:,1)", "u(:,2)", "#3", "y"]);
        assert_eq!(names("a(b,c"), ["a(b,c"]);
    }
}

/// A sign of feedback on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Sign {
    /// u = K (r - y)
    Negative,
    /// u = K (y - r)
    Positive,
}

impl From<Sign> for Feedback {
    fn from(sign: Sign) -> Self {
        match sign {
            Sign::Negative => Feedback::Negative,
            Sign::Positive => Feedback::Positive,
        }
    }
}
