//! An experiment on a rig: the loop of Fig. 3 with the safety of a real one.

use super::drive::Actuation;
use super::parameters::Safety;
use super::twin::SimulatedRig;
use crate::Result;
use youla::linalg::{check_finite, check_shape};
use youla::lti::Discrete;
use youla::{Mat, MatRef};

/// The controller of Fig. 3 in two phases, so that its observer learns the command as the actuators took it.
pub trait LoopController {
    /// The command u(k), V, from y(k), which an observer that predicts does not need yet, and the excitation alpha(k).
    fn command(&self, y: [f64; 2], alpha: [f64; 2]) -> [f64; 2];

    /// Moves the state on to k + 1; returns the innovation beta(k), um, or y(k) where there is no observer.
    fn observe(&mut self, y: [f64; 2], u_applied: [f64; 2]) -> [f64; 2];
}

/// No controller: `u = alpha`, `beta = y`, for open-loop experiments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OpenLoop;

impl LoopController for OpenLoop {
    fn command(&self, _y: [f64; 2], alpha: [f64; 2]) -> [f64; 2] {
        alpha
    }

    fn observe(&mut self, y: [f64; 2], _u_applied: [f64; 2]) -> [f64; 2] {
        y
    }
}

/// The controller of Fig. 3 with its state: the code that firmware runs.
#[derive(Debug, Clone, PartialEq)]
pub struct ObserverLoop<const N: usize> {
    /// Nominal model and gains, from [`youla::control::real_time_controller`].
    pub controller: youla_rt::Controller<f64, N, 2, 2>,
    /// The observer's state.
    pub state: youla_rt::State<f64, N>,
}

impl<const N: usize> LoopController for ObserverLoop<N> {
    fn command(&self, _y: [f64; 2], alpha: [f64; 2]) -> [f64; 2] {
        self.controller.command(&self.state, &alpha)
    }

    fn observe(&mut self, y: [f64; 2], u_applied: [f64; 2]) -> [f64; 2] {
        self.controller.observe(&mut self.state, &y, &u_applied)
    }
}

/// What was logged; all matrices samples x 2, row k at time k.
#[derive(Debug, Clone, PartialEq)]
pub struct ExperimentRecord {
    /// The clock.
    pub time: Discrete,
    /// Excitation as it was injected, after the limit and the ramp, V.
    pub alpha: Mat<f64>,
    /// Command of the controller, V.
    pub u_commanded: Mat<f64>,
    /// Command within the limits of the actuators, V.
    pub u_applied: Mat<f64>,
    /// Measured displacement, um.
    pub y: Mat<f64>,
    /// Innovation of the controller, um.
    pub beta: Mat<f64>,
    /// First sample, counted from 0, beyond the displacement limit; the excitation goes to zero from there.
    pub aborted: Option<usize>,
    /// The sample, counted from 0, at which the rotor touched; it is the last one of the record.
    pub touched: Option<usize>,
    /// Samples in which the command had to be limited, per axis.
    pub saturated: [usize; 2],
    /// Samples in which the excitation had to be limited, per axis.
    pub excitation_limited: [usize; 2],
}

