//! Factors on channels and on parts of the controller that would make it explain the log, by least squares.
//!
//! An unknown state of the controller and a constant that was taken out of the log add their free responses; P projects beside them:
//! ```text
//! factor = (P x)' (P t) / |P x|^2,    left = |P t - factor P x|    for    t = factor x + free responses
//! ```

use super::log::{Log, centred, with_constant};
use super::{Change, GainPart};
use crate::error::Result;
use youla::Mat;
use youla::lti::{Discrete, StateSpace, simulate, simulate_best};

/// The controller beside whose free responses signals are compared.
struct Beside {
    k: StateSpace<Discrete>,
    /// The controller with constants at its inputs.
    constant: StateSpace<Discrete>,
}

impl Beside {
    /// A signal of the inputs without its best free response.
    fn of(&self, x: &Mat<f64>) -> Result<Mat<f64>> {
        let rest = Mat::<f64>::zeros(x.nrows(), self.k.inputs());
        Ok(x - simulate_best(&self.constant, rest.as_ref(), x.as_ref())?)
    }

    /// The response to one channel from rest, without free responses.
    fn to(&self, of: &StateSpace<Discrete>, e: &Mat<f64>, channel: usize) -> Result<Mat<f64>> {
        let alone = Mat::from_fn(e.nrows(), e.ncols(), |t, c| if c == channel { e[(t, c)] } else { 0.0 });
        self.of(&simulate(of, alone.as_ref(), &vec![0.0; of.order()])?)
    }
}

/// The factor on `x` that leaves least of a target, and what it leaves.
fn factor(x: &Mat<f64>, target: &Mat<f64>) -> (f64, f64) {
    let product: f64 = x.col_iter().zip(target.col_iter()).map(|(x, t)| x.transpose() * t).sum();
    let factor = product / x.squared_norm_l2().max(f64::MIN_POSITIVE);
    (factor, (target - faer::Scale(factor) * x).norm_l2())
}

/// A column of a signal, zeros elsewhere.
fn column(of: &Mat<f64>, channel: usize) -> Mat<f64> {
    Mat::from_fn(of.nrows(), of.ncols(), |t, c| if c == channel { of[(t, c)] } else { 0.0 })
}

/// One factor for all channels of e, one for each channel of each signal alone, and one for each part of the controller.
pub(super) fn gains(log: &Log<'_>, k: &StateSpace<Discrete>, parts: &[GainPart]) -> Result<Vec<(Change, f64)>> {
    let beside = Beside { k: k.clone(), constant: with_constant(k)? };
    let (p, record) = (log.e.ncols(), &log.record);
    let size = |w: &Mat<f64>| centred(w).norm_l2().max(f64::MIN_POSITIVE);
    let of_e = (0..p).map(|c| beside.to(k, &log.e, c)).collect::<Result<Vec<_>>>()?;
    let law = of_e.iter().fold(Mat::zeros(log.w.nrows(), log.w.ncols()), |sum, part| sum + part);
    let (w, total) = (beside.of(&log.w)?, size(&log.w));
    let (gain, left) = factor(&law, &w);
    let mut all = vec![(Change::Gain(gain), left / total)];
    for (channel, own) in of_e.iter().enumerate() {
        // A channel in another unit is a factor on what was measured; the reference keeps its unit.
        let measured = match record.reference {
            Some(_) => beside.to(k, &record.y.to_owned(), channel)?,
            None if p > 1 => own.clone(),
            None => continue,
        };
        let (gain, left) = factor(&measured, &(&w - (&law - &measured)));
        all.push((Change::ChannelGain(channel, gain), left / total));
        if record.reference.is_some() {
            let reference = &measured - own;
            let (gain, left) = factor(&(-1.0 * &reference), &(&w - (&law + &reference)));
            all.push((Change::ReferenceGain(channel, gain), left / total));
        }
    }
    let u = record.u.to_owned();
    for channel in 0..u.ncols() {
        let (own, others) = (beside.of(&column(&u, channel))?, &w - beside.of(&column(&u, channel))?);
        let (gain, left) = factor(&own, &(&law - others));
        let of = column(&u, channel) * faer::Scale(gain - 1.0);
        all.push((Change::InputGain(channel, gain), left / size(&(&log.w + of))));
        let Some(d) = record.input_excitation else { continue };
        let d = column(&d.to_owned(), channel);
        let own = beside.of(&d)?;
        let (gain, left) = factor(&own, &(&w + &own - &law));
        all.push((Change::ExcitationGain(channel, gain), left / size(&(&log.w + d * faer::Scale(1.0 - gain)))));
    }
    for part in parts {
        let of = (0..p).map(|c| beside.to(&part.controller, &log.e, c)).collect::<Result<Vec<_>>>()?;
        let of = of.into_iter().fold(Mat::zeros(w.nrows(), w.ncols()), |sum, part| sum + part);
        let (more, left) = factor(&of, &(&w - &law));
        all.push((Change::Part(part.key.clone(), part.value + more), left / total));
    }
    Ok(all)
}
