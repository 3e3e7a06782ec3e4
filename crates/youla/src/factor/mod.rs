//! Doubly coprime factors and the Youla-Jabr-Bongiorno-Kucera parametrisation, eqs (13)-(25) and (28).

mod bezout;
mod coprime;
mod signals;
mod stream;
mod youla;

pub use coprime::CoprimeFactors;
pub use signals::YoulaSignals;
pub use stream::YoulaStream;
