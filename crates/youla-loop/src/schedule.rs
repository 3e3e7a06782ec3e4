//! Q between two operating points at which the same factors hold, so that one S and one Q belong to each.
//!
//! With `S_0, S_1` identified and `Q_0, Q_1` designed at the ends, the loop between them is that of
//!
//! ```text
//! Q(w) = (1 - w) Q_0 + w Q_1        S(v) = (1 - v) S_0 + v S_1 + dS        alpha = Q beta, beta = S alpha
//! ```
//!
//! It is stable where `T = (I - Q S)^-1` is. Around the centre of a square of half width h in (w, v), with `DQ = Q_1 - Q_0`,
//! `DS = S_1 - S_0` and T at the centre, the loop stays stable within the whole square if T is stable and
//!
//! ```text
//! h |T DQ S| + h |T Q DS| + h^2 |T DQ DS| < 1        H-infinity norms
//! ```
//!
//! by the small-gain theorem (K. Zhou, J. C. Doyle, K. Glover, Robust and Optimal Control, 1996, theorem 9.1). A square where this fails
//! is divided by four. All weights are covered at every v, so that Q need not follow the operating point exactly; the point must
//! move slowly beside the loop. What is left of 1 is the room for `dS`, since nobody knows S between the ends.

use crate::error::Result;
use youla::Mat;
use youla::linalg::eye;
use youla::lti::{Discrete, PeakOptions, StateSpace, linf_norm};
use youla::reduce::{ReducedOrder, ReductionOptions, reduce};

/// Smallest half width of a square.
const FINEST: f64 = 1.0 / 32.0;
/// Hankel singular values of Q(w) below this share of the largest are cancellations: what `Q_0` and `Q_1` have in common.
const COMMON: f64 = 1e-9;

/// Evidence that all loops between two operating points are stable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BetweenPoints {
    /// Largest left side of the inequality over the squares, below 1.
    pub gain: f64,
    /// Squares.
    pub squares: usize,
    /// H-infinity norm that `dS` may have, beta per alpha.
    pub room: f64,
    /// H-infinity norm of `S_1 - S_0`.
    pub change: f64,
    /// H-infinity norm that an error of `Q(w)` may have instead, alpha per beta.
    pub q_room: f64,
}

/// Q(w) with the error that its reduction makes.
#[derive(Debug, Clone)]
pub struct QBetween {
    /// From beta to alpha.
    pub q: StateSpace<Discrete>,
    /// Upper bound of the H-infinity norm of the error; 0 where nothing but cancellations was removed.
    pub error: f64,
}

/// Tests all loops between two operating points, `q` and `s` of both; `None` where one is unstable or nearly so.
///
/// # Errors
/// Those of the norms: another number of ports, an unstable Q or S.
///
/// ```
/// use youla::{Mat, linalg::eye, lti::{Discrete, StateSpace}};
/// use youla_loop::schedule::between_points;
/// let gain = |k: f64| StateSpace::gain(eye(1) * faer::Scale(k), Discrete::new(1e-3)?);
/// // |Q S| is at most 0.4: stable by the small-gain theorem.
/// let found = between_points([&gain(0.2)?, &gain(-0.2)?], [&gain(1.0)?, &gain(2.0)?])?.ok_or("unstable")?;
/// assert!(found.gain < 1.0 && (found.change - 1.0).abs() < 1e-2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn between_points(q: [&StateSpace<Discrete>; 2], s: [&StateSpace<Discrete>; 2]) -> Result<Option<BetweenPoints>> {
    q[0].require_stable("the first Q")?;
    q[1].require_stable("the second Q")?;
    s[0].require_stable("the first S")?;
    s[1].require_stable("the second S")?;
    let (dq, ds) = (q[1].plus(&q[0].negated())?, s[1].plus(&s[0].negated())?);
    let mut all =
        BetweenPoints { gain: 0.0, squares: 0, room: f64::INFINITY, change: norm(&ds)?, q_room: f64::INFINITY };
    let mut squares = vec![([0.5, 0.5], 0.5)];
    while let Some((centre, half)) = squares.pop() {
        let at = Square { q: &mixed(q, centre[0])?, s: &mixed(s, centre[1])?, dq: &dq, ds: &ds, half };
        match at.norms()? {
            Some(found) if found.gain < 1.0 => {
                all.gain = all.gain.max(found.gain);
                all.room = all.room.min(found.room);
                all.q_room = all.q_room.min(found.q_room);
                all.squares += 1;
            }
            _ if half <= FINEST => return Ok(None),
            _ => {
                let quarter = 0.5 * half;
                let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
                squares.extend(corners.map(|c| ([0, 1].map(|i| centre[i] + c[i] * quarter), quarter)));
            }
        }
    }
    Ok(Some(all))
}

