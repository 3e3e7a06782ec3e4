//! The matrices of a controller, and the products with them.

use crate::Real;
use core::fmt;

/// The nominal model `x+ = A x + B u, y = C x + D u` and the gains of its controller, by rows: N states, M inputs (u,
/// alpha) and P outputs (y, beta) of the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrices<T, const N: usize, const M: usize, const P: usize> {
    /// State matrix A, n x n.
    pub a: [[T; N]; N],
    /// Input matrix B, n x m.
    pub b: [[T; M]; N],
    /// Output matrix C, p x n.
    pub c: [[T; N]; P],
    /// Feedthrough D, p x m.
    pub d: [[T; M]; P],
    /// State feedback F, m x n, with A + B F stable.
    pub f: [[T; N]; M],
    /// Observer gain L, n x p, with A + L C stable.
    pub l: [[T; P]; N],
}

/// A matrix holds a value that is not finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotFinite {
    /// The letter of the matrix.
    pub matrix: char,
    /// Row, counted from 1.
    pub row: usize,
    /// Column, counted from 1.
    pub column: usize,
}

impl fmt::Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let NotFinite { matrix, row, column } = self;
        write!(f, "the matrix {matrix} holds a value that is not finite in row {row}, column {column} (counted from 1)")
    }
}

impl core::error::Error for NotFinite {}

impl<T: Real, const N: usize, const M: usize, const P: usize> Matrices<T, N, M, P> {
    pub(crate) fn check_finite(&self) -> Result<(), NotFinite> {
        check_finite('A', &self.a)?;
        check_finite('B', &self.b)?;
        check_finite('C', &self.c)?;
        check_finite('D', &self.d)?;
        check_finite('F', &self.f)?;
        check_finite('L', &self.l)
    }
}

impl<const N: usize, const M: usize, const P: usize> Matrices<f64, N, M, P> {
    /// Every entry rounded to `f32`; one beyond the range of `f32` becomes infinite.
    pub(crate) fn to_f32(&self) -> Matrices<f32, N, M, P> {
        Matrices {
            a: to_f32(&self.a),
            b: to_f32(&self.b),
            c: to_f32(&self.c),
            d: to_f32(&self.d),
            f: to_f32(&self.f),
            l: to_f32(&self.l),
        }
    }
}

pub(crate) fn check_finite<T: Real, const R: usize, const K: usize>(
    matrix: char,
    x: &[[T; K]; R],
) -> Result<(), NotFinite> {
    for (row, values) in (1..).zip(x) {
        for (column, value) in (1..).zip(values) {
            if !value.is_finite() {
                return Err(NotFinite { matrix, row, column });
            }
        }
    }
    Ok(())
}

pub(crate) fn to_f32<const R: usize, const K: usize>(x: &[[f64; K]; R]) -> [[f32; K]; R] {
    x.map(|row| row.map(|value| value as f32))
}

/// `sum + matrix * x`.
#[inline]
pub(crate) fn plus<T: Real, const R: usize, const K: usize>(
    mut sum: [T; R],
    matrix: &[[T; K]; R],
    x: &[T; K],
) -> [T; R] {
    for (sum, row) in sum.iter_mut().zip(matrix) {
        for (entry, x) in row.iter().zip(x) {
            *sum = *sum + *entry * *x;
        }
    }
    sum
}

/// `sum - matrix * x`.
#[inline]
pub(crate) fn minus<T: Real, const R: usize, const K: usize>(
    mut sum: [T; R],
    matrix: &[[T; K]; R],
    x: &[T; K],
) -> [T; R] {
    for (sum, row) in sum.iter_mut().zip(matrix) {
        for (entry, x) in row.iter().zip(x) {
            *sum = *sum - *entry * *x;
        }
    }
    sum
}
