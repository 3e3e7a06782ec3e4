//! Measured and simulated signals: labelled, clocked samples x channels; spectra, persistency and excitation signals.
//!
//! A record is checked once, at construction, and trusted afterwards: every number is finite, every channel has a name of its
//! own, and the sample time is known. Nothing is repaired: an unequal length or a NaN is an error that says where it is.

mod channel;
mod detrend;
mod excitation;
mod harmonics;
mod lines;
mod loop_record;
mod periodic;
mod persistency;
mod record;
mod spectrum;
mod stamps;
mod transform;

pub use channel::{Channel, unknown};
pub use detrend::{Detrend, Detrended, Trend};
pub use excitation::{Chirp, Excitation, Multisine, Prbs, RampedExcitation, SquareWaves, fade};
pub use harmonics::without_harmonics;
pub use lines::{SpectralLine, spectral_lines};
pub use loop_record::LoopRecord;
pub use periodic::{
    ExcitationPeriod, LineGroup, LineResponse, PeriodicExperiment, detect_period, line_response, local_response,
};
pub(crate) use periodic::{Excited, inverse, output_rest};
pub use persistency::{Persistency, persistency, persistency_order};
pub use record::{Record, SplitRecord};
pub use spectrum::{
    CrossSpectrum, ExcitedRecord, ExplainedPower, IndirectResponse, Welch, cross_spectrum, explained_power,
    indirect_response,
};
pub use stamps::StampSteps;
pub(crate) use transform::of_two_real;
