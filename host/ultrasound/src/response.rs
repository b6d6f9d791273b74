//! How the vessel's wall moves under the probe, for every stiffness within some bounds.
//!
//! The displacement u of a body of one material under dead loads depends on the force F and on Young's
//! modulus E only by their ratio s = F/E, and on Poisson's ratio ν only by the compressibility
//!
//! > c = (1 − 2ν)/(1 + ν) = (2/3) G/K
//!
//! which is small here, and in which u is smooth. For small strains u = s u₁(c) exactly, so that one
//! factorisation for each c gives every E, every force and every pose. For large strains
//!
//! > u(s, c) = s u₁(c) + s² w(s, c)
//!
//! where w varies slowly, because the first term is exact for small loads. u₁ is interpolated through
//! three values of c and w through two of c and three of s, by Lagrange's polynomials. Beyond the
//! largest s that was solved w is held; that is no solution of the equations, but it leads a search
//! back, and [`Response::is_solved`] tells it.
//!
//! The law is neo-Hookean. A probe of 10 N strains gel of 600 kPa by some per cent, where linear
//! elasticity is off by more than the 3 % that a modulus is wanted to; other laws differ less from
//! each other there than from it.

use cathforce_material::Material;
use cathforce_wall::{Kinematics, SolveError, Solver, Target, WallMaterial, WallMesh};
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::UltrasoundError;
use crate::probe::{Pose, unit_forces_n};

/// How strains are measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// Linear elasticity.
    Linear,
    /// Large strains of a neo-Hookean material.
    #[default]
    NeoHookean,
}

/// Shares of the largest load at which large strains are solved.
const LOADS: [f64; 3] = [1.0 / 3.0, 2.0 / 3.0, 1.0];

/// Of every node of the vessel's wall \[mm\].
type Places = Vec<Vector3<f64>>;

/// Stiffness of the tissue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tissue {
    pub youngs_modulus_kpa: f64,
    pub poissons_ratio: f64,
}

impl Tissue {
    /// s = F/E \[mm²\].
    fn load_mm2(&self, force_n: f64) -> f64 {
        force_n / (1e-3 * self.youngs_modulus_kpa)
    }

    fn material(&self, law: Law) -> WallMaterial {
        let (youngs_pa, poissons_ratio) = (1e3 * self.youngs_modulus_kpa, self.poissons_ratio);
        let (law, kinematics) = match law {
            Law::Linear => (Material::Elastic { youngs_modulus_pa: youngs_pa }, Kinematics::Small),
            // Its shear modulus, which is E/(2(1 + ν)), is twice C10.
            Law::NeoHookean => (
                Material::NeoHookean { c10_pa: 0.25 * youngs_pa / (1.0 + poissons_ratio) },
                Kinematics::Large,
            ),
        };
        WallMaterial { law, kinematics, poissons_ratio }
    }
}

/// c of a Poisson's ratio.
fn compressibility(poissons_ratio: f64) -> f64 {
    (1.0 - 2.0 * poissons_ratio) / (1.0 + poissons_ratio)
}

/// Poisson's ratio of a c.
fn poissons_ratio(compressibility: f64) -> f64 {
    (1.0 - compressibility) / (2.0 + compressibility)
}

/// The wall of a vessel, and the forces of the probe in each pose.
pub struct Loaded {
    mesh: WallMesh,
    unit_forces_n: Vec<Vec<Vector3<f64>>>,
    /// Nodes of the mesh on the vessel's wall.
    wall: Vec<u32>,
    /// Triangles of the wall, by place in `wall`.
    pub triangles: Vec<[u32; 6]>,
    /// Places of the nodes of the wall at rest \[mm\].
    pub rest_mm: Places,
}

