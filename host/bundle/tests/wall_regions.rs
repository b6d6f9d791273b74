//! Parts of a wall that are stiffer or softer than the rest: `wall_regions` of `[vessel]`.

mod support;

use std::fs;

use cathforce_bundle::geometry::SurfaceModel;
use cathforce_bundle::{
    Bundle, ImageBuildError, ImageOptions, LumenBuildError, Vessel, device_image,
};
use cathforce_config::image::decode;
use cathforce_mechanics::{Drive, Model, Outputs, State, settle, step};
use support::{RIG, assert_refused, example};

const STIFFNESS: &str = "wall_stiffness_N_per_m = 4000.0";
/// Insertion at which the example's tip slides along the wall \[m\].
const FED_M: f64 = 0.05;
const TICKS: usize = 300;
const FEED_M_PER_TICK: f64 = 1.3e-5;

fn regions(regions: &str) -> String {
    format!("{STIFFNESS}\nwall_regions = [ {regions} ]")
}

/// The example with its wall's stiffness replaced.
fn example_with(stiffness: &str) -> Bundle {
    let folder = tempfile::tempdir().unwrap();
    for file in ["vessel.stl", "centreline.csv", "trials/000.csv"] {
        let to = folder.path().join(file);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(example().join(file), to).unwrap();
    }
    let rig = fs::read_to_string(example().join("rig.toml")).unwrap();
    assert!(rig.contains(STIFFNESS), "the test replaces nothing");
    fs::write(folder.path().join("rig.toml"), rig.replacen(STIFFNESS, stiffness, 1)).unwrap();
    Bundle::open(folder.path()).unwrap()
}

/// Forces of the model while the instrument is fed.
fn fed(stiffness: &str) -> Vec<Outputs<f32>> {
    let options = ImageOptions { link_length_m: Some(2e-3), ..ImageOptions::default() };
    let (image, _) = device_image(&example_with(stiffness), &options).unwrap();
    let config = decode(&image).unwrap();
    let mut state = State::new();
    let drive = |insertion_m: f64| Drive { insertion_m: insertion_m as f32, rotation_rad: 0.0 };
    while !settle(&config.model, &config.lumen, &mut state, drive(FED_M)) {}
    let fed = |tick: usize| drive(FED_M + FEED_M_PER_TICK * tick as f64);
    (1..=TICKS).map(|tick| step(&config.model, &config.lumen, &mut state, fed(tick))).collect()
}

fn force_n(outputs: &Outputs<f32>) -> f64 {
    outputs.force_on_vessel_n.iter().map(|f| f64::from(*f).powi(2)).sum::<f64>().sqrt()
}

/// Largest difference of two runs over the largest force of the first.
fn difference(a: &[Outputs<f32>], b: &[Outputs<f32>]) -> f64 {
    let off = a.iter().zip(b).map(|(a, b)| (force_n(a) - force_n(b)).abs()).fold(0.0, f64::max);
    off / a.iter().map(force_n).fold(0.0, f64::max)
}

#[test]
fn a_region_that_holds_the_whole_vessel_is_a_wall_of_another_stiffness() {
    let everywhere = "{ centre_m = [0.05, 0.0, 0.0], radius_m = 0.5, stiffness_ratio = 4.0 }";
    let region = fed(&regions(everywhere));
    let whole = fed("wall_stiffness_N_per_m = 16000.0");
    assert!(difference(&whole, &region) < 1e-3, "{}", difference(&whole, &region));
    let nominal = fed(STIFFNESS);
    assert!(difference(&nominal, &region) > 0.02, "{}", difference(&nominal, &region));
}

#[test]
fn a_region_counts_where_it_is_touched_and_nowhere_else() {
    let nominal = fed(STIFFNESS);
    let ahead = "{ centre_m = [0.09, 0.0139, 0.0], radius_m = 0.004, stiffness_ratio = 10.0 }";
    assert_eq!(difference(&nominal, &fed(&regions(ahead))), 0.0);
    let here = "{ centre_m = [0.05, 0.0, 0.0], radius_m = 0.02, stiffness_ratio = 10.0 }";
    let touched = fed(&regions(here));
    assert!(difference(&nominal, &touched) > 0.02, "{}", difference(&nominal, &touched));
}

#[test]
fn a_near_rigid_region_asks_for_half_ticks_as_a_near_rigid_wall_does() {
    let options = ImageOptions { link_length_m: Some(2e-3), ..ImageOptions::default() };
    let substeps = |ratio: f64| {
        let region = format!(
            "{{ centre_m = [0.05, 0.0, 0.0], radius_m = 0.01, stiffness_ratio = {ratio} }}"
        );
        let (image, _) = device_image(&example_with(&regions(&region)), &options).unwrap();
        let model: Model<f32> = decode(&image).unwrap().model;
        model.description().solver.substeps
    };
    assert_eq!([substeps(10.0), substeps(20.0)], [1, 2]);
}

#[test]
fn a_wall_that_an_effect_makes_near_rigid_gets_half_ticks() {
    let substeps = |factor: f32| {
        let parameters = vec![("effects.wall.stiffness.factor".to_owned(), factor)];
        let link_length_m = Some(2e-3);
        let options = ImageOptions { link_length_m, parameters, ..ImageOptions::default() };
        let (image, _) = device_image(&example_with(STIFFNESS), &options).unwrap();
        let model: Model<f32> = decode(&image).unwrap().model;
        model.description().solver.substeps
    };
    assert_eq!([substeps(10.0), substeps(20.0)], [1, 2]);
}

#[test]
fn regions_that_nothing_can_have_are_refused_with_their_place() {
    let refused = |region: &str, at: &str, says: &str| {
        assert_refused(&RIG.replacen(STIFFNESS, &regions(region), 1), "wall_regions", at, says);
    };
    let with = |rest: &str| format!("{{ centre_m = [0.0, 0.0, 0.0], {rest} }}");
    refused(&with("radius_m = 0.01, stiffness_ratio = 1000.0"), "1000.0", "between 0.01 and 100");
    refused(&with("radius_m = 0.0, stiffness_ratio = 2.0"), "0.0, stiff", "above 0");
    refused(&with("radius_m = 0.01, stifness_ratio = 2.0"), "stifness", "mean `stiffness_ratio`?");
    refused(&with("radius_m = 0.01"), "{ centre", "stiffness_ratio` is missing");
}

#[test]
fn a_region_that_holds_no_wall_is_refused() {
    let aside = "{ centre_m = [0.05, 0.1, 0.0], radius_m = 0.01, stiffness_ratio = 4.0 }";
    let bundle = example_with(&regions(aside));
    let error = Vessel::from_bundle(&bundle, SurfaceModel::default()).err().unwrap();
    let LumenBuildError::Bundle(_) = &error else { panic!("{error}") };
    let text = error.to_string();
    for part in ["rig.toml: ", "wall_regions[0]", "holds no wall", "its radius is 10.0 mm", "fix: "]
    {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
    let image = device_image(&bundle, &ImageOptions::default());
    assert!(matches!(image, Err(ImageBuildError::Lumen(_))), "{image:?}");
}
