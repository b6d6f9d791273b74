//! Errors of one solution against another.

use nalgebra::Vector3;
use serde::Serialize;

/// The compared quantities at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    pub t_s: f64,
    pub insertion_m: f64,
    pub rotation_rad: f64,
    /// Axial force on the instrument behind the guide \[N\].
    pub drive_force_n: f64,
    /// Torque there, about the direction of insertion \[N·m\].
    pub drive_torque_n_m: f64,
    pub force_on_vessel_n: Vector3<f64>,
    /// Its moment about the entry \[N·m\].
    pub moment_on_vessel_n_m: Vector3<f64>,
    pub tip_m: Vector3<f64>,
    /// Whether the model did not resolve this tick; always `false` for the reference.
    pub unresolved: bool,
}

/// A snap: the tip moves far faster than the drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Snap {
    /// Time of the snap in the reference \[s\].
    pub reference_s: f64,
    /// Time of the snap in the other solution; `None` if it has none \[s\].
    pub other_s: Option<f64>,
}

/// Root mean square errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Error of the drive's axial force \[N\], and as a share of the reference's peak.
    pub drive_force_n: f64,
    pub drive_force_share: f64,
    /// Error of the force on the vessel \[N\], and as a share of the reference's peak.
    pub force_n: f64,
    pub force_share: f64,
    /// Errors of the drive's torque and of the moment on the vessel, as shares of the reference's peaks;
    /// `None` if a peak is below 10 µN·m.
    pub drive_torque_share: Option<f64>,
    pub moment_share: Option<f64>,
    pub tip_m: f64,
}

/// Errors of a solution against the reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Largest magnitudes in the reference, except during the motion of a snap \[N\].
    pub peak_drive_force_n: f64,
    pub peak_force_n: f64,
    /// \[N·m\]
    pub peak_drive_torque_n_m: f64,
    pub peak_moment_n_m: f64,
    /// Errors over the whole scored time.
    pub whole: Errors,
    /// Errors outside of the time around snaps.
    pub outside_snaps: Errors,
    /// Share of time outside snaps.
    pub outside_share: f64,
    pub snaps: Vec<Snap>,
    /// Snaps that only the other solution has \[s\].
    pub extra_snaps_s: Vec<f64>,
    /// Largest force on the vessel that is not flagged as unresolved, over the reference's peak.
    pub unflagged_peak_share: f64,
}

/// Least peak of a moment that is scored; in a plane only the weight turns a straight instrument \[N·m\].
const SCORED_N_M: f64 = 1e-5;
/// Speed of the tip above which it snaps \[m/s\].
const SNAP_M_PER_S: f64 = 0.15;
/// Fast instants closer than this belong to one snap \[s\].
const ONE_SNAP_S: f64 = 0.1;
/// Snaps farther apart than this are not the same \[s\].
const SAME_SNAP_S: f64 = 0.5;
/// Time on either side of a snap that is left out of the errors outside snaps \[s\].
const AROUND_SNAP_S: f64 = 0.1;
/// Time before its greatest speed at which the tip begins to move in a snap \[s\].
const BEFORE_SNAP_S: f64 = 0.03;

/// Scores `other`, whose records are at the same instants or between, from `from_s` on.
pub fn compare(reference: &[Record], other: &[Record], from_s: f64) -> Score {
    let reference: Vec<Record> = reference.iter().copied().filter(|r| r.t_s >= from_s).collect();
    let fast = snaps(&reference);
    let mut unmatched = snaps(other);
    unmatched.retain(|&t| t >= from_s);
    let snaps = matched(&fast, &mut unmatched);
    let left_out = |t: f64| {
        let near = |from: f64, to: f64| t > from - AROUND_SNAP_S && t < to + AROUND_SNAP_S;
        snaps.iter().any(|snap| {
            let other = snap.other_s.unwrap_or(snap.reference_s);
            near(snap.reference_s.min(other), snap.reference_s.max(other))
        }) || unmatched.iter().any(|&t| near(t, t))
    };
    // The load that a snap releases counts in the peak. Spikes of its motion do not, because they
    // would make every share small.
    let moving =
        |t: f64| fast.iter().any(|snap| t > snap - BEFORE_SNAP_S && t < snap + AROUND_SNAP_S);
    let peaks = Peaks::of(reference.iter().filter(|r| !moving(r.t_s)));
    let errors = |keep: &dyn Fn(f64) -> bool| {
        errors(reference.iter().filter(|r| keep(r.t_s)), other, &peaks)
    };
    let (whole, all) = errors(&|_| true);
    let (outside_snaps, outside) = errors(&|t| !left_out(t));
    let unflagged = other.iter().filter(|r| r.t_s >= from_s && !r.unresolved);
    let unflagged_peak = unflagged.map(|r| r.force_on_vessel_n.norm()).fold(0.0, f64::max);
    Score {
        peak_drive_force_n: peaks.drive_force_n,
        peak_force_n: peaks.force_n,
        peak_drive_torque_n_m: peaks.drive_torque_n_m,
        peak_moment_n_m: peaks.moment_n_m,
        whole,
        outside_snaps,
        outside_share: outside / f64::max(all, 1.0),
        snaps,
        extra_snaps_s: unmatched,
        unflagged_peak_share: unflagged_peak / peaks.force_n,
    }
}

