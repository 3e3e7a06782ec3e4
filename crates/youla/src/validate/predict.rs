//! Prediction of a record by a model: from the measured input, or in closed loop from the excitations alone.

use crate::control::closed_loop;
use crate::linalg::{block, check_shape};
use crate::lti::{Discrete, Partitioned, StateSpace, simulate_best};
use crate::{Mat, MatRef, Result};
use faer::Scale;

/// The known signals that enter a loop from outside.
#[derive(Debug, Clone, Copy)]
pub struct LoopExcitation<'a> {
    /// Enters the second input of the controller, samples x m: alpha for `J_K`, an excitation at the plant input for
    /// [`crate::control::with_input_port`].
    pub input: Option<MatRef<'a, f64>>,
    /// Reference r, samples x p.
    pub reference: Option<MatRef<'a, f64>>,
}

/// Simulates a model from the measured input, with the initial state that fits the measured output best:
///
/// ```text
/// min over x0 of sum |y(k) - yp(k)|^2,    x(k+1) = A x(k) + B u(k),  yp(k) = C x(k) + D u(k)
/// ```
///
/// # Errors
/// [`crate::Error::Shape`]; [`crate::Error::Diverged`] when an unstable model leaves the range of the numbers.
pub fn predict_open_loop(model: &StateSpace<Discrete>, u: MatRef<'_, f64>, y: MatRef<'_, f64>) -> Result<Mat<f64>> {
    check_shape("the record of measured outputs", y, (u.nrows(), model.outputs()))?;
    simulate_best(model, u, y)
}

/// Simulates a model under a controller with ports, `(y - r, w) -> (u, z)`, from the known excitations alone. Of the measured
/// output only the initial state of the loop is taken (least squares, as in [`predict_open_loop`]), so that neither noise
/// nor drift of an integrating or unstable plant enters.
///
/// # Errors
/// Ports, sample times, [`crate::Error::Diverged`] when the controller does not stabilise the model.
pub fn predict_closed_loop(
    model: &StateSpace<Discrete>,
    controller: &Partitioned<Discrete>,
    excitation: LoopExcitation<'_>,
    y: MatRef<'_, f64>,
) -> Result<Mat<f64>> {
    let (samples, m, p) = (y.nrows(), model.inputs(), model.outputs());
    let v1 = excitation.input.map_or_else(|| Mat::zeros(samples, m), |v| v.to_owned());
    let r = excitation.reference.map_or_else(|| Mat::zeros(samples, p), |r| r.to_owned());
    check_shape("the excitation of the loop", v1.as_ref(), (samples, m))?;
    check_shape("the reference", r.as_ref(), (samples, p))?;
    let closed = closed_loop(model, controller)?;
    let from_outside = block(&[&[v1.as_ref(), (Scale(-1.0) * &r).as_ref()]]);
    let to_output = closed.part(m..m + p, 0..m + p);
    Ok(predict_open_loop(&to_output, from_outside.as_ref(), (y - &r).as_ref())? + r)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::with_input_port;
    use crate::lti::simulate;

    fn bearing() -> StateSpace<Discrete> {
        crate::fixtures::bearing().zoh(Discrete::new(2e-4).unwrap()).unwrap()
    }

    fn noise(samples: usize, channels: usize) -> Mat<f64> {
        Mat::from_fn(samples, channels, |k, j| ((k * k * (j + 2)) as f64 * 0.37).sin())
    }

    fn relative(x: &Mat<f64>, y: &Mat<f64>) -> f64 {
        (x - y).norm_l2() / y.norm_l2()
    }

    #[test]
    fn open_loop_prediction_finds_the_initial_state() {
        let (plant, u) = (bearing(), noise(1000, 2));
        let y = simulate(&plant, u.as_ref(), &[3.0, -1.0, 2000.0, 500.0, 0.2, -0.4]).unwrap();
        let predicted = predict_open_loop(&plant, u.as_ref(), y.as_ref()).unwrap();
        assert!(relative(&predicted, &y) < 1e-10, "{:.1e}", relative(&predicted, &y));
    }

    #[test]
    fn closed_loop_prediction_finds_the_initial_state_of_the_loop() {
        let plant = bearing();
        let gain = Mat::from_fn(2, 2, |i, j| if i == j { 0.02 } else { 0.0 });
        let controller = with_input_port(&StateSpace::gain(gain, plant.time()).unwrap()).unwrap();
        let (v1, r) = (noise(1000, 2), noise(1000, 2));
        let closed = closed_loop(&plant, &controller).unwrap();
        let outside = block(&[&[v1.as_ref(), (Scale(-1.0) * &r).as_ref()]]);
        let z = simulate(&closed, outside.as_ref(), &[1.0, 2.0, -700.0, 0.0, 0.1, 0.0]).unwrap();
        let y = z.subcols(2, 2) + &r;
        let excitation = LoopExcitation { input: Some(v1.as_ref()), reference: Some(r.as_ref()) };
        let predicted = predict_closed_loop(&plant, &controller, excitation, y.as_ref()).unwrap();
        assert!(relative(&predicted, &y) < 1e-10, "{:.1e}", relative(&predicted, &y));
    }

    #[test]
    fn a_model_that_diverges_is_an_error() {
        let unstable = StateSpace::new(
            Mat::from_fn(1, 1, |_, _| 2.0),
            Mat::from_fn(1, 1, |_, _| 1.0),
            Mat::from_fn(1, 1, |_, _| 1.0),
            Mat::zeros(1, 1),
            Discrete::new(1.0).unwrap(),
        )
        .unwrap();
        let u = noise(5000, 1);
        let refused = predict_open_loop(&unstable, u.as_ref(), u.as_ref());
        assert!(matches!(refused, Err(crate::Error::Diverged { .. })), "{refused:?}");
    }
}
