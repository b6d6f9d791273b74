//! What goes into a step and what comes out.

use crate::{MAX_TENDONS, Real};

/// Position of a drive at the end of a tick.
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

/// Positions of all drives. A [`Drive`] converts into the catheter's, with the guidewire outside and no
/// tendon pulled.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Drives<T> {
    pub catheter: Drive<T>,
    /// Ignored if the description has no guidewire.
    pub guidewire: Drive<T>,
    /// Displacements of the tendons' drives from where each tendon is taut in the straight instrument,
    /// positive when pulling \[m\]. Those that the description does not have are ignored.
    pub tendons_m: [T; MAX_TENDONS],
}

impl<T: Real> Drives<T> {
    pub(crate) const ZERO: Self =
        Self { catheter: Drive::ZERO, guidewire: Drive::ZERO, tendons_m: [T::ZERO; MAX_TENDONS] };
}

impl<T: Copy + Default> From<Drive<T>> for Drives<T> {
    fn from(catheter: Drive<T>) -> Self {
        Self { catheter, ..Self::default() }
    }
}

/// External dead loads, constant in the vessel frame: weights in an experiment, the force of a tool.
/// They are not part of the contact forces of [`Outputs`].
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Loads<T> {
    /// Force on the tip \[N\].
    pub tip_force_n: [T; 3],
    /// Moment on the tip \[N·m\].
    pub tip_moment_n_m: [T; 3],
}

/// Results of one step. Results per node are read from [`crate::State`].
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Outputs<T> {
    /// Total contact force of the instrument on the vessel, rig's frame \[N\].
    pub force_on_vessel_n: [T; 3],
    /// Its total moment about the entry point, rig's frame \[N·m\].
    pub moment_on_vessel_n_m: [T; 3],
    /// Axial force on the instrument behind the guide, positive when pushing \[N\]. With a guidewire it
    /// is the catheter's share.
    pub drive_force_n: T,
    /// Torque on the instrument behind the guide, about `direction` \[N·m\]. With a guidewire it is the
    /// catheter's share.
    pub drive_torque_n_m: T,
    /// Axial force on the guidewire behind the guide, positive when pushing \[N\].
    pub guidewire_force_n: T,
    /// Torque on the guidewire behind the guide, about `direction` \[N·m\].
    pub guidewire_torque_n_m: T,
    /// Largest contact force at a node \[N\].
    pub peak_contact_force_n: T,
    /// Node with this force; 0 is the tip.
    pub peak_node: u16,
    /// Links inside the vessel in this tick.
    pub links: u16,
    /// The forces of this tick are uncertain. In this tick or one of the 7 before it, the last
    /// correction of the step was large (a snap), a point of the instrument was beyond the stored wall,
    /// a link was stretched to twice its length or compressed to half of it, or a drive was beyond the
    /// reach of the links. Also set with `lost`.
    pub unresolved: bool,
    /// A result of this step was not finite, or the run is still beginning again after one that was
    /// not. All other outputs are then meaningless.
    pub lost: bool,
}
