//! The sightings of a whole recording: what is kept, and what contradicts its neighbours.

use rayon::prelude::*;

use crate::error::CameraError;
use crate::frames::frame::Frame;
use crate::frames::source::Frames;
use crate::shape::track::{Miss, Sighting, Tracker};

/// Frames that are searched at once: a few for each core, so that memory stays small.
const AT_ONCE: usize = 32;
/// Neighbours on each side with which a length is compared.
const NEIGHBOURS: usize = 3;
/// A length may differ from the median of its neighbours by this much \[m\] …
const MOST_JUMP_M: f64 = 3e-3;
/// … and by so many of the usual steps from frame to frame.
const MOST_STEPS: f64 = 3.0;

/// A frame that is kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    pub number: usize,
    /// Time since the first frame \[s\].
    pub t_s: f64,
    pub sighting: Sighting,
}

/// A frame that is not.
#[derive(Clone, Debug, PartialEq)]
pub struct Dropped {
    pub number: usize,
    pub why: Why,
}

/// Why a frame is dropped.
#[derive(Clone, Debug, PartialEq)]
pub enum Why {
    /// Its file is missing.
    Missing,
    /// It cannot be decoded.
    Unreadable(String),
    Miss(Miss),
    /// Its centre line is longer or shorter than those of its neighbours \[m\].
    Jump(f64),
}

/// All frames of a recording.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Sequence {
    /// By time.
    pub kept: Vec<Kept>,
    /// By number.
    pub dropped: Vec<Dropped>,
}

/// Searches every `every`-th frame for the catheter, on all cores. `progress` is told how many frames
/// are done.
pub fn follow(
    frames: &mut Frames,
    tracker: &Tracker,
    every: usize,
    mut progress: impl FnMut(usize),
) -> Result<Sequence, CameraError> {
    let mut found = Vec::new();
    let mut taken = 0;
    loop {
        let mut some = Vec::new();
        while some.len() < AT_ONCE
            && let Some(frame) = frames.next_frame()?
        {
            if taken % every == 0 {
                some.push(frame);
            }
            taken += 1;
        }
        if some.is_empty() {
            break;
        }
        found.par_extend(
            some.par_iter().map(|frame| (frame.number, frame.t_s, look(frame, tracker))),
        );
        progress(taken);
    }
    let missing = frames.missing().iter();
    let missing = missing.map(|number| Dropped { number: *number, why: Why::Missing });
    // With steps a file that is missing may be one that was not wanted.
    let missing = missing.filter(|_| every == 1);
    let mut sequence = Sequence { kept: Vec::new(), dropped: missing.collect() };
    for (number, t_s, seen) in found {
        match seen {
            Ok(sighting) => sequence.kept.push(Kept { number, t_s, sighting }),
            Err(why) => sequence.dropped.push(Dropped { number, why }),
        }
    }
    sequence.drop_jumps();
    sequence.dropped.sort_by_key(|dropped| dropped.number);
    Ok(sequence)
}

fn look(frame: &Frame, tracker: &Tracker) -> Result<Sighting, Why> {
    let picture = frame.picture().map_err(|e| Why::Unreadable(e.to_string()))?;
    tracker.track(&picture).map_err(Why::Miss)
}

impl Sequence {
    /// Drops frames whose length differs from that of their neighbours: part of the catheter is hidden,
    /// or something else is taken for it.
    fn drop_jumps(&mut self) {
        let lengths: Vec<f64> = self.kept.iter().map(|kept| kept.sighting.length_m).collect();
        let steps = lengths.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let usual_m = median(steps.collect()).unwrap_or(0.0);
        let jump = |i: usize| {
            let around = i.saturating_sub(NEIGHBOURS)..(i + NEIGHBOURS + 1).min(lengths.len());
            // At the ends of a motion only as many on one side as on the other.
            let reach = (i - around.start).min(around.end - 1 - i);
            let around = if reach > 0 { i - reach..i + reach + 1 } else { around };
            let others = around.filter(|j| *j != i).map(|j| lengths[j]).collect();
            let jump_m = lengths[i] - median(others)?;
            (jump_m.abs() > MOST_JUMP_M + MOST_STEPS * usual_m).then_some(jump_m)
        };
        let jumps: Vec<Option<f64>> = (0..lengths.len()).map(jump).collect();
        let mut kept = Vec::new();
        for (one, jump) in self.kept.drain(..).zip(jumps) {
            match jump {
                None => kept.push(one),
                Some(jump_m) => {
                    self.dropped.push(Dropped { number: one.number, why: Why::Jump(jump_m) });
                }
            }
        }
        self.kept = kept;
    }

