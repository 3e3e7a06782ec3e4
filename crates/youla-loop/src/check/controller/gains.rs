//! Factors on channels and on parts of the controller that would make it explain the log, by least squares.
//!
//! An unknown state of the controller and a constant that was taken out of the log add their free responses; P projects beside them:
//! ```text
//! factor = (P x)' (P t) / |P x|^2,    left = |P t - factor P x|    for    t = factor x + free responses
//! ```

use super::log::{Log, centred, with_constant};
use super::{Change, GainPart};
use crate::error::Result;
use youla::lti::{Discrete, StateSpace, simulate, simulate_best};
use youla::{Mat, MatRef};

/// The controller beside whose free responses signals are compared, with constants at its inputs.
pub(super) struct Beside(StateSpace<Discrete>);

impl Beside {
    pub(super) fn new(k: &StateSpace<Discrete>) -> Result<Self> {
        Ok(Beside(with_constant(k)?))
    }

    /// A signal of the inputs without its best free response.
    pub(super) fn of(&self, x: MatRef<'_, f64>) -> Result<Mat<f64>> {
        let rest = Mat::<f64>::zeros(x.nrows(), self.0.inputs());
        Ok(x - simulate_best(&self.0, rest.as_ref(), x)?)
    }

    /// The response of a controller from rest, without free responses.
    pub(super) fn response(&self, k: &StateSpace<Discrete>, e: MatRef<'_, f64>) -> Result<Mat<f64>> {
        self.of(simulate(k, e, &vec![0.0; k.order()])?.as_ref())
    }
}

/// The factor on `x` that leaves least of a target, and what it leaves.
pub(super) fn factor(x: &Mat<f64>, target: &Mat<f64>) -> (f64, f64) {
    let product: f64 = x.col_iter().zip(target.col_iter()).map(|(x, t)| x.transpose() * t).sum();
    let factor = product / x.squared_norm_l2().max(f64::MIN_POSITIVE);
    (factor, (target - faer::Scale(factor) * x).norm_l2())
}

/// A column of a signal, zeros elsewhere.
fn column(of: MatRef<'_, f64>, channel: usize) -> Mat<f64> {
    Mat::from_fn(of.nrows(), of.ncols(), |t, c| if c == channel { of[(t, c)] } else { 0.0 })
}

/// One factor for all channels of e, one for each channel of each signal alone, and one for each part of the controller.
pub(super) fn gains(log: &Log<'_>, k: &StateSpace<Discrete>, parts: &[GainPart]) -> Result<Vec<(Change, f64)>> {
    let (beside, record) = (Beside::new(k)?, &log.record);
    let to = |e: MatRef<'_, f64>, channel: usize| beside.response(k, column(e, channel).as_ref());
    let size = |w: &Mat<f64>| centred(w).norm_l2().max(f64::MIN_POSITIVE);
    let of_e = (0..log.e.ncols()).map(|c| to(log.e.as_ref(), c)).collect::<Result<Vec<_>>>()?;
    let law = of_e.iter().fold(Mat::zeros(log.w.nrows(), log.w.ncols()), |sum, part| sum + part);
    let (w, total) = (beside.of(log.w.as_ref())?, size(&log.w));
    // The factor on one term of the law.
    let of_term = |term: &Mat<f64>| {
        let (gain, left) = factor(term, &(&w - (&law - term)));
        (gain, left / total)
    };
    let (gain, left) = of_term(&law);
    let mut all = vec![(Change::Gain(gain), left)];
    for (channel, own) in of_e.iter().enumerate() {
        // A channel in another unit is a factor on what was measured; the reference keeps its unit.
        if record.reference.is_some() {
            let measured = to(record.y, channel)?;
            let (gain, left) = of_term(&measured);
            all.push((Change::ChannelGain(channel, gain), left));
            let (gain, left) = of_term(&(own - measured));
            all.push((Change::ReferenceGain(channel, gain), left));
        } else if of_e.len() > 1 {
            let (gain, left) = of_term(own);
            all.push((Change::ChannelGain(channel, gain), left));
        }
    }
    for channel in 0..record.u.ncols() {
        let u = column(record.u, channel);
        let own = beside.of(u.as_ref())?;
        let (gain, left) = factor(&own, &(&law - (&w - &own)));
        all.push((Change::InputGain(channel, gain), left / size(&(&log.w + u * faer::Scale(gain - 1.0)))));
        let Some(d) = record.input_excitation else { continue };
        let d = column(d, channel);
        let own = beside.of(d.as_ref())?;
        let (gain, left) = factor(&own, &(&w + &own - &law));
        all.push((Change::ExcitationGain(channel, gain), left / size(&(&log.w + d * faer::Scale(1.0 - gain)))));
    }
    for part in parts {
        let (more, left) = factor(&beside.response(&part.controller, log.e.as_ref())?, &(&w - &law));
        let (factor, power) = part.stated;
        all.push((Change::Part(part.key.clone(), factor * (part.value + more).powi(power)), left / total));
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
            stated: (1.0, 1),
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
