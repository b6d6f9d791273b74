//! The insertion with the reference solver.

use anyhow::Context;
use cathforce_reference_solver::{
    Drive, Entry, Lumen, Numerics, Problem, Rod, Schedule, Section, TipLoad, TubePath, WallLaw,
};
use nalgebra::Vector3;

use super::{Insertion, Series};

/// Distance between the reference's nodes \[m\], a sixth of that in the compared models.
const SPACING_M: f64 = 0.5e-3;
/// Drag with which a free tip comes to rest; about the model's at rest \[N·s/m²\].
const DRAG_N_S_PER_M2: f64 = 0.2;

/// Forces of the reference, one a sample.
pub fn reference(insertion: &Insertion) -> anyhow::Result<Series> {
    let problem = problem(insertion);
    let drive = |insertion_m| Drive { insertion_m, rotation_rad: 0.0 };
    let end = insertion.samples();
    let end_s = insertion.sample_s * end as f64;
    let schedule = Schedule::samples(vec![
        (0.0, drive(insertion.start_m)),
        (end_s, drive(insertion.at_m(end))),
    ]);
    let (samples, _) =
        cathforce_reference_solver::run(&problem, &schedule.context("an empty insertion")?)?;
    Ok(samples.iter().map(|s| (s.drive.insertion_m, s.force_on_vessel_n.into())).collect())
}

fn problem(insertion: &Insertion) -> Problem {
    let described = insertion.description::<f64>(insertion.spacing_m());
    let section = described.instrument.sections[0];
    let wall = described.wall;
    let tube = insertion.tube;
    let bend_m = tube.bend_radius_m * tube.bend_angle_rad;
    let path = TubePath::from(Vector3::zeros(), Vector3::x(), tube.first_radius_m)
        .straight(tube.straight_m, tube.radius_m(tube.straight_m))
        .arc(
            tube.bend_radius_m,
            tube.bend_angle_rad,
            Vector3::y(),
            tube.radius_m(tube.straight_m + bend_m),
        )
        .straight(tube.length_m - tube.straight_m - bend_m, tube.last_radius_m);
    Problem {
        rod: Rod {
            radius_m: insertion.radius_m,
            sections: vec![Section {
                length_m: section.length_m,
                bending_n_m2: section.bending_stiffness_n_m2,
                torsion_n_m2: section.torsional_stiffness_n_m2,
                axial_n: section.axial_stiffness_n,
                mass_kg_per_m: section.mass_kg_per_m,
            }],
            curves: Vec::new(),
        },
        entry: Entry { position_m: Vector3::zeros(), direction: Vector3::x(), up: Vector3::y() },
        lumen: Lumen::tube(path.tube()),
        beyond: Default::default(),
        wall: WallLaw {
            line_stiffness_n_per_m2: wall.line_stiffness_n_per_m2,
            end_stiffness_n_per_m: wall.end_stiffness_n_per_m,
            tangential_ratio: wall.tangential_ratio,
            friction_coefficient: wall.friction_coefficient,
        },
        gravity_m_per_s2: insertion.gravity_m_per_s2.into(),
        drag_n_s_per_m2: DRAG_N_S_PER_M2,
        tip_load: TipLoad::default(),
        numerics: Numerics {
            spacing_m: SPACING_M,
            step_s: insertion.sample_s,
            ..Numerics::default()
        },
    }
}
