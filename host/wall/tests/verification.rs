//! The elements against closed forms: constant stress, uniaxial tension, thick tubes.

use cathforce_material::Material;
use cathforce_wall::{
    Kinematics, Solver, Target, Tube, TubePart, WallMaterial, WallMesh, pressure_forces,
};
use nalgebra::{Matrix3, Vector3};

const LAWS: [Material; 4] = [
    Material::Elastic { youngs_modulus_pa: 0.46e6 },
    Material::NeoHookean { c10_pa: 0.04e6 },
    Material::MooneyRivlin { c10_pa: 0.02e6, c01_pa: 0.09e6 },
    Material::Ogden { mu_pa: 0.14e6, alpha: 1.4 },
];

fn large(law: Material, poissons_ratio: f64) -> WallMaterial {
    WallMaterial { law, kinematics: Kinematics::Large, poissons_ratio }
}

fn small(youngs_modulus_pa: f64, poissons_ratio: f64) -> WallMaterial {
    let law = Material::Elastic { youngs_modulus_pa };
    WallMaterial { law, kinematics: Kinematics::Small, poissons_ratio }
}

/// A distorted block of 2 × 2 × 2 boxes, a unit wide.
fn block() -> WallMesh {
    let paths = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let number = |at: [usize; 3]| (at[0] + 3 * at[1] + 9 * at[2]) as u32;
    let mut corners = Vec::new();
    for k in 0..3 {
        for j in 0..3 {
            for i in 0..3 {
                let mut place = Vector3::new(i as f64, j as f64, k as f64) * 0.5;
                if (i, j, k) == (1, 1, 1) {
                    place += Vector3::new(0.08, -0.05, 0.06);
                }
                corners.push(place);
            }
        }
    }
    let mut tetrahedra = Vec::new();
    for corner in 0..8 {
        let start = [corner & 1, (corner >> 1) & 1, corner >> 2];
        for path in paths {
            let mut at = start;
            let mut nodes = [number(at); 4];
            for (node, axis) in nodes[1..].iter_mut().zip(path) {
                at[axis] += 1;
                *node = number(at);
            }
            tetrahedra.push(nodes);
        }
    }
    let middle = |a: &Vector3<f64>, b: &Vector3<f64>| (a + b) * 0.5;
    WallMesh::quadratic(corners, tetrahedra, &[], &[], middle).unwrap()
}

/// Nodes on the sides of the block.
fn outside(mesh: &WallMesh) -> Vec<u32> {
    let is_outside = |p: &Vector3<f64>| p.iter().any(|x| x.abs() < 1e-9 || (x - 1.0).abs() < 1e-9);
    let nodes = mesh.nodes_mm.iter().enumerate();
    nodes.filter(|(_, place)| is_outside(place)).map(|(node, _)| node as u32).collect()
}

/// With the displacement of a constant deformation on all sides, every node inside takes part in it
/// exactly, whatever the law.
#[test]
fn a_constant_deformation_is_exact() {
    let mesh = block();
    let sides = outside(&mesh);
    assert!(sides.len() < mesh.nodes_mm.len());
    let given: Vec<(u32, usize)> = sides.iter().flat_map(|n| [(*n, 0), (*n, 1), (*n, 2)]).collect();
    let mut solver = Solver::new(&mesh, &given).unwrap();
    let gradient = Matrix3::new(0.25, 0.1, 0.0, -0.05, -0.1, 0.08, 0.02, 0.0, -0.12);
    let none = Target::none(mesh.nodes_mm.len(), given.len());
    let to = Target {
        given_mm: given
            .iter()
            .map(|(node, axis)| (gradient * mesh.nodes_mm[*node as usize])[*axis])
            .collect(),
        ..none.clone()
    };
    let materials = LAWS.map(|law| large(law, 0.45)).into_iter().chain([small(0.46e6, 0.45)]);
    for material in materials {
        let solution = solver.solve(&material, &solver.unloaded(), &none, &to).unwrap();
        for (place, found) in mesh.nodes_mm.iter().zip(solution.displacements_mm()) {
            let off = (found - gradient * place).norm();
            assert!(off < 1e-8, "{material:?}: {off:e} at {place}");
        }
    }
}

