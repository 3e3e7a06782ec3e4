//! The grammar, and derivatives against differences.

use super::super::dual::Dual;
use super::super::parser::{Problem, parse};

fn number_of(name: &str) -> Option<usize> {
    ["x", "y", "E"].iter().position(|known| *known == name)
}

fn evaluated(text: &str, values: [f64; 3], direction: usize) -> Dual {
    let dual = |j: usize| Dual { value: values[j], slope: if j == direction { 1.0 } else { 0.0 } };
    parse(text, &number_of).unwrap().evaluate(&[dual(0), dual(1), dual(2)])
}

#[test]
fn texts_mean_what_they_mean_on_paper() {
    for (text, value) in [
        ("-x^2", -9.0),
        ("(-x)^2", 9.0),
        ("2^x^y", 2f64.powf(1.0 / 9.0)),
        ("2^-y", 4.0),
        ("x - y - 1", 4.0),
        ("x / y / 2", -0.75),
        ("x / (y * 2)", -0.75),
        ("1 + 2 * x", 7.0),
        ("--x", 3.0),
        ("x*-y", 6.0),
        ("1.7e6 + .5 + 2.e-1 + 1E+2", 1.7e6 + 0.5 + 0.2 + 100.0),
        ("E", 0.25),
        ("2 * pi", std::f64::consts::TAU),
        (" sqrt( x + 1 )\n", 2.0),
        ("exp(ln(x))", f64::exp(f64::ln(3.0))),
        ("4*atan(1)", std::f64::consts::PI),
    ] {
        assert_eq!(evaluated(text, [3.0, -2.0, 0.25], 0).value, value, "{text}");
    }
}

/// Central differences of fourth order at (3, -2, 0.25).
#[test]
fn slopes_are_derivatives() {
    let at = [3.0, -2.0, 0.25];
    let texts = [
        "-x^2 * y",
        "x / y - y / x",
        "y^3 + y^-2 + x^y",
        "sqrt(x + E) * exp(-E * x) + ln(x * E)",
        "sin(x) * cos(y) + tan(E) / atan(x * y)",
        "(x + y * E)^(1 + E) / (1 - x)^2",
        "x^x - (x - y)^(x * E)",
    ];
    for text in texts {
        for j in 0..3 {
            let value = |h: f64| {
                let mut moved = at;
                moved[j] += h;
                evaluated(text, moved, j).value
            };
            let h = 1e-3 * at[j].abs();
            let difference = (8.0 * (value(h) - value(-h)) - value(2.0 * h) + value(-2.0 * h)) / (12.0 * h);
            let slope = evaluated(text, at, j).slope;
            assert!((slope - difference).abs() <= 1e-7 * (1.0 + slope.abs()), "{text}, {j}: {slope} for {difference}");
        }
    }
}

/// Derivatives that hold where a formula for the general case fails.
#[test]
fn slopes_at_the_edge() {
    assert_eq!(evaluated("x^2", [0.0; 3], 0).slope, 0.0);
    assert_eq!(evaluated("x^1", [0.0; 3], 0).slope, 1.0);
    assert_eq!(evaluated("x^0", [0.0; 3], 0).slope, 0.0);
    assert_eq!(evaluated("(x - 5)^2", [3.0; 3], 0).slope, -4.0);
    assert_eq!(evaluated("sqrt(x) * y", [0.0, 2.0, 0.0], 1).slope, 0.0);
    assert_eq!(evaluated("sqrt(x)", [0.0; 3], 0).slope, f64::INFINITY);
}

#[test]
fn what_is_no_expression_is_told_with_its_place() {
    let problem = |text: &str| match parse(text, &number_of) {
        Err(Problem::Syntax { column, problem }) => format!("{column}: {problem}"),
        other => panic!("{text}: {other:?}"),
    };
    for (text, told) in [
        ("", "1: it ends where a number, a name or ( is expected"),
        ("x +", "4: it ends where a number, a name or ( is expected"),
        ("x ** y", "4: '*' is in the place of a number, a name or ("),
        ("2x", "2: 'x' is in the place of an operator"),
        ("x y", "3: 'y' is in the place of an operator"),
        ("(x", "3: a closing parenthesis is missing"),
        ("x)", "2: ')' is in the place of an operator"),
        ("1.2.3", "1: 1.2.3 is not a number"),
        ("1e999", "1: 1e999 is not a number"),
        ("y + sqrt x", "5: the function sqrt lacks its ("),
        ("log(x)", "1: log is not a function; the functions are sqrt, exp, ln, sin, cos, tan, atan, tanh, abs, sign"),
        ("x(y)", "1: x is not a function; the functions are sqrt, exp, ln, sin, cos, tan, atan, tanh, abs, sign"),
        ("x = y", "3: '=' is in the place of an operator"),
    ] {
        assert_eq!(problem(text), told, "{text}");
    }
    assert_eq!(parse("x + z", &number_of), Err(Problem::Unknown { name: "z".into() }));
}

/// Neither length nor depth exhausts the stack.
#[test]
fn long_and_deep_texts() {
    let long = format!("x{}", "+x".repeat(200_000));
    assert_eq!(evaluated(&long, [1.0; 3], 0), Dual { value: 200_001.0, slope: 200_001.0 });
    for deep in [format!("{}x", "(".repeat(100_000)), "x^".repeat(100_000), "-".repeat(100_000), "sin(".repeat(100_000)]
    {
        assert!(parse(&deep, &number_of).is_err());
    }
    let fits = format!("{}x{}", "(".repeat(64), ")".repeat(64));
    assert_eq!(evaluated(&fits, [2.0; 3], 0).value, 2.0);
}
