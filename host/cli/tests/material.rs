//! `cathforce material` and `cathforce wall`, as people meet them.

#![cfg(feature = "wall")]

mod support;

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;
use support::{assert_fails, cathforce, stderr, text};

/// Load and extension of a neo-Hookean specimen with C10 = 0.08 MPa, 32 mm long and 54 mm² wide.
fn pull(path: &Path) {
    let mut table = String::from("extension_mm,force_N\n");
    for row in 0..20 {
        let stretch = 1.0 + 0.1 * f64::from(row);
        let stress_mpa = 2.0 * 0.08 * (stretch - stretch.powi(-2));
        writeln!(table, "{:.6},{:.8}", 32.0 * (stretch - 1.0), 54.0 * stress_mpa).unwrap();
    }
    fs::write(path, table).unwrap();
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_pull_gives_the_parameters_of_its_law() {
    let folder = tempfile::tempdir().unwrap();
    let (curve, out) = (folder.path().join("pull.csv"), folder.path().join("fit.json"));
    pull(&curve);
    let fit = [
        "material",
        "fit",
        text(&curve),
        "--gauge-mm",
        "32",
        "--area-mm2",
        "54",
        "--out",
        text(&out),
    ];
    let output = cathforce(fit);
    assert!(output.status.success(), "{}", stderr(&output));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("neo-hookean    C10          0.0800"), "{table}");
    let fits = &json(&out)["fits"];
    let found = fits.as_array().unwrap().iter().find(|fit| fit["law"] == "neo-hookean").unwrap();
    let c10_pa = found["parameters"][0]["value"].as_f64().unwrap();
    assert!((c10_pa / 0.08e6 - 1.0).abs() < 1e-6, "{c10_pa}");
    assert!(found["r_squared"].as_f64().unwrap() > 0.999_999);
    // Ogden's law contains the neo-Hookean one.
    let ogden = fits.as_array().unwrap().iter().find(|fit| fit["law"] == "ogden").unwrap();
    assert!((ogden["parameters"][1]["value"].as_f64().unwrap() - 2.0).abs() < 1e-4);
}

#[test]
fn a_curve_that_is_wrong_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (curve, out) = (folder.path().join("pull.csv"), folder.path().join("fit.json"));
    pull(&curve);
    assert_fails(
        &cathforce(["material", "fit", text(&curve), "--out", text(&out)]),
        3,
        &["pull.csv:1", "--gauge-mm", "--area-mm2"],
    );
    fs::write(&curve, "strain,stress_MPa\n0,0\n100,0.4\n").unwrap();
    assert_fails(&cathforce(["material", "fit", text(&curve)]), 3, &["--stress nominal"]);
    assert_fails(
        &cathforce(["material", "fit", text(&curve), "--stress", "nominal", "--out", text(&out)]),
        3,
        &["pull.csv:3", "per cent", "fix:"],
    );
    assert!(!out.exists());
    assert_fails(&cathforce(["material", "fit", text(&curve), "--law", "ogdn"]), 2, &["ogden"]);
}
