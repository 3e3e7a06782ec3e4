//! The circle of commissioning on a machine: excite, record, identify, redesign, switch and verify, under stated limits.
//!
//! [`commission`] runs a campaign on the digital twin of the gas bearing, whose controller is the loop of the firmware. The new controller is
//! designed on the recommended model, certified over the region of S and loaded as Q; the verification is predicted by rehearsals on the
//! model. Anything short of a trusted model stops with alpha and Q at zero.

mod bench;
mod between;
mod campaign;
mod commission;
mod error;
mod figures;
mod identify;
mod link;
mod parameter;
mod point;
mod proposal;
mod q_table;
mod record;
mod rehearse;
mod report;

pub use campaign::{Campaign, CampaignLimits, Goal, OperatingPoint};
pub use commission::commission;
pub use error::{Error, Result};
pub use figures::LoopState;
pub use point::Operator;
pub use q_table::{QAtSpeed, QTable};
pub use record::{BetweenRecord, CampaignSummary, DampingFigures, PointRecord, PointStatus, ScheduleEvidence};
pub use rehearse::{DampingPrediction, LEVEL};

#[cfg(test)]
mod tests;
