//! Whether a file may be written where the user says.

use crate::error::{Error, Result};
use std::path::Path;

/// Refuses a place at which something would be lost: a file that is there, unless `replace` is set; always a link, a device, a pipe or a folder,
/// a file that is `read` for what is to be written or lies in a folder that is, and settings, which [`require_free_for_settings`] replaces.
///
/// # Errors
/// [`Error::FileExists`], [`Error::NotReplaced`].
pub fn require_free(path: &Path, replace: bool, read: &[&Path]) -> Result<()> {
    let settings = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) && path.is_file();
    if settings && replace {
        return Err(Error::NotReplaced { path: path.to_owned(), problem: "it is a file of settings".to_owned() });
    }
    require_free_for_settings(path, replace, read)
}

/// The same for settings.
///
/// # Errors
/// Those of [`require_free`].
pub fn require_free_for_settings(path: &Path, replace: bool, read: &[&Path]) -> Result<()> {
    let Ok(there) = std::fs::symlink_metadata(path) else { return Ok(()) };
    let refused = |problem: &str| Err(Error::NotReplaced { path: path.to_owned(), problem: problem.to_owned() });
    if !there.is_file() {
        let kind = if there.is_dir() { "it is a folder" } else { "it is a link, a device or a pipe" };
        return refused(kind);
    }
    if read.iter().any(|file| is_within(path, file)) {
        return refused("the data are read from it");
    }
    if replace { Ok(()) } else { Err(Error::FileExists { path: path.to_owned() }) }
}

/// Whether a path is a place or lies in it, links followed; false where one of the two is not there.
pub(crate) fn is_within(path: &Path, place: &Path) -> bool {
    matches!((path.canonicalize(), place.canonicalize()), (Ok(path), Ok(place)) if path.starts_with(&place))
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
        assert!(require_free(other.path(), true, &[&std::env::temp_dir()]).is_ok(), "nothing is there");
        assert!(require_free(log.path(), true, &[&std::env::temp_dir()]).is_err(), "it lies in a folder that is read");
        let settings = scratch("toml");
        std::fs::write(settings.path(), "").unwrap();
        let refused = require_free(settings.path(), true, &[]).unwrap_err().to_string();
        assert!(refused.contains("a file of settings"), "{refused}");
        assert!(require_free_for_settings(settings.path(), true, &[]).is_ok());
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(log.path(), other.path()).unwrap();
            let refused = require_free(other.path(), true, &[]).unwrap_err().to_string();
            assert!(refused.contains("a link, a device or a pipe"), "{refused}");
        }
    }
}
