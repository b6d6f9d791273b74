//! Tendons whose drives are recorded: `[[tendons]]` of `rig.toml` and their columns.

mod support;

use std::fs;
use std::path::Path;

use cathforce_bundle::{Bundle, BundleError, Place, SolverDefaults, to_description};
use cathforce_mechanics::{Description, DrivenTendon};
use support::{RIG, TRIAL, write_bundle};

const TENDONS: &str = "
[[tendons]]
offset_m = 0.0005
stiffness_N_per_m = 2000.0

[[tendons]]
angle_rad = 3.1
offset_m = 0.0004
anchor_m = 0.002
stiffness_N_per_m = 3000.0
slack_m = 0.0003
static_friction = 0.3
sliding_friction = 0.2
bend_behind_rad = 1.5
";
const FILE: &str = "trials/000.csv";

fn rig() -> String {
    RIG.to_owned() + TENDONS
}

/// The small trial with these columns after its own.
fn with_columns(columns: [&str; 4]) -> String {
    TRIAL.lines().zip(columns).map(|(line, more)| format!("{line},{more}\n")).collect()
}

fn trial() -> String {
    with_columns(["tendon_1_m,tendon_2_m", "0.0,0.0001", "0.001,-0.0005", "0.002,0.0"])
}

fn open_with(rig: &str, trial: &str) -> Result<Bundle, BundleError> {
    let folder = tempfile::tempdir().unwrap();
    write_bundle(folder.path());
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    fs::write(folder.path().join(FILE), trial).unwrap();
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

/// Line and column where `part` begins for the last time.
fn last_place_of(text: &str, part: &str) -> Place {
    let at = text.rfind(part).unwrap();
    let line_start = text[..at].rfind('\n').map_or(0, |end| end + 1);
    Place::LineColumn(text[..at].matches('\n').count() + 1, at - line_start + 1)
}

#[test]
fn a_rigs_tendons_are_the_models_and_their_columns_the_trials() {
    let bundle = open_with(&rig(), &trial()).unwrap();
    assert!(bundle.warnings.is_empty(), "{:?}", bundle.warnings);
    let description: Description<f64> =
        to_description(&bundle, &SolverDefaults::default()).unwrap();
    assert_eq!(description.validate(), Ok(()));
    let plain = DrivenTendon {
        angle_rad: 0.0,
        offset_m: 0.0005,
        anchor_m: 0.0,
        stiffness_n_per_m: 2000.0,
        slack_m: 0.0,
        static_friction: 0.0,
        sliding_friction: 0.0,
        bend_behind_rad: 0.0,
    };
    let full = DrivenTendon {
        angle_rad: 3.1,
        offset_m: 0.0004,
        anchor_m: 0.002,
        stiffness_n_per_m: 3000.0,
        slack_m: 0.0003,
        static_friction: 0.3,
        sliding_friction: 0.2,
        bend_behind_rad: 1.5,
    };
    assert_eq!(description.tendons.as_slice(), [plain, full]);
    let trial = &bundle.trials[0];
    assert_eq!(
        trial.catheter().unwrap().tendons_m,
        [vec![0.0, 0.001, 0.002], vec![0.0001, -0.0005, 0.0]]
    );
    let middle_s = 0.5 * (trial.t_s[0] + trial.t_s[1]);
    for (found, expected) in trial.tendons_at(middle_s).into_iter().zip([5e-4, -2e-4, 0.0, 0.0]) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}

#[test]
fn one_friction_coefficient_stands_for_both() {
    for key in ["static_friction = 0.3\n", "sliding_friction = 0.2\n"] {
        let rig = rig().replacen(key, "", 1);
        let bundle = open_with(&rig, &trial()).unwrap();
        let tendon = bundle.catheter().unwrap().tendons[1];
        assert_eq!(tendon.static_friction, tendon.sliding_friction);
    }
}

#[test]
fn the_columns_are_there_if_and_only_if_the_tendons_are() {
    let missing = ["`tendon_1_m` is missing", "2 [[tendons]]"];
    assert_refused(&rig(), TRIAL, FILE, Place::Line(1), &missing);
    let one = with_columns(["tendon_1_m", "0.0", "0.001", "0.002"]);
    assert_refused(&rig(), &one, FILE, Place::Line(1), &["`tendon_2_m` is missing"]);
    let column = TRIAL.lines().next().unwrap().split(',').count() + 1;
    let stray = ["`tendon_1_m` is of a tendon", "0 [[tendons]]", "table [[tendons]]"];
    assert_refused(RIG, &trial(), FILE, Place::LineColumn(1, column), &stray);
    let third = with_columns(["tendon_1_m,tendon_2_m,tendon_3_m", "0,0,0", "0,0,0", "0,0,0"]);
    let place = Place::LineColumn(1, column + 2);
    assert_refused(&rig(), &third, FILE, place, &["`tendon_3_m`", "2 [[tendons]]"]);
    let gap = trial().replace(",0.001,-0.0005", ",0.001,");
    let place = Place::LineColumn(3, column + 1);
    assert_refused(&rig(), &gap, FILE, place, &["tendon_2_m", "no value"]);
    let misspelt = trial().replace("tendon_2_m", "tendon2_m");
    let error = open_with(&rig(), &misspelt).unwrap_err().to_string();
    assert!(error.contains("tendon_2_m"), "{error}");
}

#[test]
fn a_tendon_that_nothing_can_have_is_refused_with_its_place() {
    let refused = |good: &str, bad: &str, at: &str, says: &[&str]| {
        let rig = rig().replacen(good, bad, 1);
        assert!(rig.contains(bad), "the test replaces nothing");
        assert_refused(&rig, &trial(), "rig.toml", last_place_of(&rig, at), says);
    };
    let radius = "the instrument's outer radius";
    refused("offset_m = 0.0004", "offset_m = 0.0044", "0.0044", &["tendons[1].offset_m", radius]);
    refused("anchor_m = 0.002", "anchor_m = 20.0", "20.0", &["anchor_m", "ends on the instrument"]);
    refused("= 3000.0", "= 0.0", "0.0\nslack", &["stiffness_N_per_m", "between 1 and"]);
    refused("slack_m = 0.0003", "slack_m = 0.3", "0.3\nstatic", &["slack_m", "0.02 m"]);
    refused(
        "sliding_friction = 0.2",
        "sliding_friction = 0.4",
        "0.4",
        &["at most static_friction"],
    );
    refused("bend_behind_rad = 1.5", "bend_behind_rad = 15.0", "15.0", &["4 over static_friction"]);
    refused("slack_m", "slak_m", "slak_m", &["mean `slack_m`?"]);
    let five = rig() + &"\n[[tendons]]\noffset_m = 0.0005\nstiffness_N_per_m = 2000.0\n".repeat(3);
    let error = open_with(&five, &trial()).unwrap_err().to_string();
    assert!(error.contains("5 tables [[tendons]]") && error.contains("at most 4"), "{error}");
    let fixed = "\n[tendon]\npull_m = 0.002\nstiffness_N_per_m = 2000.0\noffset_m = 0.0005\n\
                 length_m = 0.03\n";
    let error = open_with(&(rig() + fixed), &trial()).unwrap_err().to_string();
    assert!(error.contains("[tendon] with a fixed pull") && error.contains("fix: "), "{error}");
}

#[test]
fn slips_of_the_unit_are_warned_of() {
    let counts = trial().replace("0.002,0.0", "4000,0.0").replace("0.001,-0.0005", "2000,-0.0005");
    let bundle = open_with(&rig(), &counts).unwrap();
    let says = "tendon_1_m reaches 4000, more than 0.05 m: millimetres or counts?";
    assert!(bundle.warnings.iter().any(|w| w.message == says), "{:?}", bundle.warnings);
}
