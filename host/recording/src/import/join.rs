//! Joins a sensor's forces with the motion of a drive that was recorded by another clock.

use cathforce_bundle::bundle::LONGEST_GAP_S;

use super::ati::ForceSample;
use crate::format::trial::{Measured, MeasuredDrive, Trial};

/// Longest time between forces for which the motion's own rows are not needed \[s\]: a drive moves by a
/// tenth of a millimetre or two in it.
const LONGEST_WITHOUT_MOTION_S: f64 = 0.02;

/// A trial joined from forces and a motion, and the forces that are not in it.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Joined {
    /// Rows of the forces, and rows of the motion that hold other measurements.
    pub trial: Trial,
    /// Rows with a force of the sensor.
    pub forces: usize,
    /// Forces before the motion begins or after it ends.
    pub outside: usize,
    /// Forces between rows of the motion that are too far apart.
    pub in_gaps: usize,
    /// Rows of the motion that were kept for other measurements, or where the log has a hole.
    pub others: usize,
    /// Whether the motion had a force of its own, which was dropped.
    pub had_force: bool,
}

/// Makes a row for each force, with the motion interpolated over [`LONGEST_GAP_S`] at most. Other
/// measurements of the motion keep their own rows, and so does the motion where no force was logged.
///
/// `offset_s` is added to the time of the force.
pub fn join(motion: &Trial, forces: &[ForceSample], offset_s: f64) -> Joined {
    let rows = &motion.rows;
    let mut joined =
        Joined { had_force: rows.iter().any(|row| row.force_n.is_some()), ..Joined::default() };
    joined.trial.noise = motion.noise;
    let mut of_forces = Vec::new();
    for sample in forces {
        let t_s = sample.t_s + offset_s;
        let next = rows.partition_point(|row| row.t_s < t_s);
        let Some(after) = rows.get(next) else {
            joined.outside += 1;
            continue;
        };
        let before = match after.t_s == t_s {
            true => Some(after),
            false => next.checked_sub(1).and_then(|before| rows.get(before)),
        };
        match before {
            None => joined.outside += 1,
            Some(before) if after.t_s - before.t_s > LONGEST_GAP_S => joined.in_gaps += 1,
            Some(before) => {
                of_forces.push(between(before, after, t_s, Some(sample.force_n)));
            }
        }
    }
    joined.forces = of_forces.len();
    let shape = |i: usize| motion.shapes_m.get(i).cloned().unwrap_or_default();
    let times_s = of_forces.iter().map(|row| row.t_s).collect::<Vec<_>>();
    let others = rows.iter().enumerate().map(|(i, row)| (row, shape(i)));
    let is_kept = |row: &Measured, shape: &[[f64; 3]]| {
        has_others(row) || !shape.is_empty() || is_in_hole(&times_s, row.t_s)
    };
    let mut others = others.filter(|(row, shape)| is_kept(row, shape)).peekable();
    let mut of_forces = of_forces.into_iter().peekable();
    loop {
        let force_s = of_forces.peek().map_or(f64::INFINITY, |row| row.t_s);
        let other_s = others.peek().map_or(f64::INFINITY, |(row, _)| row.t_s);
        let force = of_forces.next_if(|row| row.t_s <= other_s);
        let other = others.next_if(|(row, _)| row.t_s <= force_s);
        joined.others += usize::from(other.is_some());
        let (row, shape) = match (force, other) {
            (None, None) => break,
            (Some(row), None) => (row, Vec::new()),
            (force, Some((row, shape))) => {
                (Measured { force_n: force.and_then(|row| row.force_n), ..*row }, shape)
            }
        };
        joined.trial.rows.push(row);
        joined.trial.shapes_m.push(shape);
    }
    joined
}

/// Whether a time is between two forces that are far apart.
fn is_in_hole(forces_s: &[f64], t_s: f64) -> bool {
    let next = forces_s.partition_point(|force_s| *force_s < t_s);
    let (Some(&after), Some(&before)) = (forces_s.get(next), forces_s[..next].last()) else {
        return false;
    };
    after != t_s && after - before > LONGEST_WITHOUT_MOTION_S
}

fn has_others(row: &Measured) -> bool {
    let wire = row.guidewire.and_then(|wire| wire.drive_force_n);
    row.drive_force_n.is_some() || row.tip_m.is_some() || wire.is_some()
}

