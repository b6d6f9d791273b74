//! How far the device said that its forces may be off, and which of the measured ones lie within.

use cathforce_recording::{
    Analysis, COLUMNS, Coverage, Measured, Recording, Trial, trial_time_s, white_noise,
};
use serde_json::{Value, json};

use super::numbers::{MOST_POINTS, floats};

/// A band holds until the next one, which comes every tenth tick; one that is older is lost \[s\].
const HELD_S: f64 = 0.025;

/// What the device said at one time.
struct Stated {
    t_s: f64,
    /// x, y, z on the vessel, and behind the guide; NaN where there is none \[N\].
    force_n: [f64; COLUMNS],
    /// `None`: not known.
    half_width_n: [Option<f64>; COLUMNS],
}

/// Everything that was said of the band during the trial.
pub struct StatedBand(Vec<Stated>);

impl StatedBand {
    /// `None` where the device was told of no band.
    pub fn of(recording: &Recording, analysis: &Analysis) -> Option<Self> {
        let mut force_n = [f64::NAN; COLUMNS];
        let mut stated = Vec::new();
        for tick in &analysis.track.ticks {
            if let Some(xyz) = tick.force_n {
                force_n[..3].copy_from_slice(&xyz.map(f64::from));
            }
            if let Some(drive) = tick.drive_force_n {
                force_n[3] = f64::from(drive);
            }
            let t_s = trial_time_s(recording, tick.at_ns);
            if tick.has_band && t_s >= 0.0 {
                let xyz = tick.force_half_width_n;
                let axis = |k: usize| xyz.map(|widths_n| f64::from(widths_n[k]));
                let drive = tick.drive_force_half_width_n.map(f64::from);
                let half_width_n = [axis(0), axis(1), axis(2), drive];
                stated.push(Stated { t_s, force_n, half_width_n });
            }
        }
        (!stated.is_empty()).then_some(Self(stated))
    }

    /// Time \[s\]; of each force the lower and the upper edge \[mN\], NaN where not known.
    pub fn lines(&self) -> Value {
        let shown = || self.0.iter().step_by(self.0.len().div_ceil(MOST_POINTS).max(1));
        let edge = |k: usize, side: f64| {
            let at = move |own: &Stated| {
                let width_n = own.half_width_n[k].unwrap_or(f64::NAN);
                1e3 * (own.force_n[k] + side * width_n)
            };
            floats(shown().map(at))
        };
        json!({
            "t": floats(shown().map(|own| own.t_s)),
            "low": (0..COLUMNS).map(|k| edge(k, -1.0)).collect::<Vec<_>>(),
            "high": (0..COLUMNS).map(|k| edge(k, 1.0)).collect::<Vec<_>>(),
        })
    }

    /// Counts every measured force against what was estimated and said at its time. The sensor's
    /// noise is allowed for: as its rows show it, where it is not stated.
    pub fn coverage(&self, recording: &Recording) -> Coverage {
        let mut coverage = Coverage::default();
        let Trial { rows, noise, .. } = &recording.trial;
        for (k, counted) in coverage.channels.iter_mut().enumerate() {
            let of = |row: &Measured| match k {
                3 => row.drive_force_n,
                axis => row.force_n.map(|force_n| force_n[axis]),
            };
            let measured = rows.iter().enumerate().filter_map(|(i, row)| Some((i, of(row)?)));
            let measured: Vec<(usize, f64)> = measured.collect();
            let stated_n = if k == 3 { noise.drive_force_n } else { noise.force_n };
            let noise_n = stated_n.unwrap_or_else(|| white_noise(&measured));
            for (i, measured_n) in measured {
                let said = self.at(rows[i].t_s);
                let width_n = said.and_then(|said| said.half_width_n[k]);
                let error_n = said.map_or(f64::NAN, |said| measured_n - said.force_n[k]);
                counted.count(width_n, error_n, noise_n);
            }
        }
        coverage
    }

    /// What holds at a time.
    fn at(&self, t_s: f64) -> Option<&Stated> {
        let after = self.0.partition_point(|own| own.t_s <= t_s + 1e-9);
        self.0[..after].last().filter(|own| t_s - own.t_s < HELD_S)
    }
}
