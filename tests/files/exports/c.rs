//! The C99 headers against the library's simulation: 1e-12 of the largest value in double precision.

use super::{folder, named, output};
use crate::common::{TS, bearing, normal, observer_factors, random_stable, random_system, rng, run, sampled};
use youla::control::closed_loop;
use youla::factor::CoprimeFactors;
use youla::linalg::{block, eye};
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla::{Mat, MatRef};
use youla_io::export::{
    CController, ControllerExport, ModelFormat, PidExport, PidForm, c_controller, export_model, export_pid,
};
use youla_loop::redesign::structured::{Discretisation, Notch, PidController, PidGains};

const EXACT: f64 = 1e-12;
const WARNINGS: [&str; 6] = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2"];

/// Reads inputs, writes outputs.
const MODEL: &str = r#"
#include <stdio.h>
#include "hansen.h"
int main(void)
{
    hansen_state s;
    hansen_real u[hansen_inputs], y[hansen_outputs];
    hansen_reset(&s);
    for (;;) {
        for (int j = 0; j < hansen_inputs; j++) {
            double value;
            if (scanf("%lf", &value) != 1) {
                return 0;
            }
            u[j] = (hansen_real)value;
        }
        hansen_output(&s, u, y);
        hansen_update(&s, u);
        for (int j = 0; j < hansen_outputs; j++) {
            printf("%.17g\n", (double)y[j]);
        }
    }
}
"#;

/// Reads y, alpha and u as applied, writes the command and beta; with LIMIT the command itself is applied, cut off there.
const CONTROLLER: &str = r#"
#include <stdio.h>
#include "controller.h"
static int take(controller_real *to, int count)
{
    for (int j = 0; j < count; j++) {
        double value;
        if (scanf("%lf", &value) != 1) {
            return 0;
        }
        to[j] = (controller_real)value;
    }
    return 1;
}
int main(void)
{
    controller_state s;
    controller_real y[controller_outputs], alpha[controller_inputs], applied[controller_inputs];
    controller_real u[controller_inputs], beta[controller_outputs];
    controller_reset(&s);
    while (take(y, controller_outputs) && take(alpha, controller_inputs) && take(applied, controller_inputs)) {
        controller_command(&s, y, alpha, u);
#ifdef LIMIT
        for (int j = 0; j < controller_inputs; j++) {
            u[j] = u[j] > (controller_real)LIMIT ? (controller_real)LIMIT : u[j];
            u[j] = u[j] < -(controller_real)LIMIT ? -(controller_real)LIMIT : u[j];
            applied[j] = u[j];
        }
#endif
        controller_observe(&s, y, applied, beta);
        for (int j = 0; j < controller_inputs; j++) {
            printf("%.17g\n", (double)u[j]);
        }
        for (int j = 0; j < controller_outputs; j++) {
            printf("%.17g\n", (double)beta[j]);
        }
    }
    return 0;
}
"#;

/// Reads r and y, writes u.
const PID: &str = r#"
#include <stdio.h>
#include "pid.h"
int main(void)
{
    pid_state s = {0};
    double r, y;
    while (scanf("%lf %lf", &r, &y) == 2) {
        printf("%.17g\n", (double)pid_step(&s, (YOULA_REAL)r, (YOULA_REAL)y));
    }
    return 0;
}
"#;

/// What the program makes of a record, samples x channels.
fn through_c(name: &str, source: &str, header: (&str, &str), flags: &[&str], input: MatRef<'_, f64>) -> Mat<f64> {
    let folder = folder(name);
    std::fs::write(folder.join(header.0), header.1).unwrap();
    std::fs::write(folder.join("main.c"), source).unwrap();
    let arguments = [&WARNINGS[..], flags, &["main.c", "-o", "program"]].concat();
    output("gcc", &arguments, &folder, "");
    let text: String =
        input.row_iter().flat_map(|row| row.iter().map(|x| format!("{x:?}\n")).collect::<Vec<_>>()).collect();
    let printed = output(folder.join("program"), &[], &folder, &text);
    let numbers: Vec<f64> = printed.lines().map(|line| line.parse().unwrap()).collect();
    let columns = numbers.len() / input.nrows();
    assert_eq!(numbers.len(), columns * input.nrows(), "{name}");
    Mat::from_fn(input.nrows(), columns, |k, j| numbers[k * columns + j])
}

