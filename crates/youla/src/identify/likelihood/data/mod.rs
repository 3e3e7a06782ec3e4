//! Records as lines of their Fourier transforms and as sums of lagged products, and complex arithmetic on several lines at a time.

pub(crate) mod lag_sums;
pub(crate) mod lanes;
pub(crate) mod spectra;