impl Loaded {
    /// `face_mm`: sides of the probe's face, along the lateral axis and across it.
    pub fn new(mesh: WallMesh, poses: &[Pose], face_mm: [f64; 2]) -> Result<Self, UltrasoundError> {
        let forces = poses.iter().map(|pose| unit_forces_n(&mesh, pose, face_mm));
        let unit_forces_n = forces.collect::<Result<_, _>>()?;
        let mut wall = mesh.inner.as_flattened().to_vec();
        wall.sort_unstable();
        wall.dedup();
        let place = |node: u32| wall.partition_point(|known| *known < node) as u32;
        let triangles = mesh.inner.iter().map(|t| t.map(place)).collect();
        let rest_mm = wall.iter().map(|node| mesh.nodes_mm[*node as usize]).collect();
        Ok(Self { mesh, unit_forces_n, wall, triangles, rest_mm })
    }

    /// Places of the wall's nodes under forces in newtons, each with the place of its pose, solved for
    /// them alone \[mm\].
    pub fn solved_mm(
        &self,
        law: Law,
        tissue: Tissue,
        loads: &[(usize, f64)],
    ) -> Result<Vec<Places>, UltrasoundError> {
        let largest_n = loads.iter().map(|(_, force_n)| *force_n).fold(0.0, f64::max);
        let failed = |cause: SolveError| UltrasoundError::Solve { force_n: largest_n, cause };
        let moved = match law {
            Law::Linear => self.all_linear(tissue, loads),
            Law::NeoHookean => self.all_large(tissue, loads),
        };
        let place = |moved: Places| {
            self.rest_mm.iter().zip(&moved).map(|(rest, moved)| rest + moved).collect()
        };
        Ok(moved.map_err(failed)?.into_iter().map(place).collect())
    }

    fn all_linear(
        &self,
        tissue: Tissue,
        loads: &[(usize, f64)],
    ) -> Result<Vec<Places>, SolveError> {
        let mut solver = Solver::new(&self.mesh, &[])?;
        let unit = solver.small(&tissue.material(Law::Linear), &self.unit_forces_n)?;
        let unit: Vec<Places> =
            unit.iter().map(|own| self.on_wall(own.displacements_mm())).collect();
        let load =
            |(pose, force_n): &(usize, f64)| unit[*pose].iter().map(|u| u * *force_n).collect();
        Ok(loads.iter().map(load).collect())
    }

    /// Force by force in each pose, the smallest first.
    fn all_large(&self, tissue: Tissue, loads: &[(usize, f64)]) -> Result<Vec<Places>, SolveError> {
        let of_pose = |pose: usize| -> Result<Vec<(usize, Places)>, SolveError> {
            let mut own: Vec<usize> = (0..loads.len()).filter(|k| loads[*k].0 == pose).collect();
            own.sort_by(|a, b| loads[*a].1.total_cmp(&loads[*b].1));
            let forces_n: Vec<f64> = own.iter().map(|k| loads[*k].1).collect();
            let mut solver = Solver::new(&self.mesh, &[])?;
            let path = self.path(&mut solver, tissue.material(Law::NeoHookean), pose, &forces_n)?;
            Ok(own.into_iter().zip(path).collect())
        };
        let poses = 0..self.unit_forces_n.len();
        let found: Result<Vec<_>, SolveError> = poses.into_par_iter().map(of_pose).collect();
        let mut all: Vec<(usize, Places)> = found?.into_iter().flatten().collect();
        all.sort_by_key(|(k, _)| *k);
        Ok(all.into_iter().map(|(_, places)| places).collect())
    }

    /// Displacements of the wall's nodes under forces that follow each other \[mm\].
    fn path(
        &self,
        solver: &mut Solver,
        material: WallMaterial,
        pose: usize,
        forces_n: &[f64],
    ) -> Result<Vec<Places>, SolveError> {
        let mut solution = solver.unloaded();
        let mut from = Target::none(self.mesh.nodes_mm.len(), 0);
        let mut path = Vec::new();
        for force_n in forces_n {
            let forces_n = self.unit_forces_n[pose].iter().map(|f| f * *force_n).collect();
            let to = Target { forces_n, given_mm: Vec::new() };
            solution = solver.solve(&material, &solution, &from, &to)?;
            path.push(self.on_wall(solution.displacements_mm()));
            from = to;
        }
        Ok(path)
    }

