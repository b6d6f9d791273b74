//! Signed distance and normal of a vessel given as a triangle mesh.

use nalgebra::Vector3;

use super::bvh::{Bvh, Closest};
use super::mesh::{Mesh, RIM, next};
use super::openings::Opening;
use super::wall::{Triangle, Wall, WallPoint};

/// How the wall is interpolated between the vertices of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SurfaceModel {
    /// Flat facets, as the file says.
    Faceted,
    /// The curved surface that vertices and vertex normals imply.
    #[default]
    Smooth,
}

/// A mesh that can be asked for its distance.
#[derive(Clone, Debug)]
pub struct MeshWall {
    mesh: Mesh,
    bvh: Bvh,
    rim: Vec<bool>,
    /// Angle-weighted normals of the vertices, averaged across creases too; they tell inside from outside.
    vertex_side: Vec<Vector3<f64>>,
    /// Rounds of refinement.
    pub rounds: usize,
    /// Where the surface ends; the wall goes on straight from there.
    pub openings: Vec<Opening>,
    /// Gaps in the surface that were closed.
    pub gaps: usize,
    /// Largest distance of a smooth surface from the facets, and the place \[m\].
    pub off_facets: Option<(f64, Vector3<f64>)>,
}

/// The feature of a mesh on which the closest point lies.
enum Feature {
    Face,
    Edge(usize),
    Corner(usize),
}

impl MeshWall {
    /// `mesh`: facets facing either way; the volume that a piece encloses tells its inner side.
    pub fn new(mut mesh: Mesh, model: SurfaceModel) -> Self {
        mesh.face_lumen();
        let bare = Self::index(mesh.clone());
        let (openings, gaps) = mesh.extend(|p| {
            let here = bare.sample(p);
            if here.beyond_m > 0.0 { 0.0 } else { here.distance_m }
        });
        let (rounds, off_facets) = match model {
            SurfaceModel::Faceted => (0, None),
            SurfaceModel::Smooth => {
                let facets: Vec<_> = (0..mesh.len()).map(|t| mesh.triangle(t)).collect();
                let rounds = mesh.refine();
                (rounds, mesh.farthest_from(&facets, rounds))
            }
        };
        Self { rounds, openings, gaps, off_facets, ..Self::index(mesh) }
    }

    fn index(mesh: Mesh) -> Self {
        let bvh = Bvh::new((0..mesh.len()).map(|t| mesh.triangle(t)).collect());
        let mut vertex_side = vec![Vector3::zeros(); mesh.positions.len()];
        for half_edge in 0..mesh.vertex.len() {
            if let Some(normal) = mesh.area_normal(half_edge / 3).try_normalize(0.0) {
                vertex_side[mesh.vertex[half_edge] as usize] +=
                    normal * mesh.corner_angle(half_edge);
            }
        }
        let rim = mesh.rim_vertices();
        let (rounds, openings, gaps, off_facets) = (0, Vec::new(), 0, None);
        Self { mesh, bvh, rim, vertex_side, rounds, openings, gaps, off_facets }
    }

    /// Triangles after refinement.
    pub fn triangles(&self) -> usize {
        self.mesh.len()
    }

    /// Distance to the nearest corner of a rim \[m\]; infinite without an opening.
    pub fn rim_distance_m(&self, p: &Vector3<f64>) -> f64 {
        let corners = self.openings.iter().flat_map(|opening| &opening.rim_m);
        corners.map(|x| (x - p).norm()).fold(f64::INFINITY, f64::min)
    }

    fn feature(&self, closest: &Closest) -> Feature {
        let first = 3 * closest.triangle;
        let mut on = (0..3).filter(|&k| closest.barycentric[k] > 0.0);
        match (on.next(), on.next(), on.next()) {
            (Some(k), None, _) => Feature::Corner(first + k),
            // Corners 0 and 2 are the ends of edge 2.
            (Some(0), Some(2), None) => Feature::Edge(first + 2),
            (Some(k), Some(_), None) => Feature::Edge(first + k),
            _ => Feature::Face,
        }
    }