/// Runs an experiment: in every sample the rig is measured, the controller computes, the rig is actuated.
///
/// `alpha` is samples x 2, V; each value is clipped to the excitation limit. From the first sample with a measured
/// displacement beyond the displacement limit, alpha falls linearly to zero within the ramp time, and the loop goes on
/// without excitation. Beyond the clearance the rotor touches: the sample is kept and the run ends. All data up to there
/// are returned: an aborted run is an outcome, not an error.
///
/// # Errors
/// [`youla::Error::Shape`] and [`youla::Error::NotFinite`] for the excitation, [`youla::Error::OutOfRange`] for a limit.
///
/// ```
/// use youla::Mat;
/// use youla_twin::rig::{BearingRig, Fidelity, OpenLoop, RigParameters, run_experiment};
/// let parameters = RigParameters::shipped();
/// let mut rig = BearingRig::new(&parameters, Fidelity::Instrumented, 1)?;
/// let alpha = Mat::from_fn(500, 2, |k, _| if k < 250 { 0.5 } else { -0.5 });
/// let log = run_experiment(&mut rig, &mut OpenLoop, alpha.as_ref(), &parameters.safety)?;
/// assert_eq!((log.y.nrows(), log.aborted, log.saturated), (500, None, [0, 0]));
/// # Ok::<(), youla_twin::Error>(())
/// ```
pub fn run_experiment(
    rig: &mut impl SimulatedRig,
    controller: &mut impl LoopController,
    alpha: MatRef<'_, f64>,
    safety: &Safety,
) -> Result<ExperimentRecord> {
    check_shape("the excitation", alpha, (alpha.nrows(), 2))?;
    check_finite("the excitation", alpha)?;
    safety.check()?;
    let mut log = ExperimentRecord::empty(rig.time(), alpha.nrows());
    for k in 0..alpha.nrows() {
        let y = rig.measure();
        log.watch(k, y, safety);
        let injected = log.inject(k, [alpha[(k, 0)], alpha[(k, 1)]], safety);
        let u = controller.command(y, injected);
        let Actuation { applied, saturated } = rig.actuate(u);
        let beta = controller.observe(y, applied);
        log.write(k, [injected, u, applied, y, beta], saturated);
        if log.touched.is_some() {
            return Ok(log.cut(k + 1));
        }
    }
    Ok(log)
}

impl ExperimentRecord {
    fn empty(time: Discrete, samples: usize) -> Self {
        let signal = || Mat::zeros(samples, 2);
        ExperimentRecord {
            time,
            alpha: signal(),
            u_commanded: signal(),
            u_applied: signal(),
            y: signal(),
            beta: signal(),
            aborted: None,
            touched: None,
            saturated: [0; 2],
            excitation_limited: [0; 2],
        }
    }

    /// Compares a measurement with the limits; one that is not a number is beyond all.
    fn watch(&mut self, k: usize, y: [f64; 2], safety: &Safety) {
        let within = |limit: f64| y.iter().all(|y| y.abs() <= limit);
        if self.aborted.is_none() && !within(safety.displacement_limit.value) {
            self.aborted = Some(k);
        }
        if !within(safety.clearance.value) {
            self.touched = Some(k);
        }
    }

    /// The excitation that is injected: clipped, and ramped out after an abort.
    fn inject(&mut self, k: usize, wanted: [f64; 2], safety: &Safety) -> [f64; 2] {
        let limit = safety.excitation_limit.value;
        let share = self.aborted.map_or(1.0, |start| {
            let passed = (k - start) as f64 * self.time.ts();
            if passed < safety.ramp_time.value { 1.0 - passed / safety.ramp_time.value } else { 0.0 }
        });
        for (count, wanted) in self.excitation_limited.iter_mut().zip(wanted) {
            *count += usize::from(wanted.abs() > limit);
        }
        wanted.map(|wanted| share * wanted.clamp(-limit, limit))
    }

    /// Row k of alpha, u commanded, u applied, y and beta.
    fn write(&mut self, k: usize, row: [[f64; 2]; 5], saturated: [bool; 2]) {
        for (signal, values) in self.signals().into_iter().zip(row) {
            (signal[(k, 0)], signal[(k, 1)]) = (values[0], values[1]);
        }
        for (count, saturated) in self.saturated.iter_mut().zip(saturated) {
            *count += usize::from(saturated);
        }
    }

    fn signals(&mut self) -> [&mut Mat<f64>; 5] {
        [&mut self.alpha, &mut self.u_commanded, &mut self.u_applied, &mut self.y, &mut self.beta]
    }

    /// The first samples alone.
    fn cut(mut self, samples: usize) -> Self {
        for signal in self.signals() {
            *signal = signal.subrows(0, samples).to_owned();
        }
        self
    }
}