    /// Noise of the tip from frame to frame, per axis \[m\]: what is left when a smooth motion is taken
    /// away by third differences, whose variance is twenty times that of the noise.
    ///
    /// `None` with fewer than eight frames.
    pub fn tip_noise_m(&self) -> Option<f64> {
        if self.kept.len() < 8 {
            return None;
        }
        // The median of a normal number's size is 0.6745 standard deviations.
        const OF_MEDIAN: f64 = 0.6745;
        let third = |axis: usize| {
            let tips: Vec<f64> = self.kept.iter().map(|kept| kept.sighting.tip_m[axis]).collect();
            let of = |four: &[f64]| (four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]).abs();
            median(tips.windows(4).map(of).collect()).unwrap_or(0.0)
        };
        let sizes = [0, 1, 2].map(|axis| third(axis) / OF_MEDIAN / 20.0_f64.sqrt());
        // The plane has two dimensions; the noise of a third axis is a mixture of theirs.
        Some((sizes.iter().map(|x| x * x).sum::<f64>() / 2.0).sqrt())
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

impl std::fmt::Display for Why {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Missing => write!(f, "there is no picture of this number"),
            Self::Unreadable(problem) => {
                write!(f, "{}", problem.lines().next().unwrap_or_default())
            }
            Self::Miss(miss) => write!(f, "{miss}"),
            Self::Jump(jump_m) => {
                let word = if *jump_m < 0.0 { "shorter" } else { "longer" };
                let size_mm = 1e3 * jump_m.abs();
                write!(f, "its centre line is {size_mm:.1} mm {word} than those of its neighbours")
            }
        }
    }
}

impl Why {
    /// What helps.
    pub fn fix(&self) -> &'static str {
        match self {
            Self::Missing => "give all pictures, or number them anew",
            Self::Unreadable(_) => "copy the pictures again",
            Self::Miss(miss) => miss.fix(),
            Self::Jump(_) => "take away what hides the catheter, or what looks like it",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(number: usize, length_m: f64) -> Kept {
        let sighting = Sighting {
            tip_m: [length_m, 0.0, 0.0],
            shape_m: Vec::new(),
            length_m,
            bridged_m: 0.0,
            unseen_at_entry_m: 0.0,
            side_branch_m: 0.0,
            threshold: 0.3,
            radius: 0.2,
        };
        Kept { number, t_s: number as f64 / 30.0, sighting }
    }

    #[test]
    fn a_frame_that_contradicts_its_neighbours_is_dropped_and_a_motion_is_not() {
        let length_m = |n: usize| 0.05 + 0.8e-3 * n as f64;
        let kept = (0..20).map(|n| kept(n, if n == 8 { 0.04 } else { length_m(n) })).collect();
        let mut sequence = Sequence { kept, dropped: Vec::new() };
        sequence.drop_jumps();
        let [Dropped { number: 8, why }] = &sequence.dropped[..] else { panic!("{sequence:?}") };
        assert_eq!(
            why.to_string(),
            "its centre line is 16.4 mm shorter than those of its neighbours"
        );
        assert_eq!(sequence.kept.len(), 19);
    }

    #[test]
    fn a_steady_motion_has_no_noise_and_noise_is_measured() {
        use rand::{Rng, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut frames: Vec<Kept> = (0..400).map(|n| kept(n, 0.05 + 1e-3 * n as f64)).collect();
        let still = Sequence { kept: frames.clone(), dropped: Vec::new() };
        assert!(still.tip_noise_m().unwrap() < 1e-12);
        for frame in &mut frames {
            for axis in 0..2 {
                // The sum of twelve even numbers has a variance of 1.
                let sum: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
                frame.sighting.tip_m[axis] += 1e-4 * sum;
            }
        }
        let noise_m = Sequence { kept: frames, dropped: Vec::new() }.tip_noise_m().unwrap();
        assert!((noise_m - 1e-4).abs() < 1.5e-5, "{noise_m}");
    }
}
