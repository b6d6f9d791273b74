//! Bending that relaxes as a standard linear solid.     docs/explanation/model.md (54)–(56)

use cathforce_scalar::Vector3;

use super::InstrumentViscoelastic;
use crate::Real;
use crate::algebra::{RelativeRotation, Rotation};
use crate::tables::Joint;

/// The two joints at the base link, whose cells are not full: the guide's, and the one before it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entering<T> {
    /// Arcs of the full cells over those of the cells \[1\].
    pub whole: [T; 2],
    /// Shares of the cells that have entered in this step \[1\].
    pub entered: [T; 2],
}

impl<T: Real> Entering<T> {
    /// What `whole` and `entered` are of the joint so many joints before the guide's.
    fn cell(&self, before: usize) -> (T, T) {
        let cell = self.whole.get(before).zip(self.entered.get(before));
        cell.map_or((T::one(), T::zero()), |(whole, entered)| (*whole, *entered))
    }
}

/// The springs that relax beside the lasting ones of the joints, in one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Relaxation<T> {
    /// Stiffness over the lasting one \[1\].
    ratio: T,
    /// Share of a relaxation that takes place in a step; `None` at rest, where all of it has.
    relaxes: Option<T>,
    /// Share of the unloaded bend from which the springs have crept away in the package \[1\].
    packed: T,
}

impl<T: Real> Relaxation<T> {
    /// `dt_s`: of a step; `None` on the way to rest. `None` for an instrument that does not relax.
    pub fn new(effect: &InstrumentViscoelastic<T>, dt_s: Option<T>) -> Option<Self> {
        (effect.ratio > T::zero()).then(|| {
            let relaxes = dt_s.map(|dt_s| {
                let steps = dt_s / effect.relaxation_s;
                steps / (T::one() + steps)
            });
            Self { ratio: effect.ratio, relaxes, packed: effect.packed_share }
        })
    }

    /// Adds the spring to a joint. `relaxed`: up and side of the bend of its full cell at which the spring rests \[rad\].
    pub fn add_spring(&self, relaxed: &[T; 2], joint: &mut Joint<T>) {
        let [up, side, twist] = joint.unloaded.into();
        let [up, side] = match self.relaxes {
            // Implicit Euler: at the end of the step the spring has relaxed towards the bend of then.
            Some(relaxes) => {
                let ratio = self.ratio * (T::one() - relaxes);
                let whole = T::one() + ratio;
                joint.bending *= whole;
                let rest = |unloaded: T, relaxed: T| (unloaded + ratio * relaxed) / whole;
                [rest(up, relaxed[0]), rest(side, relaxed[1])]
            }
            None => [up, side].map(|unloaded| unloaded - unloaded * self.ratio * self.strained()),
        };
        joint.unloaded = Vector3::new(up, side, twist);
    }

    /// Strain of the spring of a joint at rest, over the unloaded bend \[1\]: that of a free joint whose spring rests at
    /// what the package left of this bend.
    fn strained(&self) -> T {
        self.packed / (T::one() + self.ratio)
    }

    /// Relaxes the springs of the links inside the vessel after the last solve of a step.
    ///
    /// `rotation`: of each link, and of the guide behind the last one; `relaxed`: of each joint.
    pub fn finish<'r>(
        &self,
        links: usize,
        rotation: impl Fn(usize) -> &'r Rotation<T>,
        joints: &[Joint<T>],
        base: &Entering<T>,
        relaxed: &mut [[T; 2]],
    ) where
        T: 'r,
    {
        let zero = T::zero();
        for (j, (relaxed, joint)) in relaxed.iter_mut().zip(joints).take(links + 1).enumerate() {
            let [up, side, _] = joint.unloaded.into();
            // In the guide it is as straight as it was packed.
            let in_guide = [up, side].map(|unloaded| unloaded * (T::one() - self.packed));
            if j == links {
                *relaxed = in_guide;
                break;
            }
            let (whole, entered) = base.cell(links - 1 - j);
            let bend = RelativeRotation::between(rotation(j + 1), rotation(j)).angle * whole;
            let now = [(bend.x(), up, in_guide[0]), (bend.y(), side, in_guide[1])];
            for (relaxed, (bend, unloaded, in_guide)) in relaxed.iter_mut().zip(now) {
                match self.relaxes {
                    Some(relaxes) => {
                        *relaxed += (bend - *relaxed) * relaxes;
                        if entered > zero {
                            *relaxed += (in_guide - *relaxed) * entered;
                        }
                    }
                    None => *relaxed = bend - unloaded * self.strained(),
                }
            }
        }
    }
}
