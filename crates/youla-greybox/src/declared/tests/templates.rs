//! What comes with the library, read as the files of a user.

use super::super::{Declaration, DeclaredStructure, Template};
use super::declared;
use crate::tests::off;
use crate::{Matrix, Structure};
use faer::c64;
use youla::lti::{Continuous, StateSpace, frequency_response};

fn template(template: Template) -> DeclaredStructure {
    DeclaredStructure::new(&template.declaration().unwrap()).unwrap()
}

fn entry(model: &StateSpace<Continuous>, matrix: Matrix, row: usize, column: usize) -> f64 {
    match matrix {
        Matrix::A => model.a()[(row, column)],
        Matrix::B => model.b()[(row, column)],
        Matrix::C => model.c()[(row, column)],
        Matrix::D => model.d()[(row, column)],
    }
}

/// Every entry of every template; entries without a slope must not move.
#[test]
fn slopes_are_differences_of_the_model() {
    for structure in Template::ALL.map(template) {
        let theta = off(&structure.start(), 0.3, 1);
        for (j, name) in structure.names().iter().enumerate() {
            let h = 1e-3 * theta[j];
            let at = |k: f64| {
                let mut moved = theta.clone();
                moved[j] += k * h;
                structure.model(&moved).unwrap()
            };
            let [down2, down, up, up2] = [-2.0, -1.0, 1.0, 2.0].map(at);
            let slopes = structure.slopes(&theta, j);
            assert!(!slopes.is_empty(), "{name}");
            let shapes = [
                (Matrix::A, up.a().shape()),
                (Matrix::B, up.b().shape()),
                (Matrix::C, up.c().shape()),
                (Matrix::D, up.d().shape()),
            ];
            for (matrix, (rows, columns)) in shapes {
                for (row, column) in (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
                    let value = |model: &StateSpace<Continuous>| entry(model, matrix, row, column);
                    let difference = (8.0 * (value(&up) - value(&down)) - value(&up2) + value(&down2)) / (12.0 * h);
                    let found = slopes.iter().find(|s| (s.matrix, s.row, s.column) == (matrix, row, column));
                    let size = value(&up).abs() / theta[j].abs();
                    match found {
                        Some(slope) => assert!((slope.value - difference).abs() <= 1e-7 * size, "{name} {slope:?}"),
                        None => assert_eq!(difference, 0.0, "{name} {matrix:?} {row} {column}"),
                    }
                }
            }
        }
    }
}

#[test]
fn declarations_survive_writing() {
    for template in Template::ALL {
        let declaration = template.declaration().unwrap();
        let text = toml::to_string(&declaration).unwrap();
        assert_eq!(Declaration::parse(&text).unwrap(), declaration);
        let json = serde_json::to_string(&declaration).unwrap();
        assert_eq!(serde_json::from_str::<Declaration>(&json).unwrap(), declaration);
    }
}

/// A free rotor nutates at `polar / transverse * speed`; without damping all poles of the supported one are imaginary.
#[test]
fn the_rotor_nutates() {
    let free = "template = 'rotor-gyroscopic'
        parameters = { stiffness_1 = { initial = 0 }, stiffness_2 = { initial = 0 }, damping_1 = { initial = 0 }, damping_2 = { initial = 0 } }";
    let poles = |text: &str| {
        let rotor = declared(text).unwrap();
        rotor.model(&rotor.start()).unwrap().poles().unwrap()
    };
    let nutation = c64::new(0.0, 0.4 * 500.0);
    let nearest = poles(free).iter().map(|p| (p - nutation).norm()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-9 * 200.0, "{nearest:.1e}");
    let undamped = "template = 'rotor-gyroscopic'
        parameters = { damping_1 = { initial = 0 }, damping_2 = { initial = 0 } }";
    assert!(poles(undamped).iter().all(|p| p.re.abs() < 1e-9 * p.norm()));
}

/// Without losses the speed of the motor has a zero at the antiresonance and a pole at the resonance.
#[test]
fn the_drive_has_its_antiresonance() {
    let text = "template = 'two-inertia-drive'
        parameters = { damping = { initial = 0 }, friction_motor = { initial = 0 }, friction_load = { initial = 0 } }";
    let drive = declared(text).unwrap();
    let values = drive.derived(&drive.start(), None).unwrap();
    let (resonance, antiresonance) = (values[0].value, values[1].value);
    let model = drive.model(&drive.start()).unwrap();
    let response = frequency_response(&model, &[antiresonance, 0.5 * antiresonance]).unwrap();
    let sizes: Vec<f64> = response.iter().map(|h| h[(0, 0)].norm()).collect();
    assert!(sizes[0] < 1e-10 * sizes[1], "{sizes:?}");
    let nearest =
        model.poles().unwrap().iter().map(|p| (p - c64::new(0.0, resonance)).norm()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-9 * resonance, "{nearest:.1e}");
}

#[test]
fn the_mass_swings_at_its_natural_frequency() {
    let mass = template(Template::MassSpringDamper);
    let values = mass.derived(&mass.start(), None).unwrap();
    let (omega, zeta) = (values[0].value, values[1].value);
    assert_eq!((omega, zeta), (100.0, 0.1));
    let pole = mass.model(&mass.start()).unwrap().poles().unwrap()[0];
    assert!((pole.norm() / omega - 1.0).abs() < 1e-12 && (-pole.re / omega - zeta).abs() < 1e-12);
}

#[test]
fn a_template_is_amended() {
    let text = "
        template = 'mass-spring-damper'
        c = [[1, 0], [0, 'gauge']]
        [parameters.mass]
        initial = 2.5
        fixed = true
        [parameters.stiffness]
        max = 2e4
        [parameters.gauge]
        initial = 3
        [derived]
        static_gain = '1 / stiffness'";
    let structure = declared(text).unwrap();
    assert_eq!(structure.names(), ["damping", "stiffness", "gauge"]);
    assert_eq!(structure.start(), [20.0, 1e4, 3.0]);
    assert_eq!(structure.bounds()[1], (0.0, 2e4));
    assert_eq!(structure.parameters()[1].unit, "N s/m");
    let model = structure.model(&[10.0, 1e4, 4.0]).unwrap();
    assert_eq!((model.outputs(), model.b()[(1, 0)], model.c()[(1, 1)]), (2, 0.4, 4.0));
    let names: Vec<String> = structure.derived(&structure.start(), None).unwrap().into_iter().map(|v| v.name).collect();
    assert_eq!(names, ["natural_frequency", "damping_ratio", "static_gain"]);
    // A known parameter that the amended matrices no longer use may stay.
    assert!(
        declared("template = 'rotor-gyroscopic'\n[derived]\ngyroscopic = 'polar_inertia / transverse_inertia'").is_ok()
    );
}
