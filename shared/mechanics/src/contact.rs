//! Contact of one sample point with the wall: normal force with a smooth onset, Coulomb
//! friction with sticking, linearised for the sweep.

use nalgebra::Vector3;

use crate::algebra::{cross, dot};
use crate::effects::acting::Law;
use crate::effects::wall_law::Slid;
use crate::lumen::NOMINAL_WALL;
use crate::model::maximum;
use crate::{Lumen, Real, Wall};

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
        Self { slip: Vector3::zeros(), reached: T::zero(), normal_n: T::zero(), relaxed: T::zero() }
    }
}

/// The linearised contact of one sample point in one solve.
///
/// Force on the instrument: f − (stick I + push n nᵀ)(δx + δφ × arm).     docs/model.md (10)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch<T: Real> {
    /// Force on the instrument at the predicted state \[N\].
    pub force: Vector3<T>,
    /// Normal into the lumen.
    pub normal: Vector3<T>,
    /// From the link's distal node to the touching point of the surface \[m\].
    pub arm: Vector3<T>,
    /// Tangential stiffness, secant of Coulomb's law \[N/m\].
    pub stick: T,
    /// Normal stiffness less the tangential one \[N/m\].
    pub push: T,
    /// Tangential displacement at the predicted state \[m\].
    pub slip: Vector3<T>,
    /// Tangential displacement at which it slides \[m\].
    pub slip_limit: T,
    /// What a relaxing wall comes to rest at \[m\].
    pub relaxed: T,
    /// The point is beyond the stored wall: no force can be given.
    pub outside: bool,
}

impl<T: Real> Touch<T> {
    pub fn none() -> Self {
        let (o, v) = (T::zero(), Vector3::zeros());
        Self {
            force: v,
            normal: v,
            arm: v,
            stick: o,
            push: o,
            slip: v,
            slip_limit: o,
            relaxed: o,
            outside: false,
        }
    }
}

/// How a sample point moved from the last tick's state to the predicted one.
pub(crate) struct Motion<T: Real> {
    /// Displacement of the centre line \[m\].
    pub displacement: Vector3<T>,
    /// Rotation of the link \[rad\].
    pub turn: Vector3<T>,
}

/// The wall's law with the constants of one solve.
pub(crate) struct Contact<'a, T: Real> {
    pub wall: &'a Wall<T>,
    pub lumen: &'a Lumen<'a>,
    pub radius_m: T,
    pub friction: T,
    pub inverse_dt: T,
}

impl<T: Real> Contact<'_, T> {
    /// Linearises the contact of the point at `position` whose link's distal node is at
    /// `position − offset`. `stiffness` \[N/m\] is that of the sample's share of the arc.
    #[inline]
    pub fn touch(
        &self,
        law: &impl Law<T>,
        position: &Vector3<T>,
        offset: &Vector3<T>,
        stiffness: T,
        motion: &Motion<T>,
        memory: &Memory<T>,
    ) -> Touch<T> {
        let seen = self.lumen.sample(position);
        let (onset, half) = (self.wall.onset_m, T::lit(0.5));
        let (distance, n) = law.wall(position, seen.distance_m, seen.normal);
        let indentation = self.radius_m - distance;
        let into_onset = indentation + half * onset;
        if seen.distance_m < -half {
            return Touch { outside: true, ..Touch::none() };
        }
        if into_onset <= T::zero() {
            return Touch::none();
        }
        let sliding = || Slid {
            normal_n: memory.normal_n,
            slid_m: maximum(memory.reached - dot(&memory.slip, &memory.slip).root(), T::zero()),
        };
        let friction = law.friction(self.friction, sliding, stiffness);
        let stiffness = stiffness * stiffness_scale(seen.stiffness);
        // Quadratic over the onset, then linear.     docs/model.md (11)
        let (indented, slope) = if into_onset < onset {
            let share = into_onset / onset;
            (half * share * into_onset, share)
        } else {
            (indentation, T::one())
        };
        let (indented, slope, relaxed) = law.indentation(indented, slope, memory.relaxed);
        let damping = stiffness * slope * self.wall.damping_s * self.inverse_dt;
        let normal_force = stiffness * indented - damping * dot(&n, &motion.displacement);
        let normal_stiffness = stiffness * slope + damping;

        let radial = n * -self.radius_m;
        let moved = memory.slip + motion.displacement + cross(&motion.turn, &radial);
        let slip = moved - n * dot(&n, &moved);
        let length = dot(&slip, &slip).root();
        let length = maximum(length, memory.reached);
        let elastic = self.wall.tangential_ratio * stiffness * slope;
        let limit = friction * memory.normal_n;
        // Secant of Coulomb's law at the predicted displacement.     docs/model.md (12)
        let stick = if elastic * length > limit { limit / length } else { elastic };
        let slip_limit = if elastic > T::zero() { limit / elastic } else { T::zero() };
        Touch {
            force: n * normal_force - slip * stick,
            normal: n,
            arm: offset + radial,
            stick,
            push: normal_stiffness - stick,
            slip,
            slip_limit,
            relaxed,
            outside: false,
        }
    }
}

impl<T: Real> Touch<T> {
    /// Force on the instrument after the node moved by `dx` and the link turned by `turn`;
    /// brings the memory up to date.
    #[inline]
    pub fn resolve(
        &self,
        dx: &Vector3<T>,
        turn: &Vector3<T>,
        memory: &mut Memory<T>,
        last: bool,
    ) -> Vector3<T> {
        let n = &self.normal;
        let moved = dx + cross(turn, &self.arm);
        let along = dot(n, &moved);
        let force = self.force - moved * self.stick - n * (self.push * along);
        let normal_n = dot(n, &force);
        memory.normal_n = if normal_n > T::zero() { normal_n } else { T::zero() };
        if !last {
            return force;
        }
        // Return map: what exceeds the limit has slid.     docs/model.md (13)
        let slip = self.slip + moved - n * along;
        let length = dot(&slip, &slip).root();
        memory.reached = length;
        memory.relaxed = self.relaxed;
        memory.slip =
            if length > self.slip_limit { slip * (self.slip_limit / length) } else { slip };
        force
    }
}

/// Sixteen steps to a doubling.
#[inline]
fn stiffness_scale<T: Real>(code: u8) -> T {
    if code == NOMINAL_WALL {
        return T::one();
    }
    // 2^(1/16), to the powers 1, 2, 4, 8.
    const ROOTS: [f64; 4] = [
        1.044_273_782_427_413_8,
        1.090_507_732_665_257_7,
        1.189_207_115_002_721,
        core::f64::consts::SQRT_2,
    ];
    let steps = i32::from(code) - i32::from(NOMINAL_WALL);
    let mut scale = T::one();
    for (bit, root) in ROOTS.iter().enumerate() {
        if steps >> bit & 1 == 1 {
            scale *= T::lit(*root);
        }
    }
    let doublings = steps >> 4;
    let factor = if doublings < 0 { T::lit(0.5) } else { T::lit(2.0) };
    for _ in 0..doublings.abs() {
        scale *= factor;
    }
    scale
}
