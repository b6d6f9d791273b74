//! Which encoder samples are accepted, and for how long.
//!
//! A sample is accepted if it is finite, within the drive's range, and no farther from the last
//! accepted one than the drive can have moved since. Only accepted samples reach the model. One bit
//! each records whether the newest ten frames and the newest ten samples were rejected.

use crate::limits::{positive, smaller};
use crate::memory_visitor::{MemoryWord, VisitMemory};
use crate::settings::ENCODER_TIMEOUT_HARD_TICKS;
use crate::{EncoderSample, Fault, Settings, TICK_S, TendonPair};

/// Number of frames and of samples in the window.
const WINDOW: u32 = 10;
/// Largest number of rejected frames in the window that is not a fault.
const MOST_BAD_FRAMES: u32 = 3;
/// Number of refused samples in the window that is a fault.
const JUMPS: u32 = 3;

/// Physical bounds of the drive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub insertion_step_m: f32,
    pub rotation_step_rad: f32,
    max_insertion_m: f32,
    max_rotation_rad: f32,
    tendon_step_m: f32,
    max_tendon_m: f32,
    timeout_ticks: u8,
}

impl Bounds {
    /// `reach_m`: the longest insertion that the model can represent.
    pub fn new(settings: &Settings, reach_m: f32) -> Self {
        let timeout = settings.encoder_timeout_ticks.clamp(1, ENCODER_TIMEOUT_HARD_TICKS);
        Self {
            insertion_step_m: settings.max_insertion_speed_m_per_s * TICK_S,
            rotation_step_rad: settings.max_rotation_speed_rad_per_s * TICK_S,
            max_insertion_m: smaller(positive(settings.max_insertion_m), positive(reach_m)),
            max_rotation_rad: settings.max_rotation_rad,
            tendon_step_m: settings.max_tendon_speed_m_per_s * TICK_S,
            max_tendon_m: settings.max_tendon_m,
            timeout_ticks: timeout as u8,
        }
    }
}

/// What an encoder states in one sample.
pub(crate) trait Sample: Copy {
    /// The fault of an encoder that is silent, and of one that jumps.
    const LOST: Fault;
    const JUMPED: Fault;
    // In this form, NaN on either side of a comparison is refused.
    fn is_in_range(self, bounds: &Bounds) -> bool;
    /// The drive can have moved there from `from` in a number of ticks.
    fn is_reachable(self, from: Self, bounds: &Bounds, ticks: u8) -> bool;
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>));
}

impl Sample for EncoderSample {
    const LOST: Fault = Fault::EncoderLost;
    const JUMPED: Fault = Fault::EncoderJump;

    fn is_in_range(self, bounds: &Bounds) -> bool {
        self.insertion_m >= 0.0
            && self.insertion_m <= bounds.max_insertion_m
            && self.rotation_rad.abs() <= bounds.max_rotation_rad
            && self.insertion_m.is_finite()
            && self.rotation_rad.is_finite()
    }

    fn is_reachable(self, from: Self, bounds: &Bounds, ticks: u8) -> bool {
        let ticks = f32::from(ticks);
        (self.insertion_m - from.insertion_m).abs() <= bounds.insertion_step_m * ticks
            && (self.rotation_rad - from.rotation_rad).abs() <= bounds.rotation_step_rad * ticks
    }

    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        visit(MemoryWord::F32(&mut self.insertion_m));
        visit(MemoryWord::F32(&mut self.rotation_rad));
    }
}

impl Sample for TendonPair {
    const LOST: Fault = Fault::TendonLost;
    const JUMPED: Fault = Fault::TendonJump;

    fn is_in_range(self, bounds: &Bounds) -> bool {
        self.displacements_m.iter().all(|x| x.abs() <= bounds.max_tendon_m && x.is_finite())
    }

    fn is_reachable(self, from: Self, bounds: &Bounds, ticks: u8) -> bool {
        let most_m = bounds.tendon_step_m * f32::from(ticks);
        let both = self.displacements_m.iter().zip(from.displacements_m);
        both.into_iter().all(|(to, from)| (to - from).abs() <= most_m)
    }

    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        self.displacements_m.iter_mut().for_each(|x| visit(MemoryWord::F32(x)));
    }
}

