//! Parameters of declared structures from simulated records.

use super::super::DeclaredStructure;
use super::declared;
use crate::tests::off;
use crate::{GreyBoxModel, GreyBoxOptions, Problem, Side, Stop, Structure, greybox};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::Mat;
use youla::identify::subspace::{Experiment, InitialState};
use youla::lti::{Discrete, simulate};

struct Records {
    u: Mat<f64>,
    y: Mat<f64>,
    time: Discrete,
}

/// Square waves of `amplitude` at the first input, zero at the others, and white output noise.
fn records(structure: &DeclaredStructure, ts: f64, amplitude: f64, noise: f64, seed: u64) -> Records {
    const SAMPLES: usize = 4000;
    let time = Discrete::new(ts).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let model = structure.model(&structure.start()).unwrap().zoh(time).unwrap();
    let mut level = amplitude;
    let mut u = Mat::zeros(SAMPLES, model.inputs());
    for k in 0..SAMPLES {
        if rng.random::<f64>() < 0.1 {
            level = -level;
        }
        u[(k, 0)] = level;
    }
    let clean = simulate(&model, u.as_ref(), &vec![0.0; model.order()]).unwrap();
    let y = Mat::from_fn(SAMPLES, clean.ncols(), |k, i| clean[(k, i)] + noise * rng.sample::<f64, _>(StandardNormal));
    Records { u, y, time }
}

fn estimate(structure: &DeclaredStructure, start: &[f64], data: &Records) -> GreyBoxModel {
    estimate_with(structure, start, data, GreyBoxOptions::default())
}

fn estimate_with(
    structure: &DeclaredStructure,
    start: &[f64],
    data: &Records,
    options: GreyBoxOptions,
) -> GreyBoxModel {
    let experiment = Experiment::new(data.u.as_ref(), data.y.as_ref());
    let options = GreyBoxOptions { initial_state: InitialState::Zero, ..options };
    greybox(&Problem::new(structure, &[experiment], data.time), start, &options).unwrap()
}

fn within_four_deviations(structure: &DeclaredStructure, found: &GreyBoxModel) {
    let deviations = found.standard_deviations().unwrap();
    let parameters = found.parameters.iter().zip(structure.start()).zip(deviations);
    for (((found, truth), deviation), name) in parameters.zip(structure.names()) {
        assert!((found - truth).abs() < 4.0 * deviation, "{name}: {found} for {truth} +- {deviation}");
    }
    assert_eq!(found.stop, Stop::Converged);
    assert!(found.undetermined.is_empty() && found.at_bounds.is_empty());
}

const MASS: &str = "template = 'mass-spring-damper'\n";

#[test]
fn a_drive_gives_its_six_parameters() {
    let drive = declared("template = 'two-inertia-drive'").unwrap();
    let data = records(&drive, 2e-3, 0.5, 0.3, 1);
    let found = estimate(&drive, &off(&drive.start(), 0.1, 2), &data);
    within_four_deviations(&drive, &found);
    let covariance = found.covariance.as_ref().unwrap();
    let values = drive.derived(&found.parameters, Some(covariance.as_ref())).unwrap();
    let truth = drive.derived(&drive.start(), None).unwrap();
    for (found, truth) in values.iter().zip(truth) {
        let deviation = found.deviation.unwrap();
        assert!((found.value - truth.value).abs() < 4.0 * deviation, "{found:?} for {truth:?}");
        assert!(deviation < 1e-3 * truth.value, "{found:?}");
    }
}

#[test]
fn a_mass_gives_its_three_parameters() {
    let mass = declared(MASS).unwrap();
    let data = records(&mass, 5e-3, 10.0, 2e-4, 3);
    within_four_deviations(&mass, &estimate(&mass, &off(&mass.start(), 0.2, 4), &data));
}

/// On the bound, the others as if the stiffness were known to be there.
#[test]
fn an_active_bound_is_reported() {
    let mass = declared(MASS).unwrap();
    let data = records(&mass, 5e-3, 10.0, 2e-4, 5);
    let bounded = declared(&format!("{MASS}parameters.stiffness = {{ max = 9.8e3, initial = 9e3 }}")).unwrap();
    let found = estimate(&bounded, &bounded.start(), &data);
    assert_eq!((found.at_bounds.len(), found.stop), (1, Stop::Converged));
    let bound = &found.at_bounds[0];
    assert_eq!((bound.parameter.as_str(), bound.side, bound.value), ("stiffness", Side::Upper, 9.8e3));
    assert_eq!(found.parameters[2], 9.8e3);
    let fixed = declared(&format!("{MASS}parameters.stiffness = {{ initial = 9.8e3, fixed = true }}")).unwrap();
    let known = estimate(&fixed, &fixed.start(), &data);
    let (with, without) = (found.standard_deviations().unwrap(), known.standard_deviations().unwrap());
    for j in 0..2 {
        assert!((found.parameters[j] / known.parameters[j] - 1.0).abs() < 1e-6);
        assert!((with[j] / without[j] - 1.0).abs() < 1e-3);
    }
    assert_eq!(with[2], 0.0);
    assert!(found.cost > 1.01 * estimate(&mass, &mass.start(), &data).cost);
}

#[test]
fn a_parameter_leaves_the_bound_where_it_starts() {
    let mass = declared(MASS).unwrap();
    let data = records(&mass, 5e-3, 10.0, 2e-4, 6);
    let bounded = declared(&format!(
        "{MASS}parameters = {{ stiffness = {{ min = 9e3, initial = 9e3 }}, damping = {{ max = 30, initial = 30 }} }}"
    ))
    .unwrap();
    let found = estimate(&bounded, &bounded.start(), &data);
    assert!(found.at_bounds.is_empty());
    let free = estimate(&mass, &mass.start(), &data);
    for (bounded, free) in found.parameters.iter().zip(&free.parameters) {
        assert!((bounded / free - 1.0).abs() < 1e-4);
    }
}

