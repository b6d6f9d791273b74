//! Surfaces and centre lines as other tools write them, as the files of a trial bundle: VTK's VTP and VTU,
//! OBJ, PLY, STL, the markups of 3D Slicer, and tables of points.
//!
//! None of these has a unit that can be relied on, so the user names it; what the file says of itself is
//! handed on. The format is told by the content.

#![forbid(unsafe_code)]

mod contents;
mod line;
mod markups;
mod obj;
mod open;
mod ply;
mod read;
mod surface;
mod table;
mod vtk;
mod xml;

pub use contents::{Contents, FileError, Format, Point};
pub use line::{LineOptions, branches, centreline_csv};
pub use open::{End, ends, opened};
pub use surface::{stl, triangles};
