//! What a step remembers and what it reports.

use cathforce_scalar::Vector3;

use crate::algebra::{LdltFactor, Matrix3, Rotation};
use crate::coaxial::Overlap;
use crate::contact::{ContactState, LinearContact};
use crate::drive_motion::DriveHistory;
use crate::effects::state::EffectState;
use crate::feed::SHORTEST_BASE;
use crate::joint::JointLoad;
use crate::proximity::Proximity;
use crate::tables::Tables;
use crate::{MAX_LINKS, Real};

/// Where the drive is at the end of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Drive<T> {
    /// Unstretched length of instrument past the entry plane \[m\].
    pub insertion_m: T,
    /// Rotation imposed at the entry plane, right-handed about `direction` \[rad\].
    pub rotation_rad: T,
}

impl<T: Real> Drive<T> {
    pub(crate) const ZERO: Self = Self { insertion_m: T::ZERO, rotation_rad: T::ZERO };
}

/// Where the drives of both instruments are. A [`Drive`] alone is the catheter's, with the
/// guidewire outside.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Drives<T> {
    pub catheter: Drive<T>,
    /// Of no effect where the description has no guidewire.
    pub guidewire: Drive<T>,
}

impl<T: Real> Drives<T> {
    pub(crate) const ZERO: Self = Self { catheter: Drive::ZERO, guidewire: Drive::ZERO };
}

impl<T: Default> From<Drive<T>> for Drives<T> {
    fn from(catheter: Drive<T>) -> Self {
        Self { catheter, guidewire: Drive::default() }
    }
}

/// Dead loads from outside, constant in the vessel frame: weights in an experiment, the force
/// of a tool. They are no contact, so no contact force of [`Outputs`] contains them.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Loads<T> {
    /// On the tip \[N\].
    pub tip_force_n: [T; 3],
    /// On the tip \[N·m\].
    pub tip_moment_n_m: [T; 3],
}

/// What one step found. Per-node results are read from [`State`].
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Outputs<T> {
    /// Total contact force of the instrument on the vessel, rig's frame \[N\].
    pub force_on_vessel_n: [T; 3],
    /// Its total moment about the entry point, rig's frame \[N·m\].
    pub moment_on_vessel_n_m: [T; 3],
    /// Axial force on the instrument behind the guide, positive when pushing \[N\]; with a
    /// guidewire, on the catheter alone.
    pub drive_force_n: T,
    /// Torque on the instrument behind the guide, about `direction` \[N·m\]; likewise.
    pub drive_torque_n_m: T,
    /// Axial force on the guidewire behind the guide, positive when pushing \[N\].
    pub guidewire_force_n: T,
    /// Torque on the guidewire behind the guide, about `direction` \[N·m\].
    pub guidewire_torque_n_m: T,
    /// Largest contact force at a node \[N\].
    pub peak_contact_force_n: T,
    /// The node that carries it (0 is the tip).
    pub peak_node: u16,
    /// Links inside the vessel in this tick.
    pub links: u16,
    /// Forces of this tick are not to be trusted: the step's last correction was large (a
    /// snap), a point of the instrument is beyond the stored wall, a link is stretched to twice
    /// its length or pressed to half, a drive is beyond what the links reach, one of these was so within
    /// the last 7 ticks, or a number was lost.
    pub unresolved: bool,
    /// A number was lost in this step, or in one before it and the run is still beginning again:
    /// nothing else of these outputs means anything.
    pub lost: bool,
}

/// The unstretched length of a link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span<T> {
    /// \[m\]
    pub length: T,
    /// Over that of the whole link.
    pub share: T,
    /// One over the length that the stretch sees \[1/m\].
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

/// One link: from node j + 1 (towards the guide) to node j, whose motion it carries.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkState<T: Real> {
    pub rotation: Rotation<T>,
    pub tangent: Vector3<T>,
    /// Filtered angular rate, the predictor's \[rad/s\].
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
    /// Contact at the node and at the middle of the link.
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

/// Forces on a link at the predicted state, and about its node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkLoads<T: Real> {
    pub force: Vector3<T>,
    pub moment: Vector3<T>,
    /// Against any displacement of the node \[N/m\]; the contacts' normal stiffness comes on top.
    pub stiffness: T,
}

/// A link's stretch: δe = free − a·y − b·δφ.     docs/model.md (6)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch<T: Real> {
    pub free: T,
    pub by_displacement: Vector3<T>,
    pub by_rotation: Vector3<T>,
}

impl<T: Real> Stretch<T> {
    /// Of a link whose node has swung by `y` and that has turned by `turn` \[m\].
    #[inline(always)]
    pub fn back_substitute(&self, y: &Vector3<T>, turn: &Vector3<T>) -> T {
        self.free - self.by_displacement.dot(y) - self.by_rotation.dot(turn)
    }
}

