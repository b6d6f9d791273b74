//! Snaps of a trial: of the force that was measured, and of one that is predicted at its rows.

use cathforce_recording::snap::{self, Sample, Snap};
use nalgebra::Vector3;

use super::Prepared;
use crate::catheter::column::Source;
use crate::signal::interpolate;

impl Prepared {
    /// Looks for those that were measured.
    pub(super) fn find_snaps(&mut self) {
        if let Some((rows, threshold_n)) = self.force_rows() {
            self.snaps = snap::find(&rows, threshold_n);
        }
    }

    /// Those of a force, one a tick, that is read later by `shift_s`; none where no force was measured.
    pub(super) fn snaps_of(&self, force_n: &[[f64; 3]], shift_s: f64) -> Vec<Snap> {
        let Some((mut rows, threshold_n)) = self.force_rows() else { return Vec::new() };
        for row in &mut rows {
            let tick = self.index(row.t_s + shift_s).round().max(0.0) as usize;
            row.force_n = force_n[tick.min(force_n.len() - 1)];
        }
        snap::find(&rows, threshold_n)
    }

    /// Those that were measured, where forces are compared but for snaps.
    pub fn measured_snaps(&self) -> Vec<Snap> {
        self.scored(self.snaps.clone())
    }

    /// The same of a force that is predicted, one a tick, and read later by `shift_s`.
    pub fn predicted_snaps(&self, force_n: &[[f64; 3]], shift_s: f64) -> Vec<Snap> {
        self.scored(self.snaps_of(force_n, shift_s))
    }

    fn scored(&self, snaps: Vec<Snap>) -> Vec<Snap> {
        let ready_s = self.ready_s();
        let is_scored = |snap: &Snap| snap.t_s >= ready_s && !self.is_after_jump(snap.t_s);
        snaps.into_iter().filter(is_scored).collect()
    }

    /// The measured force, and by how much it jumps in a snap.
    fn force_rows(&self) -> Option<(Vec<Sample>, f64)> {
        let column = |axis| self.column(Source::Force(axis));
        let (x, y, z) = (column(0)?, column(1)?, column(2)?);
        let rows = x.rows.iter().zip(&y.rows).zip(&z.rows);
        let rows: Vec<Sample> = rows
            .map(|((&(row, x_n), &(_, y_n)), &(_, z_n))| {
                let t_s = self.clock.t_s[row];
                let index = self.index(t_s);
                Sample {
                    t_s,
                    insertion_m: interpolate(&self.inputs.insertion_m, index),
                    rotation_rad: interpolate(&self.inputs.rotation_rad, index),
                    force_n: [x_n, y_n, z_n],
                }
            })
            .collect();
        let peak_n = rows.iter().map(|row| Vector3::from(row.force_n).norm()).fold(0.0, f64::max);
        let threshold_n = snap::threshold_n(x.noise, peak_n);
        Some((rows, threshold_n))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_bundle::Bundle;

    use crate::catheter::plant::Catheter;
    use crate::plant::{Plant, Point};

    #[test]
    fn the_tip_that_jumps_off_a_dividing_wall_snaps_in_data_and_model() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let catheter = Catheter::new(&Bundle::open(&example).unwrap()).unwrap();
        let catheter = &catheter;
        let at = |shift_s: f64| {
            let mut point = Point::nominal(catheter).finer();
            let shift = catheter.nuisances().iter().position(|own| own.name == "time shift");
            point.nuisances[shift.expect("it has one")] = shift_s;
            move |trial: usize| catheter.predicted_snaps(trial, &point).unwrap()
        };
        const LATER_S: f64 = 0.04;
        let (nominal, shifted) = (at(0.0), at(LATER_S));
        for trial in 0..3 {
            assert!(catheter.snaps(trial).is_empty() && nominal(trial).is_empty(), "{trial}");
        }
        let (measured, predicted) = (catheter.snaps(3), nominal(3));
        let ([measured], [predicted]) = (&measured[..], &predicted[..]) else {
            panic!("{measured:?} {predicted:?}")
        };
        assert!((measured.insertion_m - 0.0915).abs() < 2e-4, "{measured:?}");
        assert!((predicted.insertion_m - measured.insertion_m).abs() < 2.5e-3, "{predicted:?}");
        // Of a force that is read later the same jump is earlier.
        let earlier_s = predicted.t_s - shifted(3)[0].t_s;
        assert!((earlier_s - LATER_S).abs() < 0.005, "{earlier_s}");
    }
}
