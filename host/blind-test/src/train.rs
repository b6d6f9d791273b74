//! Between the encoders and the instrument at the entry plane.

use cathforce_reference_solver::{Drive, Schedule};

use crate::change::Change;

/// What the drive feels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Load {
    pub force_n: f64,
    pub twist_rad_per_m: f64,
}

/// What has become of the feed so far.
#[derive(Clone, Debug)]
pub struct Train<'a> {
    changes: &'a [Change],
    start: Drive,
    /// Encoder as the instrument follows it.
    last: Drive,
    /// Where the instrument is.
    now: Drive,
    /// Place in the dead zone, from −½ to ½ of its width.
    play: f64,
    jumped: bool,
    /// Twist of the shaft before the entry \[rad\].
    wound_rad: f64,
}

impl<'a> Train<'a> {
    /// At rest where a schedule begins.
    pub fn new(changes: &'a [Change], schedule: &Schedule) -> Self {
        let start = schedule.at(0.0);
        let guide: f64 = changes.iter().map(guide_m).sum();
        let now = Drive { insertion_m: start.insertion_m - guide, ..start };
        Self { changes, start, last: start, now, play: 0.5, jumped: false, wound_rad: 0.0 }
    }

    /// Where the instrument is, before the first step.
    pub fn drive(&self) -> Drive {
        self.now
    }

    /// Where it is at `t_s`; `load`: what the drive pushed and turned with at the last step, and the
    /// twist of a metre of shaft under it.
    pub fn advance(&mut self, schedule: &Schedule, t_s: f64, load: Load) -> Drive {
        let Load { force_n: load_n, twist_rad_per_m } = load;
        let late: f64 = self.changes.iter().map(latency_s).sum();
        let sent = schedule.at(t_s - late);
        let mut feed = sent.insertion_m - self.last.insertion_m;
        let mut spin = sent.rotation_rad - self.last.rotation_rad;
        self.last = sent;
        let fed = sent.insertion_m - self.start.insertion_m;
        for change in self.changes {
            match *change {
                Change::EncoderScale { insertion, rotation } => {
                    feed *= insertion;
                    spin *= rotation;
                }
                Change::Backlash { width_m } => {
                    // Taken up the more, the nearer the play is to its end.
                    let to_end = 0.5 - self.play * feed.signum();
                    let share = (-4.0 * to_end.max(0.0)).exp();
                    let share = if to_end <= 1e-3 { 1.0 } else { share };
                    self.play = (self.play + feed * (1.0 - share) / width_m).clamp(-0.5, 0.5);
                    feed *= share;
                }
                Change::Ripple { ratio, pitch_m, phase } => {
                    let share = (fed / pitch_m + phase).rem_euclid(1.0);
                    feed *= 1.0 + ratio * (4.0 * (share - 0.5).abs() - 1.0);
                }
                Change::Slip { per_n } => {
                    /// Loads that count fully \[N\].
                    const FULL_N: f64 = 0.02;
                    let counted = load_n * (load_n.abs() / FULL_N).tanh();
                    feed -= feed.abs() * (per_n * counted).clamp(-0.9, 0.9);
                }
                Change::Windup { free_length_m } => {
                    // The long free piece is softer than what is inside: taken at once, the two
                    // would swing.
                    const TAKEN: f64 = 0.1;
                    let more = TAKEN * (free_length_m * twist_rad_per_m - self.wound_rad);
                    self.wound_rad += more;
                    spin -= more;
                }
                Change::Jump { at_share, length_m }
                    if !self.jumped && t_s > at_share * schedule.end_s() =>
                {
                    self.jumped = true;
                    feed -= length_m;
                }
                _ => {}
            }
        }
        self.now.insertion_m = (self.now.insertion_m + feed).max(5e-3);
        self.now.rotation_rad += spin;
        self.now
    }
}

fn latency_s(change: &Change) -> f64 {
    match *change {
        Change::Latency { time_s } => time_s,
        _ => 0.0,
    }
}

fn guide_m(change: &Change) -> f64 {
    match *change {
        Change::Guide { length_m } => length_m,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shaft_that_twists_before_the_entry_turns_less_inside() {
        let rest = Schedule::starting_at(0.03, 1.0).then(1.0, 0.0, 0.0, 0.0);
        let changes = [Change::Windup { free_length_m: 0.4 }];
        let mut train = Train::new(&changes, &rest);
        let load = Load { force_n: 0.0, twist_rad_per_m: 0.5 };
        for k in 1..=200 {
            train.advance(&rest, 4e-3 * f64::from(k), load);
        }
        assert!((train.drive().rotation_rad - (1.0 - 0.4 * 0.5)).abs() < 1e-6);
        assert_eq!(train.drive().insertion_m, 0.03);
    }
}
