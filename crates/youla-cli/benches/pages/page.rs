//! Tables in Markdown, and where and when they were made.

use std::time::{SystemTime, UNIX_EPOCH};

/// The beginning of a page.
pub(crate) fn head(title: &str, about: &str) -> String {
    format!(
        "# {title}\n\n{about}\n\nWritten by `cargo bench -p youla-cli --bench pages` on {}, version {}: {}.\n",
        today(),
        env!("CARGO_PKG_VERSION"),
        machine()
    )
}

/// A section with a table; the first column is text, the others are numbers.
pub(crate) fn table(title: &str, about: &str, columns: &[&str], rows: &[Vec<String>]) -> String {
    let mut text = format!("\n## {title}\n\n{about}\n\n| {} |\n|---|", columns.join(" | "));
    text += &"---:|".repeat(columns.len() - 1);
    for row in rows {
        text += &format!("\n| {} |", row.join(" | "));
    }
    text + "\n"
}

fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let information = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model =
        information.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": ").map(|(_, name)| name));
    format!("{cores} cores, {}", model.unwrap_or(std::env::consts::ARCH))
}

/// The day in UTC, from the days since 1970-01-01 by the civil calendar (H. Hinnant, chrono-compatible low-level date algorithms).
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let days = (seconds / 86_400) as i64 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let (date, month) = (of_year - (153 * month + 2) / 5 + 1, if month < 10 { month + 3 } else { month - 9 });
    let year = year + 400 * era + i64::from(month <= 2);
    format!("{year}-{month:02}-{date:02}")
}
