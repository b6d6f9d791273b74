//! Contact of one sample point with the wall: normal force with a smooth onset, Coulomb
//! friction with sticking, linearised for the sweep.
//!
//! A sample does the same work whether it touches or not: what it finds scales its stiffness.

use cathforce_scalar::Vector3;

use crate::coaxial::Slide;
use crate::effects::acting::Law;
use crate::effects::wall_law::Slid;
use crate::proximity::Proximity;
use crate::{Real, Wall};

/// What a sample point remembers from tick to tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory<T: Real> {
    /// Elastic tangential displacement of the surface against the wall \[m\].
    pub slip: Vector3<T>,
    /// Length of the displacement at the end of the last tick, before the return map \[m\].
    pub reached: T,
    /// Normal force of the last solve \[N\].
    pub normal_n: T,
    /// Indentation that a relaxing wall has come to rest at \[m\].
    pub relaxed: T,
}

impl<T: Real> Memory<T> {
    pub fn new() -> Self {
        Self {
            slip: Vector3::zeros(),
            reached: T::lit(SHORTEST_SLIP_M),
            normal_n: T::zero(),
            relaxed: T::zero(),
        }
    }
}

/// The linearised contact of one sample point in one solve.
///
/// Force on the instrument: f_c − (stick I + push n nᵀ)(δx + δφ × arm).     docs/model.md (10)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch<T: Real> {
    /// Normal force at the predicted state \[N\].
    pub normal_n: T,
    /// Tangential stiffness, secant of Coulomb's law \[N/m\].
    pub stick: T,
    /// Normal stiffness less the tangential one \[N/m\].
    pub push: T,
    /// Tangential displacement at the predicted state \[m\].
    pub slip: Vector3<T>,
    /// Tangential stiffness before it slides \[N/m\].
    pub elastic: T,
    /// Force at which it slides \[N\].
    pub limit: T,
    /// What a relaxing wall comes to rest at \[m\].
    pub relaxed: T,
}

impl<T: Real> Touch<T> {
    pub fn none() -> Self {
        let (o, v) = (T::zero(), Vector3::zeros());
        Self { normal_n: o, stick: o, push: o, slip: v, elastic: o, limit: o, relaxed: o }
    }
}

/// How a sample point has moved since the step began.
pub(crate) struct Motion<'a, T: Real> {
    /// Of the centre line \[m\].
    pub displacement: Vector3<T>,
    /// Of the link \[rad\].
    pub turn: Vector3<T>,
    /// From the centre line to the surface \[m\].
    pub radius: T,
    /// Of the link, and how the surface slides along and about it.
    pub tangent: &'a Vector3<T>,
    pub slide: Slide<T>,
}

/// The wall's law with the constants of one solve.
pub(crate) struct Contact<T: Real> {
    onset: T,
    inverse_onset: T,
    /// Damping over stiffness, both per displacement of a step.
    damping: T,
    tangential_ratio: T,
    friction: T,
}

impl<T: Real> Contact<T> {
    pub fn new(wall: &Wall<T>, friction: T, inverse_dt: T) -> Self {
        Self {
            onset: wall.onset_m,
            inverse_onset: T::one() / wall.onset_m,
            damping: wall.damping_s * inverse_dt,
            tangential_ratio: wall.tangential_ratio,
            friction,
        }
    }

    /// `stiffness` \[N/m\] is the nominal one of the sample's share of the arc.
    #[inline(always)]
    pub fn touch<L: Law<T>>(
        &self,
        law: &L,
        seen: &Proximity<T>,
        stiffness: T,
        motion: &Motion<'_, T>,
        memory: &Memory<T>,
    ) -> Touch<T> {
        let half = T::lit(0.5);
        let n = &seen.normal;
        // Quadratic over the onset, then linear.     docs/model.md (11)
        let indented = (half * self.onset - seen.gap).positive();
        let within = indented.smaller(self.onset);
        let slope = within * self.inverse_onset;
        let indented = indented - within + half * slope * within;
        let (indented, slope, relaxed) = law.indentation(indented, slope, memory.relaxed);
        let sliding = || Slid {
            normal_n: memory.normal_n,
            slid_m: (memory.reached - memory.slip.dot(&memory.slip).root()).positive(),
        };
        let friction = law.friction(self.friction, sliding, stiffness);
        let stiffness = stiffness * seen.stiffness;
        let normal_stiffness = stiffness * slope;
        let damping = normal_stiffness * self.damping;
        let normal_force = stiffness * indented - damping * n.dot(&motion.displacement);

        // What the surface, at −r n from the centre line, has slid.
        let (mut displacement, mut turn) = (motion.displacement, motion.turn);
        if L::COAXIAL {
            displacement += motion.tangent * motion.slide.along_m;
            turn += motion.tangent * motion.slide.turn_rad;
        }
        let moved = (memory.slip + displacement).plus_cross(n, &(turn * motion.radius));
        let slip = moved - n * n.dot(&moved);
        let length = slip.dot(&slip).root().larger(memory.reached);
        // Secant of Coulomb's law at the predicted displacement.     docs/model.md (12)
        let elastic = normal_stiffness * self.tangential_ratio;
        let limit = friction * memory.normal_n;
        let stick = elastic.smaller(limit / length);
        Touch {
            normal_n: normal_force,
            stick,
            push: normal_stiffness + damping - stick,
            slip,
            elastic,
            limit,
            relaxed,
        }
    }
}

/// Far below what f32 resolves of a position; keeps quotients finite.
const SHORTEST_SLIP_M: f64 = 1e-12;
/// Likewise of forces.
const SMALLEST_FORCE_N: f64 = 1e-18;

impl<T: Real> Touch<T> {
    /// f_c, the force on the instrument at the predicted state.
    #[inline(always)]
    pub fn force(&self, seen: &Proximity<T>) -> Vector3<T> {
        seen.normal * self.normal_n - self.slip * self.stick
    }

    /// Force on the instrument after the node moved by `dx` and the link turned by `turn`, found
    /// by the `LAST` solve of a step alone; brings the memory up to date.
    #[inline(always)]
    pub fn resolve<const LAST: bool>(
        &self,
        seen: &mut Proximity<T>,
        dx: &Vector3<T>,
        turn: &Vector3<T>,
        memory: &mut Memory<T>,
        relaxes: bool,
    ) -> Vector3<T> {
        let n = &seen.normal;
        let moved = dx.plus_cross(turn, &seen.arm);
        let along = n.dot(&moved);
        let normal_n = self.normal_n - (self.stick + self.push) * along;
        memory.normal_n = normal_n.positive();
        if !LAST {
            seen.gap += along;
            return Vector3::zeros();
        }
        let slip = self.slip + moved - n * along;
        // Return map: what exceeds the limit has slid.     docs/model.md (13)
        memory.reached = slip.dot(&slip).root().larger(T::lit(SHORTEST_SLIP_M));
        let held = self.elastic * memory.reached;
        let share = held.smaller(self.limit) / held.larger(T::lit(SMALLEST_FORCE_N));
        memory.slip = slip * share;
        if relaxes {
            memory.relaxed = self.relaxed;
        }
        n * normal_n - slip * self.stick
    }
}
