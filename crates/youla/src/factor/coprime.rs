//! The doubly coprime factorisation (13)-(15) of a nominal plant and a stabilising controller, as two systems.
//!
//! With positive feedback `u = K y`, `G(0) = N M^-1 = Mt^-1 Nt` and `K = U V^-1 = Vt^-1 Ut`,
//!
//! ```text
//! right = [M U; N V]          (eta, epsilon) -> (u, y)
//! left  = [Vt -Ut; -Nt Mt]    (u, y) -> (alpha, beta)        right * left = left * right = I      (15)
//! ```

use crate::linalg::{block, block_diagonal, eye};
use crate::lti::{Partitioned, StateSpace, TimeDomain};
use crate::{Error, Result};
use faer::{Mat, MatRef, Scale};

/// The eight coprime factors of (13)-(15), held as the block matrix and its inverse.
///
/// Both systems are stable and each is the inverse of the other. Every formula of the Youla-Jabr-Bongiorno-Kucera
/// parametrisation follows from these two, whatever construction they come from; see the other files of this module.
#[derive(Debug, Clone, PartialEq)]
pub struct CoprimeFactors<T: TimeDomain> {
    nominal: StateSpace<T>,
    right: Partitioned<T>,
    left: Partitioned<T>,
}

impl<T: TimeDomain> CoprimeFactors<T> {
    /// Factors of a nominal plant (n states, m inputs, p outputs) and its observer-based controller
    /// `xh+ = A xh + B u + L (C xh + D u - y), u = F xh` with `f` (m x n) and `l` (n x p):
    ///
    /// ```text
    /// right = [A+BF | B -L; F | I 0; C+DF | D I]     left = [A+LC | -(B+LD) L; F | I 0; C | -D I]
    /// ```
    ///
    /// Source: eqs (13)-(15) with positive feedback. The identity (15) holds to 1e-12 for the bearing
    /// (`tests/identities.rs`).
    ///
    /// # Errors
    /// [`Error::Shape`], and [`Error::Unstable`] naming the pole when `A+BF` or `A+LC` is not stable.
    ///
    /// ```
    /// use youla::{Mat, factor::CoprimeFactors, linalg::eye, lti::{Continuous, StateSpace}};
    /// let unstable = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
    /// let gain = Mat::from_fn(1, 1, |_, _| -3.0);
    /// let factors = CoprimeFactors::observer(&unstable, gain.as_ref(), gain.as_ref())?;
    /// assert_eq!(factors.right().system().order(), 1);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn observer(nominal: &StateSpace<T>, f: MatRef<'_, f64>, l: MatRef<'_, f64>) -> Result<Self> {
        let (n, m, p) = (nominal.order(), nominal.inputs(), nominal.outputs());
        crate::linalg::check_shape("the state feedback F", f, (m, n))?;
        crate::linalg::check_shape("the observer gain L", l, (n, p))?;
        let (a, b, c, d) = (nominal.a(), nominal.b(), nominal.c(), nominal.d());
        let (a_f, c_f) = (a + b * f, c + d * f);
        let (a_l, b_l) = (a + l * c, b + l * d);
        let minus = Scale(-1.0);
        let right = StateSpace::new(
            a_f,
            block(&[&[b, (minus * l).as_ref()]]),
            block(&[&[f], &[c_f.as_ref()]]),
            block(&[&[eye(m).as_ref(), Mat::zeros(m, p).as_ref()], &[d, eye(p).as_ref()]]),
            nominal.time(),
        )?;
        let left = StateSpace::new(
            a_l,
            block(&[&[(minus * b_l).as_ref(), l]]),
            block(&[&[f], &[c]]),
            block(&[&[eye(m).as_ref(), Mat::zeros(m, p).as_ref()], &[(minus * d).as_ref(), eye(p).as_ref()]]),
            nominal.time(),
        )?;
        right.require_stable("A + B F of the state feedback")?;
        left.require_stable("A + L C of the observer")?;
        Self::from_parts(nominal.clone(), right, left)
    }

    /// Factors of a nominal plant and **any** stabilising controller `u = K y` (positive feedback), by stacking a right
    /// coprime factorisation of each and inverting:
    ///
    /// ```text
    /// right = [diag(A+BF, Ak+Bk Fk) | diag(B, Bk); [F Ck+Dk Fk; C+DF Fk] | [I Dk; D I]]     left = right^-1
    /// ```
    ///
    /// The poles of `left` are those of the closed loop, so this construction is itself the test of stability. `f` (m x n)
    /// makes `A + B F` stable, `fk` (p x nk) makes `Ak + Bk Fk` stable; for a stable controller `fk = 0` gives U = K, V = I.
    ///
    /// # Errors
    /// [`Error::NotStabilising`] with the closed-loop pole, [`Error::Unstable`] for a bad `f` or `fk`,
    /// [`Error::AlgebraicLoop`] when `I - D Dk` is singular, [`Error::NoSolution`] when it is so nearly singular that the
    /// factors lose (15) to rounding, shapes and sample times.
    pub fn stacked(
        nominal: &StateSpace<T>,
        controller: &StateSpace<T>,
        f: MatRef<'_, f64>,
        fk: MatRef<'_, f64>,
    ) -> Result<Self> {
        let (m, p) = (nominal.inputs(), nominal.outputs());
        check_controller(nominal, controller)?;
        crate::linalg::check_shape("the state feedback F", f, (m, nominal.order()))?;
        crate::linalg::check_shape("the state feedback of the controller's factors", fk, (p, controller.order()))?;
        let (g, k) = (nominal, controller);
        let a = block_diagonal((g.a() + g.b() * f).as_ref(), (k.a() + k.b() * fk).as_ref());
        let b = block_diagonal(g.b(), k.b());
        let c = block(&[&[f, (k.c() + k.d() * fk).as_ref()], &[(g.c() + g.d() * f).as_ref(), fk]]);
        let d = block(&[&[eye(m).as_ref(), k.d()], &[g.d(), eye(p).as_ref()]]);
        let right = StateSpace::new(a, b, c, d, g.time())?;
        right.require_stable("A + B F of the stacked factors")?;
        let left = right.inverse().map_err(|e| match e {
            Error::Singular { rcond, .. } => Error::AlgebraicLoop { rcond },
            other => other,
        })?;
        require_stabilised(&left, "the nominal model")?;
        Self::from_parts(nominal.clone(), right, left)?.without_loss()
    }

    /// Factors of a nominal plant and **any** stabilising controller, from those of an observer-based one by the shift
    /// `Q = F_l(J_G, K)`:
    ///
    /// ```text
    /// right [I Q; 0 I]:  U + M Q, V + N Q        [I -Q; 0 I] left:  Vt + Q Nt, Ut + Q Mt        M, N, Mt, Nt unchanged
    /// ```
    ///
    /// # Errors
    /// [`Error::NotStabilising`] with the pole when the controller does not stabilise the nominal plant (Q is then
    /// unstable), [`Error::NoSolution`] when the factors lose (15) to rounding, shapes and sample times.
    pub fn shifted_to(&self, controller: &StateSpace<T>) -> Result<Self> {
        check_controller(&self.nominal, controller)?;
        let q = self.j_g()?.lower_lft(controller)?;
        require_stabilised(&q, "the nominal model")?;
        let right = shear(&q)?.then(self.right.system())?;
        let left = self.left.system().then(&shear(&q.negated())?)?;
        Self::from_parts(self.nominal.clone(), right, left)?.without_loss()
    }

    fn from_parts(nominal: StateSpace<T>, right: StateSpace<T>, left: StateSpace<T>) -> Result<Self> {
        let m = nominal.inputs();
        Ok(CoprimeFactors { right: Partitioned::new(right, m, m)?, left: Partitioned::new(left, m, m)?, nominal })
    }

    /// The nominal plant G(0).
    pub fn nominal(&self) -> &StateSpace<T> {
        &self.nominal
    }

    /// `[M U; N V]`, from (eta, epsilon) to (u, y).
    pub fn right(&self) -> &Partitioned<T> {
        &self.right
    }

    /// `[Vt -Ut; -Nt Mt]`, from (u, y) to (alpha, beta); eq. (28) is its second row.
    pub fn left(&self) -> &Partitioned<T> {
        &self.left
    }

    /// Number of plant inputs m.
    pub fn inputs(&self) -> usize {
        self.nominal.inputs()
    }

    /// Number of plant outputs p.
    pub fn outputs(&self) -> usize {
        self.nominal.outputs()
    }

    /// M, m x m: `G(0) = N M^-1`.
    pub fn m(&self) -> StateSpace<T> {
        self.right.part(0, 0)
    }

    /// N, p x m: `G(0) = N M^-1`.
    pub fn n(&self) -> StateSpace<T> {
        self.right.part(1, 0)
    }

    /// U, m x p: `K = U V^-1`.
    pub fn u(&self) -> StateSpace<T> {
        self.right.part(0, 1)
    }

    /// V, p x p: `K = U V^-1`.
    pub fn v(&self) -> StateSpace<T> {
        self.right.part(1, 1)
    }

    /// Mt (M tilde), p x p: `G(0) = Mt^-1 Nt`.
    pub fn m_t(&self) -> StateSpace<T> {
        self.left.part(1, 1)
    }

    /// Nt (N tilde), p x m: `G(0) = Mt^-1 Nt`.
    pub fn n_t(&self) -> StateSpace<T> {
        self.left.part(1, 0).negated()
    }

    /// Ut (U tilde), m x p: `K = Vt^-1 Ut`.
    pub fn u_t(&self) -> StateSpace<T> {
        self.left.part(0, 1).negated()
    }

    /// Vt (V tilde), m x m: `K = Vt^-1 Ut`.
    pub fn v_t(&self) -> StateSpace<T> {
        self.left.part(0, 0)
    }
}

