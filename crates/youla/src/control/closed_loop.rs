//! The loop of Fig. 2 and Fig. 3 as one system: a plant under a controller with ports, excited from outside.

use crate::Result;
use crate::linalg::{block, eye};
use crate::lti::{Partitioned, StateSpace, TimeDomain};
use faer::Mat;

/// Closes a plant `y_G = G u` with a controller with ports, `(y, w) -> (u, z)`, for example `J_K`, where the controller
/// sees `y = y_G + n`.
///
/// The result maps `[w; n]` to `[u; y; z]`; its state is `[x_plant; x_controller]` and its poles are those of the loop.
/// With `w = alpha` this is Fig. 3; with [`with_input_port`] `w` is an excitation v1 at the plant input; `n` is the output
/// noise, an excitation v2, or `-r` for a reference r (the output y is then the difference y - r).
///
/// # Errors
/// Ports, sample times, [`crate::Error::AlgebraicLoop`] when the loop is not well posed.
pub fn closed_loop<T: TimeDomain>(plant: &StateSpace<T>, controller: &Partitioned<T>) -> Result<StateSpace<T>> {
    let (m, p) = (plant.inputs(), plant.outputs());
    let w = controller.part(0, 1).inputs();
    let z = controller.part(1, 0).outputs();
    let both = plant.append(controller.system())?;
    let zeros = |rows: usize, cols: usize| Mat::<f64>::zeros(rows, cols);
    // Inputs of `both`: [u_G; y_K; w]; new inputs: [w; n; u; y_G].
    let inputs = block(&[
        &[zeros(m, w).as_ref(), zeros(m, p).as_ref(), eye(m).as_ref(), zeros(m, p).as_ref()],
        &[zeros(p, w).as_ref(), eye(p).as_ref(), zeros(p, m).as_ref(), eye(p).as_ref()],
        &[eye(w).as_ref(), zeros(w, p).as_ref(), zeros(w, m).as_ref(), zeros(w, p).as_ref()],
    ]);
    // Outputs of `both`: [y_G; u; z]; new outputs: [u; y; z; u; y_G], where y lacks n so far.
    let outputs = block(&[
        &[zeros(m, p).as_ref(), eye(m).as_ref(), zeros(m, z).as_ref()],
        &[eye(p).as_ref(), zeros(p, m).as_ref(), zeros(p, z).as_ref()],
        &[zeros(z, p).as_ref(), zeros(z, m).as_ref(), eye(z).as_ref()],
        &[zeros(m, p).as_ref(), eye(m).as_ref(), zeros(m, z).as_ref()],
        &[eye(p).as_ref(), zeros(p, m).as_ref(), zeros(p, z).as_ref()],
    ]);
    let open = both.map_input(&inputs).map_output(&outputs);
    let mut d = open.d().to_owned();
    for i in 0..p {
        d[(m + i, w + i)] += 1.0;
    }
    let open = StateSpace::new(open.a().to_owned(), open.b().to_owned(), open.c().to_owned(), d, open.time())?;
    open.close(eye(m + p).as_ref())
}

/// A plain controller `u = K y` as `(y, v1) -> u = K y + v1`: an excitation at the plant input and no further output.
///
/// # Errors
/// Never for a valid system.
pub fn with_input_port<T: TimeDomain>(controller: &StateSpace<T>) -> Result<Partitioned<T>> {
    let (n, m, p) = (controller.order(), controller.outputs(), controller.inputs());
    let b = block(&[&[controller.b(), Mat::zeros(n, m).as_ref()]]);
    let d = block(&[&[controller.d(), eye(m).as_ref()]]);
    let system = StateSpace::new(controller.a().to_owned(), b, controller.c().to_owned(), d, controller.time())?;
    Partitioned::new(system, m, p)
}
