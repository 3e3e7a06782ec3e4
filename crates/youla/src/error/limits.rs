//! What limits the order of a model.

/// What limits the order of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrderLimit {
    /// The controllable and observable states of the model that is reduced.
    Minimal(usize),
    /// The poles at or beyond the stability boundary, which a reduction does not remove.
    Kept(usize),
    /// (horizon - 1) x outputs.
    Horizon {
        /// The largest order.
        largest: usize,
        /// Block rows of the future.
        horizon: usize,
    },
}

impl std::fmt::Display for OrderLimit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            OrderLimit::Minimal(n) => {
                write!(f, "only {n} states are controllable and observable to working precision; ask for at most {n}")
            }
            OrderLimit::Kept(n) => write!(
                f,
                "{n} poles at or beyond the stability boundary are kept as they are; ask for at least {n} or move the boundary"
            ),
            OrderLimit::Horizon { largest, horizon } => write!(
                f,
                "{largest} = (horizon - 1) x outputs is the largest for horizon = {horizon}; ask for at most {largest} or raise horizon"
            ),
        }
    }
}
