//! The part of the logged input that the controller does not explain, as declared and with one change.

use super::gains::gains;
use super::{CONTAINED, Change, ControllerRecord, GainPart};
use crate::error::Result;
use youla::Mat;
use youla::linalg::{block, eye, least_squares};
use youla::lti::{Discrete, StateSpace, simulate_best};

/// Signals of the controller: `w = K e`.
pub(super) struct Log<'a> {
    pub(super) record: ControllerRecord<'a>,
    pub(super) e: Mat<f64>,
    pub(super) w: Mat<f64>,
}

impl<'a> Log<'a> {
    pub(super) fn new(record: ControllerRecord<'a>) -> Self {
        let e = record.reference.map_or_else(|| record.y.to_owned(), |r| record.y - r);
        let w = record.input_excitation.map_or_else(|| record.u.to_owned(), |d| record.u - d);
        Log { record, e, w }
    }

    pub(super) fn residual(&self, k: &StateSpace<Discrete>, e: &Mat<f64>, w: &Mat<f64>) -> Result<f64> {
        Ok(relative(&(w - simulate_best(&with_constant(k)?, e.as_ref(), w.as_ref())?), w))
    }

    /// Every change with the residual that it leaves; `parts` are those of the controller with a gain each.
    pub(super) fn changes(&self, k: &StateSpace<Discrete>, parts: &[GainPart]) -> Result<Vec<(Change, f64)>> {
        let mut all = vec![(Change::Sign, self.residual(&k.negated(), &self.e, &self.w)?)];
        let d = self.record.input_excitation;
        let other = d.map_or_else(|| -1.0 * self.record.u, |d| -1.0 * self.record.u - d);
        all.push((Change::InputSign, self.residual(k, &self.e, &other)?));
        let m = self.w.ncols();
        if m == self.e.ncols() {
            let exchanged = ControllerRecord { u: self.record.y, y: self.record.u, ..self.record };
            let log = Log::new(exchanged);
            all.push((Change::Roles, self.residual(k, &log.e, &log.w)?));
        }
        for (i, j) in (0..m).flat_map(|i| (i + 1..m).map(move |j| (i, j))) {
            let mut u = self.record.u.to_owned();
            for t in 0..u.nrows() {
                (u[(t, i)], u[(t, j)]) = (u[(t, j)], u[(t, i)]);
            }
            let w = d.map_or_else(|| u.clone(), |d| &u - d);
            all.push((Change::ExchangedInputs(i, j), self.residual(k, &self.e, &w)?));
        }
        let free = simulate_best(&with_trend(k)?, self.e.as_ref(), self.w.as_ref())?;
        all.push((Change::Trend, relative(&(&self.w - free), &self.w)));
        all.extend(self.shifts(k)?);
        if let Some(d) = d {
            all.push((Change::WithoutExcitation, self.residual(k, &self.e, &self.record.u.to_owned())?));
            all.push((Change::ExcitationSign, self.residual(k, &self.e, &(self.record.u + d))?));
        }
        all.extend(self.places_of_excitation(k)?);
        all.extend(gains(self, k, parts)?);
        let p = self.e.ncols();
        for (i, j) in (0..p).flat_map(|i| (i + 1..p).map(move |j| (i, j))) {
            let place = |c: usize| {
                if c == i {
                    j
                } else if c == j {
                    i
                } else {
                    c
                }
            };
            let e = match self.record.reference {
                // The measured channels are exchanged, the references are not.
                Some(r) => Mat::from_fn(self.e.nrows(), p, |t, c| self.record.y[(t, place(c))] - r[(t, c)]),
                None => Mat::from_fn(self.e.nrows(), p, |t, c| self.e[(t, place(c))]),
            };
            all.push((Change::Exchanged(i, j), self.residual(k, &e, &self.w)?));
        }
        all.extend(self.saturation(k)?);
        Ok(all)
    }

