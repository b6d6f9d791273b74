//! State of the model between steps.

use cathforce_scalar::{Number, Vector3};

use crate::algebra::{LdltFactor, Matrix3, Rotation};
use crate::contact::{ContactState, LinearContact};
use crate::drive_motion::DriveHistory;
use crate::effects::driven_tendons::TendonsState;
use crate::effects::relaxation::Springs;
use crate::effects::state::EffectState;
use crate::joint::JointLoad;
use crate::overlap::Overlap;
use crate::proximity::Proximity;
use crate::tables::Tables;
use crate::{Drives, MAX_LINKS, Real};

/// Shortest base link, over the link length, that stiffnesses are computed from. A link that enters
/// the vessel is therefore almost rigid, and softens as it grows.
pub(crate) const SHORTEST_BASE: f64 = 0.001;

/// The unstretched length of a link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span<T> {
    /// Length \[m\].
    pub length: T,
    /// Length over that of a full link \[1\].
    pub share: T,
    /// Inverse of the length that the axial stiffness is computed from \[1/m\].
    pub inverse_length: T,
}

impl<T: Real> Span<T> {
    pub fn new(length: T, whole: T) -> Self {
        let stretched = length.larger(whole * T::lit(SHORTEST_BASE));
        Self { length, share: length / whole, inverse_length: T::one() / stretched }
    }

    const fn none() -> Self {
        Self { length: T::ZERO, share: T::ZERO, inverse_length: T::ZERO }
    }
}

/// One link, from node j + 1 on the guide's side to node j, whose motion it holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkState<T: Number> {
    pub rotation: Rotation<T>,
    pub tangent: Vector3<T>,
    /// Filtered angular rate of the predictor \[rad/s\].
    pub rate: Vector3<T>,
    pub span: Span<T>,
    /// Axial strain \[1\].
    pub strain: T,
    /// Position of node j \[m\].
    pub position: Vector3<T>,
    /// Velocity of node j \[m/s\].
    pub velocity: Vector3<T>,
    /// Displacement of node j since the step began \[m\].
    pub displacement: Vector3<T>,
    /// Rotation of the link since the step began \[rad\].
    pub turn: Vector3<T>,
    /// Contact force on the instrument around node j \[N\].
    pub force: Vector3<T>,
    /// Contact states at the node and at the middle of the link.
    pub memory: [ContactState<T>; 2],
}

impl<T: Real> LinkState<T> {
    pub const fn new() -> Self {
        let v = T::ORIGIN;
        Self {
            rotation: Rotation::identity(),
            tangent: v,
            rate: v,
            span: Span::none(),
            strain: T::ZERO,
            position: v,
            velocity: v,
            displacement: v,
            turn: v,
            force: v,
            memory: [ContactState::new(); 2],
        }
    }
}

/// Force on a link at the predicted state, and moment about its node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkLoads<T: Number> {
    pub force: Vector3<T>,
    pub moment: Vector3<T>,
    /// Isotropic stiffness against displacements of the node, without the contacts' normal stiffness
    /// \[N/m\].
    pub stiffness: T,
}

/// Elongation of a link after elimination: δe = free − a·y − b·δφ.     docs/explanation/model.md (17)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch<T: Number> {
    pub free: T,
    pub by_displacement: Vector3<T>,
    pub by_rotation: Vector3<T>,
}

impl<T: Number> Stretch<T> {
    /// Elongation \[m\] of a link whose node was moved by `y` \[m\] and that was turned by `turn`
    /// \[rad\].
    #[inline(always)]
    pub fn back_substitute(&self, y: &Vector3<T>, turn: &Vector3<T>) -> T {
        self.free - self.by_displacement.dot(y) - self.by_rotation.dot(turn)
    }
}

/// What forward elimination keeps of one link for back substitution.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elimination<T: Number> {
    /// Loads on the link, and the joint at its proximal end.
    pub loads: LinkLoads<T>,
    pub joint: JointLoad<T>,
    /// Rotation of the link: L⁻ᵀ Δ⁻¹ (s − Zᵀ δx + Xᵀ δφ), with δx of joint j + 1 and δφ of link j + 1.
    /// The products Δ⁻¹ s, Z Δ⁻¹ and X Δ⁻¹ are stored.     docs/explanation/model.md (20)
    pub turn: Vector3<T>,
    pub by_displacement: Matrix3<T>,
    pub by_rotation: Matrix3<T>,
    pub factor: LdltFactor<T>,
    pub stretch: Stretch<T>,
    /// The wall at the node and at the middle of the link, and the contacts there.
    pub proximity: [Proximity<T>; 2],
    pub contacts: [LinearContact<T>; 2],
}

