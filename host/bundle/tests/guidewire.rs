//! Bundles with a guidewire in the catheter: `[guidewire]` and its columns.

mod support;

use std::fs;
use std::path::Path;

use cathforce_bundle::tips::Tip;
use cathforce_bundle::{
    Bundle, BundleError, ImageBuildError, ImageOptions, Place, SolverDefaults, describe,
    device_image, to_description,
};
use cathforce_config::image::decode;
use support::{RIG, TRIAL, write_bundle};

const GUIDEWIRE: &str = r#"
[guidewire]
length_m = 1.5
outer_diameter_m = 0.89e-3
inner_diameter_m = 0.0
density_kg_per_m3 = 6450.0
poissons_ratio = 0.3
sections = [
  { length_m = 1.45, youngs_modulus_Pa = 40.0e9 },
  { length_m = 0.05, youngs_modulus_Pa = 2.0e9 },
]
tip_precurve = [ { length_m = 0.005, curvature_per_m = 200.0 } ]
"#;

fn rig() -> String {
    RIG.to_owned() + GUIDEWIRE
}

/// The small trial with the wire's columns after the catheter's; the wire goes farther in.
fn trial() -> String {
    let wire =
        ["guidewire_insertion_m,guidewire_rotation_rad", "0.010,0.0", "0.014,-0.2", "0.019,0.4"];
    TRIAL.lines().zip(wire).map(|(line, wire)| format!("{line},{wire}\n")).collect()
}

fn open_with(rig: &str, trial: &str) -> Result<Bundle, BundleError> {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    fs::write(folder.path().join("trials/000.csv"), trial).unwrap();
    Bundle::open(folder.path())
}