/// Q(w) of at most `most` states, by balanced truncation.
///
/// # Errors
/// Those of the reduction.
pub fn q_between(q: [&StateSpace<Discrete>; 2], weight: f64, most: usize) -> Result<QBetween> {
    let system = mixed(q, weight)?;
    let minimal = reduce(&system, &ReductionOptions { minimality: COMMON, ..ReductionOptions::default() })?;
    if minimal.model.order() <= most {
        return Ok(QBetween { q: minimal.model, error: minimal.error_bound.unwrap_or(0.0) });
    }
    let order = ReducedOrder::Fixed(most);
    let reduced = reduce(&system, &ReductionOptions { order, ..ReductionOptions::default() })?;
    Ok(QBetween { error: reduced.error_bound.unwrap_or(f64::INFINITY), q: reduced.model })
}

/// `(1 - w) G_0 + w G_1`.
fn mixed(g: [&StateSpace<Discrete>; 2], weight: f64) -> Result<StateSpace<Discrete>> {
    let share = |system: &StateSpace<Discrete>, weight: f64| {
        let scaled = Mat::from_fn(system.outputs(), system.outputs(), |i, j| if i == j { weight } else { 0.0 });
        system.map_output(&scaled)
    };
    if weight == 0.0 || weight == 1.0 {
        return Ok(g[usize::from(weight == 1.0)].clone());
    }
    Ok(share(g[0], 1.0 - weight).plus(&share(g[1], weight))?)
}

fn norm(system: &StateSpace<Discrete>) -> Result<f64> {
    // The upper bound, so that the inequality is on the safe side.
    Ok(linf_norm(system, &PeakOptions { tolerance: 1e-3 })?.upper)
}

/// A square with Q and S at its centre.
struct Square<'a> {
    q: &'a StateSpace<Discrete>,
    s: &'a StateSpace<Discrete>,
    dq: &'a StateSpace<Discrete>,
    ds: &'a StateSpace<Discrete>,
    half: f64,
}

impl Square<'_> {
    /// Gain and rooms; `None` where the loop at the centre is unstable.
    fn norms(&self) -> Result<Option<BetweenPoints>> {
        let m = self.q.outputs();
        let open = self.s.then(self.q)?.negated();
        let t = open.plus(&StateSpace::gain(eye(m), open.time())?)?.inverse()?;
        if !t.is_stable()? {
            return Ok(None);
        }
        let through = |first: &StateSpace<Discrete>, second: &StateSpace<Discrete>| -> Result<f64> {
            norm(&first.then(second)?.then(&t)?)
        };
        let h = self.half;
        let of_both = through(self.ds, self.dq)?;
        let gain = h * through(self.s, self.dq)? + h * through(self.ds, self.q)? + h * h * of_both;
        let (of_q, of_dq) = (norm(&self.q.then(&t)?)?, norm(&self.dq.then(&t)?)?);
        let of_s = norm(self.s)? + h * norm(self.ds)?;
        let left = (1.0 - gain).max(0.0);
        let q_room = left / (norm(&t)? * of_s);
        Ok(Some(BetweenPoints { gain, squares: 1, room: left / (of_q + h * of_dq), change: 0.0, q_room }))
    }
}

#[cfg(test)]
mod tests;
