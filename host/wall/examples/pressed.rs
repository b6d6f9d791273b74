//! Size, time and displacement of the phantom's wall by the size of its elements: what the choice of
//! `--element-mm` rests on.
//!
//!     cargo run --release -p cathforce-wall --example pressed -- 6 4 3

use std::time::Instant;

use cathforce_material::Material;
use cathforce_wall::phantom::{Phantom, THICKNESS_M};
use cathforce_wall::{Kinematics, Patch, Solver, WallMaterial, extrude, press, remesh};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let phantom = Phantom::default();
    let (near, direction) = phantom.pressed();
    let laws = [
        (Material::Elastic { youngs_modulus_pa: 0.46e6 }, Kinematics::Small),
        (Material::MooneyRivlin { c10_pa: 0.02e6, c01_pa: 0.09e6 }, Kinematics::Large),
    ];
    for size in std::env::args().skip(1) {
        let start = Instant::now();
        let surface = remesh(&phantom, size.parse()?, None)?;
        let extruded = extrude(&surface, 1e3 * THICKNESS_M, 1)?;
        let mesh = &extruded.mesh;
        let patch = Patch::round(mesh, &near, Some(direction), 2.0)?;
        let mut solver = Solver::new(mesh, &[])?;
        let [equations, entries] = solver.size();
        println!(
            "{size} mm: {} tetrahedra, {equations} equations, {entries} entries of the factor, {} thinner \
             places down to {:.2}, {:.1} s",
            mesh.tetrahedra.len(),
            extruded.thinner,
            extruded.least,
            start.elapsed().as_secs_f64()
        );
        for (law, kinematics) in laws {
            let start = Instant::now();
            let material = WallMaterial { law, kinematics, poissons_ratio: 0.49 };
            for pressed in press(mesh, &mut solver, &material, &patch, &[0.56, 1.10, 1.63], |_| ())?
            {
                println!("  {:?} {pressed:?}", law.law());
            }
            println!("  {:.1} s", start.elapsed().as_secs_f64());
        }
    }
    Ok(())
}
