//! Models and controllers from files.

use crate::common::Folder;
use std::path::Path;
use youla::Mat;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla_io::export::{ModelFormat, NamedModel, export_model};
use youla_run::{ControllerSettings, Domain, NominalModel};

/// One file in three formats is the model that was written; another sample time is refused, the sign is stated.
#[test]
fn a_model_that_was_written_is_read_again() {
    let time = Discrete::new(1e-3).unwrap();
    let entry = |x: f64| Mat::from_fn(1, 1, |_, _| x);
    let system = StateSpace::new(entry(0.9), entry(1.0 / 3.0), entry(2.0), entry(0.1), time).unwrap();
    let ports = (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]);
    let model = NamedModel::new("g", system.clone(), ports).unwrap();
    let folder = Folder::new("models");
    for format in [ModelFormat::Json, ModelFormat::Mat, ModelFormat::Npz] {
        let file = folder.path().join(format!("model.{}", format.extension()));
        std::fs::write(&file, export_model(&model, format).unwrap()).unwrap();
        let nominal = NominalModel::ModelFile { file: file.clone(), domain: None };
        assert_eq!(nominal.realise(Path::new("/"), time).unwrap(), system);
        let error = nominal.realise(Path::new("/"), Discrete::new(2e-3).unwrap()).unwrap_err();
        assert!(error.to_string().contains("sample times differ"), "{error}");
        let text = format!("model_file = {{ feedback = \"negative\", file = {file:?} }}");
        let settings: ControllerSettings = toml::from_str(&text).unwrap();
        let running = settings.realise(system.time(), Some(&system), Path::new("/")).unwrap();
        assert_eq!(running.system(), &system.negated());
        // Only a MATLAB file may hold matrices in s.
        let continuous = NominalModel::ModelFile { file, domain: Some(Domain::Continuous) };
        assert_eq!(continuous.realise(Path::new("/"), time).is_ok(), format == ModelFormat::Mat);
    }
}