/// A row at a time between two rows of a motion, with its encoders interpolated.
pub(super) fn between(
    before: &Measured,
    after: &Measured,
    t_s: f64,
    force_n: Option<[f64; 3]>,
) -> Measured {
    let span_s = after.t_s - before.t_s;
    let share = if span_s > 0.0 { (t_s - before.t_s) / span_s } else { 0.0 };
    let between = |a: f64, b: f64| a + share * (b - a);
    Measured {
        t_s,
        insertion_m: between(before.insertion_m, after.insertion_m),
        rotation_rad: between(before.rotation_rad, after.rotation_rad),
        force_n,
        drive_force_n: None,
        tip_m: None,
        guidewire: before.guidewire.zip(after.guidewire).map(|(a, b)| MeasuredDrive {
            insertion_m: between(a.insertion_m, b.insertion_m),
            rotation_rad: between(a.rotation_rad, b.rotation_rad),
            drive_force_n: None,
        }),
        tendons_m: std::array::from_fn(|k| {
            let (before, after) = before.tendons_m[k].zip(after.tendons_m[k])?;
            Some(between(before, after))
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(t_s: f64, insertion_m: f64) -> Measured {
        Measured {
            t_s,
            insertion_m,
            rotation_rad: -insertion_m,
            force_n: None,
            drive_force_n: None,
            tip_m: None,
            guidewire: None,
            tendons_m: [None; 4],
        }
    }

    fn motion<const N: usize>(rows: [Measured; N]) -> Trial {
        Trial { rows: rows.to_vec(), ..Trial::default() }
    }

    fn force(t_s: f64) -> ForceSample {
        ForceSample { t_s, force_n: [t_s; 3] }
    }

    #[test]
    fn a_force_takes_the_motion_of_its_time() {
        let motion = motion([at(0.0, 0.1), at(0.2, 0.2)]);
        let found = join(&motion, &[-0.1, 0.0, 0.1, 0.2, 0.3].map(force), 0.0);
        assert_eq!((found.forces, found.outside, found.in_gaps, found.others), (3, 2, 0, 0));
        let rows = found.trial.rows;
        let expected = 0.1 + 0.5 * (0.2 - 0.1);
        assert_eq!((rows[1].insertion_m, rows[1].rotation_rad), (expected, -expected));
        assert_eq!(rows[2].insertion_m, 0.2);
        assert_eq!(rows[2].force_n, Some([0.2; 3]));
        assert_eq!(join(&motion, &[force(0.0)], 2.0).outside, 1);
        assert_eq!(join(&Trial::default(), &[force(0.0)], 0.0).outside, 1);
    }

    #[test]
    fn nothing_is_invented_where_the_motion_was_not_logged() {
        let motion = motion([at(0.0, 0.1), at(0.2, 0.1), at(2.2, 0.3), at(2.4, 0.3)]);
        let found = join(&motion, &[0.1, 0.2, 0.3, 1.0, 2.2, 2.3].map(force), 0.0);
        assert_eq!((found.forces, found.outside, found.in_gaps), (4, 0, 2));
        assert!(found.trial.rows.iter().all(|row| row.insertion_m != 0.2), "{found:?}");
    }

    #[test]
    fn the_motion_goes_on_where_forces_were_lost() {
        let rows = [0.0, 0.1, 0.2, 0.3].map(|t_s| at(t_s, 0.1 + t_s * t_s));
        let found = join(&motion(rows), &[0.0, 0.3].map(force), 0.0);
        assert_eq!((found.forces, found.others), (2, 2));
        let [_, second, third, _] = found.trial.rows[..] else { panic!("{found:?}") };
        assert_eq!((second, third), (rows[1], rows[2]));
    }

    #[test]
    fn what_else_the_motion_has_keeps_its_rows() {
        let tip = Measured { tip_m: Some([1.0; 3]), ..at(0.1, 0.15) };
        let own = Measured { force_n: Some([9.0; 3]), drive_force_n: Some(0.5), ..at(0.2, 0.2) };
        let mut motion = motion([at(0.0, 0.1), tip, own]);
        motion.shapes_m = vec![vec![[2.0; 3]]];
        let found = join(&motion, &[0.05, 0.1].map(force), 0.0);
        assert_eq!((found.forces, found.others, found.had_force), (2, 3, true));
        let rows = &found.trial.rows;
        assert_eq!(rows.iter().map(|row| row.t_s).collect::<Vec<_>>(), [0.0, 0.05, 0.1, 0.2]);
        assert_eq!((rows[2].tip_m, rows[2].force_n), (Some([1.0; 3]), Some([0.1; 3])));
        assert_eq!((rows[3].drive_force_n, rows[3].force_n), (Some(0.5), None));
        assert_eq!(found.trial.shapes_m[0], [[2.0; 3]]);
    }
}
