//! The found model in physical units, with its dead time as states.

use crate::Result;
use crate::identify::likelihood::choose::problem::Choice;
use crate::identify::likelihood::data::spectra::Sizes;
use crate::identify::likelihood::search::model::Model;
use crate::lti::{Discrete, StateSpace};
use faer::Mat;

/// `G(z) z^-d`: input j passes `d_j` states with poles at zero before it reaches B.
pub(crate) fn plant(choice: &Choice, sizes: &Sizes, time: Discrete) -> Result<StateSpace<Discrete>> {
    realised(&choice.found.point.model, &choice.delays, sizes, time)
}

/// The same of a model with its delays.
pub(crate) fn realised(model: &Model, delays: &[usize], sizes: &Sizes, time: Discrete) -> Result<StateSpace<Discrete>> {
    let (a, b, c) = model.matrices();
    let m = b.ncols();
    let d = Mat::from_fn(c.nrows(), m, |i, j| model.d[i * m + j]);
    let inverse = |sizes: &[f64]| sizes.iter().map(|s| 1.0 / s).collect::<Vec<f64>>();
    let found = StateSpace::new(a, b, c, d, time)?;
    delayed(&found.in_units(&inverse(&sizes.u), &inverse(&sizes.y)), delays)
}

/// The system with delayed inputs.
pub(crate) fn delayed(system: &StateSpace<Discrete>, delays: &[usize]) -> Result<StateSpace<Discrete>> {
    let (n, m, p) = (system.order(), system.inputs(), system.outputs());
    let extra: usize = delays.iter().sum();
    let (mut a, mut b) = (Mat::<f64>::zeros(n + extra, n + extra), Mat::<f64>::zeros(n + extra, m));
    let (mut c, mut d) = (Mat::<f64>::zeros(p, n + extra), system.d().to_owned());
    a.submatrix_mut(0, 0, n, n).copy_from(system.a());
    c.submatrix_mut(0, 0, p, n).copy_from(system.c());
    let mut at = n;
    for (j, delay) in delays.iter().copied().enumerate() {
        if delay == 0 {
            b.submatrix_mut(0, j, n, 1).copy_from(system.b().subcols(j, 1));
            continue;
        }
        // the oldest sample of the input stands at `at`, the newest enters at the end
        a.submatrix_mut(0, at, n, 1).copy_from(system.b().subcols(j, 1));
        c.submatrix_mut(0, at, p, 1).copy_from(system.d().subcols(j, 1));
        d.subcols_mut(j, 1).fill(0.0);
        (1..delay).for_each(|k| a[(at + k - 1, at + k)] = 1.0);
        at += delay;
        b[(at - 1, j)] = 1.0;
    }
    StateSpace::new(a, b, c, d, system.time())
}
