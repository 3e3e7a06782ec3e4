//! What seeded searches take: iterations, values of the criterion, rejected points.

use super::*;
use crate::{GreyBoxOptions, LoopOutput, Problem, greybox};

/// Another number here means that the search does other work than before: to be looked at, and explained.
#[test]
fn work_of_seeded_searches() {
    let structure = oscillator();
    let start = |factors: [f64; 3]| -> Vec<f64> { structure.start().iter().zip(factors).map(|(v, f)| v * f).collect() };
    let (near, far) = (start([1.1, 0.8, 0.95]), start([0.5, 4.0, 1.6]));
    let log = open_loop(500, 2e-5, 0.0, 1);
    let [direct, from_outside] = in_loop(500, 2e-5, 0.0, 8000.0, 2);
    let options = GreyBoxOptions::default();
    let search = |theta: &[f64], log: &Log, options: &GreyBoxOptions| {
        let found = greybox(&Problem::new(&structure, &[log.experiment()], time()), theta, options).unwrap();
        (found.iterations, found.evaluations, found.diverged)
    };
    let through_the_loop = {
        let (controller, records) = (controller(8000.0), [from_outside.experiment()]);
        let found = greybox(
            &Problem::new(&structure, &records, time()).in_loop(&controller, LoopOutput::Plant),
            &near,
            &options,
        )
        .unwrap();
        (found.iterations, found.evaluations, found.diverged)
    };
    let work = [
        search(&near, &log, &options),
        search(&far, &log, &options),
        search(&near, &direct, &options),
        through_the_loop,
    ];
    assert_eq!(work, [(6, 7, 0), (11, 17, 0), (5, 6, 0), (4, 5, 0)]);
}
