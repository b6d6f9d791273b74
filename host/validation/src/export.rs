//! Writes cases and their solutions as JSON and CSV.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::Context;
use serde_json::{Value, json};

use crate::{Case, Record};

/// Writes `NAME.json` (rod, vessel, wall), `NAME.csv` (the drive and the reference's solution, one
/// row a step) and `NAME.device.csv` (the model's, one row a tick); SI units throughout.
pub fn export(
    folder: &Path,
    case: &Case,
    reference: &[Record],
    device: &[Record],
) -> anyhow::Result<()> {
    let name: String =
        case.name.chars().filter(|c| *c != ',').map(|c| if c == ' ' { '-' } else { c }).collect();
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let write = |extension: &str, text: String| {
        let path = folder.join(format!("{name}.{extension}"));
        fs::write(&path, text).with_context(|| path.display().to_string())
    };
    write("json", format!("{:#}\n", description(case)))?;
    write("csv", csv(reference))?;
    write("device.csv", csv(device))
}

fn csv(solution: &[Record]) -> String {
    let mut text = String::from(
        "t_s,insertion_m,rotation_rad,drive_fx_N,fx_N,fy_N,fz_N,tip_x_m,tip_y_m,tip_z_m\n",
    );
    for r in solution {
        let (f, x) = (r.force_on_vessel_n, r.tip_m);
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{:.6},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9},{:.9}",
            r.t_s, r.insertion_m, r.rotation_rad, r.drive_force_n, f.x, f.y, f.z, x.x, x.y, x.z
        );
    }
    text
}

/// The description of a case without the drive's motion, which is in the rows of the solution.
fn description(case: &Case) -> Value {
    let problem = &case.problem;
    let vector = |v: &nalgebra::Vector3<f64>| json!([v.x, v.y, v.z]);
    let sections = problem.rod.sections.iter().map(|s| {
        json!({
            "length_m": s.length_m,
            "bending_stiffness_n_m2": s.bending_n_m2,
            "torsional_stiffness_n_m2": s.torsion_n_m2,
            "axial_stiffness_n": s.axial_n,
            "mass_kg_per_m": s.mass_kg_per_m,
        })
    });
    let curves = problem.rod.curves.iter().map(|c| {
        json!({
            "length_m": c.length_m,
            "curvature_per_m": c.up_per_m,
            "lateral_curvature_per_m": c.side_per_m,
        })
    });
    let tubes = problem.lumen.tubes().iter().map(|tube| {
        let stations = tube.stations().iter();
        let stations =
            stations.map(|s| json!([s.position_m.x, s.position_m.y, s.position_m.z, s.radius_m]));
        json!({ "stations_x_y_z_radius_m": stations.collect::<Vec<_>>() })
    });
    json!({
        "name": case.name,
        "kind": case.kind,
        "rod": {
            "outer_radius_m": problem.rod.radius_m,
            "sections_from_tip": sections.collect::<Vec<_>>(),
            "precurve_from_tip": curves.collect::<Vec<_>>(),
        },
        "entry": {
            "position_m": vector(&problem.entry.position_m),
            "direction": vector(&problem.entry.direction),
            "up": vector(&problem.entry.up),
        },
        "wall": {
            "line_stiffness_n_per_m2": problem.wall.line_stiffness_n_per_m2,
            "end_stiffness_n_per_m": problem.wall.end_stiffness_n_per_m,
            "tangential_ratio": problem.wall.tangential_ratio,
            "friction_coefficient": problem.wall.friction_coefficient,
        },
        "tubes": tubes.collect::<Vec<_>>(),
        "gravity_m_per_s2": vector(&problem.gravity_m_per_s2),
        "drag_n_s_per_m2": problem.drag_n_s_per_m2,
        "scored_from_s": case.scored_from_s,
    })
}
