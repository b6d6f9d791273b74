//! What a step remembers and what it reports.

use crate::{MAX_LINKS, Real};

/// Where the drive is at the end of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Drive<T> {
    /// Unstretched length of instrument past the entry plane \[m\].
    pub insertion_m: T,
    /// Rotation imposed at the entry plane, right-handed about `direction` \[rad\].
    pub rotation_rad: T,
}

/// What one step found. Per-node results are read from [`State`].
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Outputs<T> {
    /// Total contact force of the instrument on the vessel, vessel frame \[N\].
    pub force_on_vessel_n: [T; 3],
    /// Its total moment about the entry point, vessel frame \[N·m\].
    pub moment_on_vessel_n_m: [T; 3],
    /// Axial force on the instrument behind the guide, positive when pushing \[N\].
    pub drive_force_n: T,
    /// Torque on the instrument behind the guide, about `direction` \[N·m\].
    pub drive_torque_n_m: T,
    /// Largest contact force at a node \[N\].
    pub peak_contact_force_n: T,
    /// The node that carries it (0 is the tip).
    pub peak_node: u16,
    /// Links inside the vessel in this tick.
    pub links: u16,
    /// The step's last correction was large (a snap): forces of this tick are not to be trusted.
    pub unresolved: bool,
}

/// Memory of the model. Configuration never lives here.
#[derive(Clone, Debug)]
pub struct State<T> {
    pub(crate) links: usize,
    pub(crate) position: [[T; 3]; MAX_LINKS],
    pub(crate) contact_force: [[T; 3]; MAX_LINKS],
}

impl<T: Real> Default for State<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> State<T> {
    /// The instrument in the guide, nothing inside the vessel.
    pub fn new() -> Self {
        Self {
            links: 0,
            position: [[T::zero(); 3]; MAX_LINKS],
            contact_force: [[T::zero(); 3]; MAX_LINKS],
        }
    }

    /// Nodes inside the vessel: node 0 is the tip, node `nodes() − 1` the one next to the guide.
    pub fn nodes(&self) -> usize {
        self.links
    }

    /// Position of a node, vessel frame \[m\]; `None` beyond [`State::nodes`].
    pub fn node_position_m(&self, node: usize) -> Option<[T; 3]> {
        self.position.get(..self.links)?.get(node).copied()
    }

    /// Contact force of the instrument on the vessel around a node \[N\].
    pub fn node_force_n(&self, node: usize) -> Option<[T; 3]> {
        self.contact_force.get(..self.links)?.get(node).copied()
    }

    /// Insertion that the model has reached \[m\].
    pub fn insertion_m(&self) -> T {
        T::zero()
    }
}