#[track_caller]
fn assert_refused(rig: &str, trial: &str, file: &str, place: Place, says: &[&str]) {
    let error = open_with(rig, trial).unwrap_err();
    assert!(error.file.ends_with(Path::new(file)), "{error}");
    assert_eq!(error.place, place, "{error}");
    let text = error.to_string();
    for part in says.iter().chain(&["\n  fix: "]) {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
}

/// Line and column where `part` begins for the last time; the guidewire's table is the last one.
fn last_place_of(text: &str, part: &str) -> Place {
    let at = text.rfind(part).unwrap_or_else(|| panic!("`{part}` is not in the text"));
    let line_start = text[..at].rfind('\n').map_or(0, |end| end + 1);
    Place::LineColumn(text[..at].matches('\n').count() + 1, at - line_start + 1)
}

#[test]
fn the_wire_and_its_drive_are_read() {
    let bundle = open_with(&rig(), &trial()).unwrap();
    assert_eq!(bundle.warnings, []);
    let wire = bundle.catheter().unwrap().guidewire.as_ref().unwrap();
    assert_eq!((wire.outer_diameter_m, wire.sections.len()), (0.89e-3, 2));
    assert_eq!(bundle.largest_insertion_m(), Some(0.019), "the wire's");
    let trial = &bundle.trials[0];
    let (catheter, wire) = (trial.encoder_at(0.3).unwrap(), trial.guidewire_at(0.3).unwrap());
    assert!((catheter.insertion_m - 0.014).abs() < 1e-12, "{catheter:?}");
    assert!((wire.insertion_m - 0.0165).abs() < 1e-12 && (wire.rotation_rad - 0.1).abs() < 1e-12);
    assert_eq!(trial.catheter().unwrap().guidewire.as_ref().unwrap().drive_force_n, None);

    let measured = ["guidewire_drive_fx_N", "0.1", "", "-0.2"];
    let measured: String = self::trial()
        .lines()
        .zip(measured)
        .map(|(line, force)| format!("{line},{force}\n"))
        .collect();
    let bundle = open_with(&rig(), &measured).unwrap();
    let wire = bundle.trials[0].catheter().unwrap().guidewire.as_ref().unwrap();
    assert_eq!(wire.drive_force_n, Some(vec![Some(0.1), None, Some(-0.2)]));
}

#[test]
fn a_bundle_without_a_wire_is_what_it_was() {
    let bundle = open_with(RIG, TRIAL).unwrap();
    assert_eq!(bundle.catheter().unwrap().guidewire, None);
    assert_eq!(bundle.trials[0].guidewire_at(0.0), None);
    let description = to_description::<f64>(&bundle, &SolverDefaults::default()).unwrap();
    assert_eq!(description.guidewire, None);
}

#[test]
fn what_is_wrong_with_a_wire_is_named_by_its_own_table() {
    for (old, new, at, says) in [
        ("0.89e-3", "1.1e-3", "1.1e-3", &["guidewire.outer_diameter_m", "inner diameter"][..]),
        ("inner_diameter_m = 0.0", "inner_diameter_m = 0.9e-3", "0.9e-3", &["solid wire"]),
        (
            "poissons_ratio = 0.3",
            "poisons_ratio = 0.3",
            "poisons",
            &["[guidewire]", "`poissons_ratio`?"],
        ),
        ("length_m = 1.45", "length_m = 1.40", "[\n", &["1.45 m long together", "1.5"]),
        (
            "density_kg_per_m3 = 6450.0",
            "",
            "[guidewire]",
            &["`guidewire.density_kg_per_m3` is missing"],
        ),
    ] {
        assert!(GUIDEWIRE.contains(old), "{old}");
        let rig = RIG.to_owned() + &GUIDEWIRE.replacen(old, new, 1);
        assert_refused(&rig, &trial(), "rig.toml", last_place_of(&rig, at), says);
    }
    let begin = GUIDEWIRE.find("sections").unwrap();
    let end = GUIDEWIRE.find("tip_precurve").unwrap();
    let none = rig().replace(&GUIDEWIRE[begin..end], "");
    let place = last_place_of(&none, "[guidewire]");
    assert_refused(&none, &trial(), "rig.toml", place, &["`guidewire.sections` is empty"]);
    // A solid catheter has no bore.
    let solid = rig().replacen("inner_diameter_m = 1.02e-3", "inner_diameter_m = 0.0", 1);
    let place = last_place_of(&solid, "0.89e-3");
    assert_refused(&solid, &trial(), "rig.toml", place, &["inner diameter"]);
}

#[test]
fn the_columns_are_there_if_and_only_if_the_wire_is() {
    const FILE: &str = "trials/000.csv";
    let says = ["`guidewire_insertion_m` is missing", "[guidewire]", "at 0"];
    assert_refused(&rig(), TRIAL, FILE, Place::Line(1), &says);
    let without = trial().replace("guidewire_rotation_rad", "guidewire_drive_fx_N");
    assert_refused(
        &rig(),
        &without,
        FILE,
        Place::Line(1),
        &["`guidewire_rotation_rad` is missing"],
    );
    let place = Place::LineColumn(1, 10);
    assert_refused(RIG, &trial(), FILE, place, &["`guidewire_insertion_m`", "no [guidewire]"]);
    let negative = trial().replace(",0.014,", ",-0.014,");
    let place = Place::LineColumn(3, 10);
    assert_refused(&rig(), &negative, FILE, place, &["guidewire_insertion_m is -0.014"]);
    let gap = trial().replace(",0.014,-0.2", ",0.014,");
    let place = Place::LineColumn(3, 11);
    assert_refused(&rig(), &gap, FILE, place, &["guidewire_rotation_rad", "no value"]);
}

#[test]
fn slips_of_the_unit_are_warned_of() {
    for (old, new, says) in [
        (
            "1.45, youngs_modulus_Pa = 40.0e9",
            "1.45, youngs_modulus_Pa = 40.0e12",
            "stiffer than steel",
        ),
        ("6450.0", "6.45", "g/cm³?"),
        ("curvature_per_m = 200.0", "curvature_per_m = 0.2", "per millimetre?"),
    ] {
        assert!(GUIDEWIRE.contains(old), "{old}");
        let rig = RIG.to_owned() + &GUIDEWIRE.replacen(old, new, 1);
        let bundle = open_with(&rig, &trial()).unwrap();
        let line = rig[..rig.find("[guidewire]").unwrap()].matches('\n').count() + 1;
        let of_the_wire = |place| matches!(place, Place::LineColumn(at, _) if at > line);
        let warned =
            bundle.warnings.iter().any(|w| w.message.contains(says) && of_the_wire(w.place));
        assert!(warned, "{new}: {:?}", bundle.warnings);
    }
    for (old, new, says) in [
        (",0.019,", ",19.0,", "guidewire_insertion_m reaches 19, the instrument is only"),
        (",0.019,", ",1900.0,", "millimetres?"),
        (",0.4\n", ",400.0\n", "guidewire_rotation_rad reaches 400"),
    ] {
        let bundle = open_with(&rig(), &trial().replacen(old, new, 1)).unwrap();
        assert!(bundle.warnings.iter().any(|w| w.message.contains(says)), "{:?}", bundle.warnings);
    }
}

#[test]
fn the_image_carries_the_wire() {
    let bundle = open_with(&rig(), &trial()).unwrap();
    let (image, _) = device_image(&bundle, &ImageOptions::default()).unwrap();
    let config = decode(&image).unwrap();
    let wire = config.model.description().guidewire.as_ref().unwrap();
    let [tip, base] = &wire.sections[..] else { panic!("two sections") };
    assert_eq!((tip.length_m, base.length_m), (0.05, 1.45));
    // π/4 0.445⁴ mm⁴ = 0.0307986 mm⁴; π 0.445² mm² = 0.622114 mm²
    let near = |a: f32, b: f64| assert!((f64::from(a) - b).abs() < 1e-4 * b, "{a} is not {b}");
    near(tip.bending_stiffness_n_m2, 2e9 * 0.030_798_6e-12);
    near(base.torsional_stiffness_n_m2, 40e9 * 0.030_798_6e-12 / 1.3);
    near(base.mass_kg_per_m, 6450.0 * 0.622_114e-6);
    near(wire.outer_radius_m, 0.445e-3);
    near(wire.precurve[0].curvature_per_m, 200.0);
    assert_eq!(
        config.model.description(),
        &to_description(&bundle, &SolverDefaults::default()).unwrap()
    );
}

#[test]
fn a_tip_of_the_wire_needs_a_wire() {
    let options = ImageOptions { guidewire_tip: Tip::find("j"), ..ImageOptions::default() };
    let (image, _) = device_image(&open_with(&rig(), &trial()).unwrap(), &options).unwrap();
    let config = decode(&image).unwrap();
    let description = config.model.description();
    let wire = description.guidewire.as_ref().unwrap();
    assert!((wire.precurve[0].curvature_per_m - 1.0 / 3e-3).abs() < 1e-2);
    assert_eq!(description.instrument.precurve[0].curvature_per_m, 83.0, "the catheter's stays");
    let error = device_image(&open_with(RIG, TRIAL).unwrap(), &options).unwrap_err();
    assert!(matches!(error, ImageBuildError::NoGuidewire), "{error}");
    assert!(error.to_string().contains("fix: "), "{error}");
}

#[test]
fn two_solves_are_too_much_for_a_tick_with_a_wire() {
    let parameters = vec![("solver.solves".to_owned(), 2.0)];
    let options = ImageOptions { parameters, ..ImageOptions::default() };
    let error = device_image(&open_with(&rig(), &trial()).unwrap(), &options).unwrap_err();
    assert!(matches!(error, ImageBuildError::Overlong(_)), "{error}");
    assert!(error.to_string().contains("guidewire"), "{error}");
}

#[test]
fn half_ticks_are_too_much_for_a_tick_with_a_wire() {
    let rigid = rig().replace("wall_stiffness_N_per_m = 4000.0", "wall_stiffness_N_per_m = 4e5");
    let bundle = open_with(&rigid, &trial()).unwrap();
    let error = device_image(&bundle, &ImageOptions::default()).unwrap_err();
    assert!(matches!(error, ImageBuildError::Overlong(_)), "{error}");
    assert!(error.to_string().contains("near-rigid wall asks for, with a guidewire"), "{error}");
}

/// Where they overlap, their weight is the sum of both minus the water that the catheter displaces.
#[test]
fn a_fluid_carries_its_share_of_both() {
    let rig =
        rig().replace("fluid = \"none\"", "fluid = \"water\"\nfluid_density_kg_per_m3 = 1000.0");
    let bundle = open_with(&rig, &trial()).unwrap();
    let description = describe::<f64>(bundle.catheter().unwrap(), &SolverDefaults::default(), 1e-3);
    let disc = |d: f64| 0.25 * std::f64::consts::PI * d * d;
    let mass = 1100.0 * (disc(1.65e-3) - disc(1.02e-3)) + 6450.0 * disc(0.89e-3);
    let expected = -9.81 * (mass - 1000.0 * disc(1.65e-3));
    let weight = description.gravity_m_per_s2[2]
        * (description.instrument.sections[0].mass_kg_per_m
            + description.guidewire.unwrap().sections[0].mass_kg_per_m);
    assert!((weight - expected).abs() < 1e-9, "{weight} {expected}");
}
