//! `cathforce wall`: finite elements of a vessel's wall.

mod law;
mod load;
mod phantom;
mod reduce;

use crate::args::{WallAction, WallArguments};
use crate::failure::Failure;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &WallArguments) -> Result<(), Failure> {
    match &arguments.action {
        WallAction::Load(arguments) => load::run(ui, arguments),
        WallAction::Phantom(arguments) => phantom::run(ui, arguments),
        WallAction::Reduce(arguments) => reduce::run(ui, arguments),
    }
}
