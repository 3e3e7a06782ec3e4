//! How often the search of the prediction-error method arrives at the estimate that it was meant to find, and from which start.
//!
//! Every item is one record of the bearing and one start. The yardstick is the search that starts at the true parameters: a method
//! has arrived where its model's fit (26) on a record without noise stays behind that of the yardstick by at most
//! [`ARRIVED`] points on each axis.
//!
//! | file | holds |
//! |---|---|
//! | `case` | the cases: loops of the study, and open and closed loops in which a single search is known to get lost |
//! | `search` | what is compared |
//! | `settings` | everything that was chosen |
//! | `problem` | the records and the start of one item |
//! | `item` | one item: every search, verification |
//! | `row` | one line of a results file |
//! | `counts` | how many arrived, and why the others did not |

mod case;
mod counts;
mod item;
mod problem;
mod row;
mod search;
mod settings;

pub use case::StartCase;
pub use counts::{ARRIVED, StartCount, StartFailure, start_counts, start_failures};
pub use item::evaluate_starts;
pub use row::StartRow;
pub use search::Search;
pub use settings::StartsSettings;
