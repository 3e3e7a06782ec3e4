//! The demonstration of the paper: closed loop, nominal models with wrong entries of A.

use youla::identify::subspace::InitialState;
use youla_greybox::{GreyBoxOptions, Problem, Stop, greybox};
use youla_twin::rig::Bearing;
use youla_twin::{BearingStructure, DemoMachine, demo};

/// The demonstration: closed loop, start with every entry of A halved. The fit of the truth is that of the noise alone; the
/// search must end at a point no worse than its start, and say where.
#[test]
fn a_nominal_model_that_is_half_wrong() {
    let records = demo(DemoMachine::Bearing, 1).unwrap().records;
    let fit_from = |start: &Bearing| {
        let start = BearingStructure::parameters(start);
        greybox(
            &Problem::new(&BearingStructure, &records.experiments(), records.time),
            &start,
            &GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() },
        )
        .unwrap()
    };
    let best = fit_from(&Bearing::default());
    assert_eq!(best.stop, Stop::Converged);
    for theta in [0.3, 0.5, 0.7] {
        let found = fit_from(&Bearing::default().degraded(1.0 - theta, 1.0).unwrap());
        let local = found.cost > 1.001 * best.cost;
        println!(
            "theta {theta}: {} cost {:.1} of {:.1}, fit {:.2?} of {:.2?}, {:?}, {} iterations, {} evaluations, {} diverged",
            if local { "local minimum," } else { "global minimum," },
            found.cost,
            best.cost,
            found.fit,
            best.fit,
            found.stop,
            found.iterations,
            found.evaluations,
            found.diverged
        );
        assert!(found.cost > 0.9999 * best.cost);
    }
}
