//! Writes a stranger as a trial bundle.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::cases::Stranger;
use super::reading::Reading;
use crate::bundle::{centreline, rig_toml, sensor_toml};
use crate::noise::Noise;
use crate::play::Trial;

impl Stranger {
    /// Writes the bundle of what was recorded; `name` is all that its files say about the case.
    pub(crate) fn write(&self, folder: &Path, name: &str, trials: &[Trial]) -> io::Result<()> {
        fs::create_dir_all(folder.join("trials"))?;
        let (rig, stated) = (&self.rig.stated, &self.electronics.stated);
        let sensor = sensor_toml(stated.force_n, stated.tip_m, stated.drive_n);
        let mut toml = rig_toml(name, rig, &sensor);
        // Whoever measures a vessel in a scan knows how well the scan resolves it.
        if let Some(sd_m) = self.rig.truth.scan_sd_m {
            let _ = write!(toml, "\n[priors]\nwall_sd_m = {sd_m:?}\n");
        }
        fs::write(folder.join("rig.toml"), toml)?;
        fs::write(folder.join("centreline.csv"), centreline(rig))?;
        let mut noise = Noise::of_seed(self.noise_seed);
        let mut rng = ChaCha8Rng::seed_from_u64(self.noise_seed);
        for (number, trial) in trials.iter().enumerate() {
            let rows: Vec<_> =
                trial.iter().map(|row| (row.force_n, row.drive_force_n, row.tip_m)).collect();
            let readings = self.electronics.read(&rows, &mut noise, &mut rng);
            let path = folder.join(format!("trials/{number:03}.csv"));
            fs::write(path, self.csv(trial, &readings))?;
        }
        Ok(())
    }

    fn csv(&self, trial: &Trial, readings: &[Reading]) -> String {
        let (has_drive, has_tip) =
            (self.electronics.drive_noise_n.is_some(), self.electronics.tip_noise_m.is_some());
        let mut text = String::from("t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N");
        text += if has_drive { ",drive_fx_N" } else { "" };
        text += if has_tip { ",tip_x_m,tip_y_m,tip_z_m" } else { "" };
        text.push('\n');
        for (row, reading) in trial.iter().zip(readings) {
            let at = row.encoder;
            // Writing to a string does not fail.
            let _ = write!(text, "{:.4},{:.7},{:.6}", row.t_s, at.insertion_m, at.rotation_rad);
            vector(&mut text, reading.force_n);
            if has_drive {
                let _ = match reading.drive_n {
                    Some(force_n) => write!(text, ",{force_n:.6}"),
                    None => write!(text, ","),
                };
            }
            if has_tip {
                vector(&mut text, reading.tip_m);
            }
            text.push('\n');
        }
        text
    }
}

fn vector(text: &mut String, value: Option<Vector3<f64>>) {
    let _ = match value {
        Some(v) => write!(text, ",{:.6},{:.6},{:.6}", v.x, v.y, v.z),
        None => write!(text, ",,,"),
    };
}
