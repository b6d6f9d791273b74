//! The silicone of Pescio et al. 2025: the fits of Table 2 and the loaded wall of Table 3.

use anyhow::Context;
use cathforce_material::{Curve, Fit, Form, Law, Point, StressMeasure, fit};
use cathforce_wall::phantom::{
    ASSUMED, ELEMENT_MM, FORCES_N, MEASURED_MM, PATCH_MM, POISSONS_RATIO, Phantom, THICKNESS_M,
    table_3,
};
use cathforce_wall::{Kinematics, Patch, Solver, WallMaterial, WallMesh, extrude, press, remesh};

use crate::meter::{Meter, Trouble};
use crate::part::Outcome;
use crate::plot::{Curve as Drawn, Plot, Style};
use crate::row::Row;

/// Printed Ogden fit: μ₁ \[Pa\] and α₁.
const OGDEN: [f64; 2] = [0.2e6, 1.4];
/// Stretches of the curve: 500 mm/min on a gauge of 32 mm up to 550 %, at 10 Hz, every 4th sample.
const STRETCHES: usize = 56;
const LARGEST_STRETCH: f64 = 6.5;

/// Printed fits: law, then parameter, unit and value of each, R² and RMSE \[MPa\].
type PrintedFit = (Law, &'static [(&'static str, f64)], f64, f64);
const TABLE_2: [PrintedFit; 3] = [
    (Law::Elastic, &[("E", 0.46)], 0.99, 0.07),
    (Law::NeoHookean, &[("μ", 0.04)], 0.95, 1.7),
    (Law::MooneyRivlin, &[("C10", 0.02), ("C01", 0.09)], 1.00, 0.06),
];

/// Fits of the printed formulas to the curve that the printed Ogden fit gives.
pub fn tensile_test(_: &Meter) -> Result<Outcome, Trouble> {
    let curve = curve();
    let mut rows = Vec::new();
    let mut curves = vec![drawn("Ogden, as printed", Style::Truth, Law::Ogden, &OGDEN)];
    for (law, parameters, r_squared, rmse_mpa) in TABLE_2 {
        let found = fit(&curve, law, Form::Printed).context("a law was not fitted")?;
        rows.extend(fit_rows(&found, parameters, [r_squared, rmse_mpa]));
        let values: Vec<f64> = found.parameters.iter().map(|own| own.value).collect();
        curves.push(drawn(law.name(), Style::Ours, law, &values));
    }
    let why = "the measured curve is not public; this fit stands in for it";
    for (name, unit, printed) in [("μ1", "MPa", OGDEN[0] / 1e6), ("α1", "1", OGDEN[1])] {
        rows.push(
            Row::without(format!("tensile test, ogden, {name}"), unit, why).published(printed),
        );
    }
    let plot = Plot {
        title: "Tensile test of the silicone, fitted as printed".into(),
        axes: ["stretch, 1", "nominal stress, MPa"],
        equal: false,
        curves,
    };
    Ok(Outcome { rows, plots: vec![plot] })
}

fn stretches() -> impl Iterator<Item = f64> {
    let step = (LARGEST_STRETCH - 1.0) / (STRETCHES - 1) as f64;
    (0..STRETCHES).map(move |k| 1.0 + step * k as f64)
}

fn curve() -> Curve {
    let measure = StressMeasure::Nominal;
    let point = |stretch| Point {
        stretch,
        stress_pa: Form::Printed.stress_pa(Law::Ogden, &OGDEN, measure, stretch),
    };
    Curve { measure, points: stretches().map(point).collect() }
}

fn drawn(name: &str, style: Style, law: Law, parameters: &[f64]) -> Drawn {
    let stress_mpa = |x| 1e-6 * Form::Printed.stress_pa(law, parameters, StressMeasure::Nominal, x);
    Drawn { name: name.into(), style, points: stretches().map(|x| [x, stress_mpa(x)]).collect() }
}

fn fit_rows(found: &Fit, printed: &[(&str, f64)], [r_squared, rmse_mpa]: [f64; 2]) -> Vec<Row> {
    let how = "fit of the printed formula to the printed Ogden fit at 56 stretches up to 6.5, because the \
               measured curve is not public";
    let row = |what: &str, unit, ours, printed| {
        Row::of(format!("tensile test, {}, {what}", found.law), unit, ours)
            .published(printed)
            .how(how)
    };
    let parameters = found.parameters.iter().zip(printed);
    let mut rows: Vec<Row> = parameters
        .map(|(own, (name, printed))| row(name, "MPa", 1e-6 * own.value, *printed))
        .collect();
    rows.push(row("R²", "1", found.r_squared, r_squared));
    rows.push(row("RMSE", "MPa", 1e-6 * found.rmse_pa, rmse_mpa));
    rows
}

/// Work of a load of one law, in the unit of a [`Meter`].
const LOAD_WORK: u64 = 40_000;

pub fn wall_work() -> u64 {
    LOAD_WORK * (FORCES_N.len() * 5) as u64
}

