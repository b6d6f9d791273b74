//! Finite elements of a vessel's wall, and their reduction to what the device runs.
//!
//! The displacement is quadratic and the pressure linear on each tetrahedron, both continuous
//! (Taylor–Hood). This pair keeps its order of convergence as the material becomes incompressible,
//! which neither linear nor quadratic tetrahedra do without a pressure of their own (Boffi, "Three-
//! dimensional finite element methods for the Stokes problem", SIAM J. Numer. Anal. 34, 1997).
//!
//! Inside this crate lengths are in millimetres, forces in newtons and stresses in megapascals:
//! these belong together, and they keep displacement and pressure at similar size in one matrix.

#![forbid(unsafe_code)]

mod element;
mod error;
mod extrude;
mod gmsh;
mod load;
mod mesh;
pub mod phantom;
mod press;
pub mod reduce;
mod remesh;
mod response;
mod solve;
mod system;
mod tube;

pub use error::SolveError;
pub use extrude::{ExtrudeError, Extruded, Surface, extrude};
pub use gmsh::{GmshError, read_gmsh};
pub use load::{Patch, PatchError, pressure_forces};
pub use mesh::{MeshError, WallMesh};
pub use press::{PressError, Pressed, press};
pub use remesh::{RemeshError, remesh};
pub use response::{Kinematics, WallMaterial};
pub use solve::{Solution, Solver, Target};
pub use tube::{Tube, TubePart};
