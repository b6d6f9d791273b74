//! Bending that relaxes as a standard linear solid.     docs/explanation/model.md (54)–(56)

use super::InstrumentViscoelastic;
use crate::Real;
use crate::tables::Joint;

/// The springs that relax beside the lasting ones of the joints.
#[derive(Clone, Debug)]
pub(crate) struct Springs<T, const LINKS: usize> {
    /// For link j: up and side of the bend at which the spring of the joint at its proximal end rests \[rad\].
    pub relaxed: [[T; 2]; LINKS],
    /// Stiffness over the lasting one, as the present solve sees it \[1\].
    ratio: T,
    /// The unloaded bend in the present solve over the nominal one \[1\].
    unloaded: T,
    /// Whether the instrument relaxes at all.
    pub act: bool,
}

impl<T: Real, const LINKS: usize> Springs<T, LINKS> {
    pub const fn new() -> Self {
        Self { relaxed: [[T::ZERO; 2]; LINKS], ratio: T::ZERO, unloaded: T::ONE, act: false }
    }

    /// Resets to [`Springs::new`] in place.
    pub fn reset(&mut self) {
        self.relaxed = [[T::zero(); 2]; LINKS];
        self.act = false;
    }

    /// Prepares for a solve in a step of `dt_s`; `None` on the way to rest, where all springs have relaxed.
    pub fn prepare(&mut self, effect: &InstrumentViscoelastic<T>, dt_s: Option<T>) {
        let one = T::one();
        self.act = effect.ratio > T::zero();
        (self.ratio, self.unloaded) = match dt_s {
            // Implicit Euler: at the end of the step the spring has relaxed towards the bend of then.
            Some(dt_s) => (effect.ratio * (one - relaxes(effect, dt_s)), one),
            None => (T::zero(), one - effect.ratio * strained(effect)),
        };
    }

    /// Adds the spring to the joint of link `index`.
    pub fn add_to(&self, index: usize, joint: &mut Joint<T>) {
        if let Some([up, side]) = self.relaxed.get(index).filter(|_| self.act) {
            let whole = T::one() + self.ratio;
            joint.bending *= whole;
            let rest =
                |unloaded: T, relaxed: T| (unloaded * self.unloaded + self.ratio * relaxed) / whole;
            let [unloaded_up, unloaded_side, twist] = joint.unloaded.into();
            joint.unloaded = [rest(unloaded_up, *up), rest(unloaded_side, *side), twist].into();
        }
    }
}

/// Share of a relaxation that takes place in a step.
pub(crate) fn relaxes<T: Real>(effect: &InstrumentViscoelastic<T>, dt_s: T) -> T {
    let steps = dt_s / effect.relaxation_s;
    steps / (T::one() + steps)
}

/// Strain of the spring of a joint at rest, over the unloaded bend \[1\]: that of a free joint whose spring rests at
/// what the package left of this bend.
pub(crate) fn strained<T: Real>(effect: &InstrumentViscoelastic<T>) -> T {
    effect.packed_share / (T::one() + effect.ratio)
}
