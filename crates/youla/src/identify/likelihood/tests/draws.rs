//! Plants that are drawn from the region.

use super::*;

/// Poles 1.001 and 0.998 under a lead, 12 records of 600 samples: estimates of the two lie on either side of the circle, closer to each other than
/// their deviations. As two blocks of one pole each they made the loops of 137 of 1200 draws unstable.
#[test]
fn draws_of_a_servo_keep_the_loop() {
    let plant = StateSpace::new(
        matrix([[1.001, 1.0], [0.0, 0.998]]),
        matrix([[0.0], [1e-3]]),
        matrix([[1.0, 0.0]]),
        Mat::zeros(1, 1),
        time(),
    )
    .unwrap();
    let k = StateSpace::new(matrix([[0.8]]), matrix([[1.0]]), matrix([[2.4]]), matrix([[-14.0]]), time()).unwrap();
    let rig = closed_loop(&plant, &with_input_port(&k).unwrap()).unwrap();
    let (mut unstable, mut all) = (0, 0);
    for seed in 0..12 {
        let rng = &mut ChaCha8Rng::seed_from_u64(300 + seed);
        let (d, n) = (normal(rng, 600, 1, 1.0), normal(rng, 600, 1, 1e-2));
        let log = simulate(&rig, crate::linalg::block(&[&[d.as_ref(), n.as_ref()]]).as_ref(), &[0.0; 3]).unwrap();
        let (u, y) = (log.subcols(0, 1), log.subcols(1, 1));
        let own = u - &d;
        let signals = LoopSignals { seen: y, explained: own.as_ref(), applied: u, excitation: Some(d.as_ref()) };
        let known = LoopKnowledge::new(Some(&k), Some(&k), vec![signals], Vec::new()).unwrap();
        let found =
            recommend(&[Experiment::new(u, y)], &[], Some(&known), time(), &LikelihoodOptions::default()).unwrap();
        for draw in found.region.draws(100, seed) {
            let of_draw = closed_loop(&draw.plant, &with_input_port(&k).unwrap()).unwrap();
            unstable += usize::from(!of_draw.is_stable().unwrap());
            all += 1;
        }
    }
    assert!(100 * unstable <= all, "{unstable} of {all}");
}
