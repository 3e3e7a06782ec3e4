//! What the method promises: identities, published values, seeded statistics on simulated loops and on measured records.

mod closed_loop;
mod excitation;
mod identities;
mod measured;
mod paper;
mod reduction;
mod slow_modes;
mod stages;
