//! Matrix equations and ordered Schur forms beside SciPy and SLICOT:
//! `PYTHON=... OPENBLAS_NUM_THREADS=1 cargo bench -p youla-cli --bench matrix_equations -- [residuals | speed]`.
//!
//! `residuals`: 2000 random and 50 hard problems, n = 2 to 200, are written to a file once; we and the peers solve the same
//! numbers, and `peers/matrix_equations.py` computes every residual in the same way. `speed`: programs that take turns, three
//! rounds, medians. One thread each. `PYTHON` names an interpreter with numpy, scipy, slycot and ctrlsys (default:
//! python3).

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

use faer::{Mat, MatRef, Scale};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::hint::black_box;
use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::time::Instant;
use youla::linalg::{RiccatiProblem, care, dare, discrete_lyapunov, eye, lyapunov, real_schur, sylvester};
use youla::{Result, c64};

const RANDOM: usize = 2000;
const SIZES: [usize; 4] = [6, 40, 100, 200];
const KINDS: [&str; 6] = ["care", "dare", "lyapunov", "stein", "sylvester", "reorder"];

/// One problem: A, B, Q, R of a Riccati equation; A, Q of a Lyapunov equation; A, B, C of `A X + X B = C`; A of a Schur form.
struct Problem {
    kind: usize,
    hard: bool,
    matrices: Vec<Mat<f64>>,
}

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let wanted = |name: &str| arguments.is_empty() || arguments.iter().any(|a| a == name);
    let folder = std::env::temp_dir().join("youla-matrix-equations");
    std::fs::create_dir_all(&folder)?;
    if wanted("residuals") {
        residuals(&folder)?;
    }
    if wanted("speed") {
        speed(&folder)?;
    }
    Ok(())
}

/// Writes the problems and our solutions, then lets the peers solve and judge.
fn residuals(folder: &Path) -> std::io::Result<()> {
    let problems = problems();
    write(&folder.join("problems.bin"), &problems)?;
    let mut out = std::io::BufWriter::new(std::fs::File::create(folder.join("ours.bin"))?);
    for problem in &problems {
        let solution = solve(problem).unwrap_or_default();
        put(&mut out, &[solution.len() as f64])?;
        for matrix in &solution {
            put_matrix(&mut out, matrix)?;
        }
    }
    out.flush()?;
    peer(folder, &["residuals".into()]).map(|_| ())
}

/// Medians of ours and of each peer for every kind and size.
fn speed(folder: &Path) -> std::io::Result<()> {
    for kind in 0..KINDS.len() {
        for n in SIZES {
            let rng = &mut ChaCha8Rng::seed_from_u64(100 + n as u64);
            let problem = random_problem(rng, kind, n, (n / 10).max(2));
            write(&folder.join("one.bin"), std::slice::from_ref(&problem))?;
            let (mut ours, mut theirs) = (Vec::new(), String::new());
            for _ in 0..3 {
                ours.push(median_time(&problem));
                theirs += &peer(folder, &["speed".into()])?;
            }
            ours.sort_by(f64::total_cmp);
            println!("{} n = {n}: ours {:.3} ms; {}", KINDS[kind], 1e3 * ours[1], medians(&theirs));
        }
    }
    Ok(())
}

