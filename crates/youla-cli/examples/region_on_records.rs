//! Does the 95 % region of a model from some records of a measured machine hold the response that another record of it shows? The table of
//! docs/accuracy.md. The data are not part of this project: `YOULA_DATA`, or `../shared/data` beside the workspace.
//!
//! ```text
//! cargo run --release -p youla-cli --example region_on_records
//! E = S_vx S_xx^-1 S_xu (S_ux S_xx^-1 S_xu)^-1,     v = y - G u,     |E|^2 <= 3.0 (deviation of the region^2 + var E)
//! ```
//! G is the model, x the external excitation of the unused record, whose lines count under a Hann window in bands; 3.0 is the 95 % quantile of
//! a chi-square variable with two degrees of freedom over two. Bands in which `var E` is above (0.5 |G|)^2 say nothing and are left out.
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

use faer::linalg::solvers::DenseSolveCore;
use rustfft::FftPlanner;
use std::path::Path;
use youla::identify::likelihood::{LikelihoodOptions, Recommendation};
use youla::lti::frequency_response;
use youla::signal::LoopRecord;
use youla::statistics::quantile;
use youla::{Mat, MatRef, c64};
use youla_run::{RunSettings, declared_loop, read_records};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// 95 % quantile of chi-square with two degrees of freedom, over two.
const EDGE: f64 = 2.996;
/// Independent lines among those under a Hann window: one in so many.
const HANN_LOSS: f64 = 1.944;
/// Deviation of the unused record's response over the response up to which it says anything.
const TOLD: f64 = 0.5;
/// Coherence of excitation and input above which widths and bands of validity are judged.
const COHERENT: f64 = 0.9;

/// A machine: its settings, with changes; bands of how many hertz; which of all records estimate, verify, and are not used.
struct Machine {
    name: &'static str,
    settings: &'static str,
    changes: &'static [(&'static str, &'static str)],
    band_hz: f64,
    folds: Folds,
}

enum Folds {
    /// Three groups of records, each third one of all; every order of them.
    Thirds,
    /// The record of the settings alone, against the other files.
    Others(&'static [&'static str]),
}

const TWICE_THE_RATE: &[(&str, &str)] = &[
    ("sample_time = 0.0005", "sample_time = 0.00025"),
    ("[5.50311, 0.27062, -5.23249]", "[3.25276, 0.08048, -3.17228]"),
    ("[1.0, -1.14636, 0.41698]", "[1.0, -1.56384, 0.64432]"),
    ("fs2000/cycle1.mat\"", "fs4000/cycle1.mat\"\nsegments = [[1, 80000], [80001, 160000], [160001, 240000]]"),
    ("[[data.verification]]\nfile = \"../../../shared/data/flexible_drive/fs2000/cycle2.mat\"\n", ""),
    ("[[data.verification]]\nfile = \"../../../shared/data/flexible_drive/fs2000/cycle3.mat\"\n", ""),
];

const MACHINES: [Machine; 4] = [
    Machine { name: "drive, 2 kHz", settings: "flexible-drive", changes: &[], band_hz: 0.125, folds: Folds::Thirds },
    Machine {
        name: "drive, 4 kHz, thirds of a record",
        settings: "flexible-drive",
        changes: TWICE_THE_RATE,
        band_hz: 0.5,
        folds: Folds::Thirds,
    },
    Machine { name: "pendulum", settings: "qube", changes: &[], band_hz: 1.0, folds: Folds::Thirds },
    Machine {
        name: "thermal board",
        settings: "thermal-board",
        changes: &[],
        band_hz: 0.004,
        folds: Folds::Others(&["steps_reg_cons_ml.csv.gz", "steps_augmented_pca.csv.gz"]),
    },
];

/// One band of the unused record.
struct Point {
    hz: f64,
    /// `|E|^2` over its mean square, region and own noise.
    square: f64,
    /// Deviation of the region over the response, and error over it.
    width: f64,
    error: f64,
    coherence: f64,
}

/// Lines 1 to Nyquist of the columns of a signal without their means under a Hann window, lines x columns.
fn hann(signal: MatRef<'_, f64>, planner: &mut FftPlanner<f64>) -> Mat<c64> {
    let rows = signal.nrows();
    let mut out = Mat::<c64>::zeros(rows / 2 - 1, signal.ncols());
    for j in 0..signal.ncols() {
        let mean = signal.col(j).iter().sum::<f64>() / rows as f64;
        let window = |t: usize| 1.0 - (std::f64::consts::TAU * t as f64 / rows as f64).cos();
        let mut work: Vec<c64> = (0..rows).map(|t| c64::new((signal[(t, j)] - mean) * window(t), 0.0)).collect();
        planner.plan_fft_forward(rows).process(&mut work);
        (0..out.nrows()).for_each(|k| out[(k, j)] = work[k + 1]);
    }
    out
}