/// Largest difference of a column relative to its largest value.
fn miss(x: MatRef<'_, f64>, y: MatRef<'_, f64>) -> f64 {
    assert_eq!((x.nrows(), x.ncols()), (y.nrows(), y.ncols()));
    let column = |j: usize| (x.col(j) - y.col(j)).norm_max() / y.col(j).norm_max().max(f64::MIN_POSITIVE);
    (0..x.ncols()).map(column).fold(0.0, f64::max)
}

#[test]
#[ignore = "needs gcc"]
fn the_header_of_a_model_simulates_as_the_library() {
    let (rng, time) = (&mut rng(1), Discrete::new(TS).unwrap());
    let gain = random_stable(rng, (0, 2, 1), time);
    let slow = random_system(rng, (9, 1, 2), -1e-3, time);
    for (name, g) in [("many", random_stable(rng, (12, 2, 3), time)), ("gain", gain), ("slow", slow)] {
        let header = String::from_utf8(export_model(&named(&g), ModelFormat::C).unwrap()).unwrap();
        let u = normal(rng, 2000, g.inputs());
        let double = through_c(name, MODEL, ("hansen.h", &header), &[], u.as_ref());
        let expected = run(&g, u.as_ref());
        let error = miss(double.as_ref(), expected.as_ref());
        assert!(error <= EXACT, "{name}: double misses by {error:.1e}");
        let single =
            through_c(&format!("{name}-single"), MODEL, ("hansen.h", &header), &["-DYOULA_REAL=float"], u.as_ref());
        let error = miss(single.as_ref(), expected.as_ref());
        let stated = stated(&header);
        assert!(
            error <= 5.0 * stated && stated <= 1e-3,
            "{name}: single misses by {error:.1e}, the header says {stated:.1e}"
        );
        assert!(error > 0.0, "{name}: single precision was not used");
    }
}

/// The error of single precision that a header states.
fn stated(header: &str) -> f64 {
    let (_, rest) = header.split_once("differs from double by at most ").unwrap();
    rest.split_once(' ').unwrap().0.parse().unwrap()
}

/// A PID with two notches by both rules, in C against the controller that was designed.
#[test]
#[ignore = "needs gcc"]
fn the_header_of_a_pid_computes_the_controller() {
    let (rng, time) = (&mut rng(3), Discrete::new(TS).unwrap());
    for discretisation in [Discretisation::BackwardEuler, Discretisation::Tustin] {
        let gains = PidGains { discretisation, kp: 1.3, ki: 40.0, kd: 0.02, derivative_filter: 3.0 * TS };
        let notch = |share: f64, depth| Notch { hz: share / TS, width: 0.3, depth };
        let c = PidController { gains, notches: vec![notch(0.05, 0.1), notch(0.2, 0.5)], delay: 0 };
        let [(ki, i, _), (kd, d, lag)] = c.gains.parts(TS);
        let pid = PidExport {
            name: "pid".into(),
            measured: Channel::new("y", "m"),
            commanded: Channel::new("u", "V"),
            ts: TS,
            kp: c.gains.kp,
            ki,
            kd,
            derivative_filter: c.gains.derivative_filter,
            tustin: discretisation == Discretisation::Tustin,
            integral: i.map(|b| ki * b),
            derivative: [kd * d[0] / lag[0], -lag[1] / lag[0]],
            notches: c.notches.iter().map(|n| ([n.hz, n.width, n.depth], n.coefficients(TS))).collect(),
            delay: 0,
            plant: None,
            reference_filter: 0.0,
            reference_weights: [1.0; 2],
            origin: "a test".into(),
        };
        let header = export_pid(&pid, PidForm::C).unwrap();
        let input = normal(rng, 2000, 2);
        // u = K (y - r) with K in positive feedback.
        let error = Mat::from_fn(2000, 1, |k, _| input[(k, 1)] - input[(k, 0)]);
        let expected = run(&c.system(time).unwrap(), error.as_ref());
        let name = format!("pid-{discretisation:?}");
        let double = through_c(&name, PID, ("pid.h", &header), &[], input.as_ref());
        assert!(miss(double.as_ref(), expected.as_ref()) <= 1e-9, "{name}");
        let single =
            through_c(&format!("{name}-single"), PID, ("pid.h", &header), &["-DYOULA_REAL=float"], input.as_ref());
        assert!((1e-12..1e-3).contains(&miss(single.as_ref(), expected.as_ref())), "{name}");
    }
}

