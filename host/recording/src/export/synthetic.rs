//! A run of the model as a trial that sensors could have measured.

use cathforce_bundle::bundle::RigSensor;
use cathforce_config::image;
use cathforce_mechanics::MAX_TENDONS;

use crate::analysis::analyse::Analysis;
use crate::analysis::compare::{at, series};
use crate::analysis::estimates::estimates;
use crate::analysis::sensed::as_sensed;
use crate::format::trial::{Measured, MeasuredDrive, SensorNoise, Trial};
use crate::reading::reader::Recording;
use crate::replay::ReplayError;

/// Rows a second, where the rig does not state the rate of its force sensor.
pub const FORCE_HZ: f64 = 250.0;
/// Positions of the tip a second, as an X-ray or a camera gives them.
pub const CAMERA_HZ: f64 = 25.0;

/// What the rig's sensors would have measured, had the model been the rig: encoders, force on the
/// phantom, force behind the guide in every row, and the tip [`CAMERA_HZ`] times a second; with a
/// guidewire its drive too.
///
/// The recording was made in lock step, so that its analysis knows every channel in every tick.
/// `normal` gives numbers with a standard deviation of 1; with it, noise as `sensor` states it is
/// added and the encoders have its resolution. A value is missing where the model did not resolve
/// its tick.
pub fn synthetic_trial(
    recording: &Recording,
    analysis: &Analysis,
    sensor: &RigSensor,
    normal: Option<impl FnMut() -> f64>,
) -> Result<Trial, ReplayError> {
    let config = image::decode(&recording.image).map_err(ReplayError::Image)?;
    let mut estimates = estimates(recording, &analysis.track, analysis.entry_m);
    as_sensed(&mut estimates, &config.model.description().effects.sensor);
    estimates.retain(|estimate| !estimate.unresolved);
    let forces = series(&estimates, |e| Some(e.force_n));
    let drive = series(&estimates, |e| e.drive_force_n.map(|x| [x]));
    let wire = series(&estimates, |e| e.guidewire_force_n.map(|x| [x]));
    let tips = series(&estimates, |e| e.tip_m);
    let encoders = Encoders::of(&recording.trial.rows);

    let mut noise = Noise { normal, sensor };
    let rate_hz = sensor.force_rate_hz.filter(|rate| *rate > 0.0).unwrap_or(FORCE_HZ);
    // The device goes on after the trial's end until it is disarmed.
    let played_s = recording.trial.rows.last().map_or(0.0, |row| row.t_s);
    let end_s = forces.last().map_or(0.0, |(t_s, _)| *t_s).min(played_s);
    let count = (end_s * rate_hz + 1e-6).floor() as usize + 1;
    let mut pictures = 0.0;
    let rows = (0..count).map(|row| {
        let t_s = row as f64 / rate_hz;
        let has_picture = t_s * CAMERA_HZ + 1e-6 >= pictures;
        if has_picture {
            pictures = (t_s * CAMERA_HZ + 1e-6).floor() + 1.0;
        }
        let [insertion_m, rotation_rad] =
            noise.encoder(encoders.at(t_s, |row| [row.insertion_m, row.rotation_rad]));
        let has_wire = encoders.rows.first().is_some_and(|row| row.guidewire.is_some());
        let guidewire = has_wire.then(|| {
            let [insertion_m, rotation_rad] = noise.encoder(encoders.at(t_s, |row| {
                row.guidewire.map_or([0.0; 2], |wire| [wire.insertion_m, wire.rotation_rad])
            }));
            let force = at(&wire, t_s).map(|x| noise.add(x, sensor.drive_noise_sd_n)[0]);
            MeasuredDrive { insertion_m, rotation_rad, drive_force_n: force }
        });
        let tip_m = at(&tips, t_s).filter(|_| has_picture);
        Measured {
            t_s,
            insertion_m,
            rotation_rad,
            force_n: at(&forces, t_s).map(|x| noise.add(x, sensor.force_noise_sd_n)),
            drive_force_n: at(&drive, t_s).map(|x| noise.add(x, sensor.drive_noise_sd_n)[0]),
            tip_m: tip_m.map(|x| noise.add(x, sensor.tip_noise_sd_m)),
            guidewire,
            tendons_m: encoders.tendons_at(t_s),
        }
    });
    Ok(Trial { rows: rows.collect(), shapes_m: Vec::new(), noise: SensorNoise::of(sensor) })
}

/// The encoders of a trial between its rows.
struct Encoders<'a> {
    rows: &'a [Measured],
}

impl<'a> Encoders<'a> {
    fn of(rows: &'a [Measured]) -> Self {
        Self { rows }
    }

    /// Displacements of the tendons' drives, to a nanometre.
    fn tendons_at(&self, t_s: f64) -> [Option<f64>; MAX_TENDONS] {
        let there = self.rows.first().map_or([None; MAX_TENDONS], |row| row.tendons_m);
        let at_m = self.at(t_s, |row| row.tendons_m.map(|x| x.unwrap_or(0.0)));
        std::array::from_fn(|k| there[k].map(|_| (1e9 * at_m[k]).round() / 1e9))
    }

    /// Linear between rows, held before the first one and after the last.
    fn at<const N: usize>(&self, t_s: f64, of: impl Fn(&Measured) -> [f64; N]) -> [f64; N] {
        let after = self.rows.partition_point(|row| row.t_s <= t_s);
        let low = self.rows.get(after.saturating_sub(1));
        let high = self.rows.get(after).or(low);
        let Some((low, high)) = low.zip(high) else { return [0.0; N] };
        let span_s = high.t_s - low.t_s;
        let share = if span_s > 0.0 { ((t_s - low.t_s) / span_s).clamp(0.0, 1.0) } else { 0.0 };
        let (low, high) = (of(low), of(high));
        std::array::from_fn(|k| low[k] + share * (high[k] - low[k]))
    }
}

struct Noise<'a, F> {
    normal: Option<F>,
    sensor: &'a RigSensor,
}

impl<F: FnMut() -> f64> Noise<'_, F> {
    /// A reading, to seven decimals: a tenth of a micronewton, a tenth of a micrometre.
    fn add<const N: usize>(&mut self, mut values: [f64; N], sd: Option<f64>) -> [f64; N] {
        if let Some((normal, sd)) = self.normal.as_mut().zip(sd) {
            values.iter_mut().for_each(|value| *value += sd * normal());
        }
        values.map(|value| (1e7 * value).round() / 1e7)
    }

    fn encoder(&self, [insertion_m, rotation_rad]: [f64; 2]) -> [f64; 2] {
        let stepped = |value: f64, step: Option<f64>| {
            let step = step.filter(|step| self.normal.is_some() && *step > 0.0);
            let value = step.map_or(value, |step| (value / step).round() * step);
            (1e9 * value).round() / 1e9
        };
        [
            stepped(insertion_m, self.sensor.insertion_resolution_m),
            stepped(rotation_rad, self.sensor.rotation_resolution_rad),
        ]
    }
}
