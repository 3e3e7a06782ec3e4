//! One system with its ports split in two groups, `(w1, w2) -> (z1, z2)`: linear fractional transformations (18), (21)
//! and the Redheffer star product (24).

use super::{StateSpace, TimeDomain};
use crate::linalg::{eye, solve};
use crate::{Error, Result};
use faer::{Mat, Scale};

/// A system with two groups of inputs `(w1, w2)` and two groups of outputs `(z1, z2)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Partitioned<T: TimeDomain> {
    system: StateSpace<T>,
    first_inputs: usize,
    first_outputs: usize,
}

impl<T: TimeDomain> Partitioned<T> {
    /// Splits the ports of a system after its first `first_inputs` inputs and `first_outputs` outputs.
    ///
    /// # Errors
    /// [`Error::Ports`] when the system has fewer ports than that.
    pub fn new(system: StateSpace<T>, first_outputs: usize, first_inputs: usize) -> Result<Self> {
        for (what, count, all) in
            [("inputs", first_inputs, system.inputs()), ("outputs", first_outputs, system.outputs())]
        {
            if count > all {
                let what = format!("the number of {what} of the first group");
                return Err(Error::Ports { what, expected: all, found: count });
            }
        }
        Ok(Partitioned { system, first_inputs, first_outputs })
    }

    /// The whole system, `[w1; w2]` to `[z1; z2]`.
    pub fn system(&self) -> &StateSpace<T> {
        &self.system
    }

    /// From input group `column` to output group `row` (0 or 1 each).
    pub fn part(&self, row: usize, column: usize) -> StateSpace<T> {
        let range = |index: usize, first: usize, all: usize| if index == 0 { 0..first } else { first..all };
        let outputs = range(row, self.first_outputs, self.system.outputs());
        self.system.part(outputs, range(column, self.first_inputs, self.system.inputs()))
    }

    /// Upper linear fractional transformation `F_u(P, s)`: closes `w1 = s z1`, leaves `w2 -> z2`; eq. (18).
    ///
    /// # Errors
    /// [`Error::Ports`], [`Error::SampleTimeMismatch`], [`Error::AlgebraicLoop`].
    pub(crate) fn upper_lft(&self, s: &StateSpace<T>) -> Result<StateSpace<T>> {
        Ok(Partitioned::new(s.clone(), 0, 0)?.star(self)?.system)
    }

    /// Lower linear fractional transformation `F_l(P, q)`: closes `w2 = q z2`, leaves `w1 -> z1`; eq. (21).
    ///
    /// # Errors
    /// [`Error::Ports`], [`Error::SampleTimeMismatch`], [`Error::AlgebraicLoop`].
    pub fn lower_lft(&self, q: &StateSpace<T>) -> Result<StateSpace<T>> {
        let (outputs, inputs) = (q.outputs(), q.inputs());
        Ok(self.star(&Partitioned::new(q.clone(), outputs, inputs)?)?.system)
    }

    /// Redheffer star product: the second ports of this system meet the first ports of `other`
    /// (`z2` drives its `w1`, its `z1` drives `w2`); what remains is `(w1, other w2) -> (z1, other z2)`.
    ///
    /// # Errors
    /// [`Error::Ports`], [`Error::SampleTimeMismatch`], [`Error::AlgebraicLoop`] when the loop is not well posed.
    pub fn star(&self, other: &Self) -> Result<Self> {
        let (down, up) = (self.system.outputs() - self.first_outputs, self.system.inputs() - self.first_inputs);
        for (what, found, expected) in [
            ("the number of first inputs in a star product", other.first_inputs, down),
            ("the number of first outputs in a star product", other.first_outputs, up),
        ] {
            if found != expected {
                return Err(Error::Ports { what: what.into(), expected, found });
            }
        }
        let outer_in = self.first_inputs + other.system.inputs() - down;
        let outer_out = self.first_outputs + other.system.outputs() - up;
        let both = self.system.append(&other.system)?;
        // Joined order: inputs [w1, v_up, v_down, w2'], outputs [z1, r_down, r_up, z2'], internal ports moved last.
        let inputs = move_to_end(self.first_inputs, up + down, both.inputs());
        let outputs = move_to_end(self.first_outputs, up + down, both.outputs());
        let ordered = both.map_input(&inputs.transpose().to_owned()).map_output(&outputs);
        let routing = Mat::from_fn(up + down, down + up, |i, j| f64::from(j == (i + down) % (up + down).max(1)));
        let system = ordered.close(routing.as_ref())?;
        debug_assert_eq!((system.inputs(), system.outputs()), (outer_in, outer_out));
        Partitioned::new(system, self.first_outputs, self.first_inputs)
    }

