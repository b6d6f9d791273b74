//! Local searches, which end in the valley in which they begin.

mod descent;
mod simplex;

pub use descent::Descent;
pub use simplex::Simplex;
