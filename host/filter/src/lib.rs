//! Removes outliers and noise from what sensors measured: outlier replacement, wavelet denoising and
//! a moving average, in this order.
//!
//! The order is the one by which the load cell under a vessel phantom was processed (Li 2023, section
//! 3.3; Pescio et al. 2025, "Vascular instrument model"). Neither publication names the rule for
//! outliers, the wavelet or the window, so they are chosen here: [`hampel`], Daubechies' least
//! asymmetric wavelet with four vanishing moments ([`Family::Sym4`]), the universal soft threshold
//! ([`denoise`]), and a mean over 20 ms ([`Pipeline`]).
//!
//! Every step has a form that looks at both sides of a row, and a causal one that looks back only. The
//! first delays nothing; the delay of the second is stated ([`Done`]).

#![forbid(unsafe_code)]

mod average;
mod clock;
mod denoise;
mod hampel;
mod noise;
mod pipeline;
mod table;
mod wavelet;

pub use average::{moving_average, trailing_average};
pub use clock::{Clock, ClockError};
pub use denoise::{denoise, denoise_causally};
pub use hampel::{Replaced, hampel, trailing_hampel};
pub use noise::white_noise;
pub use pipeline::{Done, Filtered, Pipeline};
pub use table::{Table, TableCause, TableError};
pub use wavelet::{Family, Transform};
