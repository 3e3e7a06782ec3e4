//! The template of the bearing against the structure that is written in code.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use youla_greybox::{DeclaredStructure, Structure, Template};
use youla_twin::BearingStructure;
use youla_twin::rig::Bearing;

#[test]
fn the_bearing_is_that_of_the_rig() {
    let bearing = DeclaredStructure::new(&Template::Bearing.declaration().unwrap()).unwrap();
    let truth = BearingStructure::parameters(&Bearing::default());
    assert_eq!(bearing.names(), BearingStructure.names());
    assert_eq!(bearing.start(), truth);
    assert_eq!(bearing.bounds(), BearingStructure.bounds());
    for seed in 0..5 {
        // Every parameter off by up to half of itself.
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let theta: Vec<f64> = truth.iter().map(|v| v * (0.5 + rng.random::<f64>())).collect();
        assert_eq!(bearing.model(&theta).unwrap(), BearingStructure.model(&theta).unwrap());
        for parameter in 0..14 {
            assert_eq!(bearing.slopes(&theta, parameter), BearingStructure.slopes(&theta, parameter), "{parameter}");
        }
    }
}
