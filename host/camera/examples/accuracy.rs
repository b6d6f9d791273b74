//! How far tip and shape are off, and how long a frame takes: a recording of 3 s at 30 Hz and 23 mm/s,
//! rendered under several conditions.
//!
//!     cargo run --release -p cathforce-camera --example accuracy [STEP]
//!
//! takes every STEP-th frame.

use cathforce_camera::render::film::Film;
use cathforce_camera::render::study::{Study, conditions, mean_and_worst};

fn main() {
    let study = Study::new(&Film::webcam()).unwrap_or_else(|error| panic!("{error}"));
    let quality = &study.calibrated.calibration.quality;
    println!(
        "calibration: {} pictures, reprojection {:.3} px, worst picture {:.3} px",
        quality.pictures, quality.reprojection_rms_px, quality.worst_picture_px
    );
    println!(
        "plane: {:.3} px, worst {:.3} mm",
        study.plane.quality.rms_px,
        1e3 * study.plane.quality.worst_m
    );
    let step = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1);
    let frames = (0..90).step_by(step);
    let lengths_m: Vec<f64> = frames.map(|k| 0.045 + 0.023 * f64::from(k) / 30.0).collect();
    println!(
        "| condition | frames | missed | tip mean | tip worst | shape RMS mean | worst | ms a frame |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for condition in conditions() {
        let errors = study.errors(&condition, &lengths_m);
        let errors = errors.unwrap_or_else(|why| panic!("{why:?}"));
        let [tip, tip_worst] = mean_and_worst(&errors.tip_m).map(|m| 1e3 * m);
        let [shape, shape_worst] = mean_and_worst(&errors.shape_rms_m).map(|m| 1e3 * m);
        println!(
            "| {} | {} | {} | {tip:.3} mm | {tip_worst:.3} mm | {shape:.3} mm | {shape_worst:.3} mm | {:.1} |",
            condition.name,
            errors.frames,
            errors.missed.len(),
            1e3 * errors.seconds_a_frame
        );
        if let Some(miss) = errors.missed.first() {
            println!("first miss: {miss}");
        }
    }
}
