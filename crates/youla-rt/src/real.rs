//! The numbers that a controller computes with.

use core::fmt::Debug;
use core::ops::{Add, Mul, Neg, Sub};

/// `f32` or `f64`; sealed, because what holds for a controller was tested for these two.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
{
    /// The number 0.
    const ZERO: Self;

    /// The number 1.
    const ONE: Self;

    /// Whether the number is neither infinite nor NaN.
    fn is_finite(self) -> bool;

    /// The absolute value.
    #[must_use]
    fn abs(self) -> Self;

    /// A count as a number, exact.
    fn from_count(count: u16) -> Self;

    /// 1 / count; infinite for 0.
    fn reciprocal_of(count: u16) -> Self;

    /// From single precision, exact.
    fn from_single(x: f32) -> Self;

    /// Rounded to single precision.
    fn to_single(self) -> f32;

    /// Its bytes, the least significant first, appended to a checksum.
    fn append_to(self, checksum: &mut crate::Checksum);
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

macro_rules! real {
    ($real:ty) => {
        impl Real for $real {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;

            #[inline]
            fn is_finite(self) -> bool {
                self.is_finite()
            }

            #[inline]
            fn abs(self) -> Self {
                self.abs()
            }

            #[inline]
            fn from_count(count: u16) -> Self {
                count.into()
            }

            #[inline]
            fn reciprocal_of(count: u16) -> Self {
                1.0 / <$real>::from(count)
            }

            #[inline]
            fn from_single(x: f32) -> Self {
                x.into()
            }

            #[inline]
            fn to_single(self) -> f32 {
                self as f32
            }

            #[inline]
            fn append_to(self, checksum: &mut crate::Checksum) {
                checksum.append(&self.to_le_bytes());
            }
        }
    };
}

real!(f32);
real!(f64);
