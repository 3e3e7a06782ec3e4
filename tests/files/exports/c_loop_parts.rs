//! The header of a loop against `youla_rt` where random events do not lead: refusals of `init`, every shift register, the ends of the ramps
//! and counters, other sizes, flags that would switch the guard off.

use super::c_loop::{code, header, header_of, matrices};
use super::{folder, output};
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use youla::Mat;
use youla::lti::{Discrete, StateSpace};
use youla_rt::{Controller, ExcitationSource, ExcitedLoop, Limits, Matrices, PrbsSource};

const STRICT: [&str; 6] = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off"];

fn compiled(folder: &Path, header: &str, program: &str, flags: &[&str]) -> String {
    std::fs::write(folder.join("loop.h"), header).unwrap();
    std::fs::write(folder.join("main.c"), program).unwrap();
    output("gcc", &[&STRICT[..], flags, &["main.c", "-o", "program"]].concat(), folder, "");
    output(folder.join("program"), &[], folder, "")
}

fn controller<const N: usize, const M: usize, const P: usize>() -> Controller<f64, N, M, P> {
    let (a, b, c) = ([[0.0; N]; N], [[0.0; M]; N], [[0.0; N]; P]);
    Controller::new(Matrices { a, b, c, d: [[0.0; M]; P], f: [[0.0; N]; M], l: [[0.0; P]; N] }).unwrap()
}

fn limits<const M: usize, const P: usize>() -> Limits<f64, M, P> {
    let (y, beta) = ([1.0; P], [9.0; P]);
    Limits { y, beta, u: [1.0; M], rate: [1.0; M], clipped: 0, stuck: 0, host: 0, duration: 0 }
}

fn refusals_of_limits() -> String {
    let mut found = String::new();
    for place in 0..10 {
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut limits = limits::<2, 3>();
            match place {
                0..3 => limits.y[place] = wrong,
                3..6 => limits.beta[place - 3] = wrong,
                6..8 => limits.u[place - 6] = wrong,
                _ => limits.rate[place - 8] = wrong,
            }
            let refused = ExcitedLoop::<f64, 3, 2, 3, 1>::new(controller(), limits, 1).is_err();
            let _ = write!(found, "{}", u8::from(refused));
        }
    }
    found + "\n"
}

fn registers() -> String {
    let mut found = String::new();
    for order in 0..32 {
        let last = (1_u32 << order) - 1;
        for (hold, starts) in (0..).zip([[1, last], [0, 1], [1, 0], [1, last + 1]]) {
            let prbs = PrbsSource::new(order, hold, starts, [1.0, 2.0]);
            let _ = write!(found, "{}", u8::from(prbs.is_some()));
            let Some(prbs) = prbs else { continue };
            let mut source: ExcitationSource<'_, f64, 2, 0> = ExcitationSource::Prbs(prbs);
            for _ in 0..500 {
                let [a, b] = source.advance();
                let _ = write!(found, "{}", a + b + 3.0);
            }
        }
        found.push('\n');
    }
    found
}

fn counters(clipped: u16, stuck: u16) -> String {
    let (y, beta, u, rate) = ([9.0; 3], [9.0; 3], [0.5; 2], [9.0; 2]);
    let limits = Limits { y, beta, u, rate, clipped, stuck, host: 0, duration: 0 };
    let mut running = ExcitedLoop::<f64, 3, 2, 3, 1>::new(Controller::new(matrices()).unwrap(), limits, 1).unwrap();
    let done = [running.write_q(1.0), running.commit_q(1), running.commit_q(0), running.switch_q(), running.arm()];
    let mut found = done.map(|done| code(done).to_string()).join(" ") + ":";
    let mut last = u32::MAX;
    for sample in 0..140_000 {
        if sample == 3 {
            running.start().unwrap();
        }
        let u = running.command(&[5.0; 2]);
        let status = running.observe(&[1.0; 3], &u).status.bits();
        if status != last {
            let _ = write!(found, " {sample} {status:x}");
        }
        last = status;
    }
    found + "\n"
}

fn ramps() -> String {
    const GROWN: usize = 12;
    let mut found = String::new();
    for length in [0, 1, 2, 9, 10, 11, 12, u16::MAX] {
        for trip in [false, true] {
            let controller = Controller::new(matrices()).unwrap();
            let mut running = ExcitedLoop::<f64, 3, 2, 3, 1>::new(controller, limits(), length).unwrap();
            running.arm().unwrap();
            running.start().unwrap();
            let mut count = 0;
            while count < GROWN || running.is_excited() {
                let u = running.command(&[0.0; 2]);
                let first = if trip && count == GROWN { 2.0 } else { 0.0 };
                let _ = running.observe(&[first, 0.0, 0.0], &u);
                count += 1;
                if count == GROWN && !trip {
                    running.stop();
                }
            }
            let _ = write!(found, "{count} ");
        }
    }
    found + "\n"
}