    /// Channels a few samples earlier or later.
    pub(super) fn shifts(&self, k: &StateSpace<Discrete>) -> Result<Vec<(Change, f64)>> {
        let mut all = Vec::new();
        for rows in [-1isize, 1, -2, 2] {
            let (e, w) = shifted(&self.e, &self.w, rows);
            all.push((Change::Shift(rows), self.residual(k, &e, &w)?));
            let Some(d) = self.record.input_excitation.filter(|_| rows.abs() == 1) else { continue };
            let (d, u) = shifted(&d.to_owned(), &self.record.u.to_owned(), rows);
            all.push((Change::InputShift(rows), self.residual(k, &e, &(&u - &d))?));
        }
        Ok(all)
    }

    /// The only known excitation at the other place.
    fn places_of_excitation(&self, k: &StateSpace<Discrete>) -> Result<Option<(Change, f64)>> {
        let ControllerRecord { u, y, input_excitation, reference } = self.record;
        let (change, e, w) = match (input_excitation, reference) {
            (None, Some(r)) if r.ncols() == u.ncols() => (Change::ReferenceAtInput, y.to_owned(), u - r),
            (Some(d), None) if d.ncols() == y.ncols() => (Change::ExcitationAtReference, y - d, u.to_owned()),
            _ => return Ok(None),
        };
        Ok(Some((change, self.residual(k, &e, &w)?)))
    }

    /// Share of `u - K e` that the excitation explains, a few samples early or late, in the input where it is least; 1 where it is too small beside the rest for
    /// the comparison: in the input or not, it would explain little.
    pub(super) fn contained(&self, k: &StateSpace<Discrete>) -> Result<f64> {
        let Some(d) = self.record.input_excitation else { return Ok(1.0) };
        let u = self.record.u;
        let left = centred(&(u - simulate_best(&with_constant(k)?, self.e.as_ref(), u.to_owned().as_ref())?));
        let d = centred(&d.to_owned());
        let (reach, mut least) = (3usize, 1.0f64);
        let rows = d.nrows().saturating_sub(2 * reach);
        for j in (0..d.ncols()).filter(|j| d.col(*j).norm_max() > 0.0) {
            let regressors = Mat::from_fn(rows, 2 * reach + 1, |t, lag| d[(t + lag, j)]);
            let target = left.submatrix(reach, j, rows, 1);
            if d.col(j).squared_norm_l2() < 2.0 * CONTAINED * target.squared_norm_l2() {
                continue;
            }
            let found = least_squares("the excitation in the input", regressors.as_ref(), target)?;
            let rest = target - regressors * found.x;
            least = least.min(1.0 - rest.squared_norm_l2() / target.squared_norm_l2().max(f64::MIN_POSITIVE));
        }
        Ok(least)
    }

