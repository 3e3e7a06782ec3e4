//! State-space realisations of transfer functions and difference equations.

use super::{Discrete, StateSpace, TimeDomain};
use crate::linalg::{block, block_diagonal};
use crate::{Error, Result};
use faer::Mat;

/// A matrix of polynomials: `[row][column][coefficient]`.
pub type PolynomialMatrix = Vec<Vec<Vec<f64>>>;

impl<T: TimeDomain> StateSpace<T> {
    /// Realises the transfer matrix `numerator[i][j](x) / denominator[i][j](x)`, coefficients in **descending** powers of
    /// s or z.
    ///
    /// Where all denominators agree, the realisation has `degree * min(inputs, outputs)` states, otherwise each entry is
    /// realised by itself.
    ///
    /// # Errors
    /// [`Error::Polynomial`] for empty or ragged input, a leading coefficient of zero in a denominator, or a numerator of
    /// higher degree than its denominator.
    ///
    /// ```
    /// use youla::lti::{Continuous, StateSpace};
    /// let rigid_body = StateSpace::transfer_matrix(&vec![vec![vec![3.0]]], &vec![vec![vec![1.0, 0.5, 0.0]]], Continuous)?;
    /// assert_eq!(rigid_body.order(), 2);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn transfer_matrix(numerator: &PolynomialMatrix, denominator: &PolynomialMatrix, time: T) -> Result<Self> {
        let (p, m) = check_matrix(numerator, denominator)?;
        check_proper(numerator, denominator)?;
        let common = denominator.iter().flatten().all(|d| d == &denominator[0][0]);
        if common && p <= m {
            // One row of the transposed system at a time would double the states; the dual needs only its columns.
            let transposed: PolynomialMatrix =
                (0..m).map(|j| (0..p).map(|i| numerator[i][j].clone()).collect()).collect();
            return Ok(columns(&transposed, &denominator[0][0], time)?.dual());
        }
        if common {
            return columns(numerator, &denominator[0][0], time);
        }
        entries(numerator, denominator, time)
    }
}

impl StateSpace<Discrete> {
    /// Realises the difference equations `denominator(z^-1) u = numerator(z^-1) y` per entry, coefficients in
    /// **ascending** powers of z^-1 (the first is that of the present sample), as controllers are logged and programmed.
    ///
    /// Every such equation is causal, also with more coefficients in the numerator (a FIR filter, a PD controller).
    ///
    /// # Errors
    /// As [`Self::transfer_matrix`].
    pub fn difference_equation(
        numerator: &PolynomialMatrix,
        denominator: &PolynomialMatrix,
        time: Discrete,
    ) -> Result<Self> {
        check_matrix(numerator, denominator)?;
        // Times z^k, both polynomials of one length read as descending powers of z.
        let length = numerator.iter().chain(denominator).flatten().map(Vec::len).max().unwrap_or(0);
        let pad = |polynomials: &PolynomialMatrix| -> PolynomialMatrix {
            let padded = |c: &Vec<f64>| c.iter().copied().chain(std::iter::repeat(0.0)).take(length).collect();
            polynomials.iter().map(|row| row.iter().map(padded).collect()).collect()
        };
        Self::transfer_matrix(&pad(numerator), &pad(denominator), time)
    }
}

fn check_matrix(numerator: &PolynomialMatrix, denominator: &PolynomialMatrix) -> Result<(usize, usize)> {
    let p = numerator.len();
    let m = numerator.first().map_or(0, Vec::len);
    let bad = |problem: &'static str| Err(Error::Polynomial { problem });
    if p == 0 || m == 0 {
        return bad("the numerator is empty");
    }
    let same_shape = |x: &PolynomialMatrix| x.len() == p && x.iter().all(|row| row.len() == m);
    if !same_shape(numerator) || !same_shape(denominator) {
        return bad("numerator and denominator must have the same number of rows, and all rows the same length");
    }
    for coefficients in numerator.iter().chain(denominator).flatten() {
        if coefficients.is_empty() {
            return bad("a polynomial has no coefficients");
        }
        if coefficients.iter().any(|c| !c.is_finite()) {
            return bad("a coefficient is not a finite number");
        }
    }
    if denominator.iter().flatten().any(|d| d[0] == 0.0) {
        return bad("the first coefficient of a denominator is zero");
    }
    Ok((p, m))
}

