//! Contact of one sample point with the wall: normal force with a smooth onset, Coulomb
//! friction with sticking, linearised for the sweep.
//!
//! A sample does the same work whether it touches or not: what it finds scales its stiffness.

use cathforce_scalar::{Number, Pack, Vector3};

use crate::coaxial::Slide;
use crate::effects::acting::Law;
use crate::proximity::Proximity;
use crate::sweep::Scheme;
use crate::{Real, Wall};

/// What a sample point remembers from tick to tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory<T: Number> {
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
    pub const fn new() -> Self {
        // [`SHORTEST_SLIP_M`], as a constant.
        Self { slip: T::ORIGIN, reached: T::PICO, normal_n: T::ZERO, relaxed: T::ZERO }
    }
}

impl<N: Number> Memory<N> {
    /// The memories of some lanes side by side.
    #[inline(always)]
    pub fn side_by_side<'a, T: Real>(of: impl Fn(usize) -> &'a Memory<T>) -> Self
    where
        N: Pack<T>,
    {
        Self {
            slip: N::vectors(|lane| of(lane).slip),
            reached: N::each(|lane| of(lane).reached),
            normal_n: N::each(|lane| of(lane).normal_n),
            relaxed: N::each(|lane| of(lane).relaxed),
        }
    }
}

/// The linearised contact of one sample point in one solve.
///
/// Force on the instrument: f_c − (stick I + push n nᵀ)(δx + δφ × arm).     docs/model.md (10)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch<T: Number> {
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
    pub const fn none() -> Self {
        let (o, v) = (T::ZERO, T::ORIGIN);
        Self { normal_n: o, stick: o, push: o, slip: v, elastic: o, limit: o, relaxed: o }
    }
}

/// The wall that a sample point faces.
pub(crate) struct Facing<T: Number> {
    /// Normal into the lumen.
    pub normal: Vector3<T>,
    /// From the surface to the wall, negative if it is indented \[m\].
    pub gap: T,
    /// The wall's stiffness over the nominal one.
    pub stiffness: T,
}

impl<N: Number> Facing<N> {
    /// Those of some lanes side by side.
    #[inline(always)]
    pub fn side_by_side<'a, T: Real>(of: impl Fn(usize) -> &'a Proximity<T>) -> Self
    where
        N: Pack<T>,
    {
        Self {
            normal: N::vectors(|lane| of(lane).normal),
            gap: N::each(|lane| of(lane).gap),
            stiffness: N::each(|lane| of(lane).stiffness),
        }
    }
}

/// How a sample point has moved since the step began.
pub(crate) struct Motion<T: Number> {
    /// Of the centre line \[m\].
    pub displacement: Vector3<T>,
    /// Of the link \[rad\].
    pub turn: Vector3<T>,
    /// From the centre line to the surface \[m\].
    pub radius: T,
    /// Of the link, and how the surface slides along and about it.
    pub tangent: Vector3<T>,
    pub slide: Slide<T>,
}

/// The wall's law with the constants of one solve.
pub(crate) struct Contact<T> {
    onset: T,
    inverse_onset: T,
    /// Damping over stiffness, both per displacement of a step.
    damping: T,
    tangential_ratio: T,
    friction: T,
    sliding: T,
}

impl<N: Number> Contact<N> {
    pub fn new<T: Real>(wall: &Wall<T>, scheme: &Scheme<T>, inverse_dt: T) -> Self
    where
        N: Pack<T>,
    {
        Self {
            onset: N::all(wall.onset_m),
            inverse_onset: N::all(T::one() / wall.onset_m),
            damping: N::all(wall.damping_s * inverse_dt),
            tangential_ratio: N::all(wall.tangential_ratio),
            friction: N::all(scheme.friction),
            sliding: N::all(scheme.sliding[0]),
        }
    }

