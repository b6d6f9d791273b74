//! Measurements and estimates on the trial's time axis.

use cathforce_bundle::bundle::{CatheterTrial, RigSensor};
use cathforce_mechanics::MAX_TENDONS;
use serde::{Deserialize, Serialize};

/// One row of a trial: what was measured at `t_s`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Time since the trial began \[s\].
    pub t_s: f64,
    /// Drive-side insertion \[m\].
    pub insertion_m: f64,
    /// Drive-side rotation \[rad\].
    pub rotation_rad: f64,
    /// Force of the instrument on the phantom, vessel frame \[N\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<[f64; 3]>,
    /// Axial force behind the guide, positive when pushing \[N\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive_force_n: Option<f64>,
    /// End of the centre line, vessel frame \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_m: Option<[f64; 3]>,
    /// The guidewire's drive, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guidewire: Option<MeasuredDrive>,
    /// Displacements of the tendons' drives, as many as the rig has \[m\].
    #[serde(default, skip_serializing_if = "has_no_tendon")]
    pub tendons_m: [Option<f64>; MAX_TENDONS],
}

fn has_no_tendon(tendons_m: &[Option<f64>; MAX_TENDONS]) -> bool {
    tendons_m.iter().all(Option::is_none)
}

/// Measurements of one drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredDrive {
    /// Drive-side insertion \[m\].
    pub insertion_m: f64,
    /// Drive-side rotation \[rad\].
    pub rotation_rad: f64,
    /// Axial force behind the guide, positive when pushing \[N\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive_force_n: Option<f64>,
}

/// Standard deviations of the sensor's white noise, where the rig states them.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct SensorNoise {
    /// Force, per axis \[N\].
    pub force_n: Option<f64>,
    /// Drive force \[N\].
    pub drive_force_n: Option<f64>,
    /// Tip, per axis \[m\].
    pub tip_m: Option<f64>,
}

impl SensorNoise {
    /// The noise that rig.toml states.
    pub fn of(sensor: &RigSensor) -> Self {
        Self {
            force_n: sensor.force_noise_sd_n,
            drive_force_n: sensor.drive_noise_sd_n,
            tip_m: sensor.tip_noise_sd_m,
        }
    }
}

/// The measurements of a trial.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Trial {
    /// Rows, sorted by time.
    pub rows: Vec<Measured>,
    /// Points on the shape for each row \[m\], tip first, vessel frame. Empty where it was not measured;
    /// shorter than `rows` if no more follow.
    pub shapes_m: Vec<Vec<[f64; 3]>>,
    pub noise: SensorNoise,
}

impl Trial {
    /// The trial of a bundle, with its times. The noise is stated by the bundle's rig and set separately.
    pub fn of(t_s: &[f64], data: &CatheterTrial) -> Self {
        let rows = t_s.iter().enumerate().map(|(i, &t_s)| Measured {
            t_s,
            insertion_m: data.insertion_m[i],
            rotation_rad: data.rotation_rad[i],
            force_n: data.force_n.as_ref().and_then(|column| column[i]),
            drive_force_n: data.drive_force_n.as_ref().and_then(|column| column[i]),
            tip_m: data.tip_m.as_ref().and_then(|column| column[i]),
            guidewire: data.guidewire.as_ref().map(|wire| MeasuredDrive {
                insertion_m: wire.insertion_m[i],
                rotation_rad: wire.rotation_rad[i],
                drive_force_n: wire.drive_force_n.as_ref().and_then(|column| column[i]),
            }),
            tendons_m: std::array::from_fn(|k| data.tendons_m.get(k).map(|column| column[i])),
        });
        // A row that lacks a point counts as not measured.
        let shape = |i: usize| data.shape_m.iter().map(|point| point[i]).collect::<Option<_>>();
        let shapes_m = match data.shape_m.is_empty() {
            true => Vec::new(),
            false => (0..t_s.len()).map(|i| shape(i).unwrap_or_default()).collect(),
        };
        Self { rows: rows.collect(), shapes_m, noise: SensorNoise::default() }
    }
}

/// The model's estimates after one tick.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Estimate {
    /// Time since the trial began \[s\].
    pub t_s: f64,
    /// Total contact force on the vessel, vessel frame \[N\].
    pub force_n: [f64; 3],
    /// Axial force behind the guide \[N\], in ticks that carry it.
    pub drive_force_n: Option<f64>,
    /// Axial force behind the guidewire's guide \[N\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guidewire_force_n: Option<f64>,
    /// Half width of the band in which nine of ten true forces lie, x, y, z \[N\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_half_width_n: Option<[f64; 3]>,
    /// Half width of the band of the axial force behind the guide \[N\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive_force_half_width_n: Option<f64>,
    /// End of the centre line \[m\], in ticks that carry it.
    pub tip_m: Option<[f64; 3]>,
    /// Whether the model did not resolve this tick, so that its forces cannot be trusted.
    pub unresolved: bool,
}
