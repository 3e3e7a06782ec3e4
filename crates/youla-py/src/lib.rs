//! The extension module `youla._native`: what the Python package computes. Settings come as mappings, records and matrices as
//! NumPy arrays; results go back as JSON and arrays. The package around it gives them their types.

mod failure;
mod kept;
mod logs;
mod matrices;
mod models;
mod options;
mod parts;
mod region;
mod replicate;
mod run;
mod worker;

use pyo3::prelude::*;

/// The extension module.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::kept::{
        Region, check_settings, controller_model, read_mat, redesign, redesign_pid, report_html, settings_json,
        write_files,
    };
    #[pymodule_export]
    use super::logs::{clock, read_log, synchronise, unit_of_time};
    #[pymodule_export]
    use super::models::{certify, frequency_response, modes, reduce, simulate, simulate_loop};
    #[pymodule_export]
    use super::parts::{Subspace, agreement, check, excite, subspace};
    #[pymodule_export]
    use super::replicate::replicate;
    #[pymodule_export]
    use super::run::{Run, compare, demo, identify, identify_file};
    #[pymodule_export]
    use super::{program, version};

    #[pymodule_init]
    fn loaded(_module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        super::worker::loaded();
        Ok(())
    }
}

/// Version of library and program.
#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// Runs the program `youla` with these arguments, the first of them its name; returns its exit code.
#[pyfunction]
fn program(py: Python<'_>, args: Vec<String>) -> u8 {
    py.detach(|| youla_cli::run(args.into_iter().map(Into::into)))
}
