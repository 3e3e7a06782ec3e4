//! The demonstration: the paper's gas bearing, simulated in closed loop, with a nominal model that is half wrong.

use super::Demo;
use crate::rig::{Bearing, degraded};
use crate::{Error, Result};
use faer::Scale;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::control::{LqrWeights, NoiseCovariance, closed_loop, kalman, lqr};
use youla::factor::CoprimeFactors;
use youla::identify::subspace::{Order, Stability, SubspaceMethod, SubspaceOptions};
use youla::linalg::{block, eye};
use youla::lti::{Continuous, Discrete, StateSpace, simulate};
use youla::reduce::{ReducedOrder, ReductionOptions};
use youla::signal::Channel;
use youla::signal::{Detrend, Excitation, LoopRecord, SquareWaves};
use youla::{Mat, MatRef};
use youla_io::{ChannelRef, ChannelSpec, CsvOptions, Gaps};
use youla_loop::check::CheckOptions;
use youla_loop::redesign::RedesignOptions;
use youla_run::{ControllerSettings, Domain, Feedback, NominalModel};
use youla_run::{
    DataFile, DataSettings, FactorSettings, FrequencySettings, PredictionKind, RunSettings, VerificationSettings,
};
use youla_run::{RunRecords, SourceFile};

/// Sample time of the rig, seconds (5 kHz).
const TS: f64 = 2e-4;
/// Samples of the estimation record (4 s) and of the verification record (2 s).
const SAMPLES: [usize; 2] = [20_000, 10_000];
/// White output noise, um rms. The paper states none; its fits fit 0.3 to 0.6 um.
const NOISE: f64 = 0.3;
/// Amplitude of alpha, V, and its hold in samples.
const AMPLITUDE: f64 = 0.5;
const HOLD: (usize, usize) = (5, 40);
/// Factor on all entries of A of the nominal model: the paper's second experiment.
const A_FACTOR: f64 = 0.5;

/// Simulates the bearing (1)-(12) at 5 kHz under the observer-based controller of Fig. 3, designed on the nominal model
/// `0.5 A`, excited by square waves on alpha, with white output noise; one record to identify from, one to verify on.
///
/// The same seed gives the same records.
///
/// # Errors
/// Never for the parameters of the paper.
pub(super) fn bearing(seed: u64) -> Result<Demo> {
    let time = Discrete::new(TS)?;
    let bearing = Bearing::default().plant()?;
    let plant = bearing.zoh(time)?;
    let continuous = degraded(&bearing, A_FACTOR, 1.0)?;
    let nominal = continuous.zoh(time)?;
    let (f, l) = controller_gains(&nominal)?;
    let factors = CoprimeFactors::observer(&nominal, f.as_ref(), l.as_ref())?;
    let closed = closed_loop(&plant, &factors.j_k()?)?;
    if let Err(youla::Error::Unstable { pole, .. }) = closed.require_stable("the simulated loop") {
        return Err(Error::Method(youla::Error::NotStabilising { model: "the simulated bearing".into(), pole }));
    }
    let record = |stream: usize| simulated_record(&closed, time, seed, stream);
    let channels = |names: [&str; 2], unit: &str| names.map(|n| Channel::new(n, unit)).to_vec();
    let settings = settings(seed, &continuous, &f, &l);
    let source = |purpose: &str| SourceFile {
        path: settings.data.estimation[0].file.display().to_string(),
        purpose: purpose.into(),
        sha256: String::new(),
    };
    let sources = vec![source("simulated")];
    Ok(Demo {
        records: RunRecords {
            time,
            inputs: channels(INPUTS, "V"),
            outputs: channels(OUTPUTS, "um"),
            estimation: vec![record(0)?],
            verification: vec![record(1)?],
            sources,
            segments: Vec::new(),
            measured: None,
            true_plant: Some(plant),
        },
        settings,
    })
}

const INPUTS: [&str; 2] = ["u_h", "u_v"];
const OUTPUTS: [&str; 2] = ["y_h", "y_v"];
const NAMES: [&str; 2] = ["estimation", "verification"];

/// LQG on the nominal model. Displacements weigh 1 per um^2, velocities 10 per (1340 um/s)^2 (the displacement of a mode at
/// 213 Hz), commands 20 per V^2; the observer takes 0.5 V of input noise against 1 um of output noise.
fn controller_gains(nominal: &StateSpace<Discrete>) -> Result<(Mat<f64>, Mat<f64>)> {
    let weight = [1.0, 1.0, 10.0 / 1340f64.powi(2), 10.0 / 1340f64.powi(2), 0.0, 0.0];
    let q = Mat::from_fn(6, 6, |i, j| if i == j { weight[i] } else { 0.0 });
    let f = lqr(nominal, &LqrWeights { q, r: eye(2) * Scale(20.0), s: None })?.f;
    let noise = NoiseCovariance::at_inputs(nominal, (eye(2) * Scale(0.25)).as_ref(), eye(2).as_ref())?;
    Ok((f, kalman(nominal, &noise)?.l))
}

