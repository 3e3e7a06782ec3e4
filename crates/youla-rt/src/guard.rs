//! What ends an excitation.

use crate::Real;
use core::fmt;

/// Limits of a run. A limit of infinity and a count of 0 switch a check off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits<T, const M: usize, const P: usize> {
    /// Largest magnitude of each output y.
    pub y: [T; P],
    /// Largest magnitude of each residual beta: the distance of the plant from its nominal model.
    pub beta: [T; P],
    /// Largest magnitude of each input u. The command is always clipped to it.
    pub u: [T; M],
    /// Largest change of each input u in one sample. The command is always clipped to it.
    pub rate: [T; M],
    /// Consecutive samples for which an input may be clipped.
    pub clipped: u16,
    /// Consecutive equal values after which an output counts as stuck, while the loop is excited.
    pub stuck: u16,
    /// Samples for which the host may be silent while the loop is excited.
    pub host: u32,
    /// Longest excitation, samples.
    pub duration: u32,
}

impl<T: Real, const M: usize, const P: usize> Limits<T, M, P> {
    /// Whether every limit is above 0; NaN is not.
    pub(crate) fn are_positive(&self) -> bool {
        let of_y = self.y.iter().chain(&self.beta);
        of_y.chain(&self.u).chain(&self.rate).all(|limit| *limit > T::ZERO)
    }
}

/// Why the guard ended an excitation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Cause {
    /// An output is NaN or infinite.
    SensorNotFinite = 1,
    /// An output does not change.
    SensorStuck = 2,
    /// An output is beyond its limit.
    OutputLimit = 3,
    /// A residual is beyond its limit: the plant is not the one that the controller was made for.
    ResidualLimit = 4,
    /// An input was at its limit for too long.
    InputLimit = 5,
    /// The host is silent.
    HostSilent = 6,
    /// The longest time of an excitation is over.
    TimeOver = 7,
    /// The source of the excitation gave a value that is not finite.
    ExcitationNotFinite = 8,
    /// Coefficients of Q came with a wrong checksum or were not finite.
    QRefused = 9,
    /// The state of the controller or of Q overflowed; it starts again from 0.
    StateNotFinite = 10,
}

impl Cause {
    const ALL: [Cause; 10] = [
        Cause::SensorNotFinite,
        Cause::SensorStuck,
        Cause::OutputLimit,
        Cause::ResidualLimit,
        Cause::InputLimit,
        Cause::HostSilent,
        Cause::TimeOver,
        Cause::ExcitationNotFinite,
        Cause::QRefused,
        Cause::StateNotFinite,
    ];

    pub(crate) fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| *cause as u32 == code)
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Cause::SensorNotFinite => "an output is not finite",
            Cause::SensorStuck => "an output does not change",
            Cause::OutputLimit => "an output is beyond its limit",
            Cause::ResidualLimit => "a residual is beyond its limit",
            Cause::InputLimit => "an input was clipped for too long",
            Cause::HostSilent => "the host is silent",
            Cause::TimeOver => "the longest time of an excitation is over",
            Cause::ExcitationNotFinite => "the excitation is not finite",
            Cause::QRefused => "the coefficients of Q were refused",
            Cause::StateNotFinite => "a state overflowed",
        })
    }
}

/// A cause with its channel, counted from 1, or 0 for none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trip {
    /// Why.
    pub cause: Cause,
    /// The output or input, counted from 1; 0 where the cause has none.
    pub channel: u8,
}

impl Trip {
    pub(crate) fn new(cause: Cause) -> Self {
        Trip { cause, channel: 0 }
    }
}

/// The counters of the checks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Guard<T, const M: usize, const P: usize> {
    limits: Limits<T, M, P>,
    last: [T; P],
    equal: [u16; P],
    clipped: [u16; M],
    silent: u32,
    excited: u32,
    valid: [bool; P],
}

