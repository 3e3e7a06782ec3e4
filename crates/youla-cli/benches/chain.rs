//! Time of the numerical work beside what the machine can do: `cargo bench -p youla-cli --bench chain`.
//!
//! Every reference (a copy, a matrix product, the obvious loop) is measured in the same run, on the same data, next to the work
//! that it belongs to. The ratios are what to compare between machines. One thread, unless the line says otherwise.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod timing;

use faer::linalg::matmul::matmul;
use faer::prelude::*;
use faer::{Accum, Mat, MatRef, Par, Scale, c64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::PI;
use std::hint::black_box;
use std::path::Path;
use timing::{median, middle};
use youla::identify::subspace::{Experiment, Factorisation, Order, SubspaceData, SubspaceOptions, subspace};
use youla::linalg::{RiccatiProblem, SequentialQr, care, dare, discrete_lyapunov, eye, lyapunov};
use youla::lti::{Discrete, StateSpace, frequency_response, simulate};
use youla::reduce::{ReducedOrder, ReductionOptions, reduce};
use youla::signal::{Excitation, SquareWaves};
use youla_run::{StageClock, identify, write_run};
use youla_twin::rig::Bearing;
use youla_twin::{DemoMachine, demo};

/// Errors of all crates.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// Sample time of the bearing, seconds.
const TS: f64 = 2e-4;

fn main() -> Result<()> {
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread can be had");
    single.install(|| {
        simulation()?;
        triangular_factor();
        response()?;
        equations()?;
        reduction()
    })?;
    kernels(&single)?;
    whole_identification(&single)?;
    demonstration()
}

/// 1e6 samples of the bearing against a copy of the same bytes and against one faer product per matrix and sample.
fn simulation() -> Result<()> {
    title("simulate, 6 states, 2 inputs, 2 outputs, 1e6 samples");
    let (plant, u, _) = bearing_record(1_000_000)?;
    let ours = line("simulate", None, || simulate(&plant, u.as_ref(), &[0.0; 6]));
    line("copy of the same bytes, 16 MB to 16 MB", Some(ours), || u.clone());
    line("faer, y = C x + D u, x = A x + B u", Some(ours), || one_product_per_sample(&plant, u.as_ref()));
    Ok(())
}

fn one_product_per_sample(plant: &StateSpace<Discrete>, u: MatRef<'_, f64>) -> Mat<f64> {
    let mut x = Mat::zeros(plant.order(), 1);
    let mut y = Mat::zeros(u.nrows(), plant.outputs());
    for k in 0..u.nrows() {
        let now = u.row(k).transpose().as_mat();
        let out = plant.c() * &x + plant.d() * now;
        y.row_mut(k).copy_from(out.col(0).transpose());
        x = plant.a() * &x + plant.b() * now;
    }
    y
}

/// R of the block-Hankel data, in pieces of 4000 rows, against matrix products with as many operations, 2 N w^2.
fn triangular_factor() {
    const ROWS: usize = 100_000;
    const PIECE: usize = 4000;
    let (horizon, channels) = (20, 4);
    let width = 2 * horizon * channels;
    title(&format!("R of block-Hankel data, {ROWS} x {width}"));
    let record = random(ROWS + 2 * horizon, channels, 1);
    let ours = line("SequentialQr::fold", None, || {
        let mut triangle = SequentialQr::new(width, PIECE);
        for start in (0..ROWS).step_by(PIECE) {
            triangle.fold(PIECE, |mut piece| {
                for column in 0..width {
                    let source = record.col(column % channels).subrows(start + column / channels, PIECE);
                    piece.as_mut().col_mut(column).copy_from(source);
                }
            });
        }
        triangle
    });
    let (tall, square) = (random(PIECE, width, 2), random(width, width, 3));
    let mut product = Mat::zeros(PIECE, width);
    line("products of as many operations", Some(ours), || {
        for _ in 0..ROWS / PIECE {
            matmul(product.as_mut(), Accum::Replace, tall.as_ref(), square.as_ref(), 1.0, Par::Seq);
        }
    });
}

/// 1000 frequencies against a dense LU factorisation for each.
fn response() -> Result<()> {
    title("frequency response, 2 inputs, 2 outputs, 1000 frequencies");
    let omega: Vec<f64> = (1..=1000).map(|k| 0.999 * PI / TS * f64::from(k) / 1000.0).collect();
    for n in [18, 40] {
        let system = random_system(n)?;
        let ours = line(&format!("frequency_response, n = {n}"), None, || frequency_response(&system, &omega));
        line(&format!("dense LU per frequency, n = {n}"), Some(ours), || dense_response(&system, &omega));
    }
    Ok(())
}

fn dense_response(system: &StateSpace<Discrete>, omega: &[f64]) -> Vec<Mat<c64>> {
    let complex = |m: MatRef<'_, f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0));
    let (a, b, c, d) = (complex(system.a()), complex(system.b()), complex(system.c()), complex(system.d()));
    let n = system.order();
    let at = |w: &f64| {
        let (sin, cos) = (w * TS).sin_cos();
        let resolvent = Scale(c64::new(cos, sin)) * Mat::<c64>::identity(n, n) - &a;
        &c * resolvent.partial_piv_lu().solve(&b) + &d
    };
    omega.iter().map(at).collect()
}

/// Matrix equations against the product of two n x n matrices.
fn equations() -> Result<()> {
    title("matrix equations, 2 inputs, 2 outputs; ratio: time of a product of two n x n matrices");
    for n in [6, 40, 100] {
        let system = random_system(n)?;
        let (square, mut product) = (random(n, n, 4), Mat::zeros(n, n));
        let unit = median(|| matmul(product.as_mut(), Accum::Replace, square.as_ref(), square.as_ref(), 1.0, Par::Seq));
        let (q, r) = (eye(n), eye(2));
        let discrete = RiccatiProblem { a: system.a(), b: system.b(), q: q.as_ref(), r: r.as_ref(), s: None };
        let shifted = system.a() - eye(n);
        let continuous = RiccatiProblem { a: shifted.as_ref(), ..discrete };
        line(&format!("care, n = {n}"), Some(unit), || care("the bench", &continuous));
        line(&format!("dare, n = {n}"), Some(unit), || dare("the bench", &discrete));
        line(&format!("lyapunov, n = {n}"), Some(unit), || lyapunov(shifted.as_ref(), q.as_ref()));
        line(&format!("discrete_lyapunov, n = {n}"), Some(unit), || discrete_lyapunov(system.a(), q.as_ref()));
    }
    Ok(())
}

/// Balanced truncation of a system of 46 states to 6.
fn reduction() -> Result<()> {
    title("balanced truncation");
    let system = random_system(46)?;
    let options = ReductionOptions { order: ReducedOrder::Fixed(6), ..ReductionOptions::default() };
    line("reduce, 46 states to 6", None, || reduce(&system, &options));
    Ok(())
}

/// Checking and factoring the records, by the lag sums of the Gram matrix and by QR, against what the machine can do: plain
/// products of matrices that fill the cache, and a copy of the records. One core and two.
fn kernels(single: &rayon::ThreadPool) -> Result<()> {
    const SAMPLES: usize = 1_000_000;
    let (horizon, channels) = (20, 4);
    let (_, u, y) = bearing_record(SAMPLES)?;
    let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
    let width = 2 * horizon * channels;
    let lag_sums = 2.0 * (SAMPLES * channels * width) as f64;
    let by_qr = 2.0 * (SAMPLES * width * width) as f64;
    let time = Discrete::new(TS)?;
    let factor = |factorisation| {
        let options = SubspaceOptions { horizon, factorisation, ..SubspaceOptions::default() };
        SubspaceData::new(&experiments, time, &options).map(drop)
    };
    let double = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads can be had");
    for (threads, pool) in [(1, single), (2, &double)] {
        title(&format!(
            "factoring {SAMPLES} x {channels} samples, horizon {horizon}, {threads} threads; ratio: rate of the products"
        ));
        let peak = pool.install(|| products(threads));
        rate("Gram matrix by lag sums, with reading and checks", peak, lag_sums, || {
            pool.install(|| factor(Factorisation::Gram))
        });
        rate("QR, with reading and checks", peak, by_qr, || pool.install(|| factor(Factorisation::Qr)));
        let seconds = median(|| pool.install(|| copies(threads, &u, &y)));
        let bytes = 2.0 * 8.0 * (SAMPLES * channels) as f64;
        println!(
            "  {:<46} {:10.4} ms  {:8.1} GB/s read and written",
            "copy of the records",
            1e3 * seconds,
            1e-9 * bytes / seconds
        );
    }
    Ok(())
}

/// Rate of products of 512 x 512 matrices, one at a time for each thread, in operations per second.
fn products(threads: usize) -> f64 {
    const SIZE: usize = 512;
    const TIMES: usize = 20;
    let (a, b) = (random(SIZE, SIZE, 8), random(SIZE, SIZE, 9));
    let operations = 2.0 * (threads * TIMES * SIZE * SIZE * SIZE) as f64;
    rate("products of 512 x 512 matrices", f64::NAN, operations, || {
        each(threads, |_| {
            let mut product = Mat::zeros(SIZE, SIZE);
            for _ in 0..TIMES {
                matmul(product.as_mut(), Accum::Replace, a.as_ref(), b.as_ref(), 1.0, Par::Seq);
            }
            black_box(&product);
        });
    })
}

fn copies(threads: usize, u: &Mat<f64>, y: &Mat<f64>) {
    let rows = u.nrows() / threads;
    each(threads, |k| {
        let part = |m: &Mat<f64>| m.as_ref().subrows(k * rows, rows).to_owned();
        black_box((part(u), part(y)));
    });
}

/// Runs the same work on each thread of the pool.
fn each(threads: usize, work: impl Fn(usize) + Sync) {
    rayon::scope(|scope| {
        for k in 1..threads {
            let work = &work;
            scope.spawn(move |_| work(k));
        }
        work(0);
    });
}

/// Measures and prints the rate of `work`, and how many times slower than `peak` it is; returns the rate.
fn rate<T>(name: &str, peak: f64, operations: f64, work: impl FnMut() -> T) -> f64 {
    let seconds = median(work);
    let rate = operations / seconds;
    let ratio = if peak.is_nan() { String::new() } else { format!("{:8.2} x", peak / rate) };
    println!("  {name:<50} {:10.4} ms  {:8.1} GFLOP/s {ratio}", 1e3 * seconds, 1e-9 * rate);
    rate
}

/// The call of a user, on records of the bearing with 20 dB of noise; by the Gram matrix, and by QR where that is asked for.
fn whole_identification(single: &rayon::ThreadPool) -> Result<()> {
    title("subspace, 2 inputs, 2 outputs, order 6");
    let time = Discrete::new(TS)?;
    for (samples, horizon) in [(5_000, 20), (100_000, 20), (1_000_000, 20), (1_000_000, 40)] {
        let (_, u, y) = bearing_record(samples)?;
        let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
        let options = SubspaceOptions { order: Order::Fixed(6), horizon, ..SubspaceOptions::default() };
        let by_qr = SubspaceOptions { factorisation: Factorisation::Qr, ..options.clone() };
        let call = || subspace(&experiments, time, &options);
        let name = format!("{samples} samples, horizon {horizon}");
        let one = line(&format!("{name}, one thread"), None, || single.install(call));
        line(&format!("{name}, {} threads", rayon::current_num_threads()), Some(one), call);
        line(&format!("{name}, one thread, QR"), Some(one), || single.install(|| subspace(&experiments, time, &by_qr)));
    }
    Ok(())
}

/// `youla demo` by stages, all threads; the medians of 11 runs.
fn demonstration() -> Result<()> {
    title(&format!("demo by stages, {} threads", rayon::current_num_threads()));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bench-demo");
    let mut runs = Vec::new();
    for _ in 0..11 {
        let mut quiet = |_| ();
        let mut clock = StageClock::new(&mut quiet);
        let demo = demo(DemoMachine::Bearing, 1)?;
        let found = identify(demo.settings, demo.records, Path::new("."), &mut clock)?;
        write_run(&found, &folder, folder.exists(), &mut clock)?;
        runs.push(clock.seconds);
    }
    for (k, (stage, _)) in runs[0].iter().enumerate() {
        print_line(stage.name(), middle(runs.iter().map(|stages| stages[k].1).collect()), None);
    }
    Ok(())
}

/// The bearing at 5 kHz, its input (square waves) and its output with 20 dB of white noise.
fn bearing_record(samples: usize) -> Result<(StateSpace<Discrete>, Mat<f64>, Mat<f64>)> {
    let time = Discrete::new(TS)?;
    let plant = Bearing::default().plant()?.zoh(time)?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let waves = Excitation::SquareWaves(SquareWaves { amplitude: 1.0, hold_min: 5, hold_max: 20 });
    let u = waves.generate(samples, 2, time, &mut rng)?;
    let mut y = simulate(&plant, u.as_ref(), &[0.0; 6])?;
    let noise = 0.1 * y.norm_l2() / (2.0 * samples as f64).sqrt();
    for j in 0..2 {
        y.col_mut(j).iter_mut().for_each(|v| *v += noise * rng.sample::<f64, _>(StandardNormal));
    }
    Ok((plant, u, y))
}

/// A random discrete system with 2 inputs and 2 outputs whose poles lie in a disc of radius about 0.9.
fn random_system(n: usize) -> Result<StateSpace<Discrete>> {
    let a = random(n, n, 5) * Scale(0.9 / (n as f64).sqrt());
    Ok(StateSpace::new(a, random(n, 2, 6), random(2, n, 7), Mat::zeros(2, 2), Discrete::new(TS)?)?)
}

fn random(rows: usize, columns: usize, seed: u64) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Mat::from_fn(rows, columns, |_, _| rng.sample(StandardNormal))
}

fn title(text: &str) {
    println!("\n{text}");
}

/// Measures and prints the time of `work`, and how many times that of the reference it is.
fn line<T>(name: &str, reference: Option<f64>, work: impl FnMut() -> T) -> f64 {
    let seconds = median(work);
    print_line(name, seconds, reference.map(|r| seconds / r));
    seconds
}

fn print_line(name: &str, seconds: f64, ratio: Option<f64>) {
    let ratio = ratio.map_or(String::new(), |r| format!("{r:10.3} x"));
    println!("  {name:<46} {:10.4} ms{ratio}", 1e3 * seconds);
}
