//! Whether a file may be written where the user says.

use crate::error::{Error, Result};
use std::path::Path;

/// Refuses a place at which something would be lost: a file that is there, unless `replace` is set; always a link, a device, a pipe or a folder,
/// and a file that is `read` for what is to be written.
///
/// # Errors
/// [`Error::FileExists`], [`Error::NotReplaced`].
pub fn require_free(path: &Path, replace: bool, read: &[&Path]) -> Result<()> {
    let Ok(there) = std::fs::symlink_metadata(path) else { return Ok(()) };
    let refused = |problem: &str| Err(Error::NotReplaced { path: path.to_owned(), problem: problem.to_owned() });
    if !there.is_file() {
        let kind = if there.is_dir() { "it is a folder" } else { "it is a link, a device or a pipe" };
        return refused(kind);
    }
    let own = path.canonicalize().ok();
    if own.is_some() && read.iter().any(|file| file.canonicalize().ok() == own) {
        return refused("the data are read from it");
    }
    if replace { Ok(()) } else { Err(Error::FileExists { path: path.to_owned() }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::scratch;

    /// What is read, and what is no file, stays whatever is asked for.
    #[test]
    fn logs_folders_and_links_are_not_replaced() {
        let [log, other] = [scratch("csv"), scratch("csv")];
        assert!(require_free(log.path(), false, &[]).is_ok(), "nothing is there");
        std::fs::write(log.path(), "t,u\n").unwrap();
        assert!(matches!(require_free(log.path(), false, &[]), Err(Error::FileExists { .. })));
        assert!(require_free(log.path(), true, &[other.path()]).is_ok());
        let indirect = log.path().parent().unwrap().join(".").join(log.path().file_name().unwrap());
        let refused = require_free(&indirect, true, &[log.path()]).unwrap_err().to_string();
        assert!(refused.contains("the data are read from it"), "{refused}");
        let refused = require_free(&std::env::temp_dir(), true, &[]).unwrap_err().to_string();
        assert!(refused.contains("it is a folder"), "{refused}");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(log.path(), other.path()).unwrap();
            let refused = require_free(other.path(), true, &[]).unwrap_err().to_string();
            assert!(refused.contains("a link, a device or a pipe"), "{refused}");
        }
    }
}
