//! Q from beta to alpha.
//!
//! alpha acts on the loop of the plant with `J_K` and shows in `beta = S alpha`: `[u; y; beta] = T alpha`, one stable system of the order
//! of plant and controller. Q is the LQG controller of T that weighs u and y and measures beta. A disturbance at the plant input acts
//! nearly as alpha does, which gives the noise of the observer.

use super::lqg::observer_gain;
use super::{NewController, RedesignProblem, diagonal};
use crate::error::Result;
use youla::control::{LqrWeights, closed_loop, lqr, observer_controller};
use youla::lti::{Discrete, StateSpace, frequency_response};

/// LQG on T, weights as for F and L on the model; `deviation` is S.
pub(super) fn design(
    problem: &RedesignProblem<'_>,
    deviation: &StateSpace<Discrete>,
    weight: f64,
    output_noise: f64,
) -> Result<NewController> {
    let (m, p) = (problem.factors.inputs(), problem.factors.outputs());
    let whole = closed_loop(problem.plant, &problem.factors.j_k()?)?.part(0..m + 2 * p, 0..m).balanced()?;
    let (acted, seen) = (whole.part(0..m + p, 0..m), whole.part(m + p..m + 2 * p, 0..m));
    let sizes = problem.input_size.iter().map(|s| weight / (s * s));
    let outputs = diagonal(sizes.chain(problem.output_size.iter().map(|s| 1.0 / (s * s))));
    // alpha itself costs next to nothing: u = alpha + ... is weighed already.
    let inputs = diagonal(problem.input_size.iter().map(|s| COST_OF_ALPHA * weight / (s * s)));
    let f = lqr(&acted, &LqrWeights::on_outputs(&acted, outputs.as_ref(), inputs.as_ref())?)?.f;
    let disturbance = diagonal(problem.input_size.iter().map(|s| s * s));
    let noise = diagonal(noise_of_beta(problem, deviation)?.iter().map(|s| output_noise * s * s));
    let l = observer_gain(&seen, disturbance.as_ref(), noise.as_ref())?;
    let q = observer_controller(&seen, f.as_ref(), l.as_ref())?;
    let system = problem.factors.controller_of(&q)?;
    Ok(NewController { computed: system.clone(), system, gains: None, q: Some(q) })
}

/// Weight of alpha against that of u: only so large that the Riccati equation is regular.
const COST_OF_ALPHA: f64 = 1e-6;

/// Size of beta for outputs of their size: `beta = (Mt + S Ut) n` with the monic filter taken at its mean over frequency.
fn noise_of_beta(problem: &RedesignProblem<'_>, deviation: &StateSpace<Discrete>) -> Result<Vec<f64>> {
    let (m, p) = (problem.factors.inputs(), problem.factors.outputs());
    let filter = problem.factors.residual_filter(deviation)?.part(0..p, m..m + p);
    let nyquist = std::f64::consts::PI / filter.time().ts();
    let omega: Vec<f64> = (0..64).map(|k| nyquist * (f64::from(k) + 0.5) / 64.0).collect();
    let response = frequency_response(&filter, &omega)?;
    let row = |i: usize| {
        let power = |g: youla::MatRef<'_, youla::c64>| {
            problem.output_size.iter().enumerate().map(|(j, s)| g[(i, j)].norm_sqr() * s * s).sum::<f64>()
        };
        (response.iter().map(power).sum::<f64>() / omega.len() as f64).sqrt()
    };
    Ok((0..p).map(row).collect())
}
