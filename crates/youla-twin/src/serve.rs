//! Twins that a host can talk to: the gas bearing at any level of fidelity, and any identified model, under the loop of a file.

use crate::rig::{BearingRig, Fidelity, RigParameters, SimulatedRig};
use crate::running::{LoopDescription, RunningLoop, padded};
use crate::station::Q_STATES;
use crate::{Error, Result};
use faer::Side;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::Serialize;
use std::path::Path;
use youla::Mat;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla_io::export::NamedModel;
use youla_link::{LARGEST_BODY, Machine, Station};
use youla_rig::{Pace, Plant, Port, RigChannel, Twin, random_number, serve};
use youla_rt::{Controller, ExcitedLoop, Limits, Matrices};

/// Largest order of the nominal model.
const STATES: usize = 20;
/// Samples of the ramp of an excitation.
const RAMP: u16 = 500;
/// Seconds after which the host counts as silent while the loop is excited.
const SILENT: f64 = 1.0;

/// What a twin controls.
#[derive(Debug, Clone)]
pub enum TwinPlant {
    /// The gas bearing.
    Bearing {
        /// Level of fidelity.
        fidelity: Fidelity,
        /// Cross-coupling of the film as a share of the stiffness.
        cross_coupling: f64,
    },
    /// A model without feedthrough, with the noise of its predictor where its file has one.
    Model(Box<NamedModel>),
}

impl TwinPlant {
    fn channels(&self) -> [Vec<Channel>; 2] {
        match self {
            TwinPlant::Bearing { .. } => {
                let of = |names: [&str; 2], unit: &str| names.map(|name| Channel::new(name, unit)).to_vec();
                [of(["u_h", "u_v"], "V"), of(["y_h", "y_v"], "um")]
            }
            TwinPlant::Model(model) => [model.inputs.clone(), model.outputs.clone()],
        }
    }

    fn time(&self) -> Result<Discrete> {
        Ok(match self {
            TwinPlant::Bearing { .. } => Discrete::new(RigParameters::shipped().timing.sample_time.value)?,
            TwinPlant::Model(model) => model.system.time(),
        })
    }
}

/// Serves the loop of a file, its `[nominal]` and `[controller.observer]`, with a plant until `end` says so. The guard ends an excitation for
/// signals that are not finite and for a host that is silent for a second; it knows no other limits. In real time where `lock_step` is
/// not set.
///
/// # Errors
/// Those of the file; [`Error::Loop`] for a plant that does not fit its loop; [`Error::Connection`].
pub fn serve_loop(
    port: Port<'_>,
    path: &Path,
    plant: &TwinPlant,
    (seed, lock_step): (u64, bool),
    end: impl Fn() -> bool,
) -> Result<()> {
    let time = plant.time()?;
    let running = RunningLoop::of_any_size(LoopDescription::of_file(path)?, path, time)?;
    let pace = match lock_step {
        true => Pace::LockStep,
        false => Pace::RealTime(std::time::Duration::from_secs_f64(time.ts())),
    };
    let served = Served { port, path, running: &running, plant, seed, pace };
    match plant.channels().map(|channels| channels.len()) {
        [1, 1] => served.run::<1, 1>(&end),
        [1, 2] => served.run::<1, 2>(&end),
        [2, 1] => served.run::<2, 1>(&end),
        [2, 2] => served.run::<2, 2>(&end),
        [3, 3] => served.run::<3, 3>(&end),
        [m, p] => served.refuse(format!(
            "a twin has 1 or 2 inputs and outputs, or 3 of each; the plant has {m} inputs and {p} outputs"
        )),
    }
}

struct Served<'a> {
    port: Port<'a>,
    path: &'a Path,
    running: &'a RunningLoop,
    plant: &'a TwinPlant,
    seed: u64,
    pace: Pace,
}