/// `[I Q; 0 I]` of a Q from p to m signals.
pub fn shear<T: TimeDomain>(q: &StateSpace<T>) -> Result<StateSpace<T>> {
    let (n, m, p) = (q.order(), q.outputs(), q.inputs());
    StateSpace::new(
        q.a().to_owned(),
        block(&[&[Mat::zeros(n, m).as_ref(), q.b()]]),
        block(&[&[q.c()], &[Mat::zeros(p, n).as_ref()]]),
        block(&[&[eye(m).as_ref(), q.d()], &[Mat::zeros(p, m).as_ref(), eye(p).as_ref()]]),
        q.time(),
    )
}

fn check_controller<T: TimeDomain>(nominal: &StateSpace<T>, controller: &StateSpace<T>) -> Result<()> {
    nominal.check_time("nominal model and controller", controller)?;
    for (what, expected, found) in [
        ("the number of inputs of the controller", nominal.outputs(), controller.inputs()),
        ("the number of outputs of the controller", nominal.inputs(), controller.outputs()),
    ] {
        if expected != found {
            return Err(Error::Ports { what: what.into(), expected, found });
        }
    }
    Ok(())
}

fn require_stabilised<T: TimeDomain>(closed_loop: &StateSpace<T>, model: &str) -> Result<()> {
    closed_loop.require_stable(model).map_err(|e| match e {
        Error::Unstable { what, pole } => Error::NotStabilising { model: what, pole },
        other => other,
    })
}