/// Of a matrix in descending powers that [`check_matrix`] accepts.
fn check_proper(numerator: &PolynomialMatrix, denominator: &PolynomialMatrix) -> Result<()> {
    let (p, m) = (numerator.len(), numerator[0].len());
    let degree = |c: &[f64]| c.len() - c.iter().take_while(|&&x| x == 0.0).count();
    if (0..p).any(|i| (0..m).any(|j| degree(&numerator[i][j]) > denominator[i][j].len())) {
        let problem = "a numerator has a higher degree than its denominator (the system is not proper)";
        return Err(Error::Polynomial { problem });
    }
    Ok(())
}

/// Controllable canonical form of each input column, all with the same denominator.
fn columns<T: TimeDomain>(numerator: &PolynomialMatrix, denominator: &[f64], time: T) -> Result<StateSpace<T>> {
    let (p, m) = (numerator.len(), numerator[0].len());
    let mut system: Option<StateSpace<T>> = None;
    for j in 0..m {
        let column: Vec<&[f64]> = (0..p).map(|i| numerator[i][j].as_slice()).collect();
        let next = controllable_form(&column, denominator, time)?;
        system = Some(match system {
            None => next,
            Some(all) => StateSpace::new(
                block_diagonal(all.a(), next.a()),
                block_diagonal(all.b(), next.b()),
                block(&[&[all.c(), next.c()]]),
                block(&[&[all.d(), next.d()]]),
                time,
            )?,
        });
    }
    system.ok_or(Error::Polynomial { problem: "the numerator is empty" })
}

/// Every entry realised by itself, outputs of a row added.
fn entries<T: TimeDomain>(
    numerator: &PolynomialMatrix,
    denominator: &PolynomialMatrix,
    time: T,
) -> Result<StateSpace<T>> {
    let (p, m) = (numerator.len(), numerator[0].len());
    let mut total = StateSpace::gain(Mat::zeros(p, m), time)?;
    for i in 0..p {
        for j in 0..m {
            let entry = controllable_form(&[&numerator[i][j]], &denominator[i][j], time)?;
            let place = |rows: usize, index: usize| Mat::from_fn(rows, 1, |k, _| f64::from(k == index));
            let placed = entry.map_output(&place(p, i)).map_input(&place(m, j).transpose().to_owned());
            total = total.plus(&placed)?;
        }
    }
    Ok(total)
}

