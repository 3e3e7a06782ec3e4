//! The end of a search by the clock: what is found until then is kept.

use crate::identify::likelihood::Evidence;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The time at which the search for a better order and dead time ends, and whether it ended one. Clones share the answer.
#[derive(Debug, Clone)]
pub(crate) struct Deadline {
    until: Instant,
    cut: Arc<AtomicBool>,
}

impl Deadline {
    /// From now on.
    pub(crate) fn after(seconds: u32) -> Self {
        Deadline { until: Instant::now() + Duration::from_secs(seconds.into()), cut: Arc::default() }
    }

    /// Whether the time is over; whoever asks leaves something out then.
    pub(crate) fn ends(&self) -> bool {
        let over = Instant::now() >= self.until;
        if over {
            self.cut.store(true, Ordering::Relaxed);
        }
        over
    }

    /// That the search was ended; `None` where it was not.
    pub(crate) fn evidence(&self) -> Option<Evidence> {
        let question = "The time limit ended the search for order and dead time (time limit; 1: it did)";
        let note = "the records may support a larger order: raise the limit";
        self.cut.load(Ordering::Relaxed).then(|| Evidence::new(question, 1.0, 0.0).reported().noted(note))
    }
}
