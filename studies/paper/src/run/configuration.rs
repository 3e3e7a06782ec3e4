//! What makes one results folder differ from another.

use crate::study::{PaperSettings, Shard};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use toml::{Table, Value};
use youla_io::folder::replace_file;
use youla_twin::rig::{BearingRig, Fidelity, RigParameters};

/// The file in a results folder that says what the results are results of.
const FILE: &str = "configuration.toml";

/// Everything on which the results depend.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Configuration {
    /// Program and version.
    pub program: String,
    /// The part of the loops.
    pub shard: Shard,
    /// What was chosen.
    pub settings: PaperSettings,
    /// The rig.
    pub rig: RigParameters,
}

impl Configuration {
    /// A part of the paper with these settings on this rig.
    pub fn new(settings: PaperSettings, rig: RigParameters, shard: Shard) -> Self {
        Configuration { program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(), shard, settings, rig }
    }

    /// The whole of the paper.
    pub fn whole(settings: PaperSettings, rig: RigParameters) -> Self {
        Self::new(settings, rig, Shard::WHOLE)
    }

    /// Fails for a value without meaning, before anything is computed or written.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] naming the key.
    pub fn check(&self) -> Result<()> {
        self.settings.check()?;
        BearingRig::new(&self.rig, Fidelity::Rotating { rpm: self.settings.experiments.rpm }, 0)?;
        Ok(())
    }

    /// Reads the configuration of a results folder.
    ///
    /// # Errors
    /// [`youla_io::Error::Io`], [`youla_io::Error::Settings`].
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(FILE);
        let text = youla_io::read_text(&path).map_err(|error| match error {
            youla_io::Error::MissingFile { .. } => Error::NotResults { path: folder.to_owned() },
            other => Error::File(other),
        })?;
        Ok(youla_io::toml_file::parse(&text, &path)?)
    }

    /// Makes `target` the folder of this configuration, or finds that it is.
    pub(super) fn claim(&self, target: &Path) -> Result<()> {
        let io = |source| Error::File(youla_io::Error::Io { path: target.to_owned(), source });
        std::fs::create_dir_all(target).map_err(io)?;
        if target.join(FILE).exists() {
            return match self.difference(&Configuration::read(target)?)? {
                None => Ok(()),
                Some(difference) => Err(Error::OtherSettings { path: target.to_owned(), difference }),
            };
        }
        // A process that was killed while it wrote the file leaves a hidden one behind.
        let visible = |entry: std::io::Result<std::fs::DirEntry>| {
            entry.map_or(true, |entry| !entry.file_name().to_string_lossy().starts_with('.'))
        };
        if std::fs::read_dir(target).map_err(io)?.any(visible) {
            return Err(Error::File(youla_io::Error::OutputExists { path: target.to_owned() }));
        }
        Ok(replace_file(&target.join(FILE), &self.to_toml()?)?)
    }

    fn table(&self) -> Result<Table> {
        Table::try_from(self).map_err(|e| not_toml(&e))
    }

    /// The configuration as TOML.
    ///
    /// # Errors
    /// [`youla_io::Error::Settings`] for values that TOML cannot hold.
    pub fn to_toml(&self) -> Result<String> {
        toml::to_string(self).map_err(|e| not_toml(&e))
    }

    /// The first key in which another configuration differs, with its value there and here.
    pub(super) fn difference(&self, other: &Configuration) -> Result<Option<String>> {
        Ok(first_difference("", &Value::Table(other.table()?), &Value::Table(self.table()?)))
    }
}

fn not_toml(error: &toml::ser::Error) -> Error {
    Error::File(youla_io::Error::Settings { path: FILE.into(), at: None, problem: error.to_string() })
}

fn first_difference(key: &str, there: &Value, here: &Value) -> Option<String> {
    if there == here {
        return None;
    }
    let (Value::Table(one), Value::Table(other)) = (there, here) else {
        return Some(format!("{key} is {there} there and {here} here"));
    };
    let inner = |name: &String| if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
    let in_both = one.iter().find_map(|(name, there)| match other.get(name) {
        Some(here) => first_difference(&inner(name), there, here),
        None => Some(format!("{} is given there only", inner(name))),
    });
    in_both.or_else(|| {
        let name = other.keys().find(|name| !one.contains_key(*name))?;
        Some(format!("{} is given here only", inner(name)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_difference_is_named() {
        let one = Configuration::whole(PaperSettings::shipped(), RigParameters::shipped());
        let mut other = one.clone();
        assert_eq!(one.difference(&other).unwrap(), None);
        other.settings.seed = 2;
        assert_eq!(one.difference(&other).unwrap().unwrap(), "settings.seed is 2 there and 1 here");
        other = one.clone();
        other.rig.rotation.flexible_mode = None;
        assert_eq!(one.difference(&other).unwrap().unwrap(), "rig.rotation.flexible_mode is given here only");
        assert_eq!(other.difference(&one).unwrap().unwrap(), "rig.rotation.flexible_mode is given there only");
    }
}
