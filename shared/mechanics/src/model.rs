//! Tables made once from a [`Description`].

use nalgebra::Vector3;

use crate::algebra::Rotation;
use crate::effects::StoredCurvature;
use crate::effects::nominal::{self, Placement};
use crate::{Description, DescriptionError, Instrument, MAX_LINKS, Real, Wall};

/// Elastic properties of one joint, over a full cell of one link length around it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joint<T: Real> {
    /// Bending stiffness 1/∫ds/EI \[N·m/rad\].
    pub bending: T,
    /// Torsional stiffness 1/∫ds/GJ \[N·m/rad\].
    pub torsion: T,
    /// Rotation of the unloaded cell ∫κ₀ ds, material axes (up, side, tangent) \[rad\].
    pub unloaded: Vector3<T>,
}

/// Properties of one link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link<T> {
    /// Mean axial stiffness h/∫ds/EA \[N\].
    pub axial: T,
    /// Mass \[kg\].
    pub mass: T,
}

/// The model's configuration: a validated description and its tables, for up to `LINKS` links.
#[derive(Clone, Debug)]
pub struct Model<T: Real, const LINKS: usize = MAX_LINKS> {
    description: Description<T>,
    /// By link: the joint at its proximal end, joint j + 1, that many link lengths from the tip.
    pub(crate) joints: [Joint<T>; LINKS],
    /// Link j reaches from joint j + 1 to joint j.
    pub(crate) links: [Link<T>; LINKS],
    /// The wall's law with its effects.
    pub(crate) wall: Wall<T>,
    /// Viscous time of bending, with its effect \[s\].
    pub(crate) bending_damping_s: T,
    /// An effect acts in the recursion.
    pub(crate) acts: bool,
    /// Twist per torque of the shaft behind the entry plane \[rad/(N·m)\].
    pub(crate) windup_rad_per_n_m: T,
    /// Orientation of the guide's mouth at rotation 0: columns up, side, direction.
    pub(crate) guide: Rotation<T>,
    /// Mouth of the guide, rig's frame \[m\].
    pub(crate) mouth: Vector3<T>,
    /// Where the vessel stands, its motion apart; `None` where the rig says.
    pub(crate) placement: Option<Placement<T>>,
    pub(crate) gravity: Vector3<T>,
}

impl<T: Real, const LINKS: usize> Model<T, LINKS> {
    /// Validates the description and makes the tables.     docs/model.md (1)
    pub fn new(description: Description<T>) -> Result<Self, DescriptionError> {
        description.validate()?;
        let h = description.solver.link_length_m;
        let effects = &description.effects;
        let instrument = &nominal::instrument(&description);
        let stored = &effects.instrument.stored_curvature;
        let at = |index: usize, offset: f64| h * (T::int(index as i32) + T::lit(offset));
        let joints = core::array::from_fn(|j| {
            let (low, high) = (at(j, 0.5), at(j, 1.5));
            let cell = Compliance::between(instrument, low, high);
            Joint {
                bending: T::one() / cell.bending,
                torsion: T::one() / cell.torsion,
                unloaded: unloaded_rotation(instrument, stored, low, high),
            }
        });
        let links = core::array::from_fn(|j| {
            let piece = Compliance::between(instrument, at(j, 0.0), at(j, 1.0));
            Link { axial: h / piece.axial, mass: piece.mass }
        });
        let wall = representable(nominal::wall(&description), &description, &joints, &links);
        let entry = &description.entry;
        let placement = Placement::of(&description);
        // The model computes in the vessel's frame.
        let axis = |v: [T; 3]| {
            let v = Vector3::from(v);
            placement.map_or(v, |placement| placement.direction_to_vessel(&v))
        };
        let (direction, up) = (axis(entry.direction), axis(entry.up));
        let gravity = axis(description.gravity_m_per_s2) * effects.instrument.weight.factor;
        let guide = Rotation::from_axes(&up, &direction.cross(&up), &direction);
        Ok(Self {
            joints,
            links,
            guide,
            mouth: nominal::mouth(entry, effects.entry.guide.length_m),
            placement,
            gravity,
            wall,
            acts: nominal::acts(&description),
            windup_rad_per_n_m: nominal::windup_rad_per_n_m(&description, instrument),
            bending_damping_s: description.solver.bending_damping_s
                + effects.instrument.viscoelastic.time_s,
            description,
        })
    }

    /// What the model was made from.
    pub fn description(&self) -> &Description<T> {
        &self.description
    }

    /// The longest insertion that the links can reach \[m\].
    pub fn reach_m(&self) -> T {
        self.description.solver.link_length_m * T::int(LINKS as i32)
    }

    /// Orientation of the guide's mouth when the drive has turned by `angle` \[rad\].
    pub(crate) fn guide_turned(&self, angle: T) -> Rotation<T> {
        let half = angle * T::lit(0.5);
        let (sin, cos) = half_turn(half);
        let turn = Rotation { w: cos, v: Vector3::new(T::zero(), T::zero(), sin) };
        // guide · turn
        let g = &self.guide;
        Rotation {
            w: g.w * turn.w - g.v.dot(&turn.v),
            v: turn.v * g.w + g.v * turn.w + g.v.cross(&turn.v),
        }
        .normalised()
    }
}