/// What the sweep from tip to base leaves for the way back, link by link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elimination<T: Real> {
    /// What acts on the link, and the joint at its proximal end.
    pub loads: LinkLoads<T>,
    pub joint: JointLoad<T>,
    /// The link's rotation: δφ = L⁻ᵀ Δ⁻¹ (s − Zᵀ δx + Xᵀ δφ), of the point at joint j + 1 and of
    /// the link beyond it; s, Z and X are kept times Δ⁻¹.     docs/model.md (17)
    pub turn: Vector3<T>,
    pub by_displacement: Matrix3<T>,
    pub by_rotation: Matrix3<T>,
    pub factor: LdltFactor<T>,
    pub stretch: Stretch<T>,
    /// The wall at the node and at the middle of the link, and the contact with it.
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

/// Memory of a [`Model`] of up to `LINKS` links. Configuration never lives here.
#[derive(Clone, Debug)]
// In this order: another one costs the device up to one instruction in a hundred.
#[repr(C)]
pub struct State<T: Real, const LINKS: usize = MAX_LINKS> {
    pub(crate) eliminations: [Elimination<T>; LINKS],
    /// Links inside the vessel; link `count − 1` is the base link at the guide.
    pub(crate) count: usize,
    pub(crate) drives: Drives<T>,
    /// Of the instrument that is farther inside \[m\].
    pub(crate) insertion_m: T,
    /// Unstretched length of the base link \[m\].
    pub(crate) base_length_m: T,
    /// Feed of the chain in this step \[m\].
    pub(crate) fed_m: T,
    /// The guide, as the link that the base link is joined to: it is turned, but never moves.
    pub(crate) guide: LinkState<T>,
    /// The nodes, and not the middles of the links, were looked up in the last step.
    pub(crate) nodes_sampled: bool,
    /// A point of the instrument is beyond the stored wall: no force can be given there.
    pub(crate) outside: bool,
    /// How the drives moved before.
    pub(crate) drive_history: DriveHistory<T>,
    /// Share of the motion that goes on into the next step: less than 1 after links have turned
    /// farther than a linear solve can carry momentum.
    pub(crate) momentum_share: T,
    /// Ticks that are still flagged for the last one that was not resolved.
    pub(crate) flagged_ticks: u8,
    /// A number was lost; the run begins again, one quasi-static step a tick.
    pub(crate) lost: bool,
    /// Quasi-static steps since the drive's position was reached.
    pub(crate) steps_at_rest: u16,
    pub(crate) effects: EffectState<T>,
    /// Where two instruments lie in the chain, and its joints and links then; of no meaning for
    /// one.
    pub(crate) overlap: Overlap<T>,
    pub(crate) coaxial_tables: Tables<T, LINKS>,
    pub(crate) links: [LinkState<T>; LINKS],
}

impl<T: Real, const LINKS: usize> Default for State<T, LINKS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const LINKS: usize> State<T, LINKS> {
    /// The instrument in the guide, nothing inside the vessel.
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
        }
    }

    /// Back to [`State::new`] in place: a whole `State` does not fit on a small stack.
    pub fn reset(&mut self) {
        // No `..`: what is added to the state must be reset here.
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
    }

    /// Nodes inside the vessel: node 0 is the tip, node `nodes() − 1` the one next to the guide.
    pub fn nodes(&self) -> usize {
        self.count
    }

    fn link(&self, node: usize) -> Option<&LinkState<T>> {
        self.links.get(..self.count)?.get(node)
    }

    /// Position of a node, rig's frame \[m\]; `None` beyond [`State::nodes`].
    pub fn node_position_m(&self, node: usize) -> Option<[T; 3]> {
        self.link(node).map(|link| self.position_m(link))
    }

    /// Contact force of the instrument on the vessel around a node \[N\].
    pub fn node_force_n(&self, node: usize) -> Option<[T; 3]> {
        self.link(node).map(|link| self.force_n(link))
    }

    /// What both are of at every node, from the tip on, and then where the vessel stands: x, y, z \[m\] and
    /// the force's x, y, z \[N\] as they are computed, in the vessel's frame.
    ///
    /// For who asks for all of them in every tick: to turn them into the rig's frame costs a tenth of one.
    pub fn node_results(&self) -> impl Iterator<Item = [T; 6]> {
        let join = |a: Vector3<T>, b: Vector3<T>| {
            let ([x, y, z], [fx, fy, fz]) = (a.into(), b.into());
            [x, y, z, fx, fy, fz]
        };
        let links = self.links.get(..self.count).unwrap_or_default();
        let placement = self.effects.placement.as_ref();
        let nodes = links.iter().map(move |link| join(link.position, -link.force));
        nodes.chain(placement.map(|placement| join(placement.offset, placement.turned.v)))
    }

    #[inline(always)]
    fn position_m(&self, link: &LinkState<T>) -> [T; 3] {
        let placement = self.effects.placement.as_ref();
        placement.map_or(link.position, |placement| placement.to_rig(&link.position)).into()
    }

    #[inline(always)]
    fn force_n(&self, link: &LinkState<T>) -> [T; 3] {
        let force = -link.force;
        let placement = self.effects.placement.as_ref();
        placement.map_or(force, |placement| placement.direction_to_rig(&force)).into()
    }

    /// Insertion that the model has reached, of the instrument that is farther inside \[m\].
    pub fn insertion_m(&self) -> T {
        self.insertion_m
    }
}
