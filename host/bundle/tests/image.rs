//! Bundles to descriptions and device images.

mod support;

use std::fs;

use cathforce_bundle::{
    Bundle, ImageBuildError, ImageOptions, SolverDefaults, WallSource, describe, device_image,
    lumen_from_bundle, to_description,
};
use cathforce_config::Settings;
use cathforce_config::image::decode;
use support::{RIG, example, write_bundle};

#[test]
fn the_examples_image_is_read_back_as_it_was_made() {
    let bundle = Bundle::open(example()).unwrap();
    let options = ImageOptions::default();
    let (image, report) = device_image(&bundle, &options).unwrap();
    assert_eq!(image.len(), report.bytes);
    assert!(matches!(report.lumen.source, WallSource::Mesh { .. }));

    let config = decode(&image).unwrap();
    let expected = to_description::<f32>(&bundle, &options.solver).unwrap();
    assert_eq!(config.model.description(), &expected);
    let (header, bytes, _) = lumen_from_bundle(&bundle, options.cell_m).unwrap();
    assert_eq!(config.lumen.header(), &header);
    assert!(image.ends_with(&bytes), "the lumen is the image's end, the same in every build");
    let settings = Settings { max_insertion_m: report.reach_m as f32, ..options.settings };
    assert_eq!(config.settings, settings);
    assert!(report.reach_m >= bundle.largest_insertion_m().unwrap() + 0.0049);
}

#[test]
fn sections_turn_round_and_stiffness_follows_from_the_tube() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let bundle = Bundle::open(folder.path()).unwrap();
    let description = to_description::<f64>(&bundle, &SolverDefaults::default()).unwrap();
    let [tip, base] = &description.instrument.sections[..] else { panic!("two sections") };
    assert_eq!((tip.length_m, base.length_m), (0.05, 0.60));
    // π/4 (0.825⁴ − 0.51⁴) mm⁴ = 0.310702 mm⁴; π (0.825² − 0.51²) mm² = 1.321126 mm²
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-5 * b.abs(), "{a} is not {b}");
    near(tip.bending_stiffness_n_m2, 50e6 * 0.310_702e-12);
    near(base.bending_stiffness_n_m2, 26e6 * 0.310_702e-12);
    near(tip.torsional_stiffness_n_m2, tip.bending_stiffness_n_m2 / 1.4);
    near(tip.axial_stiffness_n, 50e6 * 1.321_126e-6);
    near(tip.mass_kg_per_m, 1100.0 * 1.321_126e-6);
    near(description.wall.line_stiffness_n_per_m2, 8e5);
    near(description.wall.end_stiffness_n_per_m, 2e3);
    near(description.solver.link_length_m, 1e-3);
    assert_eq!(description.gravity_m_per_s2, [0.0, 0.0, -9.81]);
}

#[test]
fn a_fluid_carries_its_share_of_the_weight() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let rig = RIG.replace("fluid = \"none\"", "fluid = \"water\"\nfluid_density_kg_per_m3 = 550.0");
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let bundle = Bundle::open(folder.path()).unwrap();
    let description = describe::<f64>(bundle.catheter().unwrap(), &SolverDefaults::default(), 1e-3);
    // The displaced fluid has half the density and fills the full disc instead of the ring.
    let ring = 1.0 - (1.02_f64 / 1.65).powi(2);
    let expected = -9.81 * (1.0 - 0.5 / ring);
    assert!((description.gravity_m_per_s2[2] - expected).abs() < 1e-9);
}

#[test]
fn an_image_that_does_not_fit_says_which_grid_would() {
    let bundle = Bundle::open(example()).unwrap();
    let options = ImageOptions { cell_m: 0.5e-3, ..ImageOptions::default() };
    let error = device_image(&bundle, &options).unwrap_err();
    let ImageBuildError::LumenTooLarge(too_large) = &error else { panic!("{error}") };
    let (cell_m, bytes) = too_large.fitting.unwrap();
    assert!(too_large.bytes > 2 << 20 && bytes <= 2 << 20, "{error}");
    assert!(error.to_string().contains("fix: choose a grid of"), "{error}");
    let (_, report) = device_image(&bundle, &ImageOptions { cell_m, ..options }).unwrap();
    assert_eq!(report.lumen.bytes, bytes);
}

