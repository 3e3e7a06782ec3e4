//! The numbers that a controller computes with.

use core::fmt::Debug;
use core::ops::{Add, Mul, Sub};

/// `f32` or `f64`; sealed, because what holds for a controller was tested for these two.
pub trait Real:
    sealed::Sealed + Copy + Debug + PartialEq + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// The number 0.
    const ZERO: Self;

    /// Whether the number is neither infinite nor NaN.
    fn is_finite(self) -> bool;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl Real for f32 {
    const ZERO: Self = 0.0;

    #[inline]
    fn is_finite(self) -> bool {
        self.is_finite()
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;

    #[inline]
    fn is_finite(self) -> bool {
        self.is_finite()
    }
}