/// State of the checks on one encoder.
#[derive(Clone, Debug)]
pub(crate) struct Freshness<S> {
    /// The last accepted sample; `None` before the first one and once it is too old.
    last: Option<S>,
    age_ticks: u8,
    /// One bit per frame, the newest in bit 0; set if rejected.
    frames: u16,
    /// One bit per sample, the newest in bit 0; set if refused.
    samples: u16,
}

/// Result of the checks in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Status<S> {
    /// The last accepted sample, finite; `None` if it is too old or there is none.
    pub position: Option<S>,
    /// Ticks since the newest accepted sample; 0 if it came in this tick.
    pub age_ticks: u8,
    /// What the accepted sample of this tick follows; `None` if there was none.
    pub follows: Option<Follows<S>>,
    pub fault: Option<Fault>,
}

/// Status of a drive of insertion and rotation.
pub(crate) type EncoderStatus = Status<EncoderSample>;

/// The last accepted sample before one, and the ticks between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Follows<S> {
    from: S,
    ticks: u8,
}

impl EncoderStatus {
    /// Motion up to the sample of this tick.
    #[inline(always)]
    pub fn motion(&self) -> Motion {
        match (self.position, self.follows) {
            (Some(to), Some(Follows { from, ticks })) => Motion::Known {
                insertion_m: to.insertion_m - from.insertion_m,
                rotation_rad: to.rotation_rad - from.rotation_rad,
                ticks,
            },
            _ => Motion::Unknown,
        }
    }
}

/// Motion of the drive, as its samples tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motion {
    /// There was no accepted sample in this tick.
    Unknown,
    /// Motion in this tick and the `ticks − 1` before it, which had no sample \[m, rad\].
    Known { insertion_m: f32, rotation_rad: f32, ticks: u8 },
}

impl<S: Sample> Freshness<S> {
    pub const fn new() -> Self {
        Self { last: None, age_ticks: u8::MAX, frames: 0, samples: 0 }
    }

    /// Takes in the sample of a tick, and the number of frames that were rejected since the last one.
    pub fn update(&mut self, bounds: &Bounds, sample: Option<S>, rejected_frames: u8) -> Status<S> {
        for _ in 0..u32::from(rejected_frames).min(WINDOW) {
            shift(&mut self.frames, true);
        }
        let corrupt = self.last.is_some_and(|s| !s.is_in_range(bounds));
        if corrupt {
            self.forget();
        }
        self.age_ticks = self.age_ticks.saturating_add(1);

        let mut follows = None;
        if let Some(sample) = sample {
            shift(&mut self.frames, false);
            let accepted = self.accept(bounds, sample);
            shift(&mut self.samples, accepted.is_none());
            if accepted.is_some() {
                follows = accepted;
                self.last = Some(sample);
                self.age_ticks = 0;
            }
        }

        let jumped = self.samples.count_ones() >= JUMPS;
        if jumped {
            // Start over, because the drive may really be where the samples jumped to.
            self.samples = 0;
        }
        if jumped || self.age_ticks >= bounds.timeout_ticks {
            self.forget();
        }
        let fault = self.fault(corrupt, jumped);
        Status { position: self.last, age_ticks: self.age_ticks, follows, fault }
    }

    /// The accepted sample that this one follows, itself if it is the first; `None` if it is refused.
    #[inline(always)]
    fn accept(&self, bounds: &Bounds, sample: S) -> Option<Follows<S>> {
        match self.last {
            _ if !sample.is_in_range(bounds) => None,
            None => Some(Follows { from: sample, ticks: 1 }),
            Some(from) if sample.is_reachable(from, bounds, self.age_ticks) => {
                Some(Follows { from, ticks: self.age_ticks })
            }
            Some(_) => None,
        }
    }

    /// The gravest fault of this tick.
    #[inline(always)]
    fn fault(&self, corrupt: bool, jumped: bool) -> Option<Fault> {
        if corrupt {
            Some(Fault::StateNotFinite)
        } else if jumped {
            Some(S::JUMPED)
        } else if self.frames.count_ones() > MOST_BAD_FRAMES {
            Some(Fault::BadFrames)
        } else if self.last.is_none() {
            Some(S::LOST)
        } else {
            None
        }
    }

    /// Forgets the position: the next sample in range is accepted wherever it is.
    fn forget(&mut self) {
        self.last = None;
        self.age_ticks = u8::MAX;
    }
}

