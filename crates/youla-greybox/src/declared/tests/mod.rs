mod discrete;
mod estimates;
mod expressions;
mod refusals;
mod templates;

use super::{Declaration, DeclaredStructure};
use crate::Result;

fn declared(text: &str) -> Result<DeclaredStructure> {
    DeclaredStructure::new(&Declaration::parse(text)?)
}
