//! The observer-based controller of Fig. 3.

use crate::linalg::check_shape;
use crate::lti::{StateSpace, TimeDomain};
use crate::{MatRef, Result};
use faer::{Mat, Scale};

/// The controller `xh+ = A xh + B u + L (C xh + D u - y), u = F xh` as a system from y to u, positive feedback:
///
/// ```text
/// K = [A + B F + L C + L D F | -L; F | 0]
/// ```
///
/// `f` is m x n with `A + B F` stable, `l` is n x p with `A + L C` stable.
///
/// # Errors
/// [`crate::Error::Shape`] when a gain does not fit the plant.
pub fn observer_controller<T: TimeDomain>(
    plant: &StateSpace<T>,
    f: MatRef<'_, f64>,
    l: MatRef<'_, f64>,
) -> Result<StateSpace<T>> {
    let (n, m, p) = (plant.order(), plant.inputs(), plant.outputs());
    check_shape("the state feedback F", f, (m, n))?;
    check_shape("the observer gain L", l, (n, p))?;
    let a = plant.a() + plant.b() * f + l * (plant.c() + plant.d() * f);
    StateSpace::new(a, Scale(-1.0) * l, f.to_owned(), Mat::zeros(m, p), plant.time())
}