    fn on_wall(&self, displacements_mm: &[Vector3<f64>]) -> Places {
        self.wall.iter().map(|node| displacements_mm[*node as usize]).collect()
    }
}

/// Displacements of the wall for every stiffness.
pub struct Response {
    pub loaded: Loaded,
    /// Values of c, and u₁ by c and pose \[mm per mm²\].
    first: Vec<(f64, Vec<Places>)>,
    second: Option<Second>,
}

/// The part of the response that is not proportional to the load.
struct Second {
    /// Largest s \[mm²\].
    largest_mm2: f64,
    /// Values of c, and w by c, pose and load \[mm per mm⁴\].
    by_c: Vec<(f64, Vec<Vec<Places>>)>,
}

impl Response {
    /// That of small strains. `poissons_ratios`: the bounds between which it is asked for.
    pub fn linear(loaded: Loaded, poissons_ratios: [f64; 2]) -> Result<Self, UltrasoundError> {
        let [low, high] = poissons_ratios.map(compressibility);
        let places = [low, 0.5 * (low + high), high];
        let solve = |c: &f64| {
            let unit = Tissue { youngs_modulus_kpa: 1e3, poissons_ratio: poissons_ratio(*c) };
            let mut solver = Solver::new(&loaded.mesh, &[])?;
            let found = solver.small(&unit.material(Law::Linear), &loaded.unit_forces_n)?;
            Ok((*c, found.iter().map(|own| loaded.on_wall(own.displacements_mm())).collect()))
        };
        let first: Result<Vec<_>, SolveError> = places.par_iter().map(solve).collect();
        let first = first.map_err(|cause| UltrasoundError::Solve { force_n: 1.0, cause })?;
        Ok(Self { loaded, first, second: None })
    }

    /// Adds what large strains change, up to a force on the softest tissue that is asked for closely.
    /// Nothing is changed where that has no solution.
    pub fn large_strains(&mut self, force_n: f64, softest_kpa: f64) -> Result<(), UltrasoundError> {
        let softest =
            |c: f64| Tissue { youngs_modulus_kpa: softest_kpa, poissons_ratio: poissons_ratio(c) };
        let largest_mm2 = softest(0.0).load_mm2(force_n);
        let cs = [self.first[0].0, self.first[self.first.len() - 1].0];
        let solve = |c: &f64| {
            // One solver for all poses: the factor of the unloaded block serves them all.
            let mut solver = Solver::new(&self.loaded.mesh, &[])?;
            let forces_n = LOADS.map(|share| share * force_n);
            let material = softest(*c).material(Law::NeoHookean);
            let mut of_pose = |pose: usize| -> Result<Vec<Places>, SolveError> {
                let path = self.loaded.path(&mut solver, material, pose, &forces_n)?;
                let linear = self.first_at(*c, pose);
                let rest = |(share, moved): (f64, &Places)| -> Places {
                    let s = share * largest_mm2;
                    moved.iter().zip(&linear).map(|(u, u1)| (u - u1 * s) / (s * s)).collect()
                };
                Ok(LOADS.into_iter().zip(&path).map(rest).collect())
            };
            let poses = 0..self.loaded.unit_forces_n.len();
            Ok((*c, poses.map(&mut of_pose).collect::<Result<_, _>>()?))
        };
        let by_c: Result<Vec<_>, SolveError> = cs.par_iter().map(solve).collect();
        let by_c = by_c.map_err(|cause| UltrasoundError::Solve { force_n, cause })?;
        self.second = Some(Second { largest_mm2, by_c });
        Ok(())
    }

    /// Whether this force on this tissue lies within what was solved.
    pub fn is_solved(&self, tissue: Tissue, force_n: f64) -> bool {
        let largest_mm2 = self.second.as_ref().map_or(f64::INFINITY, |own| own.largest_mm2);
        tissue.load_mm2(force_n) <= largest_mm2 * (1.0 + 1e-9)
    }