#[test]
#[ignore = "needs gcc"]
fn refusals_registers_ramps_and_counters_are_those_of_the_rust_loop() {
    let counters = counters(3, 0) + &counters(0, 0) + &counters(0, u16::MAX);
    let expected = refusals_of_limits() + &registers() + &ramps() + &counters + "1 1 0\n";
    for (name, flag) in [("loop-parts-double", "-DYOULA_REAL=double"), ("loop-parts-single", "-DYOULA_REAL=float")] {
        let found =
            compiled(&folder(name), &header(), include_str!("c_loop_parts.c"), &["-O2", "-DYOULA_Q_ORDER=1", flag]);
        for (line, (found, expected)) in found.lines().zip(expected.lines()).enumerate() {
            assert_eq!(found, expected, "{name}: line {line}");
        }
        assert_eq!(found.lines().count(), expected.lines().count(), "{name}");
    }
}

fn header_of_sizes(n: usize, m: usize, p: usize) -> String {
    let zeros = |height, width| Mat::<f64>::zeros(height, width);
    let time = Discrete::new(1e-3).unwrap();
    let model = StateSpace::new(zeros(n, n), zeros(n, m), zeros(p, n), zeros(p, m), time).unwrap();
    header_of(&model, zeros(m, n).as_ref(), zeros(n, p).as_ref())
}

const ONE_SENSOR_BREAKS: &str = r#"
#include <math.h>
#include <stdio.h>
#include "loop.h"

int main(void)
{
    static loop_loop s;
    loop_limits limits = {.clipped = 0};
    for (int i = 0; i < loop_outputs; i++) {
        limits.y[i] = limits.beta[i] = 1;
    }
    for (int i = 0; i < loop_inputs; i++) {
        limits.u[i] = limits.rate[i] = 1;
    }
    for (int broken = 0; broken < loop_outputs; broken++) {
        loop_real wanted[loop_inputs] = {0}, u[loop_inputs], y[loop_outputs] = {0};
        loop_row row;
        y[broken] = NAN;
        loop_init(&s, &limits, 1);
        loop_command(&s, wanted, u);
        loop_observe(&s, y, u, &row);
        printf("%lx\n", (unsigned long)row.status);
    }
    return 0;
}
"#;

/// Each output in turn is not a number: the status has eight outputs and fifteen channels only.
fn one_sensor_breaks<const N: usize, const M: usize, const P: usize>() {
    let mut expected = String::new();
    for broken in 0..P {
        let mut running = ExcitedLoop::<f64, N, M, P, 1>::new(controller(), limits(), 1).unwrap();
        let u = running.command(&[0.0; M]);
        let mut y = [0.0; P];
        y[broken] = f64::NAN;
        let _ = writeln!(expected, "{:x}", running.observe(&y, &u).status.bits());
    }
    for real in ["-DYOULA_REAL=double", "-DYOULA_REAL=float"] {
        let folder = folder(&format!("loop-sizes-{N}-{M}-{P}"));
        let flags = ["-O2", "-DYOULA_Q_ORDER=1", real];
        assert_eq!(compiled(&folder, &header_of_sizes(N, M, P), ONE_SENSOR_BREAKS, &flags), expected, "{N} {M} {P}");
    }
}

#[test]
#[ignore = "needs gcc"]
fn headers_of_other_sizes_compile_and_name_the_broken_sensor() {
    one_sensor_breaks::<0, 1, 1>();
    one_sensor_breaks::<1, 1, 1>();
    one_sensor_breaks::<5, 1, 17>();
    one_sensor_breaks::<2, 9, 2>();
}

/// With -ffast-math a compiler removes the checks for numbers that are not finite, and with them the guard.
#[test]
#[ignore = "needs gcc"]
fn flags_that_switch_the_guard_off_do_not_compile() {
    let folder = folder("loop-flags");
    std::fs::write(folder.join("loop.h"), header()).unwrap();
    std::fs::write(folder.join("main.c"), "#include \"loop.h\"\nint main(void) { return 0; }\n").unwrap();
    let guard = "the guard needs numbers that are not finite; compile without -ffast-math and -ffinite-math-only";
    let cases = [
        ("-ffast-math", guard),
        ("-Ofast", guard),
        ("-ffinite-math-only", guard),
        ("-DYOULA_Q_ORDER=0", "YOULA_Q_ORDER is the largest order of Q; set it to 1 or more"),
    ];
    for (flag, sentence) in cases {
        let found =
            Command::new("gcc").args(["-std=c99", flag, "-fsyntax-only", "main.c"]).current_dir(&folder).output();
        let found = found.unwrap();
        let errors = String::from_utf8_lossy(&found.stderr);
        assert!(!found.status.success() && errors.contains(sentence), "{flag}: {errors}");
    }
}
