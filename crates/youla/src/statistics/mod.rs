//! Samples and distributions: quantiles, the normal distribution and those of Student, chi-square, F and Hotelling.

mod chi_square;
mod sample;
mod student;

pub use chi_square::chi_square_tail;
pub(crate) use chi_square::{chi_square_deviations, chi_square_limit, f_deviations};
pub use sample::{median, quantile, robust_deviation};
pub use student::{ellipse, normal_quantile, student, two_sided_student};