/// All held: nothing is left to move, and the search says so at once.
#[test]
fn all_parameters_at_bounds() {
    let mass = declared(MASS).unwrap();
    let data = records(&mass, 5e-3, 10.0, 2e-4, 7);
    let text = "[parameters]\ngain = { initial = 0.5, max = 0.5 }";
    let structure = declared(&format!("a = [[0, 1], [-1e4, -20]]\nb = [[0], ['gain']]\nc = [[1, 0]]\n{text}")).unwrap();
    let found = estimate(&structure, &[0.5], &data);
    assert_eq!((found.iterations, found.stop, found.at_bounds[0].side), (0, Stop::Converged, Side::Upper));
    assert_eq!(found.standard_deviations().unwrap(), [0.0]);
}

#[test]
fn parameters_that_cannot_be_told_apart_are_named() {
    let mass = declared(MASS).unwrap();
    let data = records(&mass, 5e-3, 10.0, 2e-4, 8);
    let text = "
        a = [[0, 1], ['-k / m', '-c']]
        b = [[0], ['gain']]
        c = [[1, 0]]
        parameters = { k = { initial = 1.1e4 }, m = { initial = 1 }, c = { initial = 18 }, gain = { initial = 1 } }";
    let structure = declared(text).unwrap();
    let found = estimate(&structure, &structure.start(), &data);
    assert_eq!((found.rank, found.covariance.is_none(), found.undetermined.without_effect.len()), (3, true, 0));
    assert_eq!(
        found.undetermined.sentences(),
        [
            "the parameters k and m cannot be distinguished: changing k by +1.000 % and m by +1.000 % together leaves the outputs \
          as they are"
        ]
    );
}

/// A second input that never moves shows nothing of its gain; a rotor at rest nothing of its polar inertia.
#[test]
fn parameters_that_the_data_do_not_excite_are_named() {
    let text = "
        a = [[0, 1], ['-k', '-c']]
        b = [[0, 0], ['gain', 'other_gain']]
        c = [[1, 0]]
        parameters = { k = { initial = 1e4 }, c = { initial = 20 }, gain = { initial = 1 }, other_gain = { initial = 1 } }";
    let structure = declared(text).unwrap();
    let data = records(&structure, 5e-3, 10.0, 2e-4, 9);
    let found = estimate(&structure, &structure.start(), &data);
    assert_eq!(found.undetermined.without_effect, ["other_gain"]);
    assert!(found.undetermined.combinations.is_empty() && found.covariance.is_none());
    assert_eq!(
        found.undetermined.sentences(),
        ["the parameter other_gain has no effect on the outputs of these records"]
    );
    let rotor = declared("template = 'rotor-gyroscopic'\nparameters.speed.initial = 0").unwrap();
    let data = records(&rotor, 1e-3, 10.0, 1e-6, 10);
    let found = estimate(&rotor, &rotor.start(), &data);
    assert_eq!(found.undetermined.without_effect, ["polar_inertia"]);
}

/// The input arrives three samples late: as known, the same parameters as without delay, and a model with three more states.
#[test]
fn known_delays_are_taken_out() {
    let mass = declared(MASS).unwrap();
    let clean = records(&mass, 5e-3, 10.0, 0.0, 13);
    let late = Mat::from_fn(3990, 1, |k, _| clean.y[(k + 7, 0)]);
    let data = Records { u: clean.u.as_ref().subrows(10, 3990).to_owned(), y: late, time: clean.time };
    let options = GreyBoxOptions { delays: vec![3], initial_state: InitialState::Estimated, ..Default::default() };
    let experiment = Experiment::new(data.u.as_ref(), data.y.as_ref());
    let found = greybox(&Problem::new(&mass, &[experiment], data.time), &off(&mass.start(), 0.2, 4), &options).unwrap();
    for (found, truth) in found.parameters.iter().zip(mass.start()) {
        assert!((found / truth - 1.0).abs() < 1e-6, "{found} for {truth}");
    }
    assert_eq!((found.continuous.as_ref().unwrap().order(), found.model.order()), (2, 5));
    let again = simulate(&found.model, data.u.as_ref().subrows(3, 3987), &found.initial_states[0]).unwrap();
    assert!((&again - data.y.as_ref().subrows(3, 3987)).norm_max() < 1e-9 * data.y.norm_max());
    let refused = |delays: Vec<usize>, rows: usize| {
        let experiment = Experiment::new(data.u.as_ref().subrows(0, rows), data.y.as_ref().subrows(0, rows));
        let options = GreyBoxOptions { delays, ..Default::default() };
        greybox(&Problem::new(&mass, &[experiment], data.time), &mass.start(), &options).unwrap_err().to_string()
    };
    assert_eq!(refused(vec![1, 2], 100), "the number of delays is 2, but must be one per input, or none");
    assert_eq!(
        refused(vec![40], 40),
        "experiment 1 with a delay of 40 samples: 40 samples are too few, at least 41 are needed"
    );
}

/// The example of the documentation is read as it is there.
#[test]
fn the_documentation_holds() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/grey-box.md");
    let text = std::fs::read_to_string(path).unwrap();
    let blocks: Vec<&str> = text.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(blocks.len() >= 2, "{}", blocks.len());
    for block in blocks {
        // In a run the declaration is a table of its own.
        let declaration = block.rsplit_once(".structure]\n").map_or(block, |(_, declaration)| declaration);
        declared(declaration).unwrap();
    }
}