/// Stiffest wall, over the softest link, that single precision can add to it and take away
/// again.
const STIFFEST_WALL: f64 = 1e5;

/// A wall no stiffer than that: it gives way by less than a hundred-thousandth of what the
/// instrument does.     docs/model.md (11)
fn representable<T: Real>(
    wall: Wall<T>,
    description: &Description<T>,
    joints: &[Joint<T>],
    links: &[Link<T>],
) -> Wall<T> {
    let solver = &description.solver;
    let h = solver.link_length_m;
    let bent = joints.iter().map(|joint| joint.bending / (h * h));
    let stretched = links.iter().map(|link| link.axial / h);
    let Some(softest) = bent.chain(stretched).reduce(minimum) else { return wall };
    // What a solve sees of the wall grows by damping, and by friction that sticks.
    let parts = T::int(i32::from(solver.substeps.max(1)));
    let seen = maximum(T::one() + wall.damping_s * parts / solver.tick_s, wall.tangential_ratio);
    let stiffest = softest * T::lit(STIFFEST_WALL) / seen;
    Wall {
        line_stiffness_n_per_m2: minimum(stiffest / h, wall.line_stiffness_n_per_m2),
        end_stiffness_n_per_m: minimum(stiffest, wall.end_stiffness_n_per_m),
        ..wall
    }
}

/// Sine and cosine from correctly rounded operations only, so that host and device agree.
///
/// The angle is reduced to half a turn either way, divided by eight, and doubled back.
pub(crate) fn half_turn<T: Real>(angle: T) -> (T, T) {
    let tau = T::lit(core::f64::consts::TAU);
    let turns = T::int((angle / tau + T::lit(0.5)).floor_int());
    let a = (angle - turns * tau) * T::lit(0.125);
    let s = a * a;
    let c = |x: f64| T::lit(x);
    let mut sin = a * (c(1.0) - s * (c(1.0 / 6.0) - s * (c(1.0 / 120.0) - s * c(1.0 / 5040.0))));
    let mut versine =
        s * (c(0.5) - s * (c(1.0 / 24.0) - s * (c(1.0 / 720.0) - s * c(1.0 / 40320.0))));
    for _ in 0..3 {
        // sin 2a = 2 sin a (1 − ver a), ver 2a = 2 sin² a
        let doubled = T::lit(2.0) * sin * (T::one() - versine);
        versine = T::lit(2.0) * sin * sin;
        sin = doubled;
    }
    (sin, T::one() - versine)
}

/// Compliance and mass of a stretch of the instrument.
struct Compliance<T> {
    bending: T,
    torsion: T,
    axial: T,
    mass: T,
}

impl<T: Real> Compliance<T> {
    /// Integrals over the arc from `low` to `high`, measured from the tip; what lies
    /// beyond the tip counts as the first section.
    fn between(instrument: &Instrument<T>, low: T, high: T) -> Self {
        let zero = T::zero();
        let mut sum = Self { bending: zero, torsion: zero, axial: zero, mass: zero };
        let mut start = zero;
        let last = instrument.sections.len() - 1;
        for (i, s) in instrument.sections.iter().enumerate() {
            let end = start + s.length_m;
            let from = if i == 0 { low } else { maximum(low, start) };
            let to = if i == last { high } else { minimum(high, end) };
            let length = maximum(to - from, zero);
            sum.bending += length / s.bending_stiffness_n_m2;
            sum.torsion += length / s.torsional_stiffness_n_m2;
            sum.axial += length / s.axial_stiffness_n;
            sum.mass += length * s.mass_kg_per_m;
            start = end;
        }
        sum
    }
}

/// ∫κ₀ ds in material axes. Curvature towards `up` turns about `side`, towards `side`
/// about −`up`.
fn unloaded_rotation<T: Real>(
    instrument: &Instrument<T>,
    stored: &StoredCurvature<T>,
    low: T,
    high: T,
) -> Vector3<T> {
    let mut sum = Vector3::zeros();
    let mut start = T::zero();
    for p in &instrument.precurve {
        let end = start + p.length_m;
        let length = maximum(minimum(high, end) - maximum(low, start), T::zero());
        sum +=
            Vector3::new(-p.lateral_curvature_per_m, p.curvature_per_m, p.torsion_per_m) * length;
        start = end;
    }
    // Behind the pre-curved tip.     docs/model.md (23)
    let length = maximum(high - maximum(low, start), T::zero());
    let (up, side) = (stored.curvature_per_m, stored.lateral_curvature_per_m);
    sum + Vector3::new(-side, up, T::zero()) * length
}

/// The larger of two; NaN in `a` stays.
pub(crate) fn maximum<T: Real>(a: T, b: T) -> T {
    if a <= b { b } else { a }
}

/// The smaller of two; NaN in `a` stays.
pub(crate) fn minimum<T: Real>(a: T, b: T) -> T {
    if a >= b { b } else { a }
}
