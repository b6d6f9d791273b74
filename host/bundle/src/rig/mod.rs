//! `rig.toml`: what was set up, and the nominal parameters.

mod cause;
mod drive;
mod driven_tendons;
mod instrument;
mod keys;
mod plausible;
mod priors;
mod read;
mod read_transmission;
mod tendon;
mod toml_reader;
mod transmission;
mod types;

pub use cause::{BeyondModel, RigCause};
pub(crate) use drive::GRAVITY_M_PER_S2;
pub use drive::{DriveRig, RigCarried, RigMotor, RigPendulum};
pub use driven_tendons::RigDrivenTendon;
pub use instrument::{RigInstrument, RigSection, TipPiece};
pub use priors::RigPriors;
pub use read::FORMAT;
pub use tendon::RigTendon;
#[cfg(test)]
pub(crate) use toml_reader::known_keys;
pub(crate) use toml_reader::{RigWarning, place_of_key};
pub use transmission::{RigBoucWen, RigPrandtlIshlinskii, RigSheath, TransmissionRig};
pub use types::{
    CatheterRig, Fluid, Plant, Rig, RigEntry, RigEnvironment, RigSensor, RigVessel, WallRegion,
};