impl<T: Real> Elimination<T> {
    const fn new() -> Self {
        let (o, v) = (T::ZERO, T::ORIGIN);
        Self {
            loads: LinkLoads { force: v, moment: v, stiffness: o },
            joint: JointLoad::none(),
            turn: v,
            by_displacement: Matrix3::zeros(),
            by_rotation: Matrix3::zeros(),
            factor: LdltFactor::identity(),
            stretch: Stretch { free: o, by_displacement: v, by_rotation: v },
            proximity: [Proximity::none(); 2],
            contacts: [LinearContact::none(); 2],
        }
    }
}

/// State of a [`Model`](crate::Model) of up to `LINKS` links. It holds no configuration.
#[derive(Clone, Debug)]
// The order of the fields matters: others cost the device up to 1 % more instructions.
#[repr(C)]
pub struct State<T: Real, const LINKS: usize = MAX_LINKS> {
    pub(crate) eliminations: [Elimination<T>; LINKS],
    /// Links inside the vessel; link `count − 1` is the base link at the guide.
    pub(crate) count: usize,
    pub(crate) drives: Drives<T>,
    /// Insertion of the instrument that is farther inside \[m\].
    pub(crate) insertion_m: T,
    /// Unstretched length of the base link \[m\].
    pub(crate) base_length_m: T,
    /// Feed of the chain in this step \[m\].
    pub(crate) fed_m: T,
    /// The guide, as the link that the base link is joined to. It turns but does not move.
    pub(crate) guide: LinkState<T>,
    /// The last step sampled the wall at the nodes, and not at the middles of the links.
    pub(crate) nodes_sampled: bool,
    /// A point of the instrument is beyond the stored wall, where no force can be computed.
    pub(crate) outside: bool,
    /// Earlier motion of the drives.
    pub(crate) drive_history: DriveHistory<T>,
    /// Share of the velocities that the next step takes over. It is below 1 after links have turned too
    /// far for a linear solve to conserve momentum.
    pub(crate) momentum_share: T,
    /// Ticks still to be flagged after the last unresolved one.
    pub(crate) flagged_ticks: u8,
    /// A result was not finite; the run begins again, with one quasi-static step per tick.
    pub(crate) lost: bool,
    /// Quasi-static steps since the drives' positions were reached.
    pub(crate) steps_at_rest: u16,
    pub(crate) effects: EffectState<T>,
    /// Where two instruments lie in the chain, and the chain's joints and links; unused with one
    /// instrument.
    pub(crate) overlap: Overlap<T>,
    pub(crate) coaxial_tables: Tables<T, LINKS>,
    pub(crate) links: [LinkState<T>; LINKS],
    pub(crate) tendons: TendonsState<T, LINKS>,
    pub(crate) springs: Springs<T, LINKS>,
}