/// A block that is pulled to three times its length bears the force of the closed form.
#[test]
fn uniaxial_tension_is_that_of_each_law() {
    let mesh = block();
    let at = |axis: usize, value: f64| {
        let nodes = mesh.nodes_mm.iter().enumerate();
        let there = nodes.filter(move |(_, place)| (place[axis] - value).abs() < 1e-9);
        there.map(|(node, _)| node as u32).collect::<Vec<_>>()
    };
    let mut given: Vec<(u32, usize)> = Vec::new();
    for axis in 0..3 {
        given.extend(at(axis, 0.0).iter().map(|node| (*node, axis)));
    }
    let pulled = at(0, 1.0);
    given.extend(pulled.iter().map(|node| (*node, 0)));
    let mut solver = Solver::new(&mesh, &given).unwrap();
    let none = Target::none(mesh.nodes_mm.len(), given.len());
    for law in &LAWS[1..] {
        // Nearly incompressible: a stress of σ grows the volume by σ/(3κ), below 1e-5 here.
        let material = large(*law, 0.499_999);
        let mut to = none.clone();
        let held = given.len() - pulled.len();
        to.given_mm[held..].fill(2.0);
        let solution = solver.solve(&material, &solver.unloaded(), &none, &to).unwrap();
        let forces = solver.reactions_n(&material, &solution).unwrap();
        let force: f64 = pulled.iter().map(|node| forces[*node as usize].x).sum();
        let expected = 1e-6 * law.nominal_stress_pa(3.0);
        assert!((force / expected - 1.0).abs() < 2e-5, "{law:?}: {force} N, not {expected}");
    }
}

/// Length of the tubes, between two smooth plates \[mm\].
const LENGTH_MM: f64 = 1.0;

/// A quarter of a tube between two smooth plates.
struct Quarter {
    mesh: WallMesh,
    given: Vec<(u32, usize)>,
    inner: f64,
    outer: f64,
}

fn quarter(cells: usize) -> Quarter {
    let (inner, outer) = (4.0, 8.0);
    let even = Tube::even(inner, outer - inner, LENGTH_MM, [cells, 1, 1]);
    let quarter = std::f64::consts::FRAC_PI_2;
    let angles_rad = (0..=cells).map(|k| quarter * k as f64 / cells as f64).collect();
    let mesh = Tube { angles_rad, part: TubePart::Sector, ..even }.mesh(|_| false).unwrap();
    let mut given = Vec::new();
    for (node, place) in mesh.nodes_mm.iter().enumerate() {
        let on = [place.x.abs(), place.y.abs(), place.z.abs().min((place.z - LENGTH_MM).abs())];
        let axes = (0..3).filter(|axis| on[*axis] < 1e-9);
        given.extend(axes.map(|axis| (node as u32, axis)));
    }
    Quarter { mesh, given, inner, outer }
}

/// Lamé's tube in plane strain under a pressure inside: radial displacement at a radius.
fn lame(q: &Quarter, youngs: f64, nu: f64, pressure: f64, r: f64) -> f64 {
    let (a2, b2) = (q.inner * q.inner, q.outer * q.outer);
    let factor = (1.0 + nu) / youngs * pressure * a2 / (b2 - a2);
    factor * ((1.0 - 2.0 * nu) * r + b2 / r)
}

/// Root of the mean square of the error over all nodes.
fn error_of_lame(cells: usize, nu: f64) -> f64 {
    let q = quarter(cells);
    let mut solver = Solver::new(&q.mesh, &q.given).unwrap();
    let none = Target::none(q.mesh.nodes_mm.len(), q.given.len());
    let to = Target { forces_n: pressure_forces(&q.mesh, 0.01), ..none.clone() };
    let material = small(1e6, nu);
    let solution = solver.solve(&material, &solver.unloaded(), &none, &to).unwrap();
    let squares = q.mesh.nodes_mm.iter().zip(solution.displacements_mm()).map(|(place, found)| {
        let r = place.xy().norm();
        let expected = place.xy() * (lame(&q, 1.0, nu, 0.01, r) / r);
        (found - Vector3::new(expected.x, expected.y, 0.0)).norm_squared()
    });
    (squares.sum::<f64>() / q.mesh.nodes_mm.len() as f64).sqrt()
}