fn median_time(problem: &Problem) -> f64 {
    let mut times = Vec::new();
    while times.is_empty() || times.iter().sum::<f64>() < 0.5 && times.len() < 101 {
        let start = Instant::now();
        black_box(solve(black_box(problem)).ok());
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Lines `name seconds` of several rounds as medians.
fn medians(lines: &str) -> String {
    let mut rounds = std::collections::BTreeMap::<&str, Vec<f64>>::new();
    for line in lines.lines() {
        if let Some((name, seconds)) = line.split_once(' ') {
            rounds.entry(name).or_default().extend(seconds.parse::<f64>());
        }
    }
    let text = rounds.into_iter().filter(|(_, s)| !s.is_empty()).map(|(name, mut seconds)| {
        seconds.sort_by(f64::total_cmp);
        format!("{name} {:.3} ms", 1e3 * seconds[seconds.len() / 2])
    });
    text.collect::<Vec<_>>().join(", ")
}

fn peer(folder: &Path, arguments: &[String]) -> std::io::Result<String> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/matrix_equations.py");
    let output = Command::new(python)
        .arg(script)
        .arg(folder)
        .args(arguments)
        .env("OPENBLAS_NUM_THREADS", "1")
        .stderr(std::process::Stdio::inherit())
        .output()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    if arguments[0] == "residuals" {
        println!("{text}");
    }
    Ok(text)
}

/// The solution X; Q and T of an ordered Schur form.
fn solve(problem: &Problem) -> Result<Vec<Mat<f64>>> {
    let m: Vec<MatRef<'_, f64>> = problem.matrices.iter().map(|m| m.as_ref()).collect();
    Ok(match KINDS[problem.kind] {
        "care" => vec![care("X", &RiccatiProblem { a: m[0], b: m[1], q: m[2], r: m[3], s: None })?.x],
        "dare" => vec![dare("X", &RiccatiProblem { a: m[0], b: m[1], q: m[2], r: m[3], s: None })?.x],
        "lyapunov" => vec![lyapunov(m[0], m[1])?.x],
        "stein" => vec![discrete_lyapunov(m[0], m[1])?.x],
        "sylvester" => vec![sylvester("X", m[0], m[1], m[2])?.x],
        _ => {
            let ordered = real_schur("A", m[0])?.reorder(|p: c64| p.re < 0.0)?;
            vec![ordered.q, ordered.t]
        }
    })
}

/// 2000 random problems, sizes log-uniform from 2 to 200, and 50 hard ones.
fn problems() -> Vec<Problem> {
    let rng = &mut ChaCha8Rng::seed_from_u64(1);
    let size = |rng: &mut ChaCha8Rng| (2.0 * 100f64.powf(rng.random::<f64>())).round() as usize;
    let mut all: Vec<Problem> = (0..RANDOM)
        .map(|k| {
            let n = size(rng);
            let m = rng.random_range(1..=n.min(20));
            random_problem(rng, k % KINDS.len(), n, m)
        })
        .collect();
    for k in 0..50 {
        let n = [4, 8, 16, 32, 64][k % 5];
        all.push(hard_problem(rng, k / 10, k, n));
    }
    all
}

/// Eigenvalues of A over a disc of radius 1 (1.1 in discrete time); A stable for Lyapunov equations.
fn random_problem(rng: &mut ChaCha8Rng, kind: usize, n: usize, m: usize) -> Problem {
    let a = normal(rng, n, n) * Scale(1.0 / (n as f64).sqrt());
    let outputs = normal(rng, m, n);
    let q = outputs.transpose() * &outputs;
    let matrices = match KINDS[kind] {
        "care" => vec![a, normal(rng, n, m), q, eye(m)],
        "dare" => vec![a * Scale(1.1), normal(rng, n, m), q, eye(m)],
        "lyapunov" => vec![a - eye(n) * Scale(1.2), q],
        "stein" => vec![a * Scale(0.9), q],
        "sylvester" => {
            vec![a, normal(rng, m, m) * Scale(1.0 / (m as f64).sqrt()) + eye(m) * Scale(3.0), normal(rng, n, m)]
        }
        _ => vec![a],
    };
    Problem { kind, hard: false, matrices }
}

/// Five classes of ten: an unstable mode almost out of reach, a mode within 1e-8 of the stability boundary, states in units
/// over ten decades (Riccati); the last two for Lyapunov equations; near neighbours (Sylvester, reordering).
fn hard_problem(rng: &mut ChaCha8Rng, class: usize, k: usize, n: usize) -> Problem {
    let discrete = k % 2 == 1;
    let units: Vec<f64> = (0..n).map(|_| 10f64.powf(rng.random_range(-5.0..5.0))).collect();
    let (mut kind, m) = (usize::from(discrete), 2.min(n));
    if class == 3 {
        kind += 2;
    }
    if class == 4 {
        kind = if discrete { 5 } else { 4 };
    }
    let mut p = random_problem(rng, kind, n, m);
    p.hard = true;
    match class {
        0 | 1 => {
            // A mode of its own, coupled by a rotation afterwards.
            let mode = match (class, discrete) {
                (0, false) => 0.5,
                (0, true) => 1.5,
                (_, false) => -1e-8,
                (_, true) => 1.0 - 1e-8,
            };
            let weak = if class == 0 { 10f64.powi(-3 - (k as i32 / 2) % 5) } else { 1e-4 };
            for j in 0..n {
                p.matrices[0][(0, j)] = if j == 0 { mode } else { 0.0 };
            }
            (0..m).for_each(|j| p.matrices[1][(0, j)] *= weak);
            let u = normal(rng, n, n).qr().compute_thin_Q();
            p.matrices[0] = &u * &p.matrices[0] * u.transpose();
            p.matrices[1] = &u * &p.matrices[1];
        }
        2 => {
            p.matrices[0] = Mat::from_fn(n, n, |i, j| p.matrices[0][(i, j)] * units[j] / units[i]);
            p.matrices[1] = Mat::from_fn(n, m, |i, j| p.matrices[1][(i, j)] / units[i]);
            p.matrices[2] = Mat::from_fn(n, n, |i, j| p.matrices[2][(i, j)] * units[i] * units[j]);
        }
        3 if k % 4 < 2 => {
            p.matrices[0] = Mat::from_fn(n, n, |i, j| p.matrices[0][(i, j)] * units[j] / units[i]);
            p.matrices[1] = Mat::from_fn(n, n, |i, j| p.matrices[1][(i, j)] / units[i] / units[j]);
        }
        3 => {
            let shift = youla::linalg::eigenvalues("A", p.matrices[0].as_ref()).expect("eigenvalues");
            let rightmost = shift.iter().map(|p| p.re).fold(f64::NEG_INFINITY, f64::max);
            let radius = shift.iter().map(|p| p.norm()).fold(0.0, f64::max);
            p.matrices[0] = if discrete {
                &p.matrices[0] * Scale((1.0 - 1e-8) / radius)
            } else {
                &p.matrices[0] - eye(n) * Scale(rightmost + 1e-8)
            };
        }
        _ if discrete => {
            // Pairs of eigenvalues 1e-9 apart on both sides of the boundary.
            p.matrices[0] = Mat::from_fn(n, n, |i, j| match i.cmp(&j) {
                std::cmp::Ordering::Equal => (if i % 2 == 0 { 1e-9 } else { -1e-9 }) * (1 + i / 2) as f64,
                std::cmp::Ordering::Less => p.matrices[0][(i, j)],
                std::cmp::Ordering::Greater => 0.0,
            });
        }
        _ => {
            let a = p.matrices[0].submatrix(0, 0, m, m);
            p.matrices[1] = -(a + eye(m) * Scale(1e-9));
        }
    }
    p
}

fn normal(rng: &mut ChaCha8Rng, rows: usize, columns: usize) -> Mat<f64> {
    Mat::from_fn(rows, columns, |_, _| rng.sample(StandardNormal))
}

/// For each problem: kind, class and number of matrices; for each matrix: rows, columns, entries by columns.
fn write(path: &Path, problems: &[Problem]) -> std::io::Result<()> {
    let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
    for Problem { kind, hard, matrices } in problems {
        put(&mut out, &[*kind as f64, f64::from(*hard), matrices.len() as f64])?;
        for matrix in matrices {
            put_matrix(&mut out, matrix)?;
        }
    }
    out.flush()
}

fn put_matrix(out: &mut impl Write, matrix: &Mat<f64>) -> std::io::Result<()> {
    put(out, &[matrix.nrows() as f64, matrix.ncols() as f64])?;
    (0..matrix.ncols()).try_for_each(|j| put(out, matrix.col_as_slice(j)))
}

fn put(out: &mut impl Write, values: &[f64]) -> std::io::Result<()> {
    values.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
}
