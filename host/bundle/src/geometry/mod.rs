//! Vessel geometry: signed distance to the wall, from a mesh or from a centreline.

mod bvh;
mod centreline;
mod crossing;
mod figure;
mod frechet;
mod join_triangles;
mod mesh;
mod non_manifold;
mod openings;
mod pieces;
mod refine;
mod regions;
mod rims;
mod stitch;
mod stl;
mod stl_ascii;
mod stl_format;
mod surface;
mod wall;
mod weld;

pub use centreline::{Branch, CentrelineCause, Station, TubeWall, read_centreline};
pub use crossing::Crossing;
pub use figure::Figure;
pub use frechet::frechet;
pub use join_triangles::MeshRepairs;
pub use mesh::{Mesh, MeshCause};
pub use non_manifold::NonManifold;
pub use openings::Opening;
pub(crate) use openings::SLEEVE_M;
pub use pieces::PieceDoubts;
pub(crate) use regions::RegionalWall;
pub(crate) use rims::GAP_M;
pub use stl::read_stl;
pub use stl_format::StlCause;
pub use surface::{MeshWall, SurfaceModel};
pub use wall::{Triangle, Wall, WallPoint};