/// The error falls with the third power of the size of an element, as well when the material is all
/// but incompressible. Elements that lock would lose their order, and most of their displacement.
#[test]
fn a_thick_tube_converges_with_order_three_and_does_not_lock() {
    for nu in [0.3, 0.499_999] {
        let errors = [2, 4, 8].map(|cells| error_of_lame(cells, nu));
        let order = (errors[1] / errors[2]).log2();
        assert!(order > 2.6, "ν = {nu}: {errors:?}, order {order:.2}");
        // Of a displacement of 0.08 mm inside.
        assert!(errors[2] < 2e-5, "ν = {nu}: {errors:?}");
    }
}

/// A neo-Hookean tube of which the inner radius is doubled: outer radius and pressure follow from
/// the volume, which is kept.
#[test]
fn an_inflated_neo_hookean_tube_follows_its_closed_form() {
    let q = quarter(4);
    let inner: Vec<u32> = {
        let nodes = q.mesh.nodes_mm.iter().enumerate();
        nodes
            .filter(|(_, p)| (p.xy().norm() - q.inner).abs() < 1e-9)
            .map(|(n, _)| n as u32)
            .collect()
    };
    let mut given = q.given.clone();
    for node in &inner {
        given.extend([0, 1].map(|axis| (*node, axis)).iter().filter(|g| !q.given.contains(g)));
    }
    let mut solver = Solver::new(&q.mesh, &given).unwrap();
    let none = Target::none(q.mesh.nodes_mm.len(), given.len());
    let mut to = none.clone();
    for (value, (node, axis)) in to.given_mm.iter_mut().zip(&given) {
        if *axis < 2 && inner.contains(node) {
            *value = q.mesh.nodes_mm[*node as usize][*axis];
        }
    }
    let c10_pa = 0.04e6;
    let material = large(Material::NeoHookean { c10_pa }, 0.499_99);
    let solution = solver.solve(&material, &solver.unloaded(), &none, &to).unwrap();
    let forces = solver.reactions_n(&material, &solution).unwrap();
    // r² = R² + a² − A² with a = 2 A.
    let grown = 3.0 * q.inner * q.inner;
    for (place, moved) in q.mesh.nodes_mm.iter().zip(solution.displacements_mm()) {
        let expected = (place.xy().norm_squared() + grown).sqrt();
        let off = (place + moved).xy().norm() / expected - 1.0;
        assert!(off.abs() < 3e-3, "{off:e} at {place}");
    }
    // p = ∫ (σθθ − σrr)/r dr with σθθ − σrr = 2 C10 (λ² − λ⁻²) and λ = r/R.
    let (a, b) = (2.0 * q.inner, (q.outer * q.outer + grown).sqrt());
    let steps = 2000;
    let pressure: f64 = (0..steps)
        .map(|k| {
            let r = a + (b - a) * (k as f64 + 0.5) / steps as f64;
            let square = r * r / (r * r - grown);
            2e-6 * c10_pa * (square - 1.0 / square) / r * (b - a) / steps as f64
        })
        .sum();
    // What the plates of symmetry bear acts along them, and so across the radius.
    let radial = |node: &u32| {
        forces[*node as usize].xy().dot(&q.mesh.nodes_mm[*node as usize].xy().normalize())
    };
    let outwards: f64 = inner.iter().map(radial).sum();
    let found = outwards / (a * std::f64::consts::FRAC_PI_2 * LENGTH_MM);
    assert!((found / pressure - 1.0).abs() < 1e-2, "{found} MPa, not {pressure}");
}