fn shift(history: &mut u16, bad: bool) {
    *history = (*history << 1 | u16::from(bad)) & ((1 << WINDOW) - 1);
}

impl<S: Sample> VisitMemory for Freshness<S> {
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        if let Some(last) = &mut self.last {
            last.visit_memory(visit);
        }
        visit(MemoryWord::U8(&mut self.age_ticks));
        visit(MemoryWord::U16(&mut self.frames));
        visit(MemoryWord::U16(&mut self.samples));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(insertion_m: f32, rotation_rad: f32) -> Option<EncoderSample> {
        Some(EncoderSample { insertion_m, rotation_rad })
    }

    #[test]
    fn the_first_sample_is_believed_only_within_range() {
        let bounds = Bounds::new(&Settings::default(), 0.128);
        let nan = f32::NAN;
        for (insertion_m, rotation_rad, believed) in [
            (0.0, 0.0, true),
            (0.128, -80.0, true),
            (0.129, 0.0, false),
            (-1e-6, 0.0, false),
            (0.1, 80.1, false),
            (nan, 0.0, false),
            (0.1, nan, false),
            (f32::INFINITY, 0.0, false),
        ] {
            let sample = sample(insertion_m, rotation_rad);
            let fresh = Freshness::new().update(&bounds, sample, 0);
            assert_eq!(fresh.position, sample.filter(|_| believed));
            assert_eq!(fresh.fault, (!believed).then_some(Fault::EncoderLost));
        }
    }

    #[test]
    fn settings_that_are_no_numbers_believe_nothing_far() {
        let mut settings = Settings::default();
        settings.corrupt(|_, _| f32::NAN);
        let bounds = Bounds::new(&settings, f32::NAN);
        assert_eq!(Freshness::new().update(&bounds, sample(0.1, 0.0), 0).position, None);
    }

    #[test]
    fn after_a_fault_of_jumps_the_drive_may_be_elsewhere() {
        let bounds = Bounds::new(&Settings::default(), 0.5);
        let mut freshness = Freshness::new();
        freshness.update(&bounds, sample(0.1, 0.0), 0);
        for _ in 0..2 {
            let fresh = freshness.update(&bounds, sample(0.2, 0.0), 0);
            assert_eq!(fresh.position.map(|p| p.insertion_m), Some(0.1));
        }
        let fresh = freshness.update(&bounds, sample(0.2, 0.0), 0);
        assert_eq!((fresh.position, fresh.fault), (None, Some(Fault::EncoderJump)));
        let fresh = freshness.update(&bounds, sample(0.2, 0.0), 0);
        assert_eq!((fresh.age_ticks, fresh.fault), (0, None));
    }

    #[test]
    fn tendons_are_believed_within_their_range_and_their_speed() {
        let settings = Settings::default();
        let bounds = Bounds::new(&settings, 0.5);
        let pair =
            |first_m: f32, second_m: f32| Some(TendonPair { displacements_m: [first_m, second_m] });
        let most_m = settings.max_tendon_m;
        for (sample, believed) in [
            (pair(-most_m, most_m), true),
            (pair(1.01 * most_m, 0.0), false),
            (pair(0.0, -1.01 * most_m), false),
            (pair(f32::NAN, 0.0), false),
        ] {
            let fresh = Freshness::new().update(&bounds, sample, 0);
            assert_eq!(fresh.position, sample.filter(|_| believed));
            assert_eq!(fresh.fault, (!believed).then_some(Fault::TendonLost));
        }
        let step_m = settings.max_tendon_speed_m_per_s * TICK_S;
        let mut freshness = Freshness::new();
        freshness.update(&bounds, pair(0.0, 0.0), 0);
        let fresh = freshness.update(&bounds, pair(0.0, 0.99 * step_m), 0);
        assert_eq!((fresh.age_ticks, fresh.fault), (0, None));
        let faults = [0; 3].map(|_| freshness.update(&bounds, pair(0.04, 0.0), 0).fault);
        assert_eq!(faults, [None, None, Some(Fault::TendonJump)]);
        let mut lost = freshness.update(&bounds, pair(0.0, 0.0), 0).fault;
        for _ in 0..settings.encoder_timeout_ticks {
            assert_eq!(lost, None);
            lost = freshness.update(&bounds, None, 0).fault;
        }
        assert_eq!(lost, Some(Fault::TendonLost));
    }
}