/// One record of the loop `(alpha, n) -> (u, y, beta)`. Excitation and noise have random streams of their own.
fn simulated_record(closed: &StateSpace<Discrete>, time: Discrete, seed: u64, index: usize) -> Result<LoopRecord> {
    let samples = SAMPLES[index];
    let stream = |purpose: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(2 * index as u64 + purpose);
        rng
    };
    let waves = SquareWaves { amplitude: AMPLITUDE, hold_min: HOLD.0, hold_max: HOLD.1 };
    let alpha = Excitation::SquareWaves(waves).generate(samples, 2, time, &mut stream(0))?;
    let mut rng = stream(1);
    let noise = Mat::from_fn(samples, 2, |_, _| NOISE * rng.sample::<f64, _>(StandardNormal));
    let signals = block(&[&[alpha.as_ref(), noise.as_ref()]]);
    let z = simulate(closed, signals.as_ref(), &vec![0.0; closed.order()])?;
    let (u, y) = (z.subcols(0, 2).to_owned(), z.subcols(2, 2).to_owned());
    Ok(LoopRecord::new(time, u, y)?.with_alpha(alpha)?.named(NAMES[index]))
}

/// The run.toml of the demonstration; it works on the records in its own run folder.
fn settings(seed: u64, nominal: &StateSpace<Continuous>, f: &Mat<f64>, l: &Mat<f64>) -> RunSettings {
    let rows = |m: MatRef<'_, f64>| (0..m.nrows()).map(|i| m.row(i).iter().copied().collect()).collect();
    let channel = |name: &str, variable: &str, column: usize, unit: &str| {
        ChannelSpec::from(name, ChannelRef::Name(format!("{variable}(:,{})", column + 1)), unit)
    };
    let channels = |names: [&str; 2], variable: &str, unit: &str| -> Vec<ChannelSpec> {
        names.iter().enumerate().map(|(j, name)| channel(name, variable, j, unit)).collect()
    };
    let file = |name: &str| DataFile {
        file: format!("1-record/{name}-{name}.mat").into(),
        skip: 0,
        take: None,
        segments: Vec::new(),
        name: Some(name.into()),
    };
    let subspace = SubspaceOptions {
        method: SubspaceMethod::Cva,
        horizon: 40,
        order: Order::Fixed(10),
        ..SubspaceOptions::default()
    };
    RunSettings {
        recommended: Default::default(),
        name: "demo: gas bearing".into(),
        data: DataSettings {
            sample_time: Some(TS),
            time_column: None,
            gaps: Gaps::Refuse,
            inputs: channels(INPUTS, "u", "V"),
            outputs: channels(OUTPUTS, "y", "um"),
            input_excitation: Vec::new(),
            reference: Vec::new(),
            computed: std::collections::BTreeMap::new(),
            alpha: channels(["alpha_h", "alpha_v"], "alpha", "V"),
            csv: CsvOptions::default(),
            detrend: Detrend::None,
            disturbance: None,
            response: Vec::new(),
            estimation: vec![file(NAMES[0])],
            verification: vec![file(NAMES[1])],
        },
        nominal: Some(NominalModel::StateSpace {
            domain: Domain::Continuous,
            a: rows(nominal.a()),
            b: rows(nominal.b()),
            c: rows(nominal.c()),
            d: None,
        }),
        controller: ControllerSettings::Observer {
            feedback: Feedback::Positive,
            state_feedback: rows(f.as_ref()),
            observer_gain: rows(l.as_ref()),
        },
        factors: FactorSettings { settle: Some(0), ..FactorSettings::default() },
        direct: Some(SubspaceOptions { order: Order::Fixed(6), stability: Stability::Allow, ..subspace.clone() }),
        hansen: Some(subspace),
        reduction: Some(ReductionOptions { order: ReducedOrder::Fixed(6), ..ReductionOptions::default() }),
        grey_box: None,
        redesign: Some(RedesignOptions::default()),
        check: CheckOptions::default(),
        verification: VerificationSettings { prediction: Some(PredictionKind::OpenLoop), skip: 0 },
        frequency_response: FrequencySettings { from_hz: Some(5.0), ..FrequencySettings::default() },
        seed: Some(seed),
    }
}
