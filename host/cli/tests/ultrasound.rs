//! `cathforce ultrasound`, as people meet it.

#![cfg(feature = "wall")]

mod support;

use std::fs;
use std::path::Path;

use cathforce_camera::Picture;
use serde_json::Value;
use support::{assert_fails, cathforce, stderr, text};

/// A small block with few elements, linear, so that a test takes seconds.
const DESCRIPTION: &str = r#"
format = "ultrasound/1"
law = "linear"
[block]
size_mm = [60.0, 50.0, 30.0]
vessel_diameter_mm = 8.0
vessel_depth_mm = 11.0
[elements]
outwards = 2
around = 12
along = 5
[probe]
face_mm = [40.0, 8.0]
[masks]
size_px = [120, 110]
pixel_mm = 0.1
origin_mm = [-6.0, 5.5]
[[pose]]
at_mm = [-4.0, 0.0]
[[pose]]
at_mm = [5.0, 1.0]
turn_deg = 15.0
[[image]]
pose = 1
force_n = 4.0
mask = "a.png"
[[image]]
pose = 1
force_n = 8.0
mask = "b.png"
[[image]]
pose = 2
force_n = 8.0
mask = "c.png"
[search]
youngs_modulus_kpa = [60.0, 850.0]
poissons_ratio = [0.47, 0.49]
"#;

/// Masks of 500 kPa and 0.48 in a folder `masks`.
fn rendered(folder: &Path) {
    let (description, out) = (folder.join("block.toml"), folder.join("masks"));
    fs::write(&description, DESCRIPTION).unwrap();
    let output = cathforce([
        "ultrasound",
        "render",
        text(&description),
        "--youngs-modulus-kpa",
        "500",
        "--poissons-ratio",
        "0.48",
        "--noise",
        "--out",
        text(&out),
    ]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(fs::read_dir(&out).unwrap().count(), 4);
    assert!(String::from_utf8(output.stdout).unwrap().contains("cathforce ultrasound fit"));
}

#[test]
fn a_fit_finds_what_was_rendered() {
    let folder = tempfile::tempdir().unwrap();
    rendered(folder.path());
    let description = folder.path().join("masks/description.toml");
    let out = folder.path().join("fit.json");
    let output = cathforce(["ultrasound", "fit", text(&description), "--out", text(&out)]);
    assert!(output.status.success(), "{}", stderr(&output));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("kPa, 95 % interval") && table.contains("epochs"), "{table}");
    let json: Value = serde_json::from_slice(&fs::read(&out).unwrap()).unwrap();
    let youngs = &json["youngs_modulus_kpa"];
    let (found, sd) = (youngs["value"].as_f64().unwrap(), youngs["sd"].as_f64().unwrap());
    // Three masks tell little: the truth lies within the interval, and the interval is no wider than this.
    assert!((found - 500.0).abs() < 1.96 * sd && sd < 60.0, "{youngs}");
    assert!(json["mean_overlap"].as_f64().unwrap() > 0.85, "{json}");
    assert_eq!(json["images"].as_array().unwrap().len(), 3);
    // So few masks do not tell Poisson's ratio, which is said, in text and in JSON.
    let is_told = json["nu"] == "from the data";
    assert!(is_told || json["nu"] == "cannot be told from this data", "{json}");
    assert_eq!(!is_told, table.contains("nu: cannot be told from this data"), "{table}");
}

/// Each is refused with the file, the cause and a fix, and nothing is written.
#[test]
fn bad_masks_and_descriptions_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    rendered(folder.path());
    let masks = folder.path().join("masks");
    let (description, out) = (masks.join("description.toml"), folder.path().join("fit.json"));
    let refused = |words: &[&str]| {
        let output = cathforce(["ultrasound", "fit", text(&description), "--out", text(&out)]);
        assert_fails(&output, 3, words);
        assert!(stderr(&output).contains("fix:") && !out.exists(), "{}", stderr(&output));
    };
    let good = fs::read(masks.join("b.png")).unwrap();
    fs::write(masks.join("b.png"), "no picture").unwrap();
    refused(&["b.png", "not a PNG"]);
    fs::remove_file(masks.join("b.png")).unwrap();
    refused(&["b.png", "cannot be read"]);
    fs::write(masks.join("b.png"), good).unwrap();
    let changed = |from: &str, to: &str| {
        assert!(DESCRIPTION.contains(from), "{from}");
        fs::write(&description, DESCRIPTION.replacen(from, to, 1)).unwrap();
    };
    changed("[120, 110]", "[110, 120]");
    refused(&["a.png", "120 × 110 pixels, and the description says 110 × 120"]);
    changed("pixel_mm", "pixels_mm");
    refused(&["description.toml:", "unknown field `pixels_mm`"]);
    changed("pose = 2", "pose = 7");
    refused(&["description.toml", "has pose 7, and there are 2"]);
    changed("[60.0, 850.0]", "[850.0, 60.0]");
    refused(&["description.toml", "runs from 850 to 60"]);
    changed("at_mm = [5.0, 1.0]", "at_mm = [5.0, 30.0]");
    refused(&["description.toml", "% of the probe's face at (5.0, 30.0) mm"]);
    changed("vessel_depth_mm = 11.0", "vessel_depth_mm = 4.2");
    refused(&["description.toml", "0.20 mm of tissue"]);
}

#[test]
fn an_empty_mask_and_a_photograph_are_no_masks() {
    let folder = tempfile::tempdir().unwrap();
    rendered(folder.path());
    let masks = folder.path().join("masks");
    let description = masks.join("description.toml");
    for (values, words) in [(1, "the mask is empty"), (7, "it is not a mask: it has 7 grey values")]
    {
        let pixels: Vec<u8> = (0..120 * 110).map(|k| (k % values) as u8).collect();
        let picture = Picture::from_bytes(120, 110, &pixels).unwrap();
        picture.write(&masks.join("a.png")).unwrap();
        assert_fails(
            &cathforce(["ultrasound", "fit", text(&description)]),
            3,
            &["a.png", words, "fix:"],
        );
    }
}

#[test]
fn a_folder_that_is_there_stays_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    rendered(folder.path());
    let arguments = |modulus: &'static str, out: &'static str| {
        let mut command = support::command();
        command.current_dir(folder.path()).args(["ultrasound", "render", "block.toml"]);
        command.args(["--youngs-modulus-kpa", modulus, "--poissons-ratio", "0.48", "--out", out]);
        command.output().unwrap()
    };
    assert_fails(&arguments("500", "masks"), 2, &["masks exists already", "fix:"]);
    assert_fails(&arguments("-5", "other"), 2, &["a number of kilopascals above 0"]);
    assert!(!folder.path().join("other").exists());
}
