//! The most memory that the process ever asked for, as Linux counts it: addresses, not pages, so that what is reserved and
//! never touched counts too.

/// Bytes; `None` where there is no such count.
pub(crate) fn peak() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:"))?;
    Some(1024 * line.trim().strip_suffix(" kB")?.parse::<usize>().ok()?)
}
