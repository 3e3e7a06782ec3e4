//! Flags that say what the columns of a log mean, for the verbs that work without a run.toml.

use crate::dialect::Dialect;
use clap::Args;
use youla_io::ChannelRef;

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
