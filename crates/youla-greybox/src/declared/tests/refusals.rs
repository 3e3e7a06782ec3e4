//! Every bad declaration, with its sentence.

use super::declared;
use crate::Structure;

/// A structure of one state; `b`, the rate and what follows it may be replaced.
fn lag(b: &str, rate: &str, rest: &str) -> String {
    format!("a = [['-rate']]\nb = [[{b}]]\nc = [[1]]\n{rest}\n[parameters.rate]\n{rate}\n")
}

fn sentence(text: &str) -> String {
    declared(text).map(|s| s.names()).unwrap_err().to_string()
}

#[test]
fn expressions() {
    for (b, told) in [
        (
            "'2 * rat'",
            "row 1, column 1 of the matrix b is \"2 * rat\", but \"rat\" is not declared (did you mean \"rate\"?); declared: rate",
        ),
        (
            "'rate +'",
            "row 1, column 1 of the matrix b is \"rate +\": it ends where a number, a name or ( is expected (character 7)",
        ),
        (
            "'1 / (rate - 3)'",
            "row 1, column 1 of the matrix b is \"1 / (rate - 3)\", whose value is inf, which is not finite",
        ),
        (
            "'sqrt(rate - 3)'",
            "row 1, column 1 of the matrix b is \"sqrt(rate - 3)\", whose derivative with respect to \"rate\" is inf, which is not finite",
        ),
        ("inf", "row 1, column 1 of the matrix b is \"inf\", whose value is inf, which is not finite"),
        (
            "true",
            "the declaration cannot be read: TOML parse error at line 2, column 6\n  |\n2 | b = [[true]]\n  |      ^^^^^^\nexpected a number or a text with an expression\n",
        ),
    ] {
        assert_eq!(sentence(&lag(b, "initial = 3", "")), told);
    }
}

#[test]
fn derived_quantities() {
    let with = |derived: &str| sentence(&format!("{}[derived]\n{derived}", lag("'p'", "initial = 3", "")));
    for (derived, told) in [
        ("p = 'q'\nq = '2 * p'\nr = 'rate'", "circular definition among these derived quantities: p, q"),
        ("p = 'rate * z'", "the derived quantity p is \"rate * z\", but \"z\" is not declared; declared: rate, p"),
        (
            "p = 'rate'\nq = '1/(p - 3)'",
            "the derived quantity q is \"1/(p - 3)\", whose value is inf, which is not finite",
        ),
        ("p = '1'\nrate = '2'", "the name \"rate\" is declared twice"),
        ("p = '1'\nsqrt = '2'", "the name \"sqrt\" is that of a function or constant of expressions"),
        ("p = '1'\npi = '2'", "the name \"pi\" is that of a function or constant of expressions"),
        ("p = '1'\n'k-1' = '2'", "the name \"k-1\" must consist of letters, digits and _ and not begin with a digit"),
        ("p = '1'\n'1k' = '2'", "the name \"1k\" must consist of letters, digits and _ and not begin with a digit"),
    ] {
        assert_eq!(with(derived), told);
    }
}

#[test]
fn parameters() {
    for (rate, told) in [
        ("", "the parameter \"rate\" has no initial value"),
        ("initial = 3\nmin = 4", "the parameter \"rate\" starts at 3, but must lie from 4 to inf"),
        ("initial = 3\nmax = 2", "the parameter \"rate\" starts at 3, but must lie from -inf to 2"),
        (
            "initial = 3\nmin = 4\nmax = 2",
            "the parameter \"rate\" has the bounds 4 and 2, but the lower one must be below the upper one; set fixed = true for a known parameter",
        ),
        (
            "initial = 3\nmin = 3\nmax = 3",
            "the parameter \"rate\" has the bounds 3 and 3, but the lower one must be below the upper one; set fixed = true for a known parameter",
        ),
        (
            "initial = 3\nmin = nan",
            "the parameter \"rate\" has the bounds NaN and inf, but the lower one must be below the upper one; set fixed = true for a known parameter",
        ),
        ("initial = nan", "the initial value of the parameter \"rate\" is NaN, but must be a finite number"),
        ("initial = 3\nscale = 0", "the scale of the parameter \"rate\" is 0, but must be a positive number"),
        (
            "intial = 3",
            "the declaration cannot be read: TOML parse error at line 6, column 1\n  |\n6 | intial = 3\n  | ^^^^^^\nunknown field `intial`, expected one of `initial`, `unit`, `min`, `max`, `scale`, `fixed`\ndid you mean `initial`?",
        ),
        (
            "initial = 3\n[parameters.rte]\ninitial = 1",
            "no entry of a, b, c and d depends on the parameter \"rte\" (did you mean \"rate\"?)",
        ),
    ] {
        assert_eq!(sentence(&lag("1", rate, "")), told);
    }
    let typo = "template = 'rotor-gyroscopic'\n[parameters.sped]\ninitial = 3\nfixed = true";
    assert_eq!(sentence(typo), "no entry of a, b, c and d depends on the parameter \"sped\" (did you mean \"speed\"?)");
}

#[test]
fn matrices() {
    for (text, told) in [
        ("a = [[1]]", "the structure has no matrix b; give a, b and c, or a template"),
        ("", "the structure has no matrix a; give a, b and c, or a template"),
        ("a = []\nb = []\nc = []", "the number of rows of a is 0, but must be at least 1"),
        ("a = [[1]]\nb = [[]]\nc = [[1]]", "the number of columns of b is 0, but must be at least 1"),
        ("a = [[1]]\nb = [[1]]\nc = []", "the number of rows of c is 0, but must be at least 1"),
        ("a = [[1, 2], [3]]\nb = [[1], [1]]\nc = [[1, 1]]", "row 2 of the matrix a is 1 x 1, but must be 1 x 2"),
        ("a = [[1]]\nb = [[1], [1]]\nc = [[1]]", "the matrix b is 2 x 1, but must be 1 x 1"),
        ("a = [[1]]\nb = [[1]]\nc = [[1, 2]]", "row 1 of the matrix c is 1 x 2, but must be 1 x 1"),
        ("a = [[1]]\nb = [[1]]\nc = [[1]]\nd = [[1], [2]]", "the matrix d is 2 x 1, but must be 1 x 1"),
        ("a = [[1]]\nb = [[1, 2]]\nc = [[1]]\nd = [[1]]", "row 1 of the matrix d is 1 x 1, but must be 1 x 2"),
    ] {
        assert_eq!(sentence(text), told);
    }
    let unknown = sentence("template = 'bearin'");
    assert!(unknown.contains("line 1, column 12") && unknown.contains("expected one of `bearing`,"), "{unknown}");
    assert!(unknown.ends_with("did you mean `bearing`?"), "{unknown}");
    let key = sentence("a = [[1]]\nb = [[1]]\nc = [[1]]\nparamters = {}");
    assert!(key.ends_with("did you mean `parameters`?"), "{key}");
}

#[test]
fn vectors_of_another_length() {
    let lag = declared(&lag("1", "initial = 3", "")).unwrap();
    assert_eq!(lag.model(&[]).unwrap_err().to_string(), "the parameter vector is 0 x 1, but must be 1 x 1");
    assert!(lag.derived(&[1.0, 2.0], None).is_err());
    let covariance = youla::Mat::zeros(2, 2);
    assert!(lag.derived(&[1.0], Some(covariance.as_ref())).is_err());
    assert!(lag.slopes(&[1.0], 1).is_empty());
}