impl<T: Real, const LINKS: usize> Default for State<T, LINKS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// The instrument is in the guide; nothing is inside the vessel.
    pub const fn new() -> Self {
        Self {
            count: 0,
            drives: Drives::ZERO,
            insertion_m: T::ZERO,
            base_length_m: T::ZERO,
            fed_m: T::ZERO,
            guide: LinkState::new(),
            nodes_sampled: false,
            outside: false,
            drive_history: DriveHistory::none(),
            momentum_share: T::ONE,
            flagged_ticks: 0,
            lost: false,
            steps_at_rest: 0,
            effects: EffectState::new(),
            overlap: Overlap::new(),
            coaxial_tables: Tables::new(),
            links: [LinkState::new(); LINKS],
            eliminations: [Elimination::new(); LINKS],
            tendons: TendonsState::new(),
            springs: Springs::new(),
        }
    }

    /// Resets to [`State::new`] in place, because a whole `State` does not fit on a small stack.
    pub fn reset(&mut self) {
        // No `..`, so that every field that is added must be reset here.
        let Self {
            count,
            drives,
            insertion_m,
            base_length_m,
            fed_m,
            guide,
            nodes_sampled,
            outside,
            drive_history,
            momentum_share,
            flagged_ticks,
            lost,
            steps_at_rest,
            effects,
            overlap,
            coaxial_tables,
            links,
            eliminations,
            tendons,
            springs,
        } = self;
        *count = 0;
        *drives = Drives::default();
        *insertion_m = T::zero();
        *base_length_m = T::zero();
        *fed_m = T::zero();
        *guide = LinkState::new();
        *nodes_sampled = false;
        *outside = false;
        *drive_history = DriveHistory::none();
        *momentum_share = T::one();
        *flagged_ticks = 0;
        *lost = false;
        *steps_at_rest = 0;
        *effects = EffectState::new();
        *overlap = Overlap::new();
        coaxial_tables.reset();
        links.iter_mut().for_each(|link| *link = LinkState::new());
        eliminations.iter_mut().for_each(|elimination| *elimination = Elimination::new());
        tendons.reset();
        springs.reset();
    }

    /// Nodes inside the vessel: node 0 is the tip, node `nodes() − 1` the one next to the guide.
    pub fn nodes(&self) -> usize {
        self.count
    }

    fn link(&self, node: usize) -> Option<&LinkState<T>> {
        self.links.get(..self.count)?.get(node)
    }

    /// Position of a node, rig's frame \[m\]; `None` from [`State::nodes`] on.
    pub fn node_position_m(&self, node: usize) -> Option<[T; 3]> {
        self.link(node).map(|link| self.position_m(link))
    }

    /// Contact force of the instrument on the vessel around a node, rig's frame \[N\]; `None` from
    /// [`State::nodes`] on.
    pub fn node_force_n(&self, node: usize) -> Option<[T; 3]> {
        self.link(node).map(|link| self.force_n(link))
    }

    /// Position x, y, z \[m\] and contact force x, y, z \[N\] of every node from the tip on, in the
    /// vessel's frame; then, where the vessel is placed, its offset and the vector part of its rotation.
    ///
    /// For callers that read all of them in every tick, because conversion to the rig's frame would
    /// cost a tenth of a tick.
    pub fn node_results(&self) -> impl Iterator<Item = [T; 6]> {
        let links = self.links.get(..self.count).unwrap_or_default();
        let nodes = links.iter().map(move |link| row(link.position, -link.force));
        nodes.chain(self.placement_row())
    }

    /// The last row of [`State::node_results`], where the vessel is placed.
    pub(crate) fn placement_row(&self) -> Option<[T; 6]> {
        let placement = self.effects.placement.as_ref();
        placement.map(|placement| row(placement.offset, placement.turned.v))
    }

    #[inline(always)]
    fn position_m(&self, link: &LinkState<T>) -> [T; 3] {
        self.in_rig_m(link.position)
    }

    /// A point of the vessel's frame in the rig's \[m\].
    #[inline(always)]
    pub(crate) fn in_rig_m(&self, point: Vector3<T>) -> [T; 3] {
        let placement = self.effects.placement.as_ref();
        placement.map_or(point, |placement| placement.to_rig(&point)).into()
    }

    #[inline(always)]
    fn force_n(&self, link: &LinkState<T>) -> [T; 3] {
        let force = -link.force;
        let placement = self.effects.placement.as_ref();
        placement.map_or(force, |placement| placement.direction_to_rig(&force)).into()
    }

    /// Tensions of a driven tendon \[N\]: at its drive and at its anchor. Zero for one that the description
    /// does not have; `None` from [`MAX_TENDONS`](crate::MAX_TENDONS) on.
    pub fn tendon_tensions_n(&self, tendon: usize) -> Option<[T; 2]> {
        self.tendons.tensions_n(tendon)
    }

    /// Insertion of the instrument that is farther inside, as the model has reached it \[m\].
    pub fn insertion_m(&self) -> T {
        self.insertion_m
    }
}

#[inline(always)]
fn row<T: Real>(a: Vector3<T>, b: Vector3<T>) -> [T; 6] {
    let ([x, y, z], [fx, fy, fz]) = (a.into(), b.into());
    [x, y, z, fx, fy, fz]
}
