//! A weight between 0 and 1 that moves in equal steps and reaches both ends exactly.

use crate::Real;

/// A guard that has tripped leaves no excitation after this many samples.
pub const OUT_WITHIN: u16 = 10;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ramp<T> {
    position: u16,
    top: u16,
    step: T,
}

impl<T: Real> Ramp<T> {
    /// At 0, `length` samples from 1.
    pub(crate) fn new(length: u16) -> Self {
        let top = length.max(1);
        Ramp { position: 0, top, step: T::reciprocal_of(top) }
    }

    pub(crate) fn at_top(mut self) -> Self {
        self.position = self.top;
        self
    }

    pub(crate) fn weight(&self) -> T {
        if self.position == self.top { T::ONE } else { T::from_count(self.position) * self.step }
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.position == 0
    }

    pub(crate) fn rise(&mut self) {
        self.position = self.top.min(self.position.saturating_add(1));
    }

    pub(crate) fn fall(&mut self) {
        self.position = self.position.saturating_sub(1);
    }

    /// To 0 in at most [`OUT_WITHIN`] calls from anywhere.
    pub(crate) fn drop_out(&mut self) {
        self.position = self.position.saturating_sub(self.top.div_ceil(OUT_WITHIN));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_are_reached_exactly() {
        for length in [0, 1, 3, 9, 10, 11, 1000, u16::MAX] {
            let mut ramp = Ramp::<f32>::new(length);
            assert_eq!(ramp.weight(), 0.0);
            let samples = length.max(1);
            for _ in 0..samples {
                assert!(ramp.weight() < 1.0);
                ramp.rise();
            }
            assert_eq!(ramp.weight(), 1.0);
            assert_eq!(Ramp::<f32>::new(length).at_top(), ramp);
            let mut fast = ramp;
            for _ in 0..OUT_WITHIN {
                fast.drop_out();
            }
            assert!(fast.is_zero() && fast.weight() == 0.0);
            ramp.fall();
            assert!(ramp.weight() < 1.0);
        }
    }
}
