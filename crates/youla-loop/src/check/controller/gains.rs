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

#[cfg(test)]
mod tests {
    use crate::check::{Change, CheckOptions, ControllerRecord, Declared, GainPart, controller};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;
    use youla::Mat;
    use youla::lti::{Discrete, StateSpace};

    const ROWS: usize = 3000;

    fn number(value: f64) -> Mat<f64> {
        Mat::from_fn(1, 1, |_, _| value)
    }

    /// `u = -(kp e + ki integral of e)`, positive feedback.
    fn pi(kp: f64, ki: f64) -> StateSpace<Discrete> {
        let time = Discrete::new(1e-3).unwrap();
        StateSpace::new(number(1.0), number(0.02), number(-ki), number(-kp), time).unwrap()
    }

    /// The change that explains a log of the PI controller 1.5, 2 whose u, y, d and r are multiplied by some factors, `stated` being declared.
    fn change(stated: [f64; 2], [of_u, of_y, of_d, of_r]: [f64; 4]) -> Change {
        let rng = &mut ChaCha8Rng::seed_from_u64(7);
        let (mut x, mut integral, mut reference) = (0.0, 0.0, 0.3);
        let rows: Vec<[f64; 4]> = (0..ROWS)
            .map(|t| {
                if t % 150 == 0 {
                    reference = rng.sample(StandardNormal);
                }
                let d: f64 = rng.sample(StandardNormal);
                let y: f64 = x + 0.05 * rng.sample::<f64, _>(StandardNormal);
                let e = y - reference;
                let u = d - 1.5 * e - 2.0 * integral;
                integral += 0.02 * e;
                x = 0.95 * x + 0.1 * u;
                [of_u * u, of_y * y, of_d * d, of_r * reference]
            })
            .collect();
        let [u, y, d, r] = [0, 1, 2, 3].map(|j| Mat::from_fn(ROWS, 1, |t, _| rows[t][j]));
        let record = ControllerRecord {
            u: u.as_ref(),
            y: y.as_ref(),
            input_excitation: Some(d.as_ref()),
            reference: Some(r.as_ref()),
        };
        let part = |key: &str, value: f64, gains: [f64; 2]| GainPart {
            key: key.into(),
            value,
            controller: pi(gains[0], gains[1]),
        };
        let parts = [part("kp", stated[0], [1.0, 0.0]), part("ki", stated[1], [0.0, 1.0])];
        let k = pi(stated[0], stated[1]);
        let declared = Declared { controller: &k, readings: &[], parts: &parts };
        let (change, left) = controller(declared, record, &CheckOptions::default()).unwrap().change.unwrap();
        assert!(left < 1e-9, "{change:?} {left}");
        change
    }

    /// Planted behind an integrator: each wrong factor and each wrong gain is found with its size.
    #[test]
    fn wrong_factors_and_gains_are_found_behind_an_integrator() {
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
        let right = [1.5, 2.0];
        assert!(matches!(change([3.0, 4.0], [1.0; 4]), Change::Gain(g) if near(g, 0.5)));
        assert!(matches!(change([1.5, 20.0], [1.0; 4]), Change::Part(key, g) if key == "ki" && near(g, 2.0)));
        assert!(matches!(change([1.2, 2.0], [1.0; 4]), Change::Part(key, g) if key == "kp" && near(g, 1.5)));
        assert!(matches!(change(right, [1.0, 57.3, 1.0, 1.0]), Change::ChannelGain(0, g) if near(g, 1.0 / 57.3)));
        assert!(matches!(change(right, [1.0, 1.0, 1.0, 57.3]), Change::ReferenceGain(0, g) if near(g, 1.0 / 57.3)));
        assert!(matches!(change(right, [1e3, 1.0, 1.0, 1.0]), Change::InputGain(0, g) if near(g, 1e-3)));
        assert!(matches!(change(right, [1.0, 1.0, 10.0, 1.0]), Change::ExcitationGain(0, g) if near(g, 0.1)));
    }
}