#[test]
fn values_beyond_the_model_are_named() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let rig = RIG.replace("wall_stiffness_N_per_m = 4000.0", "wall_stiffness_N_per_m = 4e9");
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let bundle = Bundle::open(folder.path()).unwrap();
    let error = device_image(&bundle, &ImageOptions::default()).unwrap_err();
    assert!(error.to_string().contains("wall.line_stiffness_n_per_m2"), "{error}");
}

/// A stiffness that the model refuses is reported by the key of rig.toml, with line, value and bounds.
#[test]
fn a_number_beyond_the_model_has_its_line_and_what_it_may_be() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    for (old, new, key, may_be) in [
        ("4000.0", "4e9", "vessel.wall_stiffness_N_per_m", "about 0.005 to 5e6"),
        (
            "youngs_modulus_Pa = 50.0e6",
            "youngs_modulus_Pa = 5e13",
            "sections[1].youngs_modulus_Pa",
            "to 3",
        ),
        ("1100.0", "1e9", "instrument.density_kg_per_m3", "to 75"),
        ("83.0", "8300.0", "instrument.tip_precurve[0].curvature_per_m", "-1000 to 1000"),
        ("-9.81", "-981.0", "environment.gravity_m_per_s2", "-100 to 100"),
    ] {
        assert!(RIG.contains(old), "{old}");
        let rig = RIG.replacen(old, new, 1);
        let line = 1 + rig[..rig.find(new).unwrap()].matches('\n').count();
        fs::write(folder.path().join("rig.toml"), rig).unwrap();
        let bundle = Bundle::open(folder.path()).unwrap();
        let said = device_image(&bundle, &ImageOptions::default()).unwrap_err().to_string();
        for part in [&format!("rig.toml:{line}:")[..], key, may_be, "\n  fix: write about"] {
            assert!(said.contains(part), "`{part}` is not in: {said}");
        }
    }
}

#[test]
fn trials_that_go_too_far_are_blamed_and_not_the_links() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let rows = "t_s,insertion_m,rotation_rad\n0,10,0\n0.25,160,0\n";
    fs::write(folder.path().join("trials/000.csv"), rows).unwrap();
    let bundle = Bundle::open(folder.path()).unwrap();
    let error = device_image(&bundle, &ImageOptions::default()).unwrap_err();
    assert!(matches!(error, ImageBuildError::TooFar { .. }), "{error}");
    assert!(error.to_string().contains("as far as 160 m"), "{error}");
}

/// A second solve is refused if a tick has no time for it.
#[test]
fn two_solves_are_asked_for_by_name() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    let parameters = vec![("solver.solves".to_owned(), 2.0)];
    let options = ImageOptions { parameters, ..ImageOptions::default() };
    let bundle = Bundle::open(folder.path()).unwrap();
    let solves = |options| {
        let (image, _) = device_image(&bundle, options).unwrap();
        decode(&image).unwrap().model.description().solver.solves
    };
    assert_eq!((solves(&ImageOptions::default()), solves(&options)), (1, 2));

    let rigid = RIG.replace("wall_stiffness_N_per_m = 4000.0", "wall_stiffness_N_per_m = 4e5");
    fs::write(folder.path().join("rig.toml"), rigid).unwrap();
    let bundle = Bundle::open(folder.path()).unwrap();
    let error = device_image(&bundle, &options).unwrap_err();
    assert!(matches!(error, ImageBuildError::Overlong(_)), "{error}");
    assert!(error.to_string().contains("near-rigid"), "{error}");
    assert!(device_image(&bundle, &ImageOptions::default()).is_ok());
}

#[test]
fn without_trials_the_link_length_has_to_be_given() {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::remove_dir_all(folder.path().join("trials")).unwrap();
    let bundle = Bundle::open(folder.path()).unwrap();
    assert!(bundle.warnings.iter().any(|warning| warning.message.contains("no trials")));
    fs::create_dir(folder.path().join("trials")).unwrap();
    let empty = Bundle::open(folder.path()).unwrap();
    assert_eq!(empty.warnings, bundle.warnings, "an empty folder has none either");
    let error = device_image(&bundle, &ImageOptions::default()).unwrap_err();
    assert!(matches!(error, ImageBuildError::NoTrials), "{error}");
    assert!(error.to_string().contains("fix: add trials/000.csv"), "{error}");
    let options = ImageOptions { link_length_m: Some(2e-3), ..ImageOptions::default() };
    let (image, report) = device_image(&bundle, &options).unwrap();
    assert_eq!(report.lumen.source, WallSource::Centreline { branches: 1 });
    assert!(decode(&image).is_ok());
}
