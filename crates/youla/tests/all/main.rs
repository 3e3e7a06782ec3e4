//! What the method promises: identities, published values, seeded statistics on simulated loops and on measured records.
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod architecture;
mod closed_loop;
mod common;
mod excitation;
mod identities;
mod likelihood;
mod measured;
mod paper;
mod random_loops;
mod reduction;
mod stages;
mod uncertainty;
