//! The whole loop of a firmware: command, limit, apply, observe.

use crate::guard::Guard;
use crate::parameter::QBanks;
use crate::ramp::Ramp;
use crate::{Cause, Controller, Limits, Phase, QCoefficients, QRefusal, Real, State, Status, Trip};
use core::fmt;

/// One sample of the log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row<T, const M: usize, const P: usize> {
    /// Number of the sample, from 0.
    pub sample: u64,
    /// The outputs as measured, also where they are not finite.
    pub y: [T; P],
    /// The inputs that were applied.
    pub u: [T; M],
    /// The excitation of K(Q): ramped source and the free response of a Q that fades out.
    pub alpha: [T; M],
    /// The residuals that the controller used: 0 for an output that is not finite or stuck.
    pub beta: [T; P],
    /// Phase, banks of Q, causes.
    pub status: Status,
}

/// Why a request was refused. The loop goes on as before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopRefusal {
    /// A limit is not above 0.
    Limits,
    /// Start without arm.
    NotArmed,
    /// The guard has tripped: Q stays 0 until the loop is armed again.
    Tripped,
    /// An excitation runs: stop it first.
    Exciting,
    /// An output is not finite or stuck.
    Sensor,
    /// Of Q.
    Q(QRefusal),
}

impl fmt::Display for LoopRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LoopRefusal::Limits => f.write_str("every limit must be a number above 0; infinity switches it off"),
            LoopRefusal::NotArmed => f.write_str("the loop is not armed; arm it before the start"),
            LoopRefusal::Tripped => f.write_str("the guard has tripped; arm the loop before a switch of Q"),
            LoopRefusal::Exciting => f.write_str("an excitation runs; stop it first"),
            LoopRefusal::Sensor => f.write_str("an output is not finite or does not change; repair the sensor first"),
            LoopRefusal::Q(refusal) => refusal.fmt(f),
        }
    }
}

impl core::error::Error for LoopRefusal {}

impl From<QRefusal> for LoopRefusal {
    fn from(refusal: QRefusal) -> Self {
        LoopRefusal::Q(refusal)
    }
}

/// A controller K(Q) in its loop, with excitation and guard. N states, M inputs and P outputs of the nominal model; Q of order K.
///
/// ```
/// use youla_rt::{Controller, ExcitedLoop, Limits, Matrices, Phase};
///
/// let controller = Controller::new(Matrices {
///     a: [[1.1_f32]], b: [[1.0]], c: [[1.0]], d: [[0.0]], f: [[-0.6]], l: [[-0.7]],
/// })?;
/// let limits = Limits {
///     y: [10.0], beta: [5.0], u: [8.0], rate: [f32::INFINITY], clipped: 20, stuck: 0, host: 0, duration: 100_000,
/// };
/// let mut running = ExcitedLoop::<f32, 1, 1, 1, 4>::new(controller, limits, 100)?;
/// running.arm()?;
/// running.start()?;
/// let mut x = 0.0;
/// for k in 0..1000 {
///     let u = running.command(&[if k % 20 < 10 { 0.5 } else { -0.5 }]);   // apply it
///     let row = running.observe(&[x], &u);                              // log it
///     assert_eq!(row.status.phase(), Phase::Exciting);
///     x = 1.1 * x + u[0];
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitedLoop<T, const N: usize, const M: usize, const P: usize, const K: usize> {
    controller: Controller<T, N, M, P>,
    state: State<T, N>,
    q: QBanks<T, K, M, P>,
    guard: Guard<T, M, P>,
    ramp: Ramp<T>,
    phase: Phase,
    trip: Option<Trip>,
    /// Found between two measurements.
    pending: Option<Trip>,
    alpha: [T; M],
    u: [T; M],
    sample: u64,
}

