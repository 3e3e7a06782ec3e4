//! Modes as text.

use super::words::{NONE, short};
use youla::lti::Mode;

/// Damping ratio from which on a pair of poles is no oscillation that a record would show.
const DAMPED: f64 = 0.5;

/// `209.7 (0.102), 217.6 (0.082)`, those below a frequency.
pub(super) fn oscillations(modes: &[Mode], below: f64) -> String {
    let pairs = modes.iter().filter(|m| m.pole.im != 0.0 && m.zeta < DAMPED && m.hz < below);
    listed(pairs.map(|m| format!("{} ({})", short(m.hz, 4), short(m.zeta, 2))).collect())
}

/// Frequencies of the real poles below one. Faster discrete poles are a delay, or lie beyond what samples can show.
pub(super) fn real_poles(modes: &[Mode], below: f64) -> String {
    listed(modes.iter().filter(|m| m.pole.im == 0.0 && m.hz < below).map(|m| short(m.hz, 4)).collect())
}

fn listed(found: Vec<String>) -> String {
    if found.is_empty() { NONE.into() } else { found.join(", ") }
}
