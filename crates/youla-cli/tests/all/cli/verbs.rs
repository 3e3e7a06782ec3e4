//! Verbs, help and what is printed where.

use crate::common::{demo, empty_folder, loop_folder, youla};
use std::fs;

#[test]
fn without_arguments_help_is_shown() {
    let found = youla(&empty_folder("help"), &[]);
    assert_eq!(found.code, Some(2));
    assert!(found.stderr.contains("Usage: youla") && found.stderr.contains("identify run.toml"), "{}", found.stderr);
    assert_eq!(found.stdout, "");
}

#[test]
fn every_verb_has_an_example() {
    let folder = empty_folder("help-verbs");
    for verb in ["demo", "check", "synchronise", "identify", "signals", "report", "excite", "schema"] {
        let found = youla(&folder, &[verb, "--help"]);
        assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""), "{verb}");
        assert!(found.stdout.contains(&format!("Example:\n  youla {verb}")), "{}", found.stdout);
    }
    let found = youla(&folder, &["--help"]);
    assert!(found.stdout.contains("Examples:") && found.stdout.contains("Exit codes: 0 done, 1"), "{}", found.stdout);
}

#[test]
fn wrong_arguments_end_with_code_two() {
    let folder = loop_folder("arguments", &[]);
    let cases: [(&[&str], &str); 4] = [
        (&["identfy"], "identify"),
        (&["identify"], "<FILE>..."),
        (&["identify", "run.toml", "--force"], "--out"),
        (&["identify", "run.toml", "--quiet", "--json"], "cannot be used with"),
    ];
    for (arguments, evidence) in cases {
        let found = youla(&folder, arguments);
        assert_eq!((found.code, found.stdout.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(found.stderr.contains(evidence), "{}", found.stderr);
    }
}

#[test]
fn piped_output_is_a_plain_table() {
    let folder = loop_folder("table", &[]);
    for number in ["001", "002"] {
        let found = youla(&folder, &["identify", "run.toml"]);
        assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""), "no progress where nobody looks");
        assert!(!found.stdout.contains('\u{1b}') && !found.stdout.contains('\r'));
        for text in ["nominal G(0)", "direct subspace", "Hansen G(S)", "rest, y", "order", "stabilised by K"] {
            assert!(found.stdout.contains(text), "{text} is not in: {}", found.stdout);
        }
        let run = format!("runs/loop-{number}");
        assert!(found.stdout.contains(&run) && folder.join(run).join("report.html").is_file());
    }
}

#[test]
fn report_draws_again() {
    let folder = empty_folder("redraw");
    fs::copy(demo().join("report.json"), folder.join("report.json")).expect("copied");
    let found = youla(&folder, &["report", "."]);
    assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""));
    assert_eq!(found.stdout.trim(), "./report.html");
    let page = || fs::read_to_string(folder.join("report.html")).expect("readable");
    let (first, original) = (page(), fs::read_to_string(demo().join("report.html")).expect("readable"));
    // Numbers in report.json are rounded already, so that a last digit on the page may round the other way.
    assert!(first.len().abs_diff(original.len()) < 1000 && first[..2000] == original[..2000]);
    assert_eq!(youla(&folder, &["report", "."]).code, Some(0));
    assert!(page() == first, "the same data give the same page");
}

#[test]
fn a_report_with_an_impossible_clock_is_refused() {
    let folder = empty_folder("redraw-clock");
    let text = fs::read_to_string(demo().join("report.json")).expect("readable");
    let start = text.find("\"detail\":{\"start\":").expect("a clock") + 9;
    let end = start + text[start..].find('}').expect("its end") + 1;
    for (detail, evidence) in [
        ("{\"start\":18446744073709551615,\"end\":18446744073709551615}", "does not lie within its"),
        ("{\"start\":9,\"end\":7}", "rows 9 to 7"),
    ] {
        let changed = [&text[..start], detail, &text[end..]].concat();
        fs::write(folder.join("report.json"), changed).expect("written");
        let found = youla(&folder, &["report", "."]);
        assert_eq!(found.code, Some(2), "{}", found.stderr);
        assert!(found.stderr.contains("report.json") && found.stderr.contains(evidence), "{}", found.stderr);
        assert_eq!(found.stderr.trim_end().lines().count(), 1, "{}", found.stderr);
    }
}

/// Commands between backquotes; those in blocks run in the tests of the book.
#[test]
fn commands_that_the_documents_name_exist() {
    let project = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let pages = ["docs", "docs/book"].into_iter().flat_map(|folder| fs::read_dir(project.join(folder)).unwrap());
    let pages = pages.map(|entry| entry.unwrap().path()).filter(|path| path.extension().is_some_and(|e| e == "md"));
    let mut count = 0;
    for page in pages.chain(["README.md", "CONTRIBUTING.md"].map(|name| project.join(name))) {
        let text = fs::read_to_string(&page).unwrap();
        let spans = text.split("```").step_by(2).flat_map(|part| part.split('`').skip(1).step_by(2));
        for span in spans.filter(|span| span.starts_with("youla ")) {
            let mut command = youla_cli::command();
            command.build();
            let mut words = span.split(|c: char| c.is_whitespace() || c == '[' || c == ']').skip(1).peekable();
            while let Some(found) = words.peek().and_then(|word| command.find_subcommand(word)).cloned() {
                command = found;
                words.next();
            }
            let at = |what: &str| format!("{}: `{span}`: {what}", page.display());
            assert!(
                !command.has_subcommands() || words.peek().is_none_or(|w| w.starts_with("--")),
                "{}",
                at("no such verb")
            );
            for flag in words.filter_map(|word| word.strip_prefix("--")) {
                let known = command.get_arguments().any(|a| a.get_long() == Some(flag));
                assert!(known, "{}", at(flag));
            }
            count += 1;
        }
    }
    assert!(count > 30, "{count}");
}