impl Served<'_> {
    fn refuse<T>(&self, problem: String) -> Result<T> {
        Err(Error::Loop { path: self.path.to_owned(), problem })
    }

    fn run<const M: usize, const P: usize>(&self, end: &impl Fn() -> bool) -> Result<()> {
        let nominal = &self.running.nominal;
        if nominal.order() > STATES || (nominal.inputs(), nominal.outputs()) != (M, P) {
            return self.refuse(format!(
                "the nominal model has {} states, {} inputs and {} outputs; the twin takes at most {STATES} states, and its plant has {M} \
                 inputs and {P} outputs",
                nominal.order(),
                nominal.inputs(),
                nominal.outputs()
            ));
        }
        let infinite = f32::INFINITY;
        let host = (SILENT / nominal.time().ts()).ceil() as u32;
        let limits = Limits {
            y: [infinite; P],
            beta: [infinite; P],
            u: [infinite; M],
            rate: [infinite; M],
            clipped: 0,
            stuck: 0,
            host,
            duration: 0,
        };
        let wrong =
            |e: &dyn std::fmt::Display| Error::Controller { problem: format!("does not accept its matrices: {e}") };
        let controller = Controller::new(self.matrices::<M, P>()).map_err(|e| wrong(&e))?;
        let running =
            ExcitedLoop::<f32, STATES, M, P, Q_STATES>::new(controller, limits, RAMP).map_err(|e| wrong(&e))?;
        let description = self.description()?;
        let station =
            Station::new(running, Machine { description: &description, table: &[], rows: 20, life: random_number() });
        match self.plant {
            TwinPlant::Bearing { fidelity, cross_coupling } => {
                let mut parameters = RigParameters::shipped();
                parameters.rotation.cross_coupling.value = *cross_coupling;
                let plant = BearingPlant(BearingRig::new(&parameters, *fidelity, self.seed)?);
                self.serve(Twin { station, plant }, end)
            }
            TwinPlant::Model(model) => {
                let plant = ModelPlant::new(model, self.seed).or_else(|problem| self.refuse(problem))?;
                self.serve(Twin { station, plant }, end)
            }
        }
    }

    fn serve<const M: usize, const P: usize, G: Plant<M, P>>(
        &self,
        mut twin: Twin<'_, STATES, M, P, Q_STATES, G>,
        end: &impl Fn() -> bool,
    ) -> Result<()> {
        Ok(serve(self.port, &mut twin, self.pace, end)?)
    }

    fn matrices<const M: usize, const P: usize>(&self) -> Matrices<f32, STATES, M, P> {
        let (g, f, l) = (&self.running.nominal, &self.running.f, &self.running.l);
        let mut all = Matrices {
            a: [[0.0; STATES]; STATES],
            b: [[0.0; M]; STATES],
            c: [[0.0; STATES]; P],
            d: [[0.0; M]; P],
            f: [[0.0; STATES]; M],
            l: [[0.0; P]; STATES],
        };
        let fill = |to: &mut [f32], from: Vec<f32>| to.copy_from_slice(&from);
        fill(all.a.as_flattened_mut(), padded(g.a(), STATES, STATES));
        fill(all.b.as_flattened_mut(), padded(g.b(), STATES, M));
        fill(all.c.as_flattened_mut(), padded(g.c(), P, STATES));
        fill(all.d.as_flattened_mut(), padded(g.d(), P, M));
        fill(all.f.as_flattened_mut(), padded(f.as_ref(), M, STATES));
        fill(all.l.as_flattened_mut(), padded(l.as_ref(), STATES, P));
        all
    }

    /// With nominal model and controller where they fit into a frame; else the host takes them from the file by `--settings`.
    fn description(&self) -> Result<String> {
        let [inputs, outputs] = self.plant.channels().map(|all| all.iter().map(channel).collect::<Vec<_>>());
        let name = self.path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let ts = self.running.nominal.time().ts();
        let short = Described { name, sample_time: ts, q_order: Q_STATES, inputs, outputs };
        let whole = Whole { short: &short, of_loop: &self.running.description };
        let failed = |e: toml::ser::Error| Error::Controller { problem: format!("cannot be described: {e}") };
        let text = toml::to_string(&whole).map_err(failed)?;
        if text.len() + 17 <= LARGEST_BODY {
            return Ok(text);
        }
        let text = toml::to_string(&short).map_err(failed)?;
        match text.len() + 17 <= LARGEST_BODY {
            true => Ok(text),
            false => {
                self.refuse(format!("the names of its channels are longer than the {LARGEST_BODY} bytes of a frame"))
            }
        }
    }
}

