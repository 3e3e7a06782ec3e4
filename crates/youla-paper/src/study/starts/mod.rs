//! How often the search of the prediction-error method converges to the global minimum, and from which start.
//!
//! Every item is one record of the bearing and one start. The yardstick is the search that starts at the true parameters: a method
//! has converged where its model's fit (26) on a record without noise is below that of the yardstick by at most
//! [`CONVERGED_WITHIN`] points on each axis.
//!
//! | file | holds |
//! |---|---|
//! | `case` | the cases: loops of the study, and open and closed loops in which a single search is known to end in a local minimum |
//! | `search` | what is compared |
//! | `settings` | everything that was chosen |
//! | `problem` | the records and the start of one item |
//! | `item` | one item: every search, verification |
//! | `row` | one line of a results file |
//! | `counts` | how many converged, and why the others did not |

mod case;
mod counts;
mod item;
mod problem;
mod row;
mod search;
mod settings;

pub use case::StartCase;
pub use counts::{CONVERGED_WITHIN, StartCount, StartFailure, start_counts, start_failures};
pub use item::evaluate_starts;
pub use row::StartRow;
pub use search::Search;
pub use settings::StartsSettings;
