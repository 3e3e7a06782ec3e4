//! Shifts of the QR iteration, always two at a time so that the arithmetic stays real.

use crate::linalg::square::Square;

/// Two shifts: a conjugate pair `re +- i im`, or twice the real number `re`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shifts {
    re: f64,
    im: f64,
}

impl Shifts {
    /// Eigenvalues of the trailing 2 x 2 block (if real, twice the one nearer to the last entry), with an exceptional
    /// pair every tenth sweep to leave a cycle.
    pub(crate) fn choose(t: &Square, start: usize, end: usize, sweeps: usize) -> Self {
        let n = end - 1;
        let (a, b, c, d) = (t[(n - 1, n - 1)], t[(n - 1, n)], t[(n, n - 1)], t[(n, n)]);
        if sweeps.is_multiple_of(10) {
            let k = if sweeps.is_multiple_of(20) { n } else { start + 2 };
            let size = t[(k, k - 1)].abs() + t[(k - 1, k - 2)].abs();
            return Shifts { re: t[(k, k)] + 0.75 * size, im: 0.4375_f64.sqrt() * size };
        }
        let half = 0.5 * (a - d);
        let discriminant = half * half + b * c;
        if discriminant < 0.0 {
            return Shifts { re: d + half, im: (-discriminant).sqrt() };
        }
        let away = half + discriminant.sqrt().copysign(half);
        Shifts { re: if away == 0.0 { d } else { d - b * c / away }, im: 0.0 }
    }

    /// The first column of `(T - s1 I)(T - s2 I)` for the block that begins in row k, divided by its size. It is made of
    /// differences to the shifts, so that eigenvalues that agree in many digits are still distinguished.
    pub(crate) fn first_column(self, t: &Square, k: usize) -> [f64; 3] {
        let (a, b, c, d) = (t[(k, k)] - self.re, t[(k, k + 1)], t[(k + 1, k)], t[(k + 1, k + 1)] - self.re);
        let im = self.im;
        let size = a.abs() + im.abs() + c.abs();
        if size == 0.0 {
            return [0.0; 3];
        }
        let r = c / size;
        [r * b + a * (a / size) + im * (im / size), r * (a + d), r * t[(k + 2, k + 1)]]
    }

    /// The row in which a sweep may begin: the lowest below which the shifts act as if the rows above were split off, because
    /// two subdiagonal entries in turn are small. From farther up they would be lost in rounding on their way down.
    pub(crate) fn first_row(self, t: &Square, start: usize, end: usize) -> usize {
        for k in (start + 1..end - 2).rev() {
            let [x, y, z] = self.first_column(t, k);
            let neighbours = t[(k - 1, k - 1)].abs() + t[(k, k)].abs() + t[(k + 1, k + 1)].abs();
            if t[(k, k - 1)].abs() * (y.abs() + z.abs()) <= f64::EPSILON * x.abs() * neighbours {
                return k;
            }
        }
        start
    }
}
