//! What a way without guarantees did to a sequence of frames.

/// How a frame came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// After the newest one, with so many missing in between.
    New {
        /// Frames that have not come.
        missing: u32,
    },
    /// One that was missing: reordered on the way.
    Late,
    /// One that has come before. Take nothing from it.
    Doubled,
    /// More than 63 frames behind the newest: late or doubled, which cannot be told apart. Take nothing from it.
    Stale,
}

/// Counts lost, doubled and reordered frames by their sequence numbers, over a window of 64.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tracker {
    newest: Option<u32>,
    /// Bit k: the frame k before the newest has come.
    seen: u64,
    /// Frames taken.
    pub taken: u64,
    /// Frames that have not come up to now.
    pub lost: u64,
    /// Frames that came again.
    pub doubled: u64,
    /// Frames that came after a later one.
    pub reordered: u64,
    /// Frames that came too late to be taken.
    pub stale: u64,
}

impl Tracker {
    /// Before the first frame: what was sent before it is not counted.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Frames that come from now on follow none of those before: the counts go on.
    pub fn restart(&mut self) {
        self.newest = None;
    }

    /// The next frame.
    pub fn receive(&mut self, sequence: u32) -> Arrival {
        let Some(newest) = self.newest else {
            (self.newest, self.seen) = (Some(sequence), 1);
            self.taken += 1;
            return Arrival::New { missing: 0 };
        };
        let ahead = sequence.wrapping_sub(newest);
        if ahead != 0 && ahead <= u32::MAX / 2 {
            self.newest = Some(sequence);
            self.seen = self.seen.checked_shl(ahead).unwrap_or(0) | 1;
            self.taken += 1;
            self.lost += u64::from(ahead - 1);
            return Arrival::New { missing: ahead - 1 };
        }
        let behind = newest.wrapping_sub(sequence);
        let Some(bit) = 1_u64.checked_shl(behind) else {
            self.stale += 1;
            return Arrival::Stale;
        };
        if self.seen & bit != 0 {
            self.doubled += 1;
            return Arrival::Doubled;
        }
        self.seen |= bit;
        self.taken += 1;
        self.reordered += 1;
        // A frame from before the first one was not counted as lost.
        self.lost = self.lost.saturating_sub(1);
        Arrival::Late
    }
}
