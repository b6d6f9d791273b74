//! A fitted model together with its error on data that the fit has not seen.

use crate::fitting::fit::Fit;
use crate::scoring::score::Score;

/// A fitted model with its held-out score.
#[derive(Clone, Debug)]
pub struct Candidate {
    pub fit: Fit,
    pub score: Score,
}