struct Case {
    name: &'static str,
    factors: CoprimeFactors<Discrete>,
    q: Option<StateSpace<Discrete>>,
}

impl Case {
    fn export(&self) -> CController {
        let channels =
            |letter: &str, count| (1..=count).map(|k| Channel::new(format!("{letter}{k}"), "")).collect::<Vec<_>>();
        let factors = &self.factors;
        let export = ControllerExport {
            name: "controller".into(),
            measured: channels("y", factors.outputs()),
            commanded: channels("u", factors.inputs()),
            nominal: factors.nominal().clone(),
            left: factors.left().system().clone(),
            q: self.q.clone(),
            origin: "a test".into(),
        };
        c_controller(&export).unwrap()
    }
}

fn cases() -> Vec<Case> {
    let (rng, time) = (&mut rng(2), Discrete::new(TS).unwrap());
    let factors = observer_factors(&sampled(&bearing(0.0)));
    let q = random_stable(rng, (3, 2, 2), time);
    let through = factors.shifted_to(&factors.controller_of(&q).unwrap()).unwrap();
    let uneven = observer_factors(&random_system(rng, (5, 2, 3), 0.05, time));
    vec![
        Case { name: "observer", factors: factors.clone(), q: None },
        Case { name: "with-q", factors, q: Some(q) },
        Case { name: "feedthrough", factors: through, q: None },
        Case { name: "unstable", factors: uneven, q: None },
    ]
}

/// (28) and the port alpha, from what the firmware did: `[alpha + Q beta; beta] = left [u; y]`.
fn check_ports(case: &Case, found: &Mat<f64>, y: MatRef<'_, f64>, alpha: Option<MatRef<'_, f64>>) {
    let m = case.factors.inputs();
    let (u, beta) = (found.subcols(0, m), found.subcols(m, found.ncols() - m));
    let z = run(case.factors.left().system(), block(&[&[u, y]]).as_ref());
    let error = miss(z.subcols(m, beta.ncols()), beta);
    assert!(error <= 1e-10, "{}: beta misses (28) by {error:.1e}", case.name);
    if let Some(alpha) = alpha {
        let from_q = case.q.as_ref().map_or_else(|| Mat::zeros(u.nrows(), m), |q| run(q, beta));
        let error = miss((z.subcols(0, m) - from_q).as_ref(), alpha);
        assert!(error <= 1e-10, "{}: alpha misses by {error:.1e}", case.name);
    }
}

/// alpha, and u, y and beta of the library's simulation of the loop with the nominal model and with output noise.
fn logged(case: &Case, made: &CController) -> (Mat<f64>, Mat<f64>) {
    let (rng, m, p) = (&mut rng(3), case.factors.inputs(), case.factors.outputs());
    let closed = closed_loop(case.factors.nominal(), &made.j_k).unwrap();
    let (alpha, noise) = (normal(rng, 2000, m), normal(rng, 2000, p));
    let calm = run(&closed, block(&[&[alpha.as_ref(), Mat::zeros(2000, p).as_ref()]]).as_ref());
    let noise = Mat::from_fn(2000, p, |k, j| 0.1 * noise[(k, j)] * calm.col(m + j).norm_l2() / 2000f64.sqrt());
    let log = run(&closed, block(&[&[alpha.as_ref(), noise.as_ref()]]).as_ref());
    (alpha, log)
}

