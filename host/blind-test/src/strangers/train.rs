//! Between the encoders and the instrument at the entry plane.

use std::f64::consts::TAU;

use cathforce_reference_solver::{Drive, Schedule};

use super::form::Form;
use crate::train::Load;

/// What is in series with the instrument takes this part of its change at once: all of it would swing.
const TAKEN: f64 = 0.1;
/// The instrument never leaves the vessel \[m\].
const LEAST_M: f64 = 5e-3;

/// What has become of the feed so far.
#[derive(Clone, Debug)]
pub struct Train<'a> {
    forms: &'a [Form],
    start: Drive,
    /// Encoder as a lag follows it.
    followed: Drive,
    /// Where the instrument is.
    now: Drive,
    /// Place in a dead zone, from 0 (pulled through) to its width (pushed through) \[m\].
    play_m: f64,
    /// Compression of the spring behind it \[m\].
    sprung_m: f64,
    /// Twist of the shaft before the entry \[rad\].
    wound_rad: f64,
    time_s: f64,
}

impl<'a> Train<'a> {
    /// At rest where a schedule begins.
    pub fn new(forms: &'a [Form], schedule: &Schedule) -> Self {
        let start = schedule.at(0.0);
        let guide_m = |form: &Form| match *form {
            Form::SkewGuide { length_m, .. } => length_m,
            _ => 0.0,
        };
        let past_m: f64 = forms.iter().map(guide_m).sum();
        let now = Drive { insertion_m: (start.insertion_m - past_m).max(LEAST_M), ..start };
        let widths = forms.iter().map(|form| match *form {
            Form::CompliantBacklash { width_m, .. } => width_m,
            _ => 0.0,
        });
        let play_m = widths.sum();
        let followed = start;
        let (sprung_m, wound_rad, time_s) = (0.0, 0.0, 0.0);
        Self { forms, start, followed, now, play_m, sprung_m, wound_rad, time_s }
    }

    /// Where the instrument is, before the first step.
    pub fn drive(&self) -> Drive {
        self.now
    }

    /// Where it is at `t_s`; `load`: what the drive pushed and turned with at the last step.
    pub fn advance(&mut self, schedule: &Schedule, t_s: f64, load: Load) -> Drive {
        let before = self.followed;
        self.followed = self.follow(schedule, t_s);
        let mut feed = self.followed.insertion_m - before.insertion_m;
        let mut spin = self.followed.rotation_rad - before.rotation_rad;
        let fed = self.followed.insertion_m - self.start.insertion_m;
        for form in self.forms {
            match *form {
                Form::UnevenScale { insertion, rotation, uneven, pitch_m } => {
                    let round = 1.0 + uneven * (TAU * fed / pitch_m).sin();
                    feed *= 1.0 + (insertion - 1.0) * round;
                    spin *= rotation;
                }
                Form::TwoHarmonics { ratio, second, pitch_m, phase } => {
                    let angle = TAU * (fed / pitch_m + phase);
                    let wave = angle.sin() + second * (2.0 * angle + 1.0).sin();
                    feed *= 1.0 + ratio * wave / (1.0 + second);
                }
                Form::ThresholdSlip { per_n, threshold_n } => {
                    let over_n = (load.force_n.abs() - threshold_n).max(0.0);
                    let lost = per_n * over_n.copysign(load.force_n);
                    feed -= feed.abs() * lost.clamp(-0.9, 0.9);
                }
                Form::CompliantBacklash { width_m, per_n } => {
                    let reached_m = self.play_m + feed;
                    self.play_m = reached_m.clamp(0.0, width_m);
                    let more_m = TAKEN * (per_n * load.force_n - self.sprung_m);
                    self.sprung_m += more_m;
                    feed = reached_m - self.play_m - more_m;
                }
                Form::Screw { m_per_rad } => feed += m_per_rad * spin,
                Form::RotaryRipple { ratio, per_turn, phase_rad } => {
                    let angle = per_turn * self.followed.rotation_rad + phase_rad;
                    spin *= 1.0 + ratio * angle.sin();
                }
                Form::HeldWindup { free_length_m, held_rad } => {
                    let off = free_length_m * load.twist_rad_per_m - self.wound_rad;
                    let more = TAKEN * (off.abs() - held_rad).max(0.0).copysign(off);
                    self.wound_rad += more;
                    spin -= more;
                }
                _ => {}
            }
        }
        self.now.insertion_m = (self.now.insertion_m + feed).max(LEAST_M);
        self.now.rotation_rad += spin;
        self.now
    }

    /// The encoder with all that is late about the drive.
    fn follow(&mut self, schedule: &Schedule, t_s: f64) -> Drive {
        let dt_s = t_s - self.time_s;
        self.time_s = t_s;
        let late = self.forms.iter().find_map(|form| match *form {
            Form::Sluggish { dead_s, lag_s } => Some((dead_s, lag_s)),
            _ => None,
        });
        let Some((dead_s, lag_s)) = late else { return schedule.at(t_s) };
        let (sent, share) = (schedule.at(t_s - dead_s), 1.0 - (-dt_s / lag_s).exp());
        let towards = |from: f64, to: f64| from + (to - from) * share;
        Drive {
            insertion_m: towards(self.followed.insertion_m, sent.insertion_m),
            rotation_rad: towards(self.followed.rotation_rad, sent.rotation_rad),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the instrument is after each of 4 ms of a feed of 20 mm/s for a second, and back.
    fn moved(form: Form, load: Load) -> Vec<Drive> {
        let there = Schedule::starting_at(0.03, 0.0).then(1.0, 0.0, 0.02, 1.0);
        let schedule = there.then(1.0, 0.0, -0.02, -1.0);
        let forms = [form];
        let mut train = Train::new(&forms, &schedule);
        (1..=500).map(|k| train.advance(&schedule, 4e-3 * f64::from(k), load)).collect()
    }

    #[test]
    fn drives_do_what_their_forms_say() {
        let rest = Load::default();
        let dead = moved(Form::CompliantBacklash { width_m: 1e-3, per_n: 0.0 }, rest);
        assert!((dead[249].insertion_m - 0.05).abs() < 1e-9, "pushed through at first");
        assert!((dead[499].insertion_m - 0.031).abs() < 1e-9);
        let load = Load { force_n: 0.05, ..rest };
        let soft = moved(Form::CompliantBacklash { width_m: 1e-3, per_n: 4e-3 }, load);
        assert!((soft[249].insertion_m - 0.0498).abs() < 1e-8);

        let late = moved(Form::Sluggish { dead_s: 0.02, lag_s: 0.03 }, rest);
        assert!((late[249].insertion_m - (0.05 - 0.02 * 0.05)).abs() < 5e-5);

        let slip = moved(Form::ThresholdSlip { per_n: 5.0, threshold_n: 0.01 }, load);
        assert!((slip[249].insertion_m - (0.03 + 0.02 * 0.8)).abs() < 1e-9);
        let held = Load { force_n: 0.01, ..rest };
        let none = moved(Form::ThresholdSlip { per_n: 5.0, threshold_n: 0.01 }, held);
        assert!((none[249].insertion_m - 0.05).abs() < 1e-9);

        let screw = moved(Form::Screw { m_per_rad: 1e-3 }, rest);
        assert!((screw[249].insertion_m - 0.051).abs() < 1e-9);

        let twisted = Load { twist_rad_per_m: 0.5, ..rest };
        let wound = moved(Form::HeldWindup { free_length_m: 0.4, held_rad: 0.05 }, twisted);
        assert!((wound[249].rotation_rad - (1.0 - 0.15)).abs() < 1e-6);
    }
}