    /// The same system with its input groups in the other order, `(w2, w1) -> (z1, z2)`.
    ///
    /// # Errors
    /// Never for a valid system.
    pub fn with_inputs_swapped(&self) -> Result<Self> {
        let all = self.system.inputs();
        let order = move_to_end(0, self.first_inputs, all).transpose().to_owned();
        Partitioned::new(self.system.map_input(&order), self.first_outputs, all - self.first_inputs)
    }

    /// Exchanges the roles of the first ports: from `(w1, w2) -> (z1, z2)` to `(z1, w2) -> (w1, z2)`.
    ///
    /// # Errors
    /// [`Error::Ports`] unless the groups have the same size, [`Error::Singular`] when `D11` is not invertible.
    pub fn exchange_first(&self) -> Result<Self> {
        let k = self.first_inputs;
        if self.first_outputs != k {
            let what = "the number of first outputs to exchange with the first inputs".into();
            return Err(Error::Ports { what, expected: k, found: self.first_outputs });
        }
        let s = &self.system;
        let (n, m, p) = (s.order(), s.inputs(), s.outputs());
        let d11 = s.d().submatrix(0, 0, k, k);
        let what = "the feedthrough between the ports to exchange";
        // w1 = D11^-1 (z1 - C1 x - D12 w2)
        let from_x = solve(what, d11, s.c().subrows(0, k))?;
        let from_z1 = solve(what, d11, eye(k).as_ref())?;
        let from_w2 = solve(what, d11, s.d().submatrix(0, k, k, m - k))?;
        let (b1, b2) = (s.b().subcols(0, k), s.b().subcols(k, m - k));
        let (d21, d22) = (s.d().submatrix(k, 0, p - k, k), s.d().submatrix(k, k, p - k, m - k));
        let mut b = Mat::zeros(n, m);
        b.as_mut().subcols_mut(0, k).copy_from(b1 * &from_z1);
        b.as_mut().subcols_mut(k, m - k).copy_from(b2 - b1 * &from_w2);
        let mut c = Mat::zeros(p, n);
        c.as_mut().subrows_mut(0, k).copy_from(Scale(-1.0) * &from_x);
        c.as_mut().subrows_mut(k, p - k).copy_from(s.c().subrows(k, p - k) - d21 * &from_x);
        let mut d = Mat::zeros(p, m);
        d.as_mut().submatrix_mut(0, 0, k, k).copy_from(&from_z1);
        d.as_mut().submatrix_mut(0, k, k, m - k).copy_from(Scale(-1.0) * &from_w2);
        d.as_mut().submatrix_mut(k, 0, p - k, k).copy_from(d21 * &from_z1);
        d.as_mut().submatrix_mut(k, k, p - k, m - k).copy_from(d22 - d21 * &from_w2);
        let system = StateSpace::new(s.a() - b1 * &from_x, b, c, d, s.time())?;
        Partitioned::new(system, k, k)
    }
}

/// Permutation matrix that moves the `count` rows from `start` behind all others.
fn move_to_end(start: usize, count: usize, all: usize) -> Mat<f64> {
    let source = |i: usize| match i {
        _ if i < start => i,
        _ if i < all - count => i + count,
        _ => start + i - (all - count),
    };
    Mat::from_fn(all, all, |i, j| f64::from(source(i) == j))
}
