//! Q from beta to alpha.
//!
//! alpha acts on the loop through the right factors of G(S), `[u; y] = [M + U S; N + V S] alpha`, and shows in `beta = S alpha`:
//! both are one stable system T with the outputs (u, y, beta). Q is the LQG controller of T that weighs u and y and measures
//! beta. A disturbance at the plant input acts nearly as alpha does, which gives the noise of the observer.

use super::lqg::observer_gain;
use super::{NewController, RedesignProblem, diagonal};
use crate::error::Result;
use youla::control::{LqrWeights, lqr, observer_controller};
use youla::factor::CoprimeFactors;
use youla::linalg::{block, eye};
use youla::lti::{Discrete, StateSpace, frequency_response};

/// LQG on T, weights as for F and L on the model.
pub(super) fn design(problem: &RedesignProblem<'_>, weight: f64, output_noise: f64) -> Result<NewController> {
    let (m, p) = (problem.factors.inputs(), problem.factors.outputs());
    let whole = responses(problem.factors, problem.deviation)?.balanced()?;
    let (acted, seen) = (whole.part(0..m + p, 0..m), whole.part(m + p..m + 2 * p, 0..m));
    let sizes = problem.input_size.iter().map(|s| weight / (s * s));
    let outputs = diagonal(sizes.chain(problem.output_size.iter().map(|s| 1.0 / (s * s))));
    // alpha itself costs next to nothing: u = alpha + ... is weighed already.
    let inputs = diagonal(problem.input_size.iter().map(|s| 1e-6 * weight / (s * s)));
    let f = lqr(&acted, &LqrWeights::on_outputs(&acted, outputs.as_ref(), inputs.as_ref())?)?.f;
    let disturbance = diagonal(problem.input_size.iter().map(|s| s * s));
    let noise = diagonal(noise_of_beta(problem)?.iter().map(|s| output_noise * s * s));
    let l = observer_gain(&seen, disturbance.as_ref(), noise.as_ref())?;
    let q = observer_controller(&seen, f.as_ref(), l.as_ref())?;
    Ok(NewController { system: problem.factors.controller_of(&q)?, gains: None, q: Some(q) })
}

/// T, from alpha to (u, y, beta).
fn responses(factors: &CoprimeFactors<Discrete>, s: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
    let (m, p, n) = (factors.inputs(), factors.outputs(), s.order());
    let zeros = |rows, columns| youla::Mat::<f64>::zeros(rows, columns);
    let c = block(&[&[zeros(m, n).as_ref()], &[s.c()], &[s.c()]]);
    let d = block(&[&[eye(m).as_ref()], &[s.d()], &[s.d()]]);
    let column = StateSpace::new(s.a().to_owned(), s.b().to_owned(), c, d, s.time())?;
    Ok(column.then(&factors.right().system().append(&StateSpace::gain(eye(p), s.time())?)?)?)
}

/// Size of beta for outputs of their size: `beta = (Mt + S Ut) n` with the monic filter taken at its mean over frequency.
fn noise_of_beta(problem: &RedesignProblem<'_>) -> Result<Vec<f64>> {
    let (m, p) = (problem.factors.inputs(), problem.factors.outputs());
    let filter = problem.factors.residual_filter(problem.deviation)?.part(0..p, m..m + p);
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
