//! In which order the rows of the block-Hankel matrix are.

use crate::identify::subspace::SubspaceOptions;
use std::ops::Range;

/// In which order the rows of the block-Hankel matrix stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HankelLayout {
    /// `[U_f U_p Y_p Y_f]`.
    InputsFirst,
    /// `[z(k-p) ... z(k) ... z(k+f-1)]`, `z = [u; y]`.
    Chronological,
}

impl HankelLayout {
    /// From which the method of the options starts.
    pub(crate) fn of(options: &SubspaceOptions) -> Self {
        match options.method.is_for_closed_loops() {
            true => HankelLayout::Chronological,
            false => HankelLayout::InputsFirst,
        }
    }

    /// Places of all rows, counted from the oldest sample: (block row, channel of `[u; y]`) in one number.
    pub(crate) fn places(self, inputs: usize, outputs: usize, past: usize, horizon: usize) -> Vec<usize> {
        let (m, q) = (inputs, inputs + outputs);
        let block_rows = |rows: Range<usize>, channels: Range<usize>| {
            rows.flat_map(move |i| channels.clone().map(move |c| i * q + c))
        };
        let (before, after) = (0..past, past..past + horizon);
        match self {
            HankelLayout::Chronological => (0..(past + horizon) * q).collect(),
            HankelLayout::InputsFirst => block_rows(after.clone(), 0..m)
                .chain(block_rows(before.clone(), 0..m))
                .chain(block_rows(before, m..q))
                .chain(block_rows(after, m..q))
                .collect(),
        }
    }
}
