//! What docs/architecture.md promises of the whole project.

mod arrows;
mod circles;
mod documents;
mod files;
mod names;
