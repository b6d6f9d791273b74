//! Contact of one sample point with the wall, linearised for the solve: normal force with a smooth
//! onset, and Coulomb friction by return mapping.
//!
//! A sample takes the same operations whether it touches or not; without contact its stiffness is 0.

use cathforce_scalar::{Catheters, Gather, Number, Pack, Vector3};

use crate::effects::active::Law;
use crate::overlap::Slide;
use crate::proximity::Proximity;
use crate::scheme::Scheme;
use crate::{Real, Wall};

/// State of a contact that is kept from step to step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactState<T: Number> {
    /// Elastic tangential displacement of the surface against the wall, vessel frame \[m\].
    pub slip: Vector3<T>,
    /// Length of the trial displacement at the end of the last step, before return mapping \[m\].
    pub trial_slip_m: T,
    /// Normal force of the last solve \[N\].
    pub normal_n: T,
    /// Indentation to which the viscous part of the wall has relaxed \[m\].
    pub relaxed: T,
}

impl<T: Real> ContactState<T> {
    pub const fn new() -> Self {
        // [`SHORTEST_SLIP_M`], as a constant.
        Self { slip: T::ORIGIN, trial_slip_m: T::PICO, normal_n: T::ZERO, relaxed: T::ZERO }
    }
}

impl<N: Number> ContactState<N> {
    /// Gathers the states of several lanes.
    #[inline(always)]
    pub fn gather<'a, S: Number + 'a>(of: impl Fn(usize) -> &'a ContactState<S>) -> Self
    where
        N: Gather<S>,
    {
        Self {
            slip: N::gather_vectors(|lane| of(lane).slip),
            trial_slip_m: N::from_lanes(|lane| of(lane).trial_slip_m),
            normal_n: N::from_lanes(|lane| of(lane).normal_n),
            relaxed: N::from_lanes(|lane| of(lane).relaxed),
        }
    }
}

/// The linearised contact of one sample point in one solve.     docs/explanation/model.md (11)
///
/// Force on the instrument: f_c − (k_s I + p n nᵀ)(δx + δφ × arm), with the tangential stiffness k_s
/// and the excess p of the normal over the tangential stiffness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinearContact<T: Number> {
    /// Normal force at the predicted state \[N\].
    pub normal_n: T,
    /// k_s: secant of Coulomb's law \[N/m\].
    pub tangential_stiffness: T,
    /// p: normal stiffness minus k_s \[N/m\].
    pub normal_excess: T,
    /// Trial tangential displacement at the predicted state, vessel frame \[m\].
    pub slip: Vector3<T>,
    /// Tangential stiffness while the contact sticks \[N/m\].
    pub sticking_stiffness: T,
    /// Tangential force at which the contact slides \[N\].
    pub friction_limit_n: T,
    /// As [`ContactState::relaxed`], at the end of this step \[m\].
    pub relaxed: T,
}

impl<T: Real> LinearContact<T> {
    pub const fn none() -> Self {
        let (o, v) = (T::ZERO, T::ORIGIN);
        Self {
            normal_n: o,
            tangential_stiffness: o,
            normal_excess: o,
            slip: v,
            sticking_stiffness: o,
            friction_limit_n: o,
            relaxed: o,
        }
    }
}

/// The wall at a sample point.
pub(crate) struct WallGap<T: Number> {
    /// Unit normal into the lumen.
    pub normal: Vector3<T>,
    /// Distance from the surface to the wall; negative when the wall is indented \[m\].
    pub gap: T,
    /// Stiffness of the wall over the nominal one \[1\].
    pub stiffness: T,
}

