//! What the paper leaves open, and what was chosen.

use super::words::{and, count, excitation, percent, short};
use crate::study::Paper;
use youla::identify::subspace::{Order, SubspaceOptions};
use youla::reduce::ReducedOrder;

/// One sentence each.
pub(super) fn choices(paper: &Paper) -> Vec<String> {
    let (rig, s) = (&paper.rig, &paper.settings);
    let subspace = |o: &SubspaceOptions| format!("{} and {} block rows", order(&o.order), o.horizon);
    let reduced = match s.reduction.order {
        ReducedOrder::Minimal => "the minimal order".into(),
        ReducedOrder::Fixed(n) => format!("order {n}"),
        ReducedOrder::Bound(bound) => format!("the fewest states for an error bound of {}", short(bound, 3)),
        ReducedOrder::ClosedLoop(limit) => {
            format!("the fewest states for a relative closed-loop error of {}", short(limit, 3))
        }
    };
    vec![
        format!("Sample time: {} s.", short(rig.timing.sample_time.value, 4)),
        format!(
            "Size of the noise: {} um rms, white; it leaves {} % as the best fit of the A x 0.97 column, where the paper has about 84 %.",
            short(rig.sensor.noise.value, 3),
            best_small(paper)
        ),
        format!(
            "Excitation: in the study {}, in the experiments {}, independent on both axes; the paper says a series of square \
             waves.",
            excitation(&s.study.excitation),
            excitation(&s.experiments.excitation)
        ),
        format!(
            "Lengths: {} and {} samples in the experiments, {} and {} in the study (identification and verification).",
            s.experiments.samples, s.experiments.verification_samples, s.study.samples, s.study.verification_samples
        ),
        "Weights of the controller, observer gain and what counts as stabilising: see the section on the controller.".into(),
        "Sign of the feedback: positive, u = K y, without which (15) does not hold.".into(),
        format!("Identification of S: {}; direct identification: {}.", subspace(&s.hansen), subspace(&s.direct)),
        format!("Reduction: {reduced} by {}.", s.reduction.method),
        format!(
            "Prediction error: output error by Levenberg-Marquardt with at most {}; several starts means factors on A of {}.",
            count(s.pem.max_iterations, "step", "steps"),
            and(&s.experiments.start_factors.iter().map(|f| short(*f, 3)).collect::<Vec<_>>())
        ),
        format!(
            "Failed identifications in Figures 4 and 5: drawn and counted, never dropped; theta from {} to {} as the paper says, \
             although theta = 1 leaves nothing of A.",
            short(s.study.theta[0], 3),
            short(s.study.theta[1], 3)
        ),
        "Units: the paper's units of K, D and B are wrong by 1e6 for its numbers; here they are 1/s^2, 1/s and um/(s^2 V).".into(),
        "Measure: the paper calls (26) R^2, but it is the normalised root mean square fit; it is called fit here.".into(),
        "Figures and Table 1 of the paper differ in places (61.04 and 61.94 % at 2500 rpm, 81.93 and 83.21 % for A x 0.97); the table \
         is used here."
            .into(),
    ]
}

fn order(order: &Order) -> String {
    match order {
        Order::Fixed(n) => format!("order {n}"),
        Order::Auto(max) => format!("an order of at most {max} chosen from the data"),
    }
}

/// The highest fit of the column with a small deviation.
fn best_small(paper: &Paper) -> String {
    let models = paper.experiments.list.iter().filter(|e| e.case.key == "small-deviation").flat_map(|e| &e.models);
    percent(models.flat_map(|m| m.fit).fold(f64::NAN, f64::max), 1)
}
