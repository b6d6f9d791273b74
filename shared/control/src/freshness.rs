//! Which encoder samples are accepted, and for how long.
//!
//! A sample is accepted if it is finite, within the drive's range, and no farther from the last
//! accepted one than the drive can have moved since. Only accepted samples reach the model. One bit
//! each records whether the newest ten frames and the newest ten samples were rejected.

use crate::limits::{positive, smaller};
use crate::memory_visitor::{MemoryWord, VisitMemory};
use crate::settings::ENCODER_TIMEOUT_HARD_TICKS;
use crate::{EncoderSample, Fault, Settings, TICK_S};

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
            timeout_ticks: timeout as u8,
        }
    }

    // In this form, NaN on either side of a comparison is refused.
    fn in_range(&self, s: EncoderSample) -> bool {
        s.insertion_m >= 0.0
            && s.insertion_m <= self.max_insertion_m
            && s.rotation_rad.abs() <= self.max_rotation_rad
            && s.insertion_m.is_finite()
            && s.rotation_rad.is_finite()
    }

    fn reachable(&self, from: EncoderSample, to: EncoderSample, ticks: u8) -> bool {
        let ticks = f32::from(ticks);
        (to.insertion_m - from.insertion_m).abs() <= self.insertion_step_m * ticks
            && (to.rotation_rad - from.rotation_rad).abs() <= self.rotation_step_rad * ticks
    }
}

/// State of the checks on one encoder.
#[derive(Clone, Debug)]
pub(crate) struct Freshness {
    /// The last accepted sample; `None` before the first one and once it is too old.
    last: Option<EncoderSample>,
    age_ticks: u8,
    /// One bit per frame, the newest in bit 0; set if rejected.
    frames: u16,
    /// One bit per sample, the newest in bit 0; set if refused.
    samples: u16,
}

/// Result of the checks in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EncoderStatus {
    /// The last accepted sample, finite; `None` if it is too old or there is none.
    pub position: Option<EncoderSample>,
    /// Ticks since the newest accepted sample; 0 if it came in this tick.
    pub age_ticks: u8,
    pub motion: Motion,
    pub fault: Option<Fault>,
}

/// Motion of the drive, as its samples tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motion {
    /// There was no accepted sample in this tick.
    Unknown,
    /// Motion in this tick and the `ticks − 1` before it, which had no sample \[m, rad\].
    Known { insertion_m: f32, rotation_rad: f32, ticks: u8 },
}

impl Freshness {
    pub fn new() -> Self {
        Self { last: None, age_ticks: u8::MAX, frames: 0, samples: 0 }
    }

    /// Takes in the sample of a tick, and the number of frames that were rejected since the last one.
    pub fn update(
        &mut self,
        bounds: &Bounds,
        sample: Option<EncoderSample>,
        rejected_frames: u8,
    ) -> EncoderStatus {
        for _ in 0..u32::from(rejected_frames).min(WINDOW) {
            shift(&mut self.frames, true);
        }
        let corrupt = self.last.is_some_and(|s| !bounds.in_range(s));
        if corrupt {
            self.forget();
        }
        self.age_ticks = self.age_ticks.saturating_add(1);

        let mut motion = Motion::Unknown;
        if let Some(sample) = sample {
            shift(&mut self.frames, false);
            let moved = self.motion_to(bounds, sample);
            shift(&mut self.samples, moved.is_none());
            if let Some(moved) = moved {
                motion = moved;
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
        EncoderStatus { position: self.last, age_ticks: self.age_ticks, motion, fault }
    }

    /// Motion from the last accepted sample to this one; `None` if the sample is refused.
    #[inline(always)]
    fn motion_to(&self, bounds: &Bounds, sample: EncoderSample) -> Option<Motion> {
        match self.last {
            _ if !bounds.in_range(sample) => None,
            None => Some(Motion::Known { insertion_m: 0.0, rotation_rad: 0.0, ticks: 1 }),
            Some(from) if bounds.reachable(from, sample, self.age_ticks) => Some(Motion::Known {
                insertion_m: sample.insertion_m - from.insertion_m,
                rotation_rad: sample.rotation_rad - from.rotation_rad,
                ticks: self.age_ticks,
            }),
            Some(_) => None,
        }
    }

    /// The gravest fault of this tick.
    #[inline(always)]
    fn fault(&self, corrupt: bool, jumped: bool) -> Option<Fault> {
        if corrupt {
            Some(Fault::StateNotFinite)
        } else if jumped {
            Some(Fault::EncoderJump)
        } else if self.frames.count_ones() > MOST_BAD_FRAMES {
            Some(Fault::BadFrames)
        } else if self.last.is_none() {
            Some(Fault::EncoderLost)
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

impl VisitMemory for Freshness {
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        if let Some(last) = &mut self.last {
            visit(MemoryWord::F32(&mut last.insertion_m));
            visit(MemoryWord::F32(&mut last.rotation_rad));
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
}
