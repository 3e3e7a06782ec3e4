//! One replicate of a parametric bootstrap: the loop of the recommended model and its noise is simulated with the known excitations,
//! and identified again.
//!
//! ```text
//! x+ = A x + B u + K e,  y = C x + D u + e,  e white;   u = K_c (y - r) + d,  or  u = J (y - r, alpha)
//! ```
//! A pure function of settings, records, seed and index; on one core.

use crate::failure::{Failure, Result};
use crate::logs::{Log, records};
use crate::matrices::matrix;
use crate::options::Options;
use crate::worker;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::path::Path;
use youla::control::with_input_port;
use youla::linalg::{block, eye};
use youla::lti::{Discrete, Partitioned, StateSpace, simulate};
use youla::signal::LoopRecord;
use youla::{Mat, MatRef};
use youla_run::{RunRecords, RunSettings, declared_loop, factorise_run, recommend_alone, records_in_memory};

/// Seed and index of a replicate.
type Draw = (u64, u64);

/// The row of a replicate as JSON. `predictor` holds A, B, C, D, K and the covariance of e.
#[pyfunction]
pub(crate) fn replicate(
    py: Python<'_>,
    chosen: Options,
    logs: Vec<Log<'_>>,
    predictor: [PyReadonlyArray2<'_, f64>; 6],
    draw: Draw,
) -> PyResult<String> {
    let chosen = chosen.settings()?;
    let logs = records(py, logs)?;
    let predictor = predictor.map(|m| matrix(&m));
    worker::run(py, true, move |_| {
        let records = records_in_memory(&chosen.data, logs)?;
        let again = simulated(&chosen, &records, &predictor, draw)?;
        let found = recommend_alone(&chosen, &again, Path::new("."))?;
        let (pairs, real): (Vec<_>, Vec<_>) = found.modes.iter().map(|m| m.mode).partition(|m| m.pole.im != 0.0);
        let modes: Vec<[f64; 2]> = pairs.iter().map(|m| [m.hz, m.zeta]).collect();
        let real_poles: Vec<f64> = real.iter().map(|m| m.pole.re).collect();
        let model = youla_io::SystemMatrices::new(&found.plant);
        let row = serde_json::json!({
            "order": found.order, "dead_time": found.dead_time, "modes": modes, "real_poles": real_poles,
            "ts": found.plant.time().ts(), "model": model,
        });
        Ok(row.to_string())
    })
}

/// The records with simulated inputs and outputs; nothing verifies them.
fn simulated(
    chosen: &RunSettings,
    records: &RunRecords,
    predictor: &[Mat<f64>; 6],
    (seed, index): Draw,
) -> Result<RunRecords> {
    let closed = closed(chosen, records, predictor)?;
    let factor = root(predictor[5].as_ref())?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(index);
    let one = |record: &LoopRecord| {
        let (samples, m, p) = (record.samples(), record.inputs(), record.outputs());
        let white = Mat::from_fn(p, samples, |_, _| rng.sample::<f64, _>(StandardNormal));
        let e = (&factor * &white).transpose().to_owned();
        let given =
            |x: Option<MatRef<'_, f64>>, columns| x.map_or_else(|| Mat::zeros(samples, columns), |x| x.to_owned());
        let (d, alpha) = (given(record.input_excitation(), m), given(record.alpha(), m));
        let r = given(record.reference(), p);
        let outside = block(&[&[e.as_ref(), d.as_ref(), r.as_ref(), alpha.as_ref()]]);
        let both = simulate(&closed, outside.as_ref(), &vec![0.0; closed.order()])?;
        let (y, u) = (both.as_ref().subcols(0, p).to_owned(), both.as_ref().subcols(p, m).to_owned());
        Ok(record.with_response(u, y)?)
    };
    let estimation = records.estimation.iter().map(one).collect::<Result<_>>()?;
    Ok(RunRecords { estimation, verification: Vec::new(), ..records.clone() })
}

/// From (e, d, r, alpha) to (y, u).
fn closed(chosen: &RunSettings, records: &RunRecords, predictor: &[Mat<f64>; 6]) -> Result<StateSpace<Discrete>> {
    let [a, b, c, d, k, _] = predictor;
    let (n, m, p) = (a.nrows(), b.ncols(), c.nrows());
    let declared = declared_loop(chosen, records, Path::new("."))?;
    let controller = match chosen.data.alpha.is_empty() {
        true => with_input_port(declared.controller())?,
        false => factorise_run(chosen, records, Path::new("."))?.factors.j_k()?,
    };
    // The controller sees (y - r, alpha) and commands u less d.
    let law = controller.system().part(0..m, 0..p + m);
    let zero = |rows: usize, columns: usize| Mat::<f64>::zeros(rows, columns);
    let inputs = block(&[&[k.as_ref(), b.as_ref(), zero(n, p).as_ref(), zero(n, m).as_ref(), b.as_ref()]]);
    let outputs = block(&[&[c.as_ref()], &[zero(m, n).as_ref()], &[c.as_ref()], &[zero(m, n).as_ref()]]);
    let (i, j) = (eye(p), eye(m));
    let minus = Mat::from_fn(p, p, |row, column| if row == column { -1.0 } else { 0.0 });
    let through = block(&[
        &[i.as_ref(), d.as_ref(), zero(p, p).as_ref(), zero(p, m).as_ref(), d.as_ref()],
        &[zero(m, p).as_ref(), j.as_ref(), zero(m, p).as_ref(), zero(m, m).as_ref(), j.as_ref()],
        &[i.as_ref(), d.as_ref(), minus.as_ref(), zero(p, m).as_ref(), d.as_ref()],
        &[zero(m, p).as_ref(), zero(m, m).as_ref(), zero(m, p).as_ref(), j.as_ref(), zero(m, m).as_ref()],
    ]);
    let open = StateSpace::new(a.clone(), inputs, outputs, through, records.time)?;
    let closed = Partitioned::new(open, p + m, p + m + p + m)?.lower_lft(&law)?;
    closed.require_stable("the loop of the recommended model")?;
    Ok(closed)
}

/// Lower triangular root of a covariance, by Cholesky's method.
fn root(covariance: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let n = covariance.nrows();
    let mut l = Mat::<f64>::zeros(n, n);
    for j in 0..n {
        for i in j..n {
            let rest = covariance[(i, j)] - (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum::<f64>();
            if i == j && rest <= 0.0 {
                return Err(Failure::numerical("the covariance of the noise of the recommended model is singular"));
            }
            l[(i, j)] = if i == j { rest.sqrt() } else { rest / l[(j, j)] };
        }
    }
    Ok(l)
}