#[test]
#[ignore = "needs gcc"]
fn the_header_of_a_controller_runs_the_experiment() {
    for case in cases() {
        let made = case.export();
        let (m, p) = (case.factors.inputs(), case.factors.outputs());
        assert_eq!(made.header.contains("controller_ky"), case.name == "with-q" || case.name == "feedthrough");
        let (alpha, log) = logged(&case, &made);
        let y = log.subcols(m, p);
        let input = block(&[&[y, alpha.as_ref(), log.subcols(0, m)]]);
        let header = ("controller.h", made.header.as_str());
        let found = through_c(case.name, CONTROLLER, header, &[], input.as_ref());
        let expected = block(&[&[log.subcols(0, m), log.subcols(m + p, p)]]);
        let error = miss(found.as_ref(), expected.as_ref());
        println!("{}: double {error:.1e}, single {:.1e}", case.name, made.single.relative.unwrap());
        assert!(error <= EXACT, "{}: double misses by {error:.1e}", case.name);
        check_ports(&case, &found, y, Some(alpha.as_ref()));

        let limited =
            through_c(&format!("{}-limited", case.name), CONTROLLER, header, &["-DLIMIT=0.5"], input.as_ref());
        assert_eq!(limited.subcols(0, m).norm_max(), 0.5, "{}: the limit is met", case.name);
        check_ports(&case, &limited, y, None);

        let single = ["-DYOULA_REAL=float"];
        let single = through_c(&format!("{}-single", case.name), CONTROLLER, header, &single, input.as_ref());
        let (error, stated) = (miss(single.as_ref(), expected.as_ref()), stated(&made.header));
        assert!(
            error <= 5.0 * stated && stated < 1e-3,
            "{}: single misses by {error:.1e}, stated {stated:.1e}",
            case.name
        );
    }
}

#[test]
fn without_alpha_it_is_the_controller_of_q() {
    let case = &cases()[1];
    let made = case.export();
    let y = normal(&mut rng(4), 500, 2);
    let expected = run(&case.factors.controller_of(case.q.as_ref().unwrap()).unwrap(), y.as_ref());
    let j_k = run(made.j_k.system(), block(&[&[y.as_ref(), Mat::zeros(500, 2).as_ref()]]).as_ref());
    let error = miss(j_k.subcols(0, 2), expected.as_ref());
    assert!(error <= 1e-10, "{error:.1e}");
    // The opposite sign of Q is another controller.
    let other =
        Case { q: Some(case.q.as_ref().unwrap().negated()), factors: case.factors.clone(), ..cases().remove(1) };
    let j_k = run(other.export().j_k.system(), block(&[&[y.as_ref(), Mat::zeros(500, 2).as_ref()]]).as_ref());
    assert!(miss(j_k.subcols(0, 2), expected.as_ref()) > 1e-2);
}

#[test]
fn what_does_not_fit_is_refused() {
    let case = &cases()[1];
    let refused = |change: &dyn Fn(&mut ControllerExport)| {
        let channels = vec![Channel::new("x", ""), Channel::new("z", "")];
        let mut export = ControllerExport {
            name: "c".into(),
            measured: channels.clone(),
            commanded: channels,
            nominal: case.factors.nominal().clone(),
            left: case.factors.left().system().clone(),
            q: case.q.clone(),
            origin: String::new(),
        };
        change(&mut export);
        c_controller(&export).unwrap_err().to_string()
    };
    let time = Discrete::new(TS).unwrap();
    let unstable = StateSpace::new(eye(1), Mat::zeros(1, 2), Mat::zeros(2, 1), Mat::zeros(2, 2), time).unwrap();
    let slower = StateSpace::gain(Mat::zeros(2, 2), Discrete::new(2.0 * TS).unwrap()).unwrap();
    let narrow = StateSpace::gain(Mat::zeros(2, 1), time).unwrap();
    assert!(refused(&|e| e.q = Some(unstable.clone())).starts_with("Q must be stable, but has the pole 1"));
    assert!(refused(&|e| e.q = Some(slower.clone())).contains("sample times differ"));
    assert_eq!(refused(&|e| e.q = Some(narrow.clone())), "the number of inputs of Q, from beta is 1, but must be 2");
    assert!(refused(&|e| e.measured.truncate(1)).contains("the number of measured channels"));
    assert!(refused(&|e| e.left = narrow.clone()).contains("the number of inputs of the left factors"));
}
