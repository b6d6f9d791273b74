//! Files of tensile tests: both kinds, and everything that is wrong with the others.

use std::fmt::Write as _;

use cathforce_material::{Curve, ReadOptions, Specimen, StressMeasure, read_curve};

fn read(text: &str, options: &ReadOptions) -> Result<Curve, String> {
    let folder = std::env::temp_dir().join(format!(
        "cathforce-material-{}-{:?}",
        std::process::id(),
        std::thread::current().id()
    ));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("curve.csv");
    std::fs::write(&file, text).unwrap();
    let read = read_curve(&file, options).map_err(|error| error.to_string());
    std::fs::remove_dir_all(&folder).unwrap();
    read
}

/// Eight rows of `of(0) … of(7)` under a heading.
fn table(heading: &str, of: impl Fn(f64) -> (f64, f64)) -> String {
    let mut text = format!("{heading}\n");
    for row in 0..8 {
        let (a, b) = of(f64::from(row));
        writeln!(text, "{a:?},{b:?}").unwrap();
    }
    text
}

fn refused(text: &str, options: &ReadOptions, words: &[&str]) {
    let error = read(text, options).unwrap_err();
    for word in words.iter().chain(&["fix:"]) {
        assert!(error.contains(word), "`{word}` in: {error}");
    }
}

const PESCIO: ReadOptions = ReadOptions {
    specimen: Specimen { gauge_m: Some(32e-3), area_m2: Some(54e-6) },
    measure: None,
};

#[test]
fn the_same_test_in_every_unit_is_the_same_curve() {
    let none = ReadOptions::default();
    let base =
        read(&table("stretch,nominal_stress_MPa", |x| (1.0 + 0.25 * x, 0.1 * x)), &none).unwrap();
    assert_eq!(base.measure, StressMeasure::Nominal);
    for (text, options) in [
        (table("strain,engineering_stress_kPa", |x| (0.25 * x, 100.0 * x)), none),
        (table("strain_percent,nominal_stress_Pa", |x| (25.0 * x, 1e5 * x)), none),
        (table("extension_mm,force_N", |x| (8.0 * x, 5.4 * x)), PESCIO),
        (table("Extension [m],Load (kN)", |x| (8e-3 * x, 5.4e-3 * x)), PESCIO),
        (
            table("stretch,stress_MPa", |x| (1.0 + 0.25 * x, 0.1 * x)),
            ReadOptions { measure: Some(StressMeasure::Nominal), ..none },
        ),
    ] {
        let curve = read(&text, &options).unwrap();
        for (a, b) in curve.points.iter().zip(&base.points) {
            assert!((a.stretch - b.stretch).abs() < 1e-12, "{text}");
            assert!((a.stress_pa - b.stress_pa).abs() < 1e-6, "{text}");
        }
    }
    let truth = read(&table("stretch,true_stress_MPa", |x| (1.0 + x, x)), &none).unwrap();
    assert_eq!(truth.measure, StressMeasure::True);
}

#[test]
fn wrong_units_are_named() {
    let none = ReadOptions::default();
    let percent = table("strain,nominal_stress_MPa", |x| (50.0 * x, 0.1 * x));
    refused(&percent, &none, &["curve.csv:3", "350", "per cent", "strain_percent"]);
    let percent = table("stretch,nominal_stress_MPa", |x| (100.0 + 50.0 * x, 0.1 * x));
    refused(&percent, &none, &["curve.csv:2", "per cent"]);
    let strain = table("stretch,nominal_stress_MPa", |x| (0.5 * x, 0.1 * x));
    refused(&strain, &none, &["curve.csv:2", "begins near 1", "`strain`"]);
    let counts = table("extension_mm,force_N", |x| (8.0 * x, 5.4e6 * x + 0.5));
    refused(&counts, &PESCIO, &["curve.csv:9", "counts", "counts per newton"]);
    let mut counts = String::from("extension_mm,force_N\n");
    for row in 0..8 {
        writeln!(counts, "{},{}", 8 * row, 1213 * row).unwrap();
    }
    refused(&counts, &PESCIO, &["curve.csv:9", "whole numbers", "8491"]);
    refused(&table("extension_mm,force_counts", |x| (x, x)), &PESCIO, &["curve.csv:1", "no unit"]);
    let pascal = table("stretch,nominal_stress_MPa", |x| (1.0 + x, 1e5 * x));
    refused(&pascal, &none, &["more than any polymer bears", "Pa, kPa or MPa"]);
}

#[test]
fn what_a_heading_leaves_open_is_asked_for() {
    let none = ReadOptions::default();
    let unstated = table("stretch,stress_MPa", |x| (1.0 + x, x));
    refused(&unstated, &none, &["nominal or true", "--stress"]);
    let load = table("extension_mm,force_N", |x| (x, x));
    refused(&load, &none, &["unloaded length", "cross-section", "--gauge-mm", "--area-mm2"]);
    refused(
        &table("stretch,colour", |x| (x, x)),
        &none,
        &["no column `colour`", "of stress or force"],
    );
    refused(&table("stretch,forse_N", |x| (x, x)), &none, &["did you mean `force_N`?"]);
    let twice = table("stretch,strain", |x| (x, x));
    refused(&twice, &none, &["`stretch` and `strain` say the same twice"]);
    let contradiction = ReadOptions { measure: Some(StressMeasure::True), ..none };
    let nominal = table("stretch,nominal_stress_MPa", |x| (1.0 + x, x));
    refused(&nominal, &contradiction, &["`--stress true` says otherwise"]);
}

#[test]
fn bad_rows_are_all_named_with_their_lines() {
    let none = ReadOptions::default();
    let good = table("stretch,nominal_stress_MPa", |x| (1.0 + x, x));
    refused(
        &good.replace("3.0,2.0", "3.0,nan").replace("5.0,4.0", "five,4.0"),
        &none,
        &[
            "curve.csv:4: column `nominal_stress_MPa`: `nan` is not a finite number",
            "curve.csv:6: column `stretch`: `five` is not a number",
        ],
    );
    refused(&good.replace("3.0,2.0", "3.0,"), &none, &["curve.csv:4", "no value"]);
    refused(
        &good.replace("5.0,4.0", "2.5,4.0"),
        &none,
        &["curve.csv:6", "falls from 4.0000 to 2.5000"],
    );
    let short: String = good.lines().take(5).fold(String::new(), |all, line| all + line + "\n");
    refused(&short, &none, &["4 rows", "at least 6 rows"]);
    refused("stretch,nominal_stress_MPa\n", &none, &["0 rows"]);
    let falling = table("stretch,nominal_stress_MPa", |x| (1.0 + x, 1.0 - x));
    refused(&falling, &none, &["does not grow"]);
    let ragged = good.replace("3.0,2.0", "3.0,2.0,7.0");
    refused(&ragged, &none, &["curve.csv:4", "is no table"]);
    let error = read_curve(std::path::Path::new("nowhere.csv"), &none).unwrap_err().to_string();
    assert!(error.starts_with("nowhere.csv: cannot be read"), "{error}");
}