impl<N: Number> WallGap<N> {
    /// Gathers those of several lanes.
    #[inline(always)]
    pub fn gather<'a, S: Number + 'a>(of: impl Fn(usize) -> &'a Proximity<S>) -> Self
    where
        N: Gather<S>,
    {
        Self {
            normal: N::gather_vectors(|lane| of(lane).normal),
            gap: N::from_lanes(|lane| of(lane).gap),
            stiffness: N::from_lanes(|lane| of(lane).stiffness),
        }
    }
}

/// Motion of a sample point since the step began.
pub(crate) struct Motion<T: Number> {
    /// Displacement of the centre line \[m\].
    pub displacement: Vector3<T>,
    /// Rotation of the link \[rad\].
    pub turn: Vector3<T>,
    /// Radius of the instrument \[m\].
    pub radius: T,
    /// Tangent of the link, and how the surface slides along and about it.
    pub tangent: Vector3<T>,
    pub slide: Slide<T>,
}

/// The contact law of the wall with the constants of one solve.
pub(crate) struct ContactLaw<T> {
    onset: T,
    inverse_onset: T,
    /// Normal damping over normal stiffness, both per displacement in a step \[1\].
    damping: T,
    tangential_ratio: T,
    friction: T,
    sliding: T,
}

impl<N: Number> ContactLaw<N> {
    #[inline(always)]
    pub fn new<S: Number>(wall: &Wall<S>, scheme: &Scheme<S>, inverse_dt: S) -> Self
    where
        N: Gather<S>,
    {
        Self {
            onset: N::splat(wall.onset_m),
            inverse_onset: N::splat(S::lit(1.0) / wall.onset_m),
            damping: N::splat(wall.damping_s * inverse_dt),
            tangential_ratio: N::splat(wall.tangential_ratio),
            friction: N::splat(scheme.friction),
            sliding: N::splat(scheme.sliding[0]),
        }
    }

    /// Linearises the contact of one sample at the predicted state.     docs/explanation/model.md (11)
    ///
    /// `stiffness`: nominal normal stiffness of the sample \[N/m\], at the tip including the end's;
    /// `arc_m`: tributary length of the sample \[m\].
    #[inline(always)]
    pub fn linearise<S: Catheters, L: Law<S>>(
        &self,
        law: &L,
        wall: &WallGap<N>,
        stiffness: N,
        arc_m: N,
        motion: &Motion<N>,
        memory: &ContactState<N>,
    ) -> LinearContact<N>
    where
        N: Pack<S>,
    {
        let half = N::lit(0.5);
        let n = &wall.normal;
        // The force grows quadratically over the onset, then linearly.     docs/explanation/model.md (10)
        let indented = (half * self.onset - wall.gap).positive();
        let within = indented.smaller(self.onset);
        let slope = within * self.inverse_onset;
        let indented = indented - within + half * slope * within;
        let (indented, slope, relaxed) = law.indentation_response(indented, slope, memory.relaxed);
        let friction = law.friction(self.friction, memory.normal_n, arc_m);
        let stiffness = stiffness * wall.stiffness;
        let normal_stiffness = stiffness * slope;
        let damping = normal_stiffness * self.damping;
        let normal_force = stiffness * indented - damping * n.dot(&motion.displacement);

        // Slip of the surface, which lies at −r n from the centre line.
        let (mut displacement, mut turn) = (motion.displacement, motion.turn);
        let mut sliding = self.sliding;
        if L::COAXIAL {
            sliding = motion.slide.ratio_to_last;
            displacement += motion.tangent * motion.slide.along_m;
            turn += motion.tangent * motion.slide.turn_rad;
        }
        let moved = (memory.slip + displacement).plus_cross(n, &(turn * motion.radius));
        let slip = moved - n * n.dot(&moved);
        let length = slip.dot(&slip).root().larger(memory.trial_slip_m * sliding);
        // Secant of Coulomb's law at the predicted slip.     docs/explanation/model.md (12)
        let sticking_stiffness = normal_stiffness * self.tangential_ratio;
        let friction_limit_n = friction * memory.normal_n;
        let tangential_stiffness = sticking_stiffness.smaller(friction_limit_n / length);
        LinearContact {
            normal_n: normal_force,
            tangential_stiffness,
            normal_excess: normal_stiffness + damping - tangential_stiffness,
            slip,
            sticking_stiffness,
            friction_limit_n,
            relaxed,
        }
    }
}

/// Shortest slip that is divided by: far below the resolution of positions in `f32`.
const SHORTEST_SLIP_M: f64 = f64::PICO;
/// Smallest force that is divided by, likewise.
const SMALLEST_FORCE_N: f64 = 1e-18;

impl<N: Number> LinearContact<N> {
    /// f_c: force on the instrument at the predicted state \[N\].
    #[inline(always)]
    pub fn force(&self, normal: &Vector3<N>) -> Vector3<N> {
        normal * self.normal_n - self.slip * self.tangential_stiffness
    }