#[derive(Serialize)]
struct Described {
    name: String,
    sample_time: f64,
    q_order: usize,
    inputs: Vec<RigChannel>,
    outputs: Vec<RigChannel>,
}

#[derive(Serialize)]
struct Whole<'a> {
    #[serde(flatten)]
    short: &'a Described,
    #[serde(flatten)]
    of_loop: &'a LoopDescription,
}

fn channel(channel: &Channel) -> RigChannel {
    RigChannel { name: channel.name.clone(), unit: channel.unit.clone() }
}

struct BearingPlant(BearingRig);

impl<const M: usize, const P: usize> Plant<M, P> for BearingPlant {
    fn measure(&mut self) -> [f32; P] {
        let y = self.0.measure();
        std::array::from_fn(|i| y.get(i).map_or(0.0, |y| *y as f32))
    }

    fn apply(&mut self, u: &[f32; M]) {
        let mut command = [0.0; 2];
        command.iter_mut().zip(u).for_each(|(to, from)| *to = f64::from(*from));
        self.0.actuate(command);
    }
}

/// `x+ = A x + B u + K e, y = C x + e`.
struct ModelPlant {
    system: StateSpace<Discrete>,
    /// Square root of the covariance of e; without rows where there is no noise.
    root: Mat<f64>,
    random: ChaCha8Rng,
    x: Vec<f64>,
    e: Vec<f64>,
}

impl ModelPlant {
    fn new(model: &NamedModel, seed: u64) -> Result<Self, String> {
        if model.system.d().norm_max() > 0.0 {
            return Err("the model has a feedthrough, but the command of the loop comes before the measurement".into());
        }
        let (system, root) = match model.with_noise() {
            None => (model.system.clone(), Mat::zeros(0, 0)),
            Some((system, covariance)) => match covariance.llt(Side::Lower) {
                Ok(factor) => (system, factor.L().to_owned()),
                Err(_) => return Err("the covariance of the model's noise is not positive".into()),
            },
        };
        let x = vec![0.0; system.order()];
        Ok(ModelPlant { system, root, random: ChaCha8Rng::seed_from_u64(seed), x, e: Vec::new() })
    }
}

impl<const M: usize, const P: usize> Plant<M, P> for ModelPlant {
    fn measure(&mut self) -> [f32; P] {
        let white: Vec<f64> = (0..self.root.nrows()).map(|_| self.random.sample(StandardNormal)).collect();
        self.e = (0..white.len()).map(|i| (0..=i).map(|j| self.root[(i, j)] * white[j]).sum()).collect();
        let c = self.system.c();
        std::array::from_fn(|i| {
            let y: f64 = self.x.iter().enumerate().map(|(j, x)| c[(i, j)] * x).sum();
            (y + self.e.get(i).copied().unwrap_or(0.0)) as f32
        })
    }

    fn apply(&mut self, u: &[f32; M]) {
        let (a, b) = (self.system.a(), self.system.b());
        let inputs: Vec<f64> = u.iter().map(|u| f64::from(*u)).chain(self.e.iter().copied()).collect();
        let next = |i: usize| {
            let of_x: f64 = self.x.iter().enumerate().map(|(j, x)| a[(i, j)] * x).sum();
            of_x + inputs.iter().enumerate().map(|(j, u)| b[(i, j)] * u).sum::<f64>()
        };
        self.x = (0..self.x.len()).map(next).collect();
    }
}