/// The unused records against the model, band by band, all entries.
fn points(found: &Recommendation, unused: &[LoopRecord], band_hz: f64) -> Result<Vec<Point>> {
    let ts = unused[0].time().ts();
    let mut planner = FftPlanner::new();
    let mut bands: Vec<Vec<[Vec<c64>; 3]>> = Vec::new();
    for record in unused {
        let excitation = record.excitation().ok_or("no excitation")?;
        let [x, u, y] = [excitation.as_ref(), record.u(), record.y()].map(|signal| hann(signal, &mut planner));
        let step = 1.0 / (record.samples() as f64 * ts);
        let omega: Vec<f64> = (0..u.nrows()).map(|k| std::f64::consts::TAU * step * (k + 1) as f64).collect();
        let model = frequency_response(&found.plant, &omega)?;
        for k in 1..u.nrows() {
            let band = (step * (k + 1) as f64 / band_hz) as usize;
            bands.resize_with(bands.len().max(band + 1), Vec::new);
            let row = |of: &Mat<c64>| -> Vec<c64> { of.row(k).iter().copied().collect() };
            let of_model = |i: usize| (0..u.ncols()).fold(c64::ZERO, |sum, j| sum + model.at(k)[(i, j)] * u[(k, j)]);
            let v = (0..y.ncols()).map(|i| y[(k, i)] - of_model(i)).collect();
            bands[band].push([row(&x), row(&u), v]);
        }
    }
    let (first, last) = (found.region.hz[0], *found.region.hz.last().ok_or("no region")?);
    let mut out = Vec::new();
    for (band, lines) in bands.iter().enumerate() {
        let hz = (band as f64 + 0.5) * band_hz;
        if (first..=last).contains(&hz) {
            out.extend(of_band(found, lines, hz)?);
        }
    }
    Ok(out)
}

fn of_band(found: &Recommendation, lines: &[[Vec<c64>; 3]], hz: f64) -> Result<Vec<Point>> {
    let stacked = |of: usize| Mat::from_fn(lines[0][of].len(), lines.len(), |i, k| lines[k][of][i]);
    if lines.is_empty() {
        return Ok(Vec::new());
    }
    let [x, u, v] = [0, 1, 2].map(stacked);
    let eigen = (&x * x.adjoint()).self_adjoint_eigen(faer::Side::Lower).map_err(|_| "eigenvalues")?;
    let strongest = eigen.S().column_vector().iter().map(|s| s.re).fold(0.0, f64::max);
    let strong: Vec<usize> = (0..x.nrows()).filter(|k| eigen.S()[*k].re > 1e-6 * strongest).collect();
    let free = lines.len() as f64 / HANN_LOSS - x.nrows() as f64;
    if strong.len() < u.nrows() || free < 2.0 {
        return Ok(Vec::new());
    }
    // Along the strong directions of x, of unit size.
    let basis =
        Mat::from_fn(x.nrows(), strong.len(), |i, k| eigen.U()[(i, strong[k])] / eigen.S()[strong[k]].re.sqrt());
    let along = |signal: &Mat<c64>| signal * x.adjoint() * &basis;
    let (of_u, of_v) = (along(&u), along(&v));
    let inverse = (&of_u * of_u.adjoint()).partial_piv_lu().inverse();
    let error = &of_v * of_u.adjoint() * &inverse;
    let stated = found.region.entry_errors(&[hz]).remove(0);
    let model = frequency_response(&found.plant, &[std::f64::consts::TAU * hz])?;
    let mut out = Vec::new();
    for i in 0..v.nrows() {
        let noise = (v.row(i).squared_norm_l2() - of_v.row(i).squared_norm_l2()) / free;
        for j in 0..u.nrows() {
            let (variance, size) = (noise * inverse[(j, j)].re, model.at(0)[(i, j)].norm());
            let [re, _, im] = stated.covariance((i, j));
            if variance < (TOLD * size).powi(2) {
                out.push(Point {
                    hz,
                    square: error[(i, j)].norm_sqr() / (re + im + variance),
                    width: (re + im).sqrt() / size,
                    error: error[(i, j)].norm() / size,
                    coherence: of_u.row(j).squared_norm_l2() / u.row(j).squared_norm_l2(),
                });
            }
        }
    }
    Ok(out)
}

