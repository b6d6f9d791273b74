//! What goes into a step and what comes out.

use crate::Real;

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

/// What one step found. Per-node results are read from [`crate::State`].
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
