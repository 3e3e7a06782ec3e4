//! What a mode could do to the loop above the frequencies at which the excitation shows the plant.

use super::Loops;
use super::limits::LARGEST_UNSEEN_GAIN;
use super::loop_ratio::LoopAt;
use crate::identify::likelihood::{Evidence, figure};
use crate::lti::largest_singular_value;
use crate::{Mat, c64};

/// The largest gain of the loop there, `sigma_max(G K (I - G K)^-1)`, with the frequency from which it counts; `None` where no frequency is shown, or
/// none lies above. A factor of G beyond one over it makes the loop unstable at some phase, and a model continues what it has.
///
/// `shown` says whether the excitation shows what each input does at a frequency in Hz; `sizes` are those of the outputs.
pub(super) fn beyond(loops: &Loops, shown: impl Fn(f64) -> bool, sizes: &[f64]) -> Option<Evidence> {
    let from = loops.at.iter().rposition(|at| shown(at.hz))?;
    // G K (I - G K)^-1 = S - I
    let of_loop = |at: &LoopAt| at.sensitivity(sizes) - Mat::<c64>::identity(sizes.len(), sizes.len());
    let gain = |at: &LoopAt| largest_singular_value(of_loop(at).as_ref()).unwrap_or(0.0);
    let above = loops.at[from + 1..].iter().map(|at| (gain(at), at.hz));
    let (largest, hz) = above.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let question =
        "Gain of the closed loop above the frequencies at which the excitation shows the plant (unseen gain)";
    let times = format!(
        "above {} Hz the model continues what it has; a mode of {} times its response would make the loop unstable",
        figure(loops.at[from].hz),
        figure(1.0 / largest)
    );
    Some(Evidence::new(question, largest, LARGEST_UNSEEN_GAIN).at([hz; 2]).reported().noted(times))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lti::{Discrete, StateSpace};

    /// `G K / (1 - G K)` of G = 0.2 and K = -1 is -1/6 above the last frequency shown; nothing is left above where all are.
    #[test]
    fn the_gain_counts_above_what_is_shown() {
        let of = |gain: f64| StateSpace::gain(Mat::from_fn(1, 1, |_, _| gain), Discrete::new(0.01).unwrap()).unwrap();
        let loops = Loops { at: LoopAt::all(&of(0.2), &of(-1.0), &[1.0, 10.0, 20.0]).unwrap() };
        let found = beyond(&loops, |hz| hz < 15.0, &[3.0]).unwrap();
        assert!((found.figure - 1.0 / 6.0).abs() < 1e-12 && !found.required, "{found}");
        assert!(found.note.contains("above 10 Hz") && found.note.contains("a mode of 6.00 times"), "{}", found.note);
        assert!(beyond(&loops, |_| true, &[3.0]).is_none() && beyond(&loops, |_| false, &[3.0]).is_none());
    }
}