    /// Points to the inner side of the wall whatever the angle of the facets.
    /// Source: Bærentzen and Aanæs, angle-weighted pseudo-normals (2005).
    fn side(&self, feature: &Feature, triangle: usize) -> Vector3<f64> {
        match *feature {
            Feature::Face => self.mesh.area_normal(triangle),
            Feature::Edge(half_edge) => {
                let unit = |t| self.mesh.area_normal(t).try_normalize(0.0).unwrap_or_default();
                let twin = self.mesh.twin[half_edge];
                let other = if twin == RIM { Vector3::zeros() } else { unit(twin as usize / 3) };
                unit(triangle) + other
            }
            Feature::Corner(corner) => self.vertex_side[self.mesh.vertex[corner] as usize],
        }
    }

    /// Whether the closest point lies on the rim of an opening.
    fn on_rim(&self, feature: &Feature) -> bool {
        match *feature {
            Feature::Face => false,
            Feature::Edge(half_edge) => self.mesh.twin[half_edge] == RIM,
            Feature::Corner(corner) => self.rim[self.mesh.vertex[corner] as usize],
        }
    }

    /// Whether the closest point lies on a crease, where no single normal is right.
    fn on_crease(&self, feature: &Feature) -> bool {
        match *feature {
            Feature::Face => false,
            Feature::Edge(half_edge) => {
                let twin = self.mesh.twin[half_edge];
                twin != RIM && {
                    let (normal, twin) = (&self.mesh.corner_normal, twin as usize);
                    normal[half_edge] != normal[next(twin)]
                        || normal[next(half_edge)] != normal[twin]
                }
            }
            Feature::Corner(corner) => {
                let smooth = self.mesh.normals[self.mesh.corner_normal[corner] as usize];
                let side = self.vertex_side[self.mesh.vertex[corner] as usize];
                // The two are the same sum unless a crease parts the facets around the vertex.
                smooth.dot(&side) < 0.98 * side.norm()
            }
        }
    }
}

impl Wall for MeshWall {
    fn sample(&self, p: &Vector3<f64>) -> WallPoint {
        let closest = self.bvh.closest(p);
        let feature = self.feature(&closest);
        let from_wall = p - closest.point;
        let smooth: Vector3<f64> = (0..3)
            .map(|k| {
                let normal = self.mesh.corner_normal[3 * closest.triangle + k] as usize;
                self.mesh.normals[normal] * closest.barycentric[k]
            })
            .sum();
        let side = self.side(&feature, closest.triangle);
        let normal = smooth.try_normalize(1e-9).or_else(|| side.try_normalize(0.0));
        let normal = normal.unwrap_or_default();
        let beyond_m: f64 = (0..3)
            .map(|k| {
                let vertex = self.mesh.vertex[3 * closest.triangle + k] as usize;
                self.mesh.beyond_m[vertex] * closest.barycentric[k]
            })
            .sum();
        if self.on_rim(&feature) {
            // Past the end of a sleeve nothing closes it either.
            let distance_m = from_wall.dot(&normal);
            let beyond_m = beyond_m + (from_wall - normal * distance_m).norm();
            return WallPoint { distance_m, normal, beyond_m };
        }
        let sign = if from_wall.dot(&side) < 0.0 { -1.0 } else { 1.0 };
        let length = from_wall.norm();
        let normal = if self.on_crease(&feature) && length > 1e-7 {
            from_wall * (sign / length)
        } else {
            normal
        };
        WallPoint { distance_m: sign * length, normal, beyond_m }
    }

    fn bounds_m(&self) -> (Vector3<f64>, Vector3<f64>) {
        let infinite = Vector3::repeat(f64::INFINITY);
        let surface = self.mesh.positions.iter().zip(&self.mesh.beyond_m);
        surface
            .filter(|(_, beyond_m)| **beyond_m == 0.0)
            .fold((infinite, -infinite), |(low, high), (p, _)| (low.inf(p), high.sup(p)))
    }

    fn facets(&self) -> usize {
        self.mesh.len()
    }

    fn facet(&self, index: usize) -> Option<Triangle> {
        let corners = &self.mesh.vertex[3 * index..][..3];
        let is_beside = corners.iter().all(|&corner| self.mesh.beyond_m[corner as usize] == 0.0);
        is_beside.then(|| self.mesh.triangle(index))
    }
}