/// The wall of the phantom in finite elements, pressed law by law.
pub fn wall(meter: &Meter) -> Result<Outcome, Trouble> {
    let table = table_3(POISSONS_RATIO).context("a published law is no material")?;
    let (mesh, patch) = pressed_wall().context("the phantom's wall")?;
    let mut solver = Solver::new(&mesh, &[]).context("the phantom's wall")?;
    let mut rows = Vec::new();
    let mut curves = vec![displacements("measured", Style::Truth, &MEASURED_MM)];
    for row in table {
        let ours = pressed(meter, &mesh, &mut solver, &patch, &row.material)?;
        let known: Vec<f64> = ours.iter().map_while(|own| own.as_ref().ok().copied()).collect();
        curves.push(displacements(row.material.name(), Style::Ours, &known));
        let cases = FORCES_N.into_iter().zip(row.simulated_mm).zip(ours);
        rows.extend(cases.map(|((force_n, printed_mm), ours)| {
            wall_row(&row.material, &mesh, force_n, ours).published(printed_mm)
        }));
    }
    let plot = Plot {
        title: "Left iliac artery of the silicone phantom, pressed".into(),
        axes: ["force, N", "displacement, mm"],
        equal: false,
        curves,
    };
    Ok(Outcome { rows, plots: vec![plot] })
}

/// How far a force of the insertion presses this wall in, which the truth of the insertion leaves out.
pub fn yielded(force_n: f64) -> Result<Row, Trouble> {
    let [row, ..] = table_3(POISSONS_RATIO).context("a published law is no material")?;
    let (mesh, patch) = pressed_wall().context("the phantom's wall")?;
    let mut solver = Solver::new(&mesh, &[]).context("the phantom's wall")?;
    let found = press(&mesh, &mut solver, &row.material, &patch, &[force_n], |_| ())
        .context("the phantom's wall")?;
    let how = format!(
        "finite elements of the silicone wall as for Table 3, {}, under the largest force that the sensor \
         reads at 13 mm/s behind the guide, {:.1} mN; the wall of the insertion's truth is therefore rigid",
        row.material.name(),
        1e3 * force_n
    );
    let figure = "wall under the largest force of the insertion, displacement";
    Ok(Row::of(figure, "mm", found[0].displacement_mm).how(how))
}

fn pressed_wall() -> anyhow::Result<(WallMesh, Patch)> {
    let phantom = Phantom::default();
    let surface = remesh(&phantom, ELEMENT_MM, None)?;
    let mesh = extrude(&surface, 1e3 * THICKNESS_M, 1)?.mesh;
    let (near, direction) = phantom.pressed();
    let patch = Patch::round(&mesh, &near, Some(direction), PATCH_MM)?;
    Ok((mesh, patch))
}

/// Displacement at each force \[mm\], or why there is none.
fn pressed(
    meter: &Meter,
    mesh: &WallMesh,
    solver: &mut Solver,
    patch: &Patch,
    material: &WallMaterial,
) -> Result<[Result<f64, String>; 3], Trouble> {
    let mut found = Vec::new();
    let mut stopped = None;
    let end = press(mesh, solver, material, patch, &FORCES_N, |pressed| {
        found.push(pressed.displacement_mm);
        stopped = stopped.take().or(meter.add(LOAD_WORK).err());
    });
    if let Some(trouble) = stopped {
        return Err(trouble);
    }
    let why = end.err().map_or_else(String::new, |error| error.to_string());
    Ok(std::array::from_fn(|k| found.get(k).copied().ok_or_else(|| why.clone())))
}

fn wall_row(
    material: &WallMaterial,
    mesh: &WallMesh,
    force_n: f64,
    ours: Result<f64, String>,
) -> Row {
    let strains = match material.kinematics {
        Kinematics::Small => "small strains",
        Kinematics::Large => "large strains",
    };
    let figure = format!("wall at {force_n:.2} N, {}, displacement", material.name());
    let how = format!(
        "{} quadratic tetrahedra, {strains}, parameters of table 2, Poisson's ratio {POISSONS_RATIO}, \
         pressed on a radius of {PATCH_MM} mm; assumed: {ASSUMED}",
        mesh.tetrahedra.len()
    );
    match ours {
        Ok(ours_mm) => Row::of(figure, "mm", ours_mm).how(how),
        Err(why) => Row::without(figure, "mm", why).how(how),
    }
}

fn displacements(name: &str, style: Style, at_forces_mm: &[f64]) -> Drawn {
    let points = FORCES_N.into_iter().zip(at_forces_mm).map(|(force_n, mm)| [force_n, *mm]);
    Drawn { name: name.into(), style, points: [[0.0; 2]].into_iter().chain(points).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_fits_are_fits_of_one_curve() {
        let meter = Meter::new(0, &|_, _| (), &|| false);
        let outcome = tensile_test(&meter).unwrap();
        for row in
            outcome.rows.iter().filter(|row| row.unit == "MPa" && !row.figure.contains("RMSE"))
        {
            let (Some(ours), Some(printed)) = (row.ours, row.published) else { continue };
            // Half of the last printed digit.
            assert!((ours - printed).abs() <= 0.005, "{row:?}");
        }
        assert_eq!(outcome.rows.len(), 12);
    }
}
