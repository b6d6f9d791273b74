//! How probable the measurements are under a set of effects.
//!
//! A reality differs from the model by more than noise even where all effects are known: the mesh and
//! the wall are a little off, and no effect has quite the shape that the library gives to it. Means over
//! bins of a tenth of a second follow Student's t with the variance
//!
//! > σ² = n²/k + a² (m² + (0.3 n)²) + κ² g²,   z ~ N(0, ω²)
//!
//! n is the sensor's noise and k the number of samples of the bin, m what the model leaves open there, g the
//! size of the nominal model's gap around it, z the nuisances. g is the same for all sets of effects, so
//! that they are compared by what they leave of it. Where all causes are in the library, κ is small.
//!
//! The score of a set is the logarithm of the density of every trial, given the parameters that the
//! others teach, times a temper: neighbouring bins are not independent. Temper and priors are learned from
//! realities whose causes are known (`prior`).

mod binned;
mod density;
pub mod discrepancy;
pub mod noise;
pub mod prior;