/// One input, several outputs over one denominator, coefficients in descending powers.
fn controllable_form<T: TimeDomain>(column: &[&[f64]], denominator: &[f64], time: T) -> Result<StateSpace<T>> {
    let n = denominator.len() - 1;
    let den: Vec<f64> = denominator.iter().map(|c| c / denominator[0]).collect();
    // Numerator coefficient of x^(n-k), left-padded with zeros.
    let num = |i: usize, k: usize| {
        let c = column[i];
        let index = (k + c.len()) as isize - (n + 1) as isize;
        if index < 0 { 0.0 } else { c[index as usize] / denominator[0] }
    };
    let a = Mat::from_fn(n, n, |i, j| if i == 0 { -den[j + 1] } else { f64::from(i == j + 1) });
    let b = Mat::from_fn(n, 1, |i, _| f64::from(i == 0));
    let c = Mat::from_fn(column.len(), n, |i, j| num(i, j + 1) - den[j + 1] * num(i, 0));
    let d = Mat::from_fn(column.len(), 1, |i, _| num(i, 0));
    StateSpace::new(a, b, c, d, time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lti::{Continuous, frequency_response, simulate};
    use faer::c64;

    fn horner(coefficients: &[f64], x: c64) -> c64 {
        coefficients.iter().fold(c64::new(0.0, 0.0), |sum, c| sum * x + c)
    }

    /// Largest relative distance between a realisation and its polynomials.
    fn distance<T: TimeDomain>(system: &StateSpace<T>, num: &PolynomialMatrix, den: &PolynomialMatrix) -> f64 {
        let omega = [0.1, 0.7, 1.3, 2.9];
        let response = frequency_response(system, &omega).unwrap();
        let mut worst = 0.0f64;
        for (k, w) in omega.iter().enumerate() {
            let x = system.time().boundary(*w);
            for (i, row) in num.iter().enumerate() {
                for (j, n) in row.iter().enumerate() {
                    let expected = horner(n, x) / horner(&den[i][j], x);
                    worst = worst.max((response.at(k)[(i, j)] - expected).norm() / expected.norm());
                }
            }
        }
        worst
    }

    #[test]
    fn realisations_have_the_response_of_their_polynomials() {
        let num = vec![vec![vec![2.0, 1.0], vec![3.0]], vec![vec![1.0, 0.5, 4.0], vec![0.0, 1.0]]];
        let common = vec![vec![vec![2.0, 0.3, 5.0]; 2]; 2];
        let each = vec![vec![vec![1.0, 3.0], vec![1.0, 0.2, 9.0]], vec![vec![2.0, 1.0, 1.0], vec![1.0, 4.0]]];
        for (den, order) in [(&common, 4), (&each, 6)] {
            let system = StateSpace::transfer_matrix(&num, den, Continuous).unwrap();
            assert_eq!(system.order(), order);
            assert!(distance(&system, &num, den) < 1e-14);
        }
        let (row, column) = (vec![vec![vec![1.0], vec![2.0, 3.0]]], vec![vec![vec![1.0]], vec![vec![2.0, 3.0]]]);
        for num in [row, column] {
            let den = num.iter().map(|r| vec![vec![1.0, 0.4, 2.0]; r.len()]).collect();
            let system = StateSpace::transfer_matrix(&num, &den, Discrete::new(0.5).unwrap()).unwrap();
            assert_eq!(system.order(), 2, "one denominator needs its degree only once");
            assert!(distance(&system, &num, &den) < 1e-14);
        }
    }

    #[test]
    fn difference_equation_is_the_recursion() {
        let (b, a) = ([5.5, 0.3, -5.2], [2.0, -1.1, 0.4]);
        let time = Discrete::new(5e-4).unwrap();
        let system = StateSpace::difference_equation(&vec![vec![b.to_vec()]], &vec![vec![a.to_vec()]], time).unwrap();
        let u = Mat::from_fn(50, 1, |k, _| ((k * k) as f64).sin());
        let y = simulate(&system, u.as_ref(), &[0.0, 0.0]).unwrap();
        let past = |m: &Mat<f64>, k: usize, delay: usize| if k < delay { 0.0 } else { m[(k - delay, 0)] };
        for k in 0..50 {
            let forced: f64 = (0..3).map(|d| b[d] * past(&u, k, d)).sum();
            let free: f64 = (1..3).map(|d| a[d] * past(&y, k, d)).sum();
            assert!((y[(k, 0)] - (forced - free) / a[0]).abs() < 1e-12);
        }
    }

    /// u(k) = 0.8 y(k) - 0.75 y(k-1) + 0.1 y(k-2): a numerator longer than its denominator delays, and is causal.
    #[test]
    fn finite_impulse_responses_are_difference_equations() {
        let taps = [0.8, -0.75, 0.1];
        let time = Discrete::new(1e-3).unwrap();
        let fir = StateSpace::difference_equation(&vec![vec![taps.to_vec()]], &vec![vec![vec![1.0]]], time).unwrap();
        assert_eq!(fir.order(), 2);
        let y = Mat::from_fn(6, 1, |k, _| f64::from(k == 0));
        let u = simulate(&fir, y.as_ref(), &[0.0; 2]).unwrap();
        assert!((0..6).all(|k| (u[(k, 0)] - taps.get(k).copied().unwrap_or(0.0)).abs() < 1e-15));
        let bad = |d: Vec<f64>| StateSpace::difference_equation(&vec![vec![vec![1.0, 2.0]]], &vec![vec![d]], time);
        assert!(bad(vec![0.0, 1.0]).is_err() && bad(Vec::new()).is_err());
    }

    #[test]
    fn unusable_polynomials_are_refused() {
        let refused = |num: &[f64], den: &[f64]| {
            StateSpace::transfer_matrix(&vec![vec![num.to_vec()]], &vec![vec![den.to_vec()]], Continuous).is_err()
        };
        assert!(refused(&[1.0, 0.0, 0.0], &[1.0, 1.0]), "not proper");
        assert!(!refused(&[0.0, 1.0, 0.0], &[1.0, 1.0]), "leading zeros do not count");
        assert!(refused(&[1.0], &[0.0, 1.0]) && refused(&[], &[1.0]) && refused(&[f64::NAN], &[1.0]));
    }
}
