//! The terminal: its width, words wrapped at it, and colour where there is one.

pub(crate) use anstream::{stderr, stdout};

/// Columns of a terminal on standard output; `None` where the output goes elsewhere.
pub(crate) fn width() -> Option<usize> {
    let size = terminal_size::terminal_size_of(std::io::stdout());
    size.map(|(width, _)| usize::from(width.0).max(NARROWEST))
}

/// Below this nothing is wrapped any narrower.
const NARROWEST: usize = 40;

/// Width of tables that go elsewhere than to a terminal.
pub(crate) const PLAIN: usize = 80;

/// Text for people: lines broken at blanks where the terminal ends, and its first words coloured. Unchanged without a terminal.
pub(crate) fn shown(text: &str) -> String {
    match width() {
        None => text.to_owned(),
        Some(columns) => text.lines().map(|line| coloured(&wrapped(line, columns))).collect::<Vec<_>>().join("\n"),
    }
}

/// One line broken at blanks, the rest indented by two more than the line; words longer than the line, as of paths, stay whole.
/// Lines with wide gaps are rows of tables and stay.
pub(crate) fn wrapped(line: &str, columns: usize) -> String {
    if line.chars().count() <= columns || line.trim_start().contains("   ") {
        return line.to_owned();
    }
    let indent = line.len() - line.trim_start().len();
    let (mut text, mut used) = (" ".repeat(indent), indent);
    let mut first = true;
    for word in line.split_whitespace() {
        let length = word.chars().count();
        if !first && used + 1 + length > columns {
            text += &format!("\n{}", " ".repeat(indent + 2));
            used = indent + 2;
        } else if !first {
            text.push(' ');
            used += 1;
        }
        text += word;
        used += length;
        first = false;
    }
    text
}

/// Bold red and bold yellow (ECMA-48); `anstream` leaves them out where there is no terminal, and for NO_COLOR.
const RED: &str = "\u{1b}[1;31m";
const YELLOW: &str = "\u{1b}[1;33m";
const PLAIN_AGAIN: &str = "\u{1b}[0m";

/// Defects red, cautions yellow.
fn coloured(line: &str) -> String {
    for (word, colour) in [("defect", RED), ("caution", YELLOW)] {
        if let Some(rest) = line.strip_prefix(word) {
            return format!("{colour}{word}{PLAIN_AGAIN}{rest}");
        }
    }
    line.to_owned()
}

/// The word before the sentence of a failure, for standard error.
pub(crate) fn error_word() -> String {
    format!("{RED}error:{PLAIN_AGAIN}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_wrapped_and_rows_of_tables_are_not() {
        let text = wrapped("caution: one two three four", 15);
        assert_eq!(text, "caution: one\n  two three\n  four");
        assert_eq!(wrapped("  a b", 80), "  a b");
        let row = "label    1.00   2.00   3.00";
        assert_eq!(wrapped(row, 10), row);
        assert_eq!(wrapped("runs/a-very-long-path/report.html x", 10), "runs/a-very-long-path/report.html\n  x");
    }
}
