//! Rolling hash over every bit of every output.
//!
//! Each word is mixed in by a function that is one-to-one in the word and in the digest. A single
//! differing word therefore always changes the digest, whatever equal words follow. Two differing
//! words cancel by chance once in 2³². A word takes three instructions on a Cortex-M7.

use cathforce_mechanics as mechanics;

use crate::memory_visitor::{MemoryWord, VisitMemory};
use crate::{Fault, HapticSource, Outputs};

/// Number of words of [`Outputs::digest_words`].
const OUTPUT_WORDS: usize = 26;

impl Outputs {
    /// The bits of every output except the digest itself.
    pub(crate) fn digest_words(&self) -> [u32; OUTPUT_WORDS] {
        // No `..`, so that every output that is added must be added here.
        let Self {
            mode,
            fault,
            limited,
            haptic_source,
            force_n,
            torque_n_m,
            contact,
            band,
            encoder_age_ticks,
            guidewire_age_ticks,
            digest: _,
        } = *self;
        let mechanics::Outputs {
            force_on_vessel_n: [fx, fy, fz],
            moment_on_vessel_n_m: [mx, my, mz],
            drive_force_n,
            drive_torque_n_m,
            guidewire_force_n,
            guidewire_torque_n_m,
            peak_contact_force_n,
            peak_node,
            links,
            unresolved,
            // Always false here, because a lost tick is a fault and has no contact.
            lost: _,
        } = contact;
        // An unknown width has bits that no width has.
        let [bx, by, bz] = band.force_n.map_or([u32::MAX; 3], |xyz| xyz.map(f32::to_bits));
        let band_drive = band.drive_force_n.map_or(u32::MAX, f32::to_bits);
        [
            u32::from(mode.code()),
            u32::from(fault.map_or(0, Fault::code)),
            u32::from(limited.bits()),
            u32::from(haptic_source == HapticSource::Guidewire),
            force_n.to_bits(),
            torque_n_m.to_bits(),
            fx.to_bits(),
            fy.to_bits(),
            fz.to_bits(),
            mx.to_bits(),
            my.to_bits(),
            mz.to_bits(),
            drive_force_n.to_bits(),
            drive_torque_n_m.to_bits(),
            guidewire_force_n.to_bits(),
            guidewire_torque_n_m.to_bits(),
            peak_contact_force_n.to_bits(),
            u32::from(peak_node),
            u32::from(links),
            u32::from(unresolved),
            bx,
            by,
            bz,
            band_drive,
            u32::from(encoder_age_ticks),
            u32::from(guidewire_age_ticks),
        ]
    }
}

/// The digest so far.
#[derive(Clone, Debug)]
pub(crate) struct Digest(u32);

impl Digest {
    pub fn new() -> Self {
        Self(0x811C_9DC5)
    }

    pub fn value(&self) -> u32 {
        self.0
    }

    #[inline(always)]
    pub fn add(&mut self, word: u32) {
        self.0 = mixed(self.0, word);
    }

    /// Goes on from another value.
    #[cfg_attr(target_os = "none", expect(dead_code, reason = "of catheters abreast"))]
    pub fn set(&mut self, value: u32) {
        self.0 = value;
    }
}

/// The digest after one more word.
#[inline(always)]
pub(crate) fn mixed(digest: u32, word: u32) -> u32 {
    // Rotation and multiplication by an odd number are one-to-one.
    (digest.rotate_left(5) ^ word).wrapping_mul(0x9E37_79B1)
}

impl VisitMemory for Digest {
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>)) {
        visit(MemoryWord::U32(&mut self.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn p22_any_single_differing_bit_shows(
            words in prop::collection::vec(any::<u32>(), 1..200),
            at: prop::sample::Index,
            bit in 0u32..32,
        ) {
            let digest = |words: &[u32]| {
                let mut digest = Digest::new();
                words.iter().for_each(|&w| digest.add(w));
                digest.value()
            };
            let mut other = words.clone();
            *at.get_mut(&mut other) ^= 1 << bit;
            prop_assert_ne!(digest(&words), digest(&other));
        }
    }
}
