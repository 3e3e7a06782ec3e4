//! Doubly coprime factors and the Youla-Jabr-Bongiorno-Kucera parametrisation, eqs (13)-(25) and (28).

mod bezout;
mod coprime;
mod loop_factors;
mod signals;
mod youla;

pub use coprime::CoprimeFactors;
pub use coprime::shear;
pub use loop_factors::loop_factors;
pub use signals::YoulaSignals;
