//! Which columns of a text file become which channels.

use crate::assemble::assemble;
use crate::choose::{ChannelRef, ChannelSpec};
use crate::error::{Error, Result};
use crate::time::TimeSource;
use std::path::Path;
use youla::signal::{Channel, Record};

/// Columns of the file and the channels they become.
pub(super) struct Plan {
    pub(super) channels: Vec<Channel>,
    /// Indices of the channels and, last, of the time column.
    pub(super) columns: Vec<usize>,
    pub(super) timed: bool,
}

impl Plan {
    pub(super) fn new(path: &Path, names: &[String], specs: &[ChannelSpec], time: &TimeSource) -> Result<Plan> {
        let what = path.display().to_string();
        let index = |reference: &ChannelRef| reference.index(&what, names);
        let clock = time.column.as_ref().map(index).transpose()?;
        let mut plan = Plan { channels: Vec::new(), columns: Vec::new(), timed: clock.is_some() };
        for spec in specs {
            plan.channels.push(Channel::new(&spec.name, &spec.unit));
            plan.columns.push(index(&spec.source())?);
        }
        if specs.is_empty() {
            plan.columns = (0..names.len()).filter(|&j| Some(j) != clock).collect();
            plan.channels = plan.columns.iter().map(|&j| Channel::new(&names[j], "")).collect();
        }
        if plan.channels.is_empty() {
            return Err(Error::NoData { path: path.to_owned(), problem: "there is no column besides the time" });
        }
        plan.columns.extend(clock);
        Ok(plan)
    }

    pub(super) fn assemble(self, path: &Path, time: &TimeSource, mut columns: Vec<Vec<f64>>) -> Result<Vec<Record>> {
        let what = path.display().to_string();
        let times = if self.timed { columns.pop() } else { None };
        let clock = time.resolve(&what, times.as_deref())?;
        assemble(&what, self.channels, &columns, clock)
    }
}
