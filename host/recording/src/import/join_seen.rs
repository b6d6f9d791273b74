//! Joins what a camera saw with the motion of a drive.

use cathforce_bundle::bundle::LONGEST_GAP_S;

use super::join::between;
use crate::format::trial::{Measured, Trial};

/// Tip and shape at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// Time since the first frame \[s\].
    pub t_s: f64,
    /// End of the centre line, vessel frame \[m\].
    pub tip_m: [f64; 3],
    /// Points on the shape, tip first, vessel frame \[m\]; may be empty.
    pub shape_m: Vec<[f64; 3]>,
    /// Length of the centre line past the entry \[m\].
    pub length_m: f64,
}

/// A trial joined from a motion and what a camera saw.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct JoinedSeen {
    /// All rows of the motion, and a row for each time of the camera.
    pub trial: Trial,
    /// Rows with a tip of the camera.
    pub seen: usize,
    /// Sightings before the motion begins or after it ends.
    pub outside: usize,
    /// Sightings between rows of the motion that are too far apart.
    pub in_gaps: usize,
    /// Whether the motion had tips or shapes of its own, which were dropped.
    pub had_own: bool,
    /// Length seen less insertion, of each sighting \[m\].
    pub excess_m: Vec<f64>,
}

/// Adds a row for each sighting, with the encoders interpolated over [`LONGEST_GAP_S`] at most. A
/// sighting at the time of a row is put into that row.
///
/// `offset_s` is added to the time of the camera.
pub fn join_seen(motion: &Trial, seen: &[Seen], offset_s: f64) -> JoinedSeen {
    let mut joined = JoinedSeen {
        had_own: motion.rows.iter().any(|row| row.tip_m.is_some())
            || motion.shapes_m.iter().any(|shape| !shape.is_empty()),
        ..JoinedSeen::default()
    };
    joined.trial.noise = motion.noise;
    let mut seen = seen.iter().peekable();
    let mut before: Option<&Measured> = None;
    for row in &motion.rows {
        let mut own = Measured { tip_m: None, ..*row };
        let mut shape_m = Vec::new();
        while let Some(one) = seen.next_if(|one| one.t_s + offset_s <= row.t_s) {
            let t_s = one.t_s + offset_s;
            if t_s == row.t_s {
                own.tip_m = Some(one.tip_m);
                shape_m.clone_from(&one.shape_m);
                joined.count(one, &own);
                continue;
            }
            match before {
                None => joined.outside += 1,
                Some(before) if row.t_s - before.t_s > LONGEST_GAP_S => joined.in_gaps += 1,
                Some(before) => {
                    let tip_m = Some(one.tip_m);
                    let between = Measured { tip_m, ..between(before, row, t_s, None) };
                    joined.count(one, &between);
                    joined.trial.rows.push(between);
                    joined.trial.shapes_m.push(one.shape_m.clone());
                }
            }
        }
        joined.trial.rows.push(own);
        joined.trial.shapes_m.push(shape_m);
        before = Some(row);
    }
    joined.outside += seen.count();
    joined
}

impl JoinedSeen {
    fn count(&mut self, one: &Seen, row: &Measured) {
        self.seen += 1;
        self.excess_m.push(one.length_m - row.insertion_m);
    }

    /// Mean and standard deviation of the length seen less the insertion \[m\]. `None` without sightings.
    pub fn excess(&self) -> Option<(f64, f64)> {
        let n = self.excess_m.len() as f64;
        let mean = self.excess_m.iter().sum::<f64>() / n;
        let square = self.excess_m.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        (n > 0.0).then_some((mean, square.sqrt()))
    }
}

/// The offset near `around_s` at which length and insertion change together best, and the standard
/// deviation of their difference there \[m\]. Steps are 10 ms, a third of a webcam's frame.
///
/// `None` if no offset leaves most of the sightings inside the motion.
pub fn best_offset(motion: &Trial, seen: &[Seen], around_s: f64) -> Option<(f64, f64)> {
    const STEP_S: f64 = 0.01;
    const STEPS: i32 = 100;
    let bare: Vec<Seen> =
        seen.iter().map(|one| Seen { shape_m: Vec::new(), ..one.clone() }).collect();
    let at = |k: i32| {
        let offset_s = around_s + STEP_S * f64::from(k);
        let joined = join_seen(motion, &bare, offset_s);
        let is_most = 2 * joined.seen > seen.len();
        joined.excess().filter(|_| is_most).map(|(_, sd_m)| (offset_s, sd_m))
    };
    (-STEPS..=STEPS).filter_map(at).min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(t_s: f64, insertion_m: f64) -> Measured {
        let force_n = Some([t_s; 3]);
        let (drive_force_n, tip_m, guidewire) = (None, None, None);
        let rotation_rad = 0.0;
        Measured {
            t_s,
            insertion_m,
            rotation_rad,
            force_n,
            drive_force_n,
            tip_m,
            guidewire,
            tendons_m: [None; 4],
        }
    }

    fn seen(t_s: f64, length_m: f64) -> Seen {
        Seen { t_s, tip_m: [length_m, 0.0, 0.0], shape_m: vec![[t_s; 3]; 2], length_m }
    }

    #[test]
    fn a_sighting_takes_the_motion_of_its_time_and_rows_stay() {
        let rows = vec![at(0.0, 0.1), at(0.1, 0.2), at(0.2, 0.2), at(2.0, 0.3)];
        let motion = Trial { rows, ..Trial::default() };
        let frames = [-0.1, 0.05, 0.1, 1.0, 3.0].map(|t| seen(t, 0.16));
        let found = join_seen(&motion, &frames, 0.0);
        assert_eq!((found.seen, found.outside, found.in_gaps, found.had_own), (2, 2, 1, false));
        let times: Vec<f64> = found.trial.rows.iter().map(|row| row.t_s).collect();
        assert_eq!(times, [0.0, 0.05, 0.1, 0.2, 2.0]);
        let between = &found.trial.rows[1];
        assert!((between.insertion_m - 0.15).abs() < 1e-12 && between.force_n.is_none());
        assert_eq!(found.trial.rows[2].force_n, Some([0.1; 3]));
        assert_eq!(found.trial.rows[2].tip_m, Some([0.16, 0.0, 0.0]));
        assert_eq!(found.trial.shapes_m.iter().map(Vec::len).collect::<Vec<_>>(), [0, 2, 2, 0, 0]);
        let (mean_m, sd_m) = found.excess().unwrap();
        assert!((mean_m + 0.015).abs() < 1e-12 && (sd_m - 0.025).abs() < 1e-12);
    }

    #[test]
    fn the_offset_of_the_clocks_is_found() {
        let insertion_m = |t: f64| 0.1 + 0.02 * (3.0 * t).sin();
        let rows = (0..1000).map(|k| f64::from(k) * 0.01).map(|t| at(t, insertion_m(t)));
        let motion = Trial { rows: rows.collect(), ..Trial::default() };
        let frames = (0..200).map(|k| f64::from(k) / 30.0);
        let frames: Vec<Seen> = frames.map(|t| seen(t, insertion_m(t + 1.27) - 0.002)).collect();
        let (offset_s, sd_m) = best_offset(&motion, &frames, 1.0).unwrap();
        assert!((offset_s - 1.27).abs() < 1e-9 && sd_m < 1e-5, "{offset_s} {sd_m}");
    }
}
