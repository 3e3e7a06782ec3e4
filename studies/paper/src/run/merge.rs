//! Parts of the paper, computed apart, put together to what one run gives.

use super::configuration::Configuration;
use super::results::{CROSSOVER, STUDY};
use crate::study::{Shard, crossover_items, read_results};
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use youla_io::folder::replace_file;

/// Joins the loops of all parts in `target` and returns the configuration of the whole, for [`super::paper`] to finish.
///
/// # Errors
/// [`Error::Parts`] where a part is missing, given twice, unfinished or of another study; [`Error::NotResults`] where a
/// folder is none; those of a folder that cannot be the target.
pub fn merge(parts: &[PathBuf], target: &Path) -> Result<Configuration> {
    let configurations = parts.iter().map(|part| Configuration::read(part)).collect::<Result<Vec<_>>>()?;
    let (Some(first), Some(folder)) = (configurations.first(), parts.first()) else {
        return Err(Error::Parts { path: target.to_owned(), problem: "no parts were given to merge".into() });
    };
    let whole = Configuration { shard: Shard::WHOLE, ..first.clone() };
    let mut by_number: Vec<Option<&PathBuf>> = vec![None; first.shard.count()];
    for (part, configuration) in parts.iter().zip(&configurations) {
        let refused = |problem: String| Err(Error::Parts { path: part.clone(), problem });
        if configuration.shard.count() != first.shard.count() {
            let (here, there) = (configuration.shard, first.shard);
            return refused(format!("this is shard {here}, but {} is shard {there}", folder.display()));
        }
        let alike = Configuration { shard: Shard::WHOLE, ..configuration.clone() };
        if let Some(difference) = alike.difference(&whole)? {
            return refused(format!("this part has other settings than {}: {difference}", folder.display()));
        }
        if let Some(other) = by_number[configuration.shard.index() - 1].replace(part) {
            return refused(format!("shard {} is given twice, also as {}", configuration.shard, other.display()));
        }
    }
    if let Some(missing) = by_number.iter().position(Option::is_none) {
        let problem = format!("shard {}/{} is missing among the parts", missing + 1, by_number.len());
        return Err(Error::Parts { path: target.to_owned(), problem });
    }
    whole.check()?;
    let ordered: Vec<&PathBuf> = by_number.into_iter().flatten().collect();
    let files = [(STUDY, whole.settings.study.models), (CROSSOVER, crossover_items(&whole.settings))];
    let texts = files.map(|(file, total)| joined(&ordered, file, total, &whole));
    whole.claim(target)?;
    for ((file, _), text) in files.into_iter().zip(texts) {
        replace_file(&target.join(file), &text?)?;
    }
    Ok(whole)
}

/// The rows of all parts of one file.
fn joined(parts: &[&PathBuf], file: &str, total: usize, whole: &Configuration) -> Result<String> {
    let mut text = format!("{}\n", crate::study::StudyRow::HEADER);
    for (k, part) in parts.iter().enumerate() {
        let items = Shard::new(k + 1, parts.len())?.items(total);
        let path = part.join(file);
        let rows = read_results(&path, items.clone(), whole.settings.compared().count())?;
        let done = rows.len() / whole.settings.compared().count();
        if done < items.len() {
            let problem = format!("holds {done} of {} loops; finish this shard first", items.len());
            return Err(Error::Parts { path, problem });
        }
        rows.iter().for_each(|row| text += &(row.line() + "\n"));
    }
    Ok(text)
}
