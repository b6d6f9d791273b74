//! `cathforce import`: recordings and trials from the files of other tools.

mod ati;
#[cfg(feature = "camera")]
mod camera;
pub mod candump;
mod drive;
mod into_bundle;
#[cfg(feature = "meshes")]
mod mesh;
mod motion;
mod ros;
mod table;
pub mod trial;

#[cfg(not(feature = "camera"))]
use super::left_out::camera;
#[cfg(not(feature = "meshes"))]
use super::left_out::mesh;
use crate::args::ImportSource;
use crate::failure::Failure;
use crate::ui::Ui;

pub fn run(ui: &Ui, from: &ImportSource) -> Result<(), Failure> {
    match from {
        ImportSource::Can(arguments) => candump::run(ui, arguments),
        ImportSource::Ati(arguments) => ati::run(ui, arguments),
        ImportSource::Csv(arguments) => table::run(ui, arguments),
        ImportSource::Ros(arguments) => ros::run(ui, arguments),
        ImportSource::Drive(arguments) => drive::table(ui, arguments),
        ImportSource::Dynamixel(arguments) => drive::dynamixel(ui, arguments),
        ImportSource::Odrive(arguments) => drive::odrive(ui, arguments),
        ImportSource::Moteus(arguments) => drive::moteus(ui, arguments),
        ImportSource::Joint(arguments) => drive::joint(ui, arguments),
        ImportSource::Mesh(arguments) => mesh::surface(ui, arguments),
        ImportSource::Centreline(arguments) => mesh::centreline(ui, arguments),
        ImportSource::Camera(arguments) => camera::run(ui, arguments),
    }
}