impl<T: Real, const N: usize, const M: usize, const P: usize, const K: usize> ExcitedLoop<T, N, M, P, K> {
    /// At rest, with Q = 0. An excitation grows over `ramp` samples and falls as slowly after a stop; a Q that is replaced
    /// fades out over the same time. After a trip both are out within [`crate::OUT_WITHIN`] samples.
    ///
    /// # Errors
    /// [`LoopRefusal::Limits`].
    pub fn new(controller: Controller<T, N, M, P>, limits: Limits<T, M, P>, ramp: u16) -> Result<Self, LoopRefusal> {
        if !limits.are_positive() {
            return Err(LoopRefusal::Limits);
        }
        Ok(ExcitedLoop {
            controller,
            state: State::at_rest(),
            q: QBanks::new(ramp),
            guard: Guard::new(limits),
            ramp: Ramp::new(ramp),
            phase: Phase::Idle,
            trip: None,
            pending: None,
            alpha: [T::ZERO; M],
            u: [T::ZERO; M],
            sample: 0,
        })
    }

    /// First phase: the input to apply, within its limits. `wanted` is the excitation at its full size; it counts only
    /// while [`ExcitedLoop::is_excited`].
    #[inline]
    #[must_use]
    pub fn command(&mut self, wanted: &[T; M]) -> [T; M] {
        self.alpha = self.q.fading();
        if self.is_excited() {
            self.add_excitation(wanted);
        }
        let mut port = self.q.feedback();
        for (port, alpha) in port.iter_mut().zip(&self.alpha) {
            *port = *port + *alpha;
        }
        let u = self.controller.command(&self.state, &port);
        self.u = self.guard.clip(&u, &self.u);
        self.u
    }

    fn add_excitation(&mut self, wanted: &[T; M]) {
        if !wanted.iter().all(|value| value.is_finite()) {
            self.pending = Some(Trip::new(Cause::ExcitationNotFinite));
            return;
        }
        let weight = self.ramp.weight();
        for (alpha, wanted) in self.alpha.iter_mut().zip(wanted) {
            *alpha = *alpha + *wanted * weight;
        }
    }

    /// Second phase: takes the measurement and the input that was applied, and gives the row of the log.
    #[inline]
    pub fn observe(&mut self, y: &[T; P], applied: &[T; M]) -> Row<T, M, P> {
        let excited = self.phase == Phase::Exciting;
        if applied.iter().all(|u| u.is_finite()) {
            self.u = *applied;
        }
        let of_outputs = self.guard.outputs(y, excited);
        let mut beta = self.controller.residual(&self.state, y, &self.u);
        // An output that is not used is taken as predicted.
        for (beta, valid) in beta.iter_mut().zip(self.guard.valid()) {
            if !*valid {
                *beta = T::ZERO;
            }
        }
        let of_rest = self.guard.rest(&beta, excited);
        self.controller.advance(&mut self.state, &self.u, &beta);
        let mut finite = self.q.advance(&beta, self.phase == Phase::Tripped);
        if !self.state.is_finite() {
            self.state = State::at_rest();
            finite = false;
        }
        let of_state = (!finite).then_some(Trip::new(Cause::StateNotFinite));
        self.move_ramp();
        if let Some(trip) = self.pending.take().or(of_outputs).or(of_rest).or(of_state) {
            self.trip(trip);
        }
        let row = Row { sample: self.sample, y: *y, u: self.u, alpha: self.alpha, beta, status: self.status() };
        self.sample = self.sample.wrapping_add(1);
        row
    }

    fn move_ramp(&mut self) {
        match self.phase {
            Phase::Exciting => self.ramp.rise(),
            Phase::Tripped => self.ramp.drop_out(),
            Phase::Idle | Phase::Armed => self.ramp.fall(),
        }
    }

    /// The first cause counts. The excitation and Q are on their way out from the next sample on.
    fn trip(&mut self, trip: Trip) {
        if self.phase != Phase::Tripped {
            self.phase = Phase::Tripped;
            self.trip = Some(trip);
            self.ramp.drop_out();
            self.q.drop_out();
        }
    }

    /// Whether the source of the excitation is in use, at the start, in between, or running out.
    #[must_use]
    pub fn is_excited(&self) -> bool {
        self.phase == Phase::Exciting || !self.ramp.is_zero()
    }

