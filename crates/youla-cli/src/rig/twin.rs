//! `youla rig twin`: a machine to try the other verbs on.

use super::{refused, seconds};
use crate::output::{Failure, Form, say};
use clap::{Args, ValueEnum};
use std::net::UdpSocket;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use youla_rig::{Pace, Port, read_key, rotor, serve};
use youla_run::model_for_export;
use youla_twin::rig::Fidelity;
use youla_twin::{TwinPlant, serve_loop};

pub(super) const EXAMPLES: &str = "\
Examples:
  youla rig twin                                              a rotor at 20 kHz
  youla rig twin examples/commission/weak.toml --bearing rotating --rpm 1250
  youla rig twin run.toml --model runs/rotor-001              an identified model under its controller";

/// Arguments of `youla rig twin`.
#[derive(Debug, Args)]
pub(crate) struct TwinArgs {
    /// File with `[nominal]` and `[controller.observer]` of the loop, for example a run.toml; without it the twin is a rotor with two
    /// lightly damped modes.
    #[arg(requires = "plant")]
    file: Option<PathBuf>,
    /// Control the gas bearing at this level of fidelity.
    #[arg(long, value_enum, group = "plant", requires = "file")]
    bearing: Option<Level>,
    /// Control an identified model: a run folder (its recommended model) or the file of a model.
    #[arg(long, value_name = "RUN|MODEL", group = "plant", requires = "file")]
    model: Option<PathBuf>,
    /// Speed of the bearing in revolutions per minute.
    #[arg(long, default_value_t = 0.0, requires = "bearing")]
    rpm: f64,
    /// UDP port on this machine; 0 takes a free one.
    #[arg(long, default_value_t = 4000)]
    port: u16,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How it takes its time.
    #[arg(long, value_enum, default_value = "real-time")]
    pace: PaceName,
    /// Take requests that are signed with the key in this file only, and a stop of anybody.
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// End after so many seconds.
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
}

/// Level of fidelity of the bearing.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Level {
    /// linear, white noise on the outputs
    Linear,
    /// with sensors, valves and delay
    Instrumented,
    /// with what a turning shaft adds, at --rpm
    Rotating,
}

/// How a twin takes its time.
#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum PaceName {
    /// one sample each sample time
    RealTime,
    /// 20 samples for each request
    LockStep,
}

pub(super) fn twin(form: Form, args: &TwinArgs) -> Result<(), Failure> {
    let until = args.duration.map(|value| seconds("--duration", value)).transpose()?;
    let plant = plant(args)?;
    let key = args.key.as_deref().map(read_key).transpose()?;
    let socket = UdpSocket::bind(("127.0.0.1", args.port))
        .map_err(|e| refused(format!("--port {}: {e}; choose another port", args.port)))?;
    let place = socket.local_addr().map_err(|e| refused(e.to_string()))?;
    if !form.quiet {
        say(&format!("udp://{place}"))?;
    }
    let port = Port { socket: &socket, key: key.as_ref() };
    let begin = Instant::now();
    let end = || until.is_some_and(|until| begin.elapsed() >= until);
    let lock_step = args.pace == PaceName::LockStep;
    match (&args.file, plant) {
        (Some(file), Some(plant)) => Ok(serve_loop(port, file, &plant, (args.seed, lock_step), end)?),
        _ => {
            let pace = if lock_step { Pace::LockStep } else { Pace::RealTime(Duration::from_micros(50)) };
            Ok(serve(port, &mut rotor(args.seed)?, pace, end)?)
        }
    }
}

fn plant(args: &TwinArgs) -> Result<Option<TwinPlant>, Failure> {
    if let Some(model) = &args.model {
        return Ok(Some(TwinPlant::Model(Box::new(model_for_export(model, None)?))));
    }
    let fidelity = |level: Level| match level {
        Level::Linear => Fidelity::Linear,
        Level::Instrumented => Fidelity::Instrumented,
        Level::Rotating => Fidelity::Rotating { rpm: args.rpm },
    };
    Ok(args.bearing.map(|level| TwinPlant::Bearing { fidelity: fidelity(level), cross_coupling: 0.0 }))
}