/// Matches each snap of the reference with the nearest one of the other solution, which is taken out of
/// `unmatched`.
fn matched(reference: &[f64], unmatched: &mut Vec<f64>) -> Vec<Snap> {
    let match_one = |&reference_s: &f64| {
        let near = (0..unmatched.len())
            .filter(|&i| (unmatched[i] - reference_s).abs() < SAME_SNAP_S)
            .min_by(|&a, &b| {
                let apart = |i: usize| (unmatched[i] - reference_s).abs();
                apart(a).total_cmp(&apart(b))
            });
        Snap { reference_s, other_s: near.map(|i| unmatched.remove(i)) }
    };
    reference.iter().map(match_one).collect()
}

/// Largest magnitudes in the reference.
struct Peaks {
    drive_force_n: f64,
    force_n: f64,
    drive_torque_n_m: f64,
    moment_n_m: f64,
}

impl Peaks {
    fn of<'a>(records: impl Iterator<Item = &'a Record> + Clone) -> Self {
        let peak = |of: fn(&Record) -> f64| records.clone().map(of).fold(0.0, f64::max);
        Self {
            drive_force_n: peak(|r| r.drive_force_n.abs()),
            force_n: peak(|r| r.force_on_vessel_n.norm()),
            drive_torque_n_m: peak(|r| r.drive_torque_n_m.abs()),
            moment_n_m: peak(|r| r.moment_on_vessel_n_m.norm()),
        }
    }
}

/// RMS errors of `other` at the times of these records of the reference, and the number of records.
fn errors<'a>(
    reference: impl Iterator<Item = &'a Record>,
    other: &[Record],
    peaks: &Peaks,
) -> (Errors, f64) {
    let mut sums = [0.0; 5];
    let mut count = 0.0;
    for r in reference {
        let Some(o) = at(other, r.t_s) else { continue };
        sums[0] += (o.drive_force_n - r.drive_force_n).powi(2);
        sums[1] += (o.force_on_vessel_n - r.force_on_vessel_n).norm_squared();
        sums[2] += (o.tip_m - r.tip_m).norm_squared();
        sums[3] += (o.drive_torque_n_m - r.drive_torque_n_m).powi(2);
        sums[4] += (o.moment_on_vessel_n_m - r.moment_on_vessel_n_m).norm_squared();
        count += 1.0;
    }
    let [drive_force_n, force_n, tip_m, drive_torque_n_m, moment_n_m] =
        sums.map(|sum| (sum / f64::max(count, 1.0)).sqrt());
    let errors = Errors {
        drive_force_n,
        drive_force_share: drive_force_n / peaks.drive_force_n,
        force_n,
        force_share: force_n / peaks.force_n,
        drive_torque_share: share_of_moment(drive_torque_n_m, peaks.drive_torque_n_m),
        moment_share: share_of_moment(moment_n_m, peaks.moment_n_m),
        tip_m,
    };
    (errors, count)
}

/// Error of a moment over its peak; `None` if the peak is not scored.
fn share_of_moment(error_n_m: f64, peak_n_m: f64) -> Option<f64> {
    (peak_n_m > SCORED_N_M).then(|| error_n_m / peak_n_m)
}

