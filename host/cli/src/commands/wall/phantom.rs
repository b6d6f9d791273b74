//! `cathforce wall phantom`: the static test of Pescio et al. 2025 on finite elements.

use std::fmt::Write as _;

use cathforce_material::{Form, Law, Material};
use cathforce_wall::phantom::Phantom;
use cathforce_wall::{Kinematics, Patch, Pressed};
use serde_json::{Value, json};

use super::law::Named;
use super::load::{describe, law_json, mesh_json, meshed, patch_json, press_all};
use crate::args::WallPhantomArguments;
use crate::failure::Failure;
use crate::ui::Ui;

/// Forces, and displacements that were measured and simulated: Pescio et al. 2025, Table 3 (the forces
/// of the text; the table rounds two of them).
const FORCES_N: [f64; 3] = [0.56, 1.10, 1.63];
const MEASURED_MM: [f64; 3] = [3.34, 4.61, 4.92];
const ELASTIC_MM: [f64; 3] = [2.20, 5.24, 7.80];
const NEO_HOOKEAN_MM: [f64; 3] = [0.85, 1.75, 2.72];
const MOONEY_RIVLIN_MM: [f64; 3] = [0.39, 0.83, 1.28];
const OGDEN_MM: [f64; 3] = [0.31, 0.64, 1.00];

/// A row of Table 3 with its parameters of Table 2.
struct Row {
    named: Named,
    published_mm: [f64; 3],
}

pub fn run(ui: &Ui, arguments: &WallPhantomArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let rows = rows(arguments.elements.poisson)?;
    let phantom = Phantom::default();
    let mesh = meshed(ui, &phantom, arguments.thickness_mm, &arguments.elements)?.mesh;
    let (near, direction) = phantom.pressed();
    let patch = Patch::round(&mesh, &near, Some(direction), arguments.patch_mm);
    let patch = patch.map_err(Failure::input)?;
    let (laws, published): (Vec<_>, Vec<_>) =
        rows.into_iter().map(|row| (row.named, row.published_mm)).unzip();
    let results = press_all(ui, &mesh, &laws, &patch, &FORCES_N)?;
    let rows = || results.iter().zip(&published);
    let json = json!({
        "mesh": mesh_json(&mesh),
        "patch": patch_json(&patch),
        "thickness_mm": arguments.thickness_mm,
        "poissons_ratio": arguments.elements.poisson,
        "assumed": ASSUMED,
        "measured_mm": MEASURED_MM,
        "rows": rows().map(|((name, pressed), published)| {
            let mut row = law_json(name, pressed);
            row["published_mm"] = json!(published);
            row
        }).collect::<Vec<Value>>(),
    });
    let mut text = describe(&mesh, &patch);
    text += &format!(
        "wall {} mm thick, Poisson's ratio {}\nassumed: {ASSUMED}\n\n{:<14} {:>8} {:>10} {:>13} {:>9} {:>12}\n",
        arguments.thickness_mm,
        arguments.elements.poisson,
        "law",
        "force N",
        "measured",
        "published mm",
        "ours mm",
        "ours/publ."
    );
    for ((name, pressed), published) in rows() {
        lines(&mut text, name, pressed, published);
    }
    arguments.json_file.write(ui, &json, text)
}

/// What the papers do not say.
const ASSUMED: &str = "straight arteries in one plane, 25° between iliac artery and aorta; held 100 mm \
                       (left), 45 mm (right) and 45 mm (aorta) from the crotch; pressed in the middle of the \
                       left artery, on the outer side; the place that is pressed is round";

fn lines(text: &mut String, name: &str, pressed: &[Pressed], published: &[f64; 3]) {
    for (index, force_n) in FORCES_N.into_iter().enumerate() {
        let ours = pressed.iter().find(|pressed| pressed.force_n == force_n);
        let [ours, ratio] = match ours {
            Some(ours) => [
                format!("{:.2}", ours.displacement_mm),
                format!("{:.2}", ours.displacement_mm / published[index]),
            ],
            None => ["none".into(), String::new()],
        };
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{:<14} {force_n:>8.2} {:>10.2} {:>13.2} {ours:>9} {ratio:>12}",
            if index == 0 { name } else { "" },
            MEASURED_MM[index],
            published[index],
        );
    }
}

/// The laws with the parameters of Table 2, put into the energies (7) to (9) of the paper. The elastic
/// law is listed twice: with small strains, and with rotations of any size as a corotational element
/// has them.
fn rows(poissons_ratio: f64) -> Result<Vec<Row>, Failure> {
    let printed = |law, parameters: &[f64]| {
        Form::Printed.material(law, parameters).map_err(|error| Failure::input(&error))
    };
    let elastic = Material::Elastic { youngs_modulus_pa: 0.46e6 };
    let large = Kinematics::Large;
    let rows = [
        (elastic, Kinematics::Small, ELASTIC_MM),
        (elastic, large, ELASTIC_MM),
        (printed(Law::NeoHookean, &[0.04e6])?, large, NEO_HOOKEAN_MM),
        (printed(Law::MooneyRivlin, &[0.02e6, 0.09e6])?, large, MOONEY_RIVLIN_MM),
        (printed(Law::Ogden, &[0.20e6, 1.4])?, large, OGDEN_MM),
    ];
    let row = |(law, kinematics, published_mm)| Row {
        named: Named::new(law, kinematics, poissons_ratio),
        published_mm,
    };
    Ok(rows.map(row).into())
}