    /// Splits into the contacts of the lanes.
    #[inline(always)]
    pub fn split<S: Number>(self) -> N::Lanes<LinearContact<S>>
    where
        N: Pack<S>,
    {
        let slip = N::split_vectors(self.slip);
        N::per_lane(|lane| LinearContact {
            normal_n: self.normal_n.lane(lane),
            tangential_stiffness: self.tangential_stiffness.lane(lane),
            normal_excess: self.normal_excess.lane(lane),
            slip: slip[lane],
            sticking_stiffness: self.sticking_stiffness.lane(lane),
            friction_limit_n: self.friction_limit_n.lane(lane),
            relaxed: self.relaxed.lane(lane),
        })
    }

    /// Updates the contact after its node moved by `dx` \[m\] and its link turned by `turn` \[rad\].
    ///
    /// Only the `LAST` solve of a step computes more than the normal part.
    #[inline(always)]
    pub fn return_mapping<const LAST: bool>(
        &self,
        normal: &Vector3<N>,
        arm: &Vector3<N>,
        dx: &Vector3<N>,
        turn: &Vector3<N>,
    ) -> ContactUpdate<N> {
        let moved = dx.plus_cross(turn, arm);
        let along = normal.dot(&moved);
        let pressed_n = self.normal_n - (self.tangential_stiffness + self.normal_excess) * along;
        let normal_n = pressed_n.positive();
        if !LAST {
            let (zero, v) = (N::lit(0.0), Vector3::zeros());
            return ContactUpdate { along, normal_n, trial_slip_m: zero, slip: v, force: v };
        }
        let slip = self.slip + moved - normal * along;
        // Return mapping: the slip beyond Coulomb's limit becomes sliding.     docs/explanation/model.md (13)
        let trial_slip_m = slip.dot(&slip).root().larger(N::lit(SHORTEST_SLIP_M));
        let held = self.sticking_stiffness * trial_slip_m;
        let share = held.smaller(self.friction_limit_n) / held.larger(N::lit(SMALLEST_FORCE_N));
        let force = normal * pressed_n - slip * self.tangential_stiffness;
        ContactUpdate { along, normal_n, trial_slip_m, slip: slip * share, force }
    }

    /// Gathers those of several lanes.
    #[inline(always)]
    pub fn gather<'a, S: Number + 'a>(of: impl Fn(usize) -> &'a LinearContact<S>) -> Self
    where
        N: Gather<S>,
    {
        Self {
            normal_n: N::from_lanes(|lane| of(lane).normal_n),
            tangential_stiffness: N::from_lanes(|lane| of(lane).tangential_stiffness),
            normal_excess: N::from_lanes(|lane| of(lane).normal_excess),
            slip: N::gather_vectors(|lane| of(lane).slip),
            sticking_stiffness: N::from_lanes(|lane| of(lane).sticking_stiffness),
            friction_limit_n: N::from_lanes(|lane| of(lane).friction_limit_n),
            relaxed: N::from_lanes(|lane| of(lane).relaxed),
        }
    }
}

/// Result of a solve at a sample point.
pub(crate) struct ContactUpdate<T: Number> {
    /// Displacement along the normal \[m\].
    pub along: T,
    /// The new values of [`ContactState`].
    pub normal_n: T,
    pub trial_slip_m: T,
    pub slip: Vector3<T>,
    /// Force on the instrument \[N\].
    pub force: Vector3<T>,
}