impl<T: Real, const M: usize, const P: usize> Guard<T, M, P> {
    pub(crate) fn new(limits: Limits<T, M, P>) -> Self {
        Guard { limits, last: [T::ZERO; P], equal: [0; P], clipped: [0; M], silent: 0, excited: 0, valid: [true; P] }
    }

    pub(crate) fn limits(&self) -> &Limits<T, M, P> {
        &self.limits
    }

    pub(crate) fn valid(&self) -> &[bool; P] {
        &self.valid
    }

    pub(crate) fn restart(&mut self) {
        (self.silent, self.excited, self.clipped) = (0, 0, [0; M]);
    }

    pub(crate) fn heard(&mut self) {
        self.silent = 0;
    }

    /// The command within its limits, `last` being the input before.
    #[inline]
    pub(crate) fn clip(&mut self, wanted: &[T; M], last: &[T; M]) -> [T; M] {
        let mut u = *wanted;
        let limits = self.limits.u.iter().zip(&self.limits.rate);
        for (((u, last), (limit, rate)), count) in u.iter_mut().zip(last).zip(limits).zip(&mut self.clipped) {
            let given = *u;
            // Off where the state was not finite: the input before is.
            let finite = if given.is_finite() { given } else { *last };
            *u = between(between(finite, *last - *rate, *last + *rate), -*limit, *limit);
            *count = if *u == given { 0 } else { count.saturating_add(1) };
        }
        u
    }

    pub(crate) fn is_clipped(&self) -> bool {
        self.clipped.iter().any(|count| *count > 0)
    }

    /// The outputs: which are valid, and whether one trips.
    #[inline]
    pub(crate) fn outputs(&mut self, y: &[T; P], excited: bool) -> Option<Trip> {
        let mut trip = None;
        let state = self.last.iter_mut().zip(&mut self.equal).zip(&mut self.valid);
        for (((last, equal), valid), ((y, limit), channel)) in state.zip(y.iter().zip(&self.limits.y).zip(1_u8..)) {
            *equal = if *y == *last { equal.saturating_add(1) } else { 0 };
            *last = *y;
            // A channel that was found stuck stays so until it moves.
            let stuck = self.limits.stuck > 0
                && equal.saturating_add(1) >= self.limits.stuck
                && (excited || !*valid && y.is_finite());
            *valid = y.is_finite() && !stuck;
            let cause = match (y.is_finite(), stuck) {
                (false, _) => Some(Cause::SensorNotFinite),
                (true, true) => Some(Cause::SensorStuck),
                (true, false) => (y.abs() > *limit).then_some(Cause::OutputLimit),
            };
            trip = trip.or(cause.map(|cause| Trip { cause, channel }));
        }
        trip
    }

    /// The residuals, the inputs and the times.
    #[inline]
    pub(crate) fn rest(&mut self, beta: &[T; P], excited: bool) -> Option<Trip> {
        let mut trip = None;
        for ((beta, limit), channel) in beta.iter().zip(&self.limits.beta).zip(1_u8..) {
            if beta.abs() > *limit {
                trip = trip.or(Some(Trip { cause: Cause::ResidualLimit, channel }));
            }
        }
        for (count, channel) in self.clipped.iter().zip(1_u8..) {
            if self.limits.clipped > 0 && *count > self.limits.clipped {
                trip = trip.or(Some(Trip { cause: Cause::InputLimit, channel }));
            }
        }
        if excited {
            self.silent = self.silent.saturating_add(1);
            self.excited = self.excited.saturating_add(1);
            let over = |count: u32, limit: u32| limit > 0 && count > limit;
            if over(self.silent, self.limits.host) {
                trip = trip.or(Some(Trip::new(Cause::HostSilent)));
            }
            if over(self.excited, self.limits.duration) {
                trip = trip.or(Some(Trip::new(Cause::TimeOver)));
            }
        }
        trip
    }
}

fn between<T: Real>(x: T, low: T, high: T) -> T {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}