fn print(name: &str, found: &Recommendation, points: &[Point]) {
    let inside = |points: &[&Point]| {
        let count = points.iter().filter(|p| p.square <= EDGE).count();
        if points.is_empty() {
            String::new()
        } else {
            format!("{:.0} % of {}", 100.0 * count as f64 / points.len() as f64, points.len())
        }
    };
    let all: Vec<&Point> = points.iter().collect();
    let mut decades: Vec<i32> = points.iter().map(|p| p.hz.log10().floor() as i32).collect();
    decades.dedup();
    let decades: Vec<String> = decades
        .into_iter()
        .map(|decade| {
            let of: Vec<&Point> = points.iter().filter(|p| p.hz.log10().floor() as i32 == decade).collect();
            format!("from {} Hz: {}", 10f64.powi(decade), inside(&of))
        })
        .collect();
    let coherent: Vec<&Point> = points.iter().filter(|p| p.coherence > COHERENT).collect();
    let median = |pick: fn(&Point) -> f64| {
        let mut values: Vec<f64> = coherent.iter().map(|p| pick(p)).collect();
        values.sort_by(f64::total_cmp);
        if values.is_empty() { f64::NAN } else { quantile(&values, 0.5) }
    };
    let valid = |p: &&&Point| found.bands.iter().any(|[from, to]| (*from..=*to).contains(&p.hz));
    let covered = coherent.iter().filter(valid).count() as f64 / coherent.len().max(1) as f64;
    println!(
        "| {name} | {} | {:.2} | {} | {} | {:.3} / {:.3} | {:.0} % |",
        if found.trusted() { "trusted" } else { "not trusted" },
        found.loop_ratio.as_ref().map_or(f64::NAN, |r| r.largest),
        inside(&all),
        decades.join(", "),
        median(|p| p.width),
        median(|p| p.error),
        100.0 * covered,
    );
}

/// The settings of an example with its data in place and some of its text changed.
fn settings(machine: &Machine, also: &[(&str, &str)]) -> Result<(RunSettings, std::path::PathBuf)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let data = std::env::var_os("YOULA_DATA").map_or_else(|| root.join("../shared/data"), Into::into);
    let data = data.canonicalize().map_err(|e| format!("the measured data at {}: {e}", data.display()))?;
    let folder = root.join("examples").join(machine.settings);
    let mut text = std::fs::read_to_string(folder.join("run.toml"))?;
    for (from, to) in machine.changes.iter().chain(also) {
        assert!(text.contains(from), "{}: no {from:?} in its run.toml", machine.name);
        text = text.replace(from, to);
    }
    let text = text.replace("../../../shared/data", &data.display().to_string());
    Ok((RunSettings::parse(&text, &folder.join("run.toml"))?, folder))
}

fn run(machine: &Machine) -> Result<()> {
    let (settings_of_all, folder) = settings(machine, &[])?;
    let records = read_records(&settings_of_all.data, &folder)?;
    let declared = declared_loop(&settings_of_all, &records, &folder)?;
    let found = |estimation: &[LoopRecord], fresh: &[LoopRecord]| {
        let options = LikelihoodOptions::default();
        youla::identify(estimation, fresh, &declared.running, declared.nominal.as_ref(), &options)
            .map(|found| found.model)
    };
    match machine.folds {
        Folds::Thirds => {
            let all: Vec<LoopRecord> = records.estimation.iter().chain(&records.verification).cloned().collect();
            let third = |k: usize| all.iter().skip(k).step_by(3).cloned().collect::<Vec<_>>();
            for [a, b, c] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                let model = found(&third(a), &third(b))?;
                let name = format!("{}: {} ({} fresh), unused {}", machine.name, a + 1, b + 1, c + 1);
                print(&name, &model, &points(&model, &third(c), machine.band_hz)?);
            }
        }
        Folds::Others(files) => {
            let model = found(&records.estimation, &[])?;
            for file in files {
                let (other, folder) = settings(machine, &[("steps_constrained_ml_2.csv.gz", file)])?;
                let unused = read_records(&other.data, &folder)?.estimation;
                print(&format!("{}: unused {file}", machine.name), &model, &points(&model, &unused, machine.band_hz)?);
            }
        }
    }
    Ok(())
}

fn main() -> Result<()> {
    println!("| records | verdict | r | in the region | by decade | width / error, median | in bands |");
    println!("|---|---|---:|---|---|---:|---:|");
    MACHINES.iter().try_for_each(run)
}
