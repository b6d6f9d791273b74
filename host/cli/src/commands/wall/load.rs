//! `cathforce wall load`: how far a wall gives way under a force.

use std::fmt::Write as _;
use std::path::Path;

use cathforce_bundle::geometry::{SurfaceModel, Wall};
use cathforce_bundle::open_vessel;
use cathforce_wall::phantom::ELEMENT_MM;
use cathforce_wall::{
    Extruded, Patch, Pressed, Solver, WallMesh, extrude, press, read_gmsh, remesh,
};
use nalgebra::Vector3;
use serde_json::{Value, json};

use super::law::{Named, of_argument, of_fit};
use crate::args::{ElementArguments, WallLoadArguments};
use crate::failure::{Code, Failure};
use crate::output::shown;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &WallLoadArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let laws = laws(arguments)?;
    let mesh = mesh(ui, arguments)?;
    let near = Vector3::from(arguments.at);
    let direction = arguments.direction.map(Vector3::from);
    let patch =
        Patch::round(&mesh, &near, direction, arguments.patch_mm).map_err(Failure::input)?;
    let off_mm = (patch.centre_mm - near).norm();
    if off_mm > 2.0 * arguments.patch_mm {
        ui.warn(format_args!(
            "--at is {off_mm:.1} mm away from the wall; the nearest place of it is pressed"
        ));
    }
    let mut forces_n = arguments.forces_n.clone();
    forces_n.sort_by(f64::total_cmp);
    forces_n.dedup();
    let results = press_all(ui, &mesh, &laws, &patch, &forces_n)?;
    let json = json!({
        "path": shown(&arguments.path),
        "mesh": mesh_json(&mesh),
        "patch": patch_json(&patch),
        "poissons_ratio": arguments.elements.poisson,
        "laws": results.iter().map(|(name, pressed)| law_json(name, pressed)).collect::<Vec<_>>(),
    });
    let text = format!("{}\n{}", describe(&mesh, &patch), table(&results));
    arguments.json_file.write(ui, &json, text)
}

fn laws(arguments: &WallLoadArguments) -> Result<Vec<Named>, Failure> {
    let poisson = arguments.elements.poisson;
    let mut laws = Vec::new();
    for law in &arguments.laws {
        laws.push(of_argument(law, poisson)?);
    }
    if let Some(fit) = &arguments.fit {
        laws.extend(of_fit(fit, poisson)?);
    }
    if laws.is_empty() {
        let message =
            "no law is given\n  fix: give --law, as in `--law neo-hookean:0.04`, or --fit";
        return Err(Failure::new(Code::Usage, message));
    }
    Ok(laws)
}

fn mesh(ui: &Ui, arguments: &WallLoadArguments) -> Result<WallMesh, Failure> {
    let path = &arguments.path;
    let is = |ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    if is("msh") {
        if arguments.thickness_mm.is_some() {
            ui.warn("--thickness-mm is not used, because a mesh of a wall has its own thickness");
        }
        return read_gmsh(path).map_err(Failure::input);
    }
    let thickness_mm = thickness(path, arguments.thickness_mm)?;
    let mut warnings = Vec::new();
    let vessel = open_vessel(path, SurfaceModel::default(), &mut warnings);
    warnings.iter().for_each(|warning| ui.warn(warning));
    let vessel = vessel.map_err(Failure::input)?;
    Ok(meshed(ui, vessel.wall(), thickness_mm, &arguments.elements)?.mesh)
}

/// The thickness, which a surface does not have.
pub fn thickness(path: &Path, thickness_mm: Option<f64>) -> Result<f64, Failure> {
    thickness_mm.ok_or_else(|| {
        let message = format!(
            "{}: a surface is no wall: it has no thickness\n  fix: give the thickness of the wall with \
             --thickness-mm, or a mesh of the wall's volume (.msh)",
            path.display()
        );
        Failure::new(Code::Usage, message)
    })
}

