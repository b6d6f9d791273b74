//! A case as a trial bundle: the nominal rig, and what was measured on the real one.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use crate::noise::Noise;
use crate::play::Trial;
use crate::rigs::{CONTACT_SPACING_M, GRAVITY_M_PER_S2, Rig, TANGENTIAL_RATIO};

/// White noise of a row: force and drive force \[N\], tip \[m\].
pub const FORCE_NOISE_N: f64 = 2e-3;
pub const DRIVE_NOISE_N: f64 = 2e-3;
pub const TIP_NOISE_M: f64 = 1.5e-4;
/// Rows between two of the tip: 25 a second.
const TIP_EVERY: usize = 10;
/// Zero of the force sensor from trial to trial, which is no effect \[N\].
const ZERO_SD_N: f64 = 1e-3;

/// Writes a bundle; `name` is all that its files say about the case.
pub fn write_bundle(
    folder: &Path,
    name: &str,
    rig: &Rig,
    trials: &[Trial],
    noise_seed: u64,
) -> io::Result<()> {
    fs::create_dir_all(folder.join("trials"))?;
    fs::write(folder.join("rig.toml"), rig_toml(name, rig))?;
    fs::write(folder.join("centreline.csv"), centreline(rig))?;
    let mut noise = Noise::of_seed(noise_seed);
    for (number, trial) in trials.iter().enumerate() {
        let path = folder.join(format!("trials/{number:03}.csv"));
        fs::write(path, csv(trial, &mut noise))?;
    }
    Ok(())
}

fn csv(trial: &Trial, noise: &mut Noise) -> String {
    let mut text = String::from(
        "t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N,drive_fx_N,tip_x_m,tip_y_m,tip_z_m\n",
    );
    let zero = noise.vector(ZERO_SD_N);
    // Writing to a string does not fail.
    for (k, row) in trial.iter().enumerate() {
        let force = row.force_n + zero + noise.vector(FORCE_NOISE_N);
        let drive = row.drive_force_n + noise.normal() * DRIVE_NOISE_N;
        let _ = write!(
            text,
            "{:.4},{:.7},{:.6},{:.6},{:.6},{:.6},{:.6}",
            row.t_s,
            row.encoder.insertion_m,
            row.encoder.rotation_rad,
            force.x,
            force.y,
            force.z,
            drive
        );
        let _ = if k % TIP_EVERY == 0 {
            let tip = row.tip_m + noise.vector(TIP_NOISE_M);
            writeln!(text, ",{:.6},{:.6},{:.6}", tip.x, tip.y, tip.z)
        } else {
            writeln!(text, ",,,")
        };
    }
    text
}

fn centreline(rig: &Rig) -> String {
    let mut text = String::from("branch,s_m,x_m,y_m,z_m,radius_m\n");
    for (branch, stations) in rig.branches.iter().enumerate() {
        let mut arc = 0.0;
        let mut before = stations.first().map(|s| s.position_m).unwrap_or_default();
        for station in stations {
            let (p, radius) = (station.position_m, station.radius_m);
            arc += (p - before).norm();
            before = p;
            let _ =
                writeln!(text, "{branch},{arc:.7},{:.8},{:.8},{:.8},{radius:.8}", p.x, p.y, p.z);
        }
    }
    text
}

fn rig_toml(name: &str, rig: &Rig) -> String {
    let i = &rig.instrument;
    let section = |(length, youngs): (f64, f64)| {
        format!("  {{ length_m = {length:?}, youngs_modulus_Pa = {youngs:?} }},\n")
    };
    let piece = |(length, curvature): (f64, f64)| {
        format!("  {{ length_m = {length:?}, curvature_per_m = {curvature:?} }},\n")
    };
    let sections: String = i.sections.iter().copied().map(section).collect();
    let precurve: String = i.precurve.iter().copied().map(piece).collect();
    let length = i.sections.iter().map(|(length, _)| length).sum::<f64>();
    format!(
        r#"format = "trial-bundle/1"
name = "{name}"

[instrument]
length_m = {length:?}
outer_diameter_m = {:?}
inner_diameter_m = {:?}
density_kg_per_m3 = {:?}
poissons_ratio = {:?}
sections = [
{sections}]
tip_precurve = [
{precurve}]

[entry]
position_m = [0.0, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]

[vessel]
friction_coefficient = {:?}
wall_stiffness_N_per_m = {:?}
wall_contact_spacing_m = {CONTACT_SPACING_M:?}
wall_tangential_ratio = {TANGENTIAL_RATIO:?}

[environment]
gravity_m_per_s2 = {GRAVITY_M_PER_S2:?}
fluid = "none"

[sensor]
force_noise_sd_N = {FORCE_NOISE_N:?}
force_rate_hz = 250.0
tip_noise_sd_m = {TIP_NOISE_M:?}
drive_noise_sd_N = {DRIVE_NOISE_N:?}
"#,
        i.outer_diameter_m,
        i.inner_diameter_m,
        i.density_kg_per_m3,
        i.poissons_ratio,
        rig.friction_coefficient,
        i.wall_stiffness_n_per_m,
    )
}