/// The record at a time, linearly interpolated.
fn at(records: &[Record], t_s: f64) -> Option<Record> {
    let after = records.partition_point(|r| r.t_s < t_s - 1e-9);
    let b = records.get(after)?;
    let Some(a) = after.checked_sub(1).map(|i| &records[i]) else { return Some(*b) };
    let share = (t_s - a.t_s) / (b.t_s - a.t_s);
    let blend = |x: f64, y: f64| x + (y - x) * share;
    Some(Record {
        t_s,
        insertion_m: blend(a.insertion_m, b.insertion_m),
        rotation_rad: blend(a.rotation_rad, b.rotation_rad),
        drive_force_n: blend(a.drive_force_n, b.drive_force_n),
        drive_torque_n_m: blend(a.drive_torque_n_m, b.drive_torque_n_m),
        force_on_vessel_n: a.force_on_vessel_n.lerp(&b.force_on_vessel_n, share),
        moment_on_vessel_n_m: a.moment_on_vessel_n_m.lerp(&b.moment_on_vessel_n_m, share),
        tip_m: a.tip_m.lerp(&b.tip_m, share),
        unresolved: a.unresolved || b.unresolved,
    })
}

/// The time of each snap: the first time at which the tip has half of its greatest speed. The greatest
/// speed itself may occur again when the tip swings back.
fn snaps(records: &[Record]) -> Vec<f64> {
    let fastest = |snap: &Vec<(f64, f64)>| {
        snap.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a }).unwrap_or_default()
    };
    let mut found: Vec<Vec<(f64, f64)>> = Vec::new();
    for pair in records.windows(2) {
        let speed = (pair[1].tip_m - pair[0].tip_m).norm() / (pair[1].t_s - pair[0].t_s);
        if speed < SNAP_M_PER_S {
            continue;
        }
        let t = pair[1].t_s;
        match found.last_mut() {
            Some(snap) if t - fastest(snap).0 < ONE_SNAP_S => {
                snap.push((t, speed));
            }
            _ => found.push(vec![(t, speed)]),
        }
    }
    let run_off = |snap: Vec<(f64, f64)>| {
        let greatest = fastest(&snap).1;
        snap.into_iter().find(|(_, speed)| *speed >= 0.5 * greatest)
    };
    found.into_iter().filter_map(run_off).map(|(t, _)| t).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tip that creeps, and jumps 5 mm within 10 ms at `jump_s`.
    fn records(jump_s: f64, error_n: f64) -> Vec<Record> {
        (0..1000)
            .map(|k| {
                let t_s = f64::from(k) * 2e-3;
                let jumped = ((t_s - jump_s) / 0.01).clamp(0.0, 1.0);
                Record {
                    t_s,
                    insertion_m: 0.01 * t_s,
                    rotation_rad: 0.0,
                    drive_force_n: 0.02 + error_n,
                    drive_torque_n_m: 4e-4 + 0.01 * error_n,
                    force_on_vessel_n: Vector3::x() * (0.03 + 0.1 * jumped),
                    moment_on_vessel_n_m: Vector3::z() * (5e-3 + 0.01 * error_n),
                    tip_m: Vector3::x() * (0.01 * t_s + 5e-3 * jumped),
                    unresolved: false,
                }
            })
            .collect()
    }

    #[test]
    fn a_snap_is_where_the_tip_runs_off_however_fast_it_swings_back() {
        let mut swinging = records(1.0, 0.0);
        for r in &mut swinging {
            // Back by 3 mm, within 4 ms, 40 ms later: half as fast again as it ran off.
            r.tip_m -= Vector3::x() * (3e-3 * ((r.t_s - 1.04) / 0.004).clamp(0.0, 1.0));
        }
        let [once, back] = [records(1.0, 0.0), swinging].map(|records| snaps(&records));
        assert_eq!((once.len(), &once), (1, &back));
    }

    #[test]
    fn a_late_snap_is_told_from_an_error() {
        let score = compare(&records(1.0, 0.0), &records(1.06, 1e-3), 0.1);
        let [snap] = &score.snaps[..] else { panic!("{:?}", score.snaps) };
        let late = snap.other_s.unwrap() - snap.reference_s;
        assert!((late - 0.06).abs() < 0.004, "{late}");
        assert!(score.whole.force_n > 0.015);
        assert!(score.outside_snaps.force_n < 1e-12);
        let outside = score.outside_snaps;
        for (share, exact) in [
            (outside.drive_force_share, 0.05),
            (outside.drive_torque_share.unwrap(), 0.025),
            (outside.moment_share.unwrap(), 0.002),
        ] {
            assert!((share - exact).abs() < 1e-9, "{share}, not {exact}");
        }
        assert!(score.extra_snaps_s.is_empty());
    }
}
