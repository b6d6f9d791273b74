//! Rigs of bundles that somebody else made.

mod support;

use std::path::Path;

use cathforce_blind_test::{BlindTest, GivenError, Stand};
use support::{changed, short};

fn columns(path: &Path, names: &[&str]) -> Vec<Vec<f64>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let headers = reader.headers().unwrap().clone();
    let at = |name: &&str| headers.iter().position(|header| header == *name).unwrap();
    let at: Vec<usize> = names.iter().map(at).collect();
    let row = |row: csv::StringRecord| at.iter().map(|k| row[*k].parse().unwrap()).collect();
    reader.records().map(|record| row(record.unwrap())).collect()
}

#[test]
fn a_reality_goes_as_the_bundle_went_and_feels_what_it_felt() {
    let folder = tempfile::tempdir().unwrap();
    let given = folder.path().join("given");
    changed(&given, 500, "", "");
    let stand = Stand::of_bundle(&given).unwrap();
    assert_eq!(stand.motions.len(), 2, "its own, and one that is withheld");
    let played = stand.play(&[]).unwrap();
    let made = folder.path().join("made");
    stand.write(&made, "none", &played, 3).unwrap();
    let same = |file: &str| {
        let read = |folder: &Path| std::fs::read(folder.join(file)).unwrap();
        assert!(read(&given) == read(&made), "{file}");
    };
    same("rig.toml");
    same("centreline.csv");
    let names = ["t_s", "insertion_m", "rotation_rad", "fx_N", "fy_N", "fz_N"];
    let [theirs, ours] =
        [&given, &made].map(|folder| columns(&folder.join("trials/000.csv"), &names));
    // The bundle's first row is the moment from which a reality goes on.
    let (mut error, mut size, mut noise) = (0.0, 0.0, 0.0);
    for (a, b) in theirs[1..].iter().zip(&ours) {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < 2e-4), "{a:?} {b:?}");
        let square = |of: &dyn Fn(usize) -> f64| (3..6).map(|k| of(k).powi(2)).sum::<f64>();
        error += square(&|k| a[k] - b[k]);
        size += square(&|k| a[k]);
        noise += 6.0 * stand.accuracy.force_n.powi(2);
    }
    assert!(error - noise < 0.02 * size, "{error:e} with {noise:e} of noise among {size:e}");
    assert!(size > 4.0 * noise, "the instrument touches the wall");
}

#[test]
fn bundles_that_no_reality_can_follow_are_refused_with_the_reason() {
    let refused = |from: &str, to: &str| {
        let folder = tempfile::tempdir().unwrap();
        changed(folder.path(), 3, from, to);
        Stand::of_bundle(folder.path()).unwrap_err().to_string()
    };
    let entry = refused("position_m = [0.000000", "position_m = [0.100000");
    assert!(entry.contains("rig.toml: the entry is not at the origin"), "{entry}");
    let section = "sections = [";
    let third = "sections = [\n  { length_m = 0.1, youngs_modulus_Pa = 1e7 },";
    let sections = refused(section, third);
    assert!(sections.contains("one section or two\n  fix: "), "{sections}");
    let tendon = refused("[vessel]", "[tendon]\n[vessel]");
    assert!(tendon.contains("steered by a tendon") && tendon.contains("\n  fix: "), "{tendon}");
    let folder = tempfile::tempdir().unwrap();
    changed(folder.path(), 3, "", "");
    std::fs::remove_file(folder.path().join("trials/000.csv")).unwrap();
    let nothing = Stand::of_bundle(folder.path()).unwrap_err();
    assert!(matches!(nothing, GivenError::Unfit { .. }), "{nothing}");
    std::fs::remove_dir(folder.path().join("trials")).unwrap();
    let nothing = Stand::of_bundle(folder.path()).unwrap_err();
    assert!(matches!(nothing, GivenError::File { .. }), "{nothing}");
}

#[test]
fn cases_of_one_rig_do_not_get_into_a_folder_of_another() {
    let folder = tempfile::tempdir().unwrap();
    let blind_test = BlindTest::at(folder.path());
    blind_test.make(Some(3), 1, 5, &[short()], &|| {}).unwrap();
    assert!(blind_test.make(Some(3), 2, 5, &Stand::all_own(), &|| {}).is_err());
    assert!(!folder.path().join("cases/001").exists());
}

#[test]
fn where_a_vessel_divides_elsewhere_is_a_doubt_of_the_floor() {
    let stand = short();
    let unchanged = stand.unchanged().unwrap();
    let mut elsewhere = stand.clone();
    elsewhere.rig.blend_m *= 0.5;
    let own = unchanged.divided_as(&elsewhere).unwrap();
    assert_eq!(own.nominal, elsewhere.play(&[]).unwrap());
    assert_eq!(own.doubts[1], [unchanged.nominal, own.nominal.clone()]);
}

#[test]
fn the_tip_of_an_instrument_of_one_section_is_its_curved_end() {
    let folder = tempfile::tempdir().unwrap();
    let (base, tip) =
        ("length_m = 0.6000, youngs", "  { length_m = 0.0500, youngs_modulus_Pa = 50000000.0 },\n");
    changed(folder.path(), 3, base, "length_m = 0.6500, youngs");
    let rig = folder.path().join("rig.toml");
    let text = std::fs::read_to_string(&rig).unwrap();
    assert!(text.contains(tip));
    std::fs::write(&rig, text.replace(tip, "")).unwrap();
    let sections = Stand::of_bundle(folder.path()).unwrap().rig.instrument.sections;
    for ((length_m, modulus_pa), expected_m) in sections.into_iter().zip([0.626, 0.024]) {
        assert!((length_m - expected_m).abs() < 1e-12, "{sections:?}");
        assert_eq!(modulus_pa, 26e6);
    }
}