    /// Places of the wall's nodes \[mm\].
    pub fn places_mm(&self, tissue: Tissue, pose: usize, force_n: f64) -> Places {
        let (c, s) = (compressibility(tissue.poissons_ratio), tissue.load_mm2(force_n));
        let mut places = self.first_at(c, pose);
        places.iter_mut().for_each(|place| *place *= s);
        if let Some(Second { largest_mm2, by_c }) = &self.second {
            let loads = LOADS.map(|share| share * largest_mm2);
            let by_load = lagrange(&loads, s.min(*largest_mm2));
            let cs: Vec<f64> = by_c.iter().map(|(c, _)| *c).collect();
            for ((_, poses), of_c) in by_c.iter().zip(lagrange(&cs, c)) {
                for (own, of_load) in poses[pose].iter().zip(&by_load) {
                    add(&mut places, own, s * s * of_c * of_load);
                }
            }
        }
        add(&mut places, &self.loaded.rest_mm, 1.0);
        places
    }

    /// u₁ at a c.
    fn first_at(&self, c: f64, pose: usize) -> Places {
        let cs: Vec<f64> = self.first.iter().map(|(c, _)| *c).collect();
        let mut sum = vec![Vector3::zeros(); self.loaded.rest_mm.len()];
        for ((_, poses), weight) in self.first.iter().zip(lagrange(&cs, c)) {
            add(&mut sum, &poses[pose], weight);
        }
        sum
    }
}

fn add(sum: &mut Places, own: &Places, weight: f64) {
    sum.iter_mut().zip(own).for_each(|(sum, own)| *sum += own * weight);
}

/// Weights of the values at `nodes` in the polynomial through them, at x.
fn lagrange(nodes: &[f64], x: f64) -> Vec<f64> {
    let weight = |k: usize| -> f64 {
        let others = (0..nodes.len()).filter(|i| *i != k);
        others.map(|i| (x - nodes[i]) / (nodes[k] - nodes[i])).product()
    };
    (0..nodes.len()).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::{Block, Elements};

    fn loaded() -> Loaded {
        let block = Block {
            size_mm: [60.0, 50.0, 30.0],
            vessel_diameter_mm: 8.0,
            vessel_depth_mm: 11.0,
            vessel_aside_mm: 0.0,
        };
        let mesh = block.mesh(Elements { outwards: 2, around: 12, along: 5 }).unwrap();
        let pose = Pose { at_mm: [2.0, 0.0], turn_deg: 0.0 };
        Loaded::new(mesh, &[pose], [40.0, 8.0]).unwrap()
    }

    fn largest(a: &Places, b: &Places) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn between_what_was_solved_the_response_is_that_of_a_solution() {
        let tissue = Tissue { youngs_modulus_kpa: 500.0, poissons_ratio: 0.477 };
        for law in [Law::Linear, Law::NeoHookean] {
            let mut response = Response::linear(loaded(), [0.47, 0.49]).unwrap();
            if law == Law::NeoHookean {
                response.large_strains(10.0, 400.0).unwrap();
            }
            for force_n in [4.0, 9.0] {
                assert!(response.is_solved(tissue, force_n));
                let expected = response.loaded.solved_mm(law, tissue, &[(0, force_n)]).unwrap();
                let expected = &expected[0];
                let found = response.places_mm(tissue, 0, force_n);
                let moved = largest(expected, &response.loaded.rest_mm);
                let off = largest(expected, &found);
                // A tenth of what changes Young's modulus by a per cent.
                assert!(off < 1e-3 * moved, "{law:?} {force_n} N: {off} of {moved} mm");
            }
        }
    }

    #[test]
    fn softer_tissue_than_was_solved_is_told() {
        let mut response = Response::linear(loaded(), [0.47, 0.49]).unwrap();
        let soft = Tissue { youngs_modulus_kpa: 100.0, poissons_ratio: 0.48 };
        assert!(response.is_solved(soft, 10.0));
        response.large_strains(10.0, 400.0).unwrap();
        assert!(!response.is_solved(soft, 10.0) && response.is_solved(soft, 2.0));
        assert!(response.places_mm(soft, 0, 10.0).iter().all(|p| p.norm().is_finite()));
    }
}
