//! How well a stiffness is found from masks of a known truth: one line for each seed of the noise, the
//! first one without noise.
//!
//! Usage: `cargo run --release -p cathforce-ultrasound --example measure -- DESCRIPTION.toml E_KPA NU
//! SEEDS`; `host/ultrasound/src/example.toml` is a description.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use cathforce_ultrasound::{Description, Fit, ImageNoise, Tissue, fit_reusing, render, sections};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, youngs_modulus_kpa, poissons_ratio, seeds] = &arguments[..] else {
        return Err("give a description, E in kPa, Poisson's ratio, and the number of seeds".into());
    };
    let description = Description::read(Path::new(file))?;
    let truth = Tissue {
        youngs_modulus_kpa: youngs_modulus_kpa.parse()?,
        poissons_ratio: poissons_ratio.parse()?,
    };
    let start = Instant::now();
    let sections = sections(&description, Path::new(""), truth)?;
    println!("truth: {:.1} s", start.elapsed().as_secs_f64());
    let mut known = None;
    for seed in 0..=seeds.parse()? {
        let noise = (seed > 0).then_some((ImageNoise::TYPICAL, seed));
        let images = render(&description, &sections, noise);
        let mesh = description.mesh(Path::new(""), description.elements)?;
        let study = description.study_of(mesh, images);
        let start = Instant::now();
        let (found, response) = fit_reusing(&study, known.take(), &AtomicBool::new(false))?;
        known = Some(response);
        print(seed, truth, &found, start.elapsed().as_secs_f64());
    }
    Ok(())
}

fn print(seed: u64, truth: Tissue, found: &Fit, seconds: f64) {
    let Tissue { youngs_modulus_kpa, poissons_ratio } = found.tissue;
    println!(
        "seed {seed}: E {youngs_modulus_kpa:.1} kPa ({:+.2} %, sd {:.1}), nu {poissons_ratio:.4} ({:+.4}, \
         sd {:.4}) {:?}, overlap {:.3}, {} epochs, {} evaluations, {seconds:.1} s",
        100.0 * (youngs_modulus_kpa / truth.youngs_modulus_kpa - 1.0),
        found.youngs_modulus_kpa.sd,
        poissons_ratio - truth.poissons_ratio,
        found.poissons_ratio.sd,
        found.poissons_ratio_known,
        found.mean_overlap,
        found.epochs.len(),
        found.evaluations
    );
    let profile = found.profile.iter().map(|own| {
        format!("{:.4}: {:.1} kPa {:.5}", own.poissons_ratio, own.youngs_modulus_kpa, own.overlap)
    });
    println!("  {}", profile.collect::<Vec<_>>().join(", "));
}