    fn saturation(&self, k: &StateSpace<Discrete>) -> Result<Option<(Change, f64)>> {
        let u = self.record.u;
        let free = simulate_best(&with_constant(k)?, self.e.as_ref(), self.w.as_ref())?;
        let free = self.record.input_excitation.map_or_else(|| free.clone(), |d| &free + d);
        let limits = |j: usize| {
            let values = u.col(j);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            [low, values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
        };
        let all: Vec<[f64; 2]> = (0..u.ncols()).map(limits).collect();
        let held = Mat::from_fn(u.nrows(), u.ncols(), |t, j| free[(t, j)].clamp(all[j][0], all[j][1]));
        let left = relative(&(u - held), &u.to_owned());
        Ok(all.first().map(|limits| (Change::Saturation(*limits), left)))
    }
}

/// The controller with a constant at each of its inputs as further states. The mean that was taken out of a record is such a constant,
/// and an integrator makes a ramp of it.
pub(super) fn with_constant(k: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
    let (n, p) = (k.order(), k.inputs());
    let zero = Mat::<f64>::zeros(p, n);
    let a = block(&[&[k.a(), k.b()], &[zero.as_ref(), eye(p).as_ref()]]);
    let b = block(&[&[k.b()], &[Mat::<f64>::zeros(p, p).as_ref()]]);
    Ok(StateSpace::new(a, b, block(&[&[k.c(), k.d()]]), k.d().to_owned(), k.time())?)
}

/// The controller with a line of time at each of its inputs as further states.
fn with_trend(k: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
    let (n, p) = (k.order(), k.inputs());
    let zeros = |rows, columns| Mat::<f64>::zeros(rows, columns);
    // The line grows by a share of itself that keeps the states of one size.
    let slope = eye(p) * faer::Scale(1e-3);
    let a = block(&[
        &[k.a(), k.b(), zeros(n, p).as_ref()],
        &[zeros(p, n).as_ref(), eye(p).as_ref(), slope.as_ref()],
        &[zeros(p, n).as_ref(), zeros(p, p).as_ref(), eye(p).as_ref()],
    ]);
    let b = block(&[&[k.b()], &[zeros(2 * p, p).as_ref()]]);
    let c = block(&[&[k.c(), k.d(), zeros(k.outputs(), p).as_ref()]]);
    Ok(StateSpace::new(a, b, c, k.d().to_owned(), k.time())?)
}

/// `e(k - rows)` beside `w(k)`.
fn shifted(e: &Mat<f64>, w: &Mat<f64>, rows: isize) -> (Mat<f64>, Mat<f64>) {
    let count = e.nrows() - rows.unsigned_abs();
    let (of_e, of_w) = if rows > 0 { (0, rows.unsigned_abs()) } else { (rows.unsigned_abs(), 0) };
    (e.subrows(of_e, count).to_owned(), w.subrows(of_w, count).to_owned())
}

pub(super) fn centred(x: &Mat<f64>) -> Mat<f64> {
    let mean: Vec<f64> = x.col_iter().map(|c| c.iter().sum::<f64>() / x.nrows() as f64).collect();
    Mat::from_fn(x.nrows(), x.ncols(), |i, j| x[(i, j)] - mean[j])
}

fn relative(left: &Mat<f64>, of: &Mat<f64>) -> f64 {
    let size = centred(of).norm_l2();
    if size > 0.0 { centred(left).norm_l2() / size } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A PI controller on records whose means were removed: explained to rounding, and not with the other sign.
    #[test]
    fn removed_means_are_no_error_of_an_integrator() {
        let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
        let time = Discrete::new(1e-3).unwrap();
        let k = StateSpace::new(number(1.0), number(1.0), number(0.02), number(0.5), time).unwrap();
        let y = Mat::from_fn(2000, 1, |t, _| (0.07 * t as f64).sin() + (0.011 * t as f64).cos() + 0.3);
        let d = Mat::from_fn(2000, 1, |t, _| if (t / 37) % 2 == 0 { 1.0 } else { -1.0 });
        let u = youla::lti::simulate(&k, y.as_ref(), &[2.0]).unwrap() + &d;
        let (u, y, d) = (centred(&u), centred(&y), centred(&d));
        let record =
            ControllerRecord { u: u.as_ref(), y: y.as_ref(), input_excitation: Some(d.as_ref()), reference: None };
        let log = Log::new(record);
        assert!(log.residual(&k, &log.e, &log.w).unwrap() < 1e-9);
        assert!(log.residual(&k.negated(), &log.e, &log.w).unwrap() > 0.1);
    }

    /// Another column is found beside the controller that ran; beside a controller of another unit nothing is said of the excitation.
    #[test]
    fn the_excitation_is_compared_where_it_matters() {
        let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
        let k = |gain: f64| {
            let time = Discrete::new(1e-3).unwrap();
            StateSpace::new(number(0.5), number(1.0), number(gain), number(gain), time).unwrap()
        };
        let square = |half: usize| Mat::from_fn(2000, 1, |t, _| if (t / half).is_multiple_of(2) { 1.0 } else { -1.0 });
        let (y, d, other) = (Mat::from_fn(2000, 1, |t, _| (0.07 * t as f64).sin()), square(37), square(23));
        let u = youla::lti::simulate(&k(0.5), y.as_ref(), &[0.0]).unwrap() + &d;
        let contained = |d: &Mat<f64>, gain: f64| {
            let (u, y, input_excitation) = (u.as_ref(), y.as_ref(), Some(d.as_ref()));
            Log::new(ControllerRecord { u, y, input_excitation, reference: None }).contained(&k(gain)).unwrap()
        };
        assert!(contained(&d, 0.5) > 0.99 && contained(&other, 0.5) < CONTAINED);
        assert_eq!([contained(&d, 30.0), contained(&other, 30.0)], [1.0; 2]);
    }
}