/// Meshes the wall around a lumen.
pub fn meshed(
    ui: &Ui,
    wall: &dyn Wall,
    thickness_mm: f64,
    elements: &ElementArguments,
) -> Result<Extruded, Failure> {
    let element_mm = elements.element_mm.unwrap_or(ELEMENT_MM);
    let surface = remesh(wall, element_mm, None).map_err(Failure::input)?;
    let extruded = extrude(&surface, thickness_mm, usize::from(elements.layers));
    let extruded = extruded.map_err(Failure::input)?;
    if extruded.thinner > 0 {
        ui.warn(format_args!(
            "the wall is thinner than {thickness_mm} mm at {} of {} places, down to {:.0} %, because the \
             walls of two branches would go through each other there",
            extruded.thinner,
            surface.vertices_mm.len(),
            100.0 * extruded.least
        ));
    }
    Ok(extruded)
}

/// Presses with every law. A law under which the wall gives way altogether is left out with a
/// warning, unless it is the only one.
pub fn press_all(
    ui: &Ui,
    mesh: &WallMesh,
    laws: &[Named],
    patch: &Patch,
    forces_n: &[f64],
) -> Result<Vec<(String, Vec<Pressed>)>, Failure> {
    let mut solver = Solver::new(mesh, &[]).map_err(Failure::input)?;
    let mut bar = ui.progress("pressing", (laws.len() * forces_n.len()) as u64, "loads");
    let mut done = 0;
    let mut results = Vec::new();
    for law in laws {
        let mut found = Vec::new();
        let pressed = press(mesh, &mut solver, &law.material, patch, forces_n, |pressed| {
            found.push(*pressed);
            done += 1;
            bar.set(done);
        });
        if let Err(error) = pressed {
            if laws.len() == 1 {
                return Err(Failure::new(Code::Failed, format!("{}: {error}", law.name)));
            }
            ui.warn(format_args!("{}: {error}", law.name));
        }
        results.push((law.name.clone(), found));
    }
    drop(bar);
    Ok(results)
}

pub fn describe(mesh: &WallMesh, patch: &Patch) -> String {
    let [x, y, z]: [f64; 3] = patch.centre_mm.into();
    let [dx, dy, dz]: [f64; 3] = patch.direction.into();
    format!(
        "{} tetrahedra, {} nodes, {:.0} mm³ of wall\npressed at ({x:.1}, {y:.1}, {z:.1}) mm along \
         ({dx:.2}, {dy:.2}, {dz:.2}) on a radius of {:.1} mm\n",
        mesh.tetrahedra.len(),
        mesh.nodes_mm.len(),
        mesh.volume_mm3(),
        patch.half_axes_mm[0]
    )
}

fn table(results: &[(String, Vec<Pressed>)]) -> String {
    let mut text = format!(
        "{:<14} {:>8} {:>16} {:>13} {:>16}\n",
        "law", "force N", "displacement mm", "largest mm", "stiffness N/mm"
    );
    for (name, pressed) in results {
        for (index, p) in pressed.iter().enumerate() {
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "{:<14} {:>8.3} {:>16.3} {:>13.3} {:>16.4}",
                if index == 0 { name } else { "" },
                p.force_n,
                p.displacement_mm,
                p.largest_mm,
                p.force_n / p.displacement_mm
            );
        }
    }
    text
}

pub fn mesh_json(mesh: &WallMesh) -> Value {
    json!({
        "tetrahedra": mesh.tetrahedra.len(), "nodes": mesh.nodes_mm.len(), "held": mesh.fixed.len(),
        "volume_mm3": mesh.volume_mm3(),
    })
}

pub fn patch_json(patch: &Patch) -> Value {
    json!({
        "centre_mm": patch.centre_mm.as_slice(), "direction": patch.direction.as_slice(),
        "half_axes_mm": patch.half_axes_mm,
    })
}

pub fn law_json(name: &str, pressed: &[Pressed]) -> Value {
    let pressed = pressed.iter().map(|p| {
        json!({
            "force_n": p.force_n, "displacement_mm": p.displacement_mm, "largest_mm": p.largest_mm,
            "corrections": p.corrections,
        })
    });
    json!({ "law": name, "loads": pressed.collect::<Vec<_>>() })
}
