//! Loops of the families example that a model once lacked modes of.

#[path = "../../crates/youla-cli/examples/families/mod.rs"]
mod families;

use families::FAMILIES;
use youla::identify::likelihood::LikelihoodOptions;

/// Five modes at a fiftieth of the rate, under LQG: with the fourth mode alone the loop with the stated controller is unstable, and with the fifth it is
/// stable again. Without the way through unstable loops three or four of the modes were found.
#[test]
fn a_mode_that_only_an_unstable_loop_leads_to_is_found() {
    let slow =
        FAMILIES.iter().filter(|family| family.honest).find(|family| family.name.starts_with("five modes")).unwrap();
    for seed in [317, 2027] {
        let system = slow.system(seed).unwrap();
        let [records, fresh] = system.log(seed).unwrap().records(system.plant.time()).unwrap();
        let found = youla::identify(&records, &fresh, &system.stated, None, &LikelihoodOptions::default()).unwrap();
        let hz = |of: &youla::lti::StateSpace<youla::lti::Discrete>| -> Vec<f64> {
            let mut hz: Vec<f64> = of.modes().unwrap().iter().map(|mode| mode.hz).collect();
            hz.sort_by(f64::total_cmp);
            hz
        };
        let (truth, found_hz) = (hz(&system.plant), hz(&found.model.plant));
        assert_eq!(truth.len(), found_hz.len(), "seed {seed}: {truth:?}, found {found_hz:?}");
        for (truth, found) in truth.iter().zip(&found_hz) {
            assert!((found / truth - 1.0).abs() < 0.005, "seed {seed}: {truth} Hz, found {found} Hz");
        }
    }
}
