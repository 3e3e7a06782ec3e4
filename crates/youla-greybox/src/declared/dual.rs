//! Numbers with the derivative in one direction: `(v, v')` with `f(v, v') = (f(v), f'(v) v')`, exact but for rounding.

/// A value and its derivative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dual {
    pub(super) value: f64,
    pub(super) slope: f64,
}

impl Dual {
    pub(super) fn constant(value: f64) -> Self {
        Dual { value, slope: 0.0 }
    }

    /// `f(v)` with `f' = derivative`, which may be infinite where v does not move.
    pub(super) fn chain(self, value: f64, derivative: f64) -> Self {
        Dual { value, slope: times(derivative, self.slope) }
    }

    pub(super) fn plus(self, other: Self) -> Self {
        Dual { value: self.value + other.value, slope: self.slope + other.slope }
    }

    pub(super) fn minus(self, other: Self) -> Self {
        Dual { value: self.value - other.value, slope: self.slope - other.slope }
    }

    pub(super) fn negated(self) -> Self {
        Dual { value: -self.value, slope: -self.slope }
    }

    pub(super) fn by(self, other: Self) -> Self {
        let slope = times(self.value, other.slope) + times(other.value, self.slope);
        Dual { value: self.value * other.value, slope }
    }

    pub(super) fn over(self, other: Self) -> Self {
        let value = self.value / other.value;
        let slope = times(1.0 / other.value, self.slope) - times(value / other.value, other.slope);
        Dual { value, slope }
    }

    /// `v^w`: `w v^(w-1) v' + v^w ln v w'`; a negative base is fine where the exponent does not move.
    pub(super) fn power(self, exponent: Self) -> Self {
        let (v, w) = (self.value, exponent.value);
        let value = v.powf(w);
        let by_base = if w == 0.0 { 0.0 } else { times(w * v.powf(w - 1.0), self.slope) };
        Dual { value, slope: by_base + times(value * v.ln(), exponent.slope) }
    }
}

/// A product with a direction: nothing comes of a direction that is zero.
fn times(factor: f64, slope: f64) -> f64 {
    if slope == 0.0 { 0.0 } else { factor * slope }
}