    /// `stiffness` \[N/m\] is the nominal one of the piece `arc_m` that the sample stands for, at the
    /// tip with what the end adds.
    #[inline(always)]
    pub fn touch<T: Real, L: Law<T>>(
        &self,
        law: &L,
        seen: &Facing<N>,
        stiffness: N,
        arc_m: N,
        motion: &Motion<N>,
        memory: &Memory<N>,
    ) -> Touch<N>
    where
        N: Pack<T>,
    {
        let half = N::lit(0.5);
        let n = &seen.normal;
        // Quadratic over the onset, then linear.     docs/model.md (11)
        let indented = (half * self.onset - seen.gap).positive();
        let within = indented.smaller(self.onset);
        let slope = within * self.inverse_onset;
        let indented = indented - within + half * slope * within;
        let (indented, slope, relaxed) = law.indentation(indented, slope, memory.relaxed);
        let friction = law.friction(self.friction, memory.normal_n, arc_m);
        let stiffness = stiffness * seen.stiffness;
        let normal_stiffness = stiffness * slope;
        let damping = normal_stiffness * self.damping;
        let normal_force = stiffness * indented - damping * n.dot(&motion.displacement);

        // What the surface, at −r n from the centre line, has slid.
        let (mut displacement, mut turn) = (motion.displacement, motion.turn);
        let mut sliding = self.sliding;
        if L::COAXIAL {
            sliding = motion.slide.of_last;
            displacement += motion.tangent * motion.slide.along_m;
            turn += motion.tangent * motion.slide.turn_rad;
        }
        let moved = (memory.slip + displacement).plus_cross(n, &(turn * motion.radius));
        let slip = moved - n * n.dot(&moved);
        let length = slip.dot(&slip).root().larger(memory.reached * sliding);
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
const SHORTEST_SLIP_M: f64 = f64::PICO;
/// Likewise of forces.
const SMALLEST_FORCE_N: f64 = 1e-18;

impl<N: Number> Touch<N> {
    /// f_c, the force on the instrument at the predicted state.
    #[inline(always)]
    pub fn force(&self, normal: &Vector3<N>) -> Vector3<N> {
        normal * self.normal_n - self.slip * self.stick
    }

    /// The contact of each lane.
    #[inline(always)]
    pub fn apart<T: Real>(self) -> N::Lanes<Touch<T>>
    where
        N: Pack<T>,
    {
        let slip = N::apart(self.slip);
        N::lanes(|lane| Touch {
            normal_n: self.normal_n.lane(lane),
            stick: self.stick.lane(lane),
            push: self.push.lane(lane),
            slip: slip[lane],
            elastic: self.elastic.lane(lane),
            limit: self.limit.lane(lane),
            relaxed: self.relaxed.lane(lane),
        })
    }

    /// After the node moved by `dx` and the link turned by `turn`; all but the normal part is
    /// found by the `LAST` solve of a step alone.
    #[inline(always)]
    pub fn resolve<const LAST: bool>(
        &self,
        normal: &Vector3<N>,
        arm: &Vector3<N>,
        dx: &Vector3<N>,
        turn: &Vector3<N>,
    ) -> Resolved<N> {
        let moved = dx.plus_cross(turn, arm);
        let along = normal.dot(&moved);
        let pressed_n = self.normal_n - (self.stick + self.push) * along;
        let normal_n = pressed_n.positive();
        if !LAST {
            let (zero, v) = (N::lit(0.0), Vector3::zeros());
            return Resolved { along, normal_n, reached: zero, slip: v, force: v };
        }
        let slip = self.slip + moved - normal * along;
        // Return map: what exceeds the limit has slid.     docs/model.md (13)
        let reached = slip.dot(&slip).root().larger(N::lit(SHORTEST_SLIP_M));
        let held = self.elastic * reached;
        let share = held.smaller(self.limit) / held.larger(N::lit(SMALLEST_FORCE_N));
        let force = normal * pressed_n - slip * self.stick;
        Resolved { along, normal_n, reached, slip: slip * share, force }
    }

    /// Those of some lanes side by side.
    #[inline(always)]
    pub fn side_by_side<'a, T: Real>(of: impl Fn(usize) -> &'a Touch<T>) -> Self
    where
        N: Pack<T>,
    {
        Self {
            normal_n: N::each(|lane| of(lane).normal_n),
            stick: N::each(|lane| of(lane).stick),
            push: N::each(|lane| of(lane).push),
            slip: N::vectors(|lane| of(lane).slip),
            elastic: N::each(|lane| of(lane).elastic),
            limit: N::each(|lane| of(lane).limit),
            relaxed: N::each(|lane| of(lane).relaxed),
        }
    }
}

/// What a solve has found at a sample point.
pub(crate) struct Resolved<T: Number> {
    /// Motion along the normal \[m\].
    pub along: T,
    /// What [`Memory`] keeps of it.
    pub normal_n: T,
    pub reached: T,
    pub slip: Vector3<T>,
    /// On the instrument \[N\].
    pub force: Vector3<T>,
}
