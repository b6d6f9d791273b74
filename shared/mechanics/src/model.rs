//! Tables made once from a [`Description`].

use cathforce_scalar::Vector3;
use heapless::Vec;

use crate::algebra::Rotation;
use crate::effects::StoredCurvature;
use crate::effects::driven_tendons::{self, TendonTable};
use crate::effects::nominal::{self, Placement};
use crate::effects::wall_law;
use crate::grid::Grid;
use crate::math::{maximum, minimum, sin_cos};
use crate::segments::{AxialPosition, Segments, Walk};
use crate::tables::Tables;
use crate::{Description, DescriptionError, Drive, Instrument, MAX_LINKS, MAX_TENDONS, Real, Wall};

/// Configuration of the model: a validated description and its tables, for up to `LINKS` links.
#[derive(Clone, Debug)]
pub struct Model<T: Real, const LINKS: usize = MAX_LINKS> {
    description: Description<T>,
    /// Tables of the catheter alone.
    pub(crate) tables: Tables<T, LINKS>,
    pub(crate) grid: Grid<T>,
    pub(crate) catheter: Segments<T>,
    pub(crate) guidewire: Option<Segments<T>>,
    /// Law of the wall with the effects on it.
    pub(crate) wall: Wall<T>,
    /// Smallest stretch of the compressed wall that its law is evaluated at \[1\].
    pub(crate) least_stretch: T,
    /// Viscous time of bending, including the effect on it \[s\].
    pub(crate) bending_damping_s: T,
    /// An effect acts in the recursion.
    pub(crate) has_active_effects: bool,
    /// Twist per torque of the shaft behind the entry plane \[rad/(N·m)\].
    pub(crate) windup_rad_per_n_m: T,
    /// Orientation of the guide's mouth at rotation 0: columns up, side, direction.
    pub(crate) guide: Rotation<T>,
    /// Mouth of the guide, rig's frame \[m\].
    pub(crate) mouth: Vector3<T>,
    /// Placement of the vessel without its motion; `None` if the vessel's frame is the rig's.
    pub(crate) placement: Option<Placement<T>>,
    pub(crate) gravity: Vector3<T>,
    pub(crate) tendons: Vec<TendonTable<T>, MAX_TENDONS>,
}

impl<T: Real, const LINKS: usize> Model<T, LINKS> {
    /// Validates the description and makes the tables.     docs/explanation/model.md (2)
    ///
    /// Errors: the first number of the description that is out of range.
    pub fn new(description: Description<T>) -> Result<Self, DescriptionError> {
        description.validate()?;
        let effects = &description.effects;
        let instrument = &nominal::instrument(&description);
        let catheter = Segments::of(instrument, &effects.instrument.stored_curvature);
        let straight = StoredCurvature::off();
        let guidewire = description.guidewire.as_ref().map(|wire| Segments::of(wire, &straight));
        let mut tables = Tables::new();
        let alone = Walk::new((&catheter, AxialPosition::leading()), None);
        let grid = Grid::new(&description.solver);
        tables.fill(LINKS, &grid, alone);
        let stiffest = stiffest_wall(&description, instrument);
        let wall = representable(nominal::wall(&description), &description, stiffest);
        let stiffening = most_stiffening(&wall, &description, stiffest);
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
            tables,
            grid,
            guide,
            mouth: nominal::mouth(entry, effects.entry.guide.length_m),
            placement,
            gravity,
            tendons: driven_tendons::tables(&description),
            wall,
            least_stretch: wall_law::least_stretch(&effects.wall.hyperelastic, stiffening),
            has_active_effects: description.has_active_effects(),
            windup_rad_per_n_m: effects.instrument.torsional_windup.free_length_m
                / catheter.shaft_torsion(),
            catheter,
            guidewire,
            bending_damping_s: description.solver.bending_damping_s
                + effects.instrument.viscoelastic.time_s,
            description,
        })
    }

    /// The description that the model was made from.
    pub fn description(&self) -> &Description<T> {
        &self.description
    }

    /// The longest insertion that the links can reach \[m\].
    pub fn reach_m(&self) -> T {
        self.description.solver.reach_m(LINKS)
    }

    /// The position of a drive, clamped to the reach of the links.
    pub(crate) fn within_reach(&self, drive: Drive<T>) -> Drive<T> {
        let insertion_m = minimum(maximum(drive.insertion_m, T::zero()), self.reach_m());
        Drive { insertion_m, ..drive }
    }

    /// Orientation of the guide's mouth after the drive has turned by `angle` \[rad\].
    pub(crate) fn guide_turned(&self, angle: T) -> Rotation<T> {
        let half = angle * T::lit(0.5);
        let (sin, cos) = sin_cos(half);
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

/// Largest stiffness of the wall over that of the softest link \[1\]: single precision can still add
/// the former to the latter and subtract it again.
const STIFFEST_WALL: f64 = 1e5;

/// Largest stiffness of the contact at a sample \[N/m\]. Such a contact is indented by less than 1/10⁵
/// of the instrument's deflection.     docs/explanation/model.md (10)
fn stiffest_wall<T: Real>(description: &Description<T>, instrument: &Instrument<T>) -> T {
    let solver = &description.solver;
    let h = solver.link_length_m;
    let sections =
        || instrument.sections.iter().chain(description.guidewire.iter().flat_map(|w| &w.sections));
    // Stiffness after softening.
    let left = T::one() - maximum(description.effects.instrument.softening.share, T::zero());
    let bent = sections().map(|section| section.bending_stiffness_n_m2 * left / (h * h * h));
    let stretched = sections().map(|section| section.axial_stiffness_n / h);
    let softest = bent.chain(stretched).fold(T::lit(f64::MAX), minimum);
    // Damping and sticking friction add to the stiffness in a solve.
    let wall = &description.wall;
    let parts = T::int(i32::from(solver.substeps.max(1)));
    let seen = maximum(T::one() + wall.damping_s * parts / solver.tick_s, wall.tangential_ratio);
    softest * T::lit(STIFFEST_WALL) / seen
}

/// The wall with its stiffness limited to `stiffest`, relaxing part included.
fn representable<T: Real>(wall: Wall<T>, description: &Description<T>, stiffest: T) -> Wall<T> {
    let lasting = stiffest / (T::one() + description.effects.wall.viscoelastic.ratio);
    Wall {
        line_stiffness_n_per_m2: minimum(
            lasting / description.solver.link_length_m,
            wall.line_stiffness_n_per_m2,
        ),
        end_stiffness_n_per_m: minimum(lasting, wall.end_stiffness_n_per_m),
        ..wall
    }
}

/// Factor by which compression may stiffen the wall up to `stiffest`, relaxing part included \[1\].
fn most_stiffening<T: Real>(wall: &Wall<T>, description: &Description<T>, stiffest: T) -> T {
    let line = wall.line_stiffness_n_per_m2 * description.solver.link_length_m;
    stiffest / maximum(line, wall.end_stiffness_n_per_m)
        - description.effects.wall.viscoelastic.ratio
}