    /// Allows a start, and clears the last trip.
    ///
    /// # Errors
    /// [`LoopRefusal::Exciting`], [`LoopRefusal::Sensor`].
    pub fn arm(&mut self) -> Result<(), LoopRefusal> {
        if self.is_excited() {
            return Err(LoopRefusal::Exciting);
        }
        if self.guard.valid().contains(&false) {
            return Err(LoopRefusal::Sensor);
        }
        self.phase = Phase::Armed;
        self.trip = None;
        self.guard.restart();
        Ok(())
    }

    /// Starts the excitation at the next sample.
    ///
    /// # Errors
    /// [`LoopRefusal::NotArmed`].
    pub fn start(&mut self) -> Result<(), LoopRefusal> {
        if self.phase != Phase::Armed {
            return Err(LoopRefusal::NotArmed);
        }
        self.guard.restart();
        self.phase = Phase::Exciting;
        Ok(())
    }

    /// Ramps the excitation out. A trip stays until [`ExcitedLoop::arm`].
    pub fn stop(&mut self) {
        if self.phase != Phase::Tripped {
            self.phase = Phase::Idle;
        }
    }

    /// The host has been heard.
    pub fn heard(&mut self) {
        self.guard.heard();
    }

    /// Begins to load Q into the bank that does not run.
    ///
    /// # Errors
    /// [`QRefusal::Fading`].
    pub fn begin_q(&mut self) -> Result<(), LoopRefusal> {
        Ok(self.q.begin()?)
    }

    /// The next coefficient, in the order of [`QCoefficients::values`].
    ///
    /// # Errors
    /// [`QRefusal::NotFinite`] and [`QRefusal::Count`]. While the loop is excited the first is a trip too.
    pub fn write_q(&mut self, value: T) -> Result<(), LoopRefusal> {
        self.q.write(value).map_err(|refusal| self.refused(refusal))
    }

    /// Declares Q complete.
    ///
    /// # Errors
    /// [`QRefusal::Count`] and [`QRefusal::Checksum`]. While the loop is excited this is a trip too.
    pub fn commit_q(&mut self, checksum: u32) -> Result<(), LoopRefusal> {
        self.q.commit(checksum).map_err(|refusal| self.refused(refusal))
    }

    fn refused(&mut self, refusal: QRefusal) -> LoopRefusal {
        if self.is_excited() {
            self.pending = Some(Trip::new(Cause::QRefused));
        }
        LoopRefusal::Q(refusal)
    }

    /// Connects the Q that was loaded last, or after a switch the one before it, at the next sample and without a bump.
    ///
    /// # Errors
    /// [`QRefusal::NotLoaded`], [`QRefusal::Fading`], [`LoopRefusal::Tripped`].
    pub fn switch_q(&mut self) -> Result<(), LoopRefusal> {
        if self.phase == Phase::Tripped {
            return Err(LoopRefusal::Tripped);
        }
        Ok(self.q.connect()?)
    }

    /// Q = 0: back to the controller K, without a bump.
    pub fn release_q(&mut self) {
        self.q.disconnect();
    }

    /// The Q that is connected.
    #[must_use]
    pub fn running_q(&self) -> Option<&QCoefficients<T, K, M, P>> {
        self.q.running()
    }

    /// The controller without Q.
    #[must_use]
    pub fn controller(&self) -> &Controller<T, N, M, P> {
        &self.controller
    }

    /// The limits.
    #[must_use]
    pub fn limits(&self) -> &Limits<T, M, P> {
        self.guard.limits()
    }

    /// Number of the sample that comes next.
    #[must_use]
    pub fn sample(&self) -> u64 {
        self.sample
    }

    /// Phase, banks and causes at this moment.
    #[must_use]
    pub fn status(&self) -> Status {
        let masked = self.guard.valid().iter().zip(16_u32..24).filter(|(valid, _)| !**valid);
        let of_outputs = masked.fold(0, |bits, (_, bit)| bits | 1 << bit);
        let of_q = self.q.connected() << 2 | u32::from(self.q.is_fading()) << 4;
        let clipped = u32::from(self.guard.is_clipped()) << 5;
        Status::new(self.phase, self.trip).with(of_outputs | of_q | clipped)
    }
}

#[cfg(test)]
mod tests;
