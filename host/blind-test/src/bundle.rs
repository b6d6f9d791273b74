//! A case as a trial bundle: the nominal rig, and what was measured on the real one.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use nalgebra::Vector3;

use crate::noise::Noise;
use crate::play::{Row, Trial};
use crate::rigs::{CONTACT_SPACING_M, GRAVITY_M_PER_S2, Rig, TANGENTIAL_RATIO};
use crate::stand::{Accuracy, Stand};

/// On the shape, the tip and the entry among them.
const SHAPE_POINTS: usize = 8;

impl Stand {
    /// Writes a bundle; `name` is all that the files of an own rig say about the case. Files of a
    /// given rig are copied.
    pub fn write(
        &self,
        folder: &Path,
        name: &str,
        trials: &[Trial],
        noise_seed: u64,
    ) -> io::Result<()> {
        fs::create_dir_all(folder.join("trials"))?;
        match &self.given {
            None => {
                let Accuracy { force_n, tip_m, drive_n, .. } = self.accuracy;
                let sensor = sensor_toml(Some(force_n), Some(tip_m), Some(drive_n));
                fs::write(folder.join("rig.toml"), rig_toml(name, &self.rig, &sensor))?;
                fs::write(folder.join("centreline.csv"), centreline(&self.rig))?;
            }
            Some(given) => {
                let files = ["rig.toml", "centreline.csv", "vessel.stl"];
                for file in files.iter().filter(|file| given.join(file).exists()) {
                    fs::copy(given.join(file), folder.join(file))?;
                }
            }
        }
        let mut noise = Noise::of_seed(noise_seed);
        for (number, trial) in trials.iter().enumerate() {
            let path = folder.join(format!("trials/{number:03}.csv"));
            fs::write(path, csv(trial, &self.accuracy, &mut noise))?;
        }
        Ok(())
    }
}

fn csv(trial: &Trial, accuracy: &Accuracy, noise: &mut Noise) -> String {
    let mut text = String::from("t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N,drive_fx_N");
    let shape =
        (0..if accuracy.shape_m.is_some() { SHAPE_POINTS } else { 0 }).map(|k| format!("p{k:02}"));
    for point in std::iter::once("tip".to_owned()).chain(shape) {
        text += &format!(",{point}_x_m,{point}_y_m,{point}_z_m");
    }
    text.push('\n');
    // Writing to a string does not fail.
    for (k, row) in trial.iter().enumerate() {
        let force = row.force_n + noise.vector(accuracy.force_n);
        let drive = row.drive_force_n + noise.normal() * accuracy.drive_n;
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
        let tip = (k % accuracy.tip_every == 0).then(|| row.tip_m + noise.vector(accuracy.tip_m));
        point(&mut text, tip);
        if let Some(sd_m) = accuracy.shape_m {
            let seen = evenly(row);
            for k in 0..SHAPE_POINTS {
                point(&mut text, seen.get(k).map(|p| p + noise.vector(sd_m)));
            }
        }
        text.push('\n');
    }
    text
}

fn point(text: &mut String, at: Option<Vector3<f64>>) {
    let _ = match at {
        Some(p) => write!(text, ",{:.6},{:.6},{:.6}", p.x, p.y, p.z),
        None => write!(text, ",,,"),
    };
}

/// Points of a row's centre line, if it has one, that are as far from each other along it.
fn evenly(row: &Row) -> Vec<Vector3<f64>> {
    let line = &row.shape_m;
    if line.len() < 2 {
        return Vec::new();
    }
    let mut arc = vec![0.0];
    for pair in line.windows(2) {
        arc.push(arc[arc.len() - 1] + (pair[1] - pair[0]).norm());
    }
    let length = arc[arc.len() - 1];
    let at = |k: usize| {
        let at = length * k as f64 / (SHAPE_POINTS - 1) as f64;
        let after = arc.partition_point(|a| *a < at).clamp(1, line.len() - 1);
        let share = (at - arc[after - 1]) / (arc[after] - arc[after - 1]);
        line[after - 1].lerp(&line[after], share)
    };
    (0..SHAPE_POINTS).map(at).collect()
}

/// The text of `centreline.csv`.
pub(crate) fn centreline(rig: &Rig) -> String {
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

/// The table `[sensor]`; noise that is `None` is not stated \[N\], \[m\], \[N\].
pub(crate) fn sensor_toml(
    force_n: Option<f64>,
    tip_m: Option<f64>,
    drive_n: Option<f64>,
) -> String {
    let line = |key: &str, value: Option<f64>| {
        value.map_or(String::new(), |value| format!("{key} = {value:?}\n"))
    };
    let force = line("force_noise_sd_N", force_n);
    let (tip, drive) = (line("tip_noise_sd_m", tip_m), line("drive_noise_sd_N", drive_n));
    format!("[sensor]\n{force}force_rate_hz = 250.0\n{tip}{drive}")
}

/// The text of `rig.toml`; `sensor`: its table of the sensors.
pub(crate) fn rig_toml(name: &str, rig: &Rig, sensor: &str) -> String {
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

{sensor}"#,
        i.outer_diameter_m,
        i.inner_diameter_m,
        i.density_kg_per_m3,
        i.poissons_ratio,
        rig.friction_coefficient,
        i.wall_stiffness_n_per_m,
    )
}
