//! Linear time-invariant systems.

mod discretise;
mod modes;
mod response;
mod simulate;
mod state_space;
mod time;

pub use modes::Mode;
pub use response::{FrequencyResponse, frequency_response};
pub use simulate::{SimulationState, Simulator, simulate};
pub use state_space::StateSpace;
pub use time::{Continuous, Discrete, TimeDomain};

/// The bearing of eqs. (3)-(12) at rest, states (l, l', m) in um, um/s, V, for tests.
#[cfg(test)]
pub(crate) fn bearing() -> StateSpace<Continuous> {
    let stiffness = [[-1.869e6, -8577.0], [-9510.0, -1.737e6]];
    let damping = [[-224.9, 3.97], [9.12, -267.7]];
    let gain = [[-6.126e6, 3.154e5], [-1.571e5, -4.516e6]];
    let pole = [989.0, 942.5];
    let a = faer::Mat::from_fn(6, 6, |i, j| match (i / 2, j / 2) {
        (0, 1) if i % 2 == j % 2 => 1.0,
        (1, 0) => stiffness[i % 2][j % 2],
        (1, 1) => damping[i % 2][j % 2],
        (1, 2) => gain[i % 2][j % 2],
        (2, 2) if i == j => -pole[i % 2],
        _ => 0.0,
    });
    let b = faer::Mat::from_fn(6, 2, |i, j| if i == j + 4 { pole[j] } else { 0.0 });
    let c = faer::Mat::from_fn(2, 6, |i, j| if i == j { 1.0 } else { 0.0 });
    StateSpace::new(a, b, c, faer::Mat::zeros(2, 2), Continuous).expect("the matrices fit")
}
