//! `cathforce gap`.

mod effects;

use crate::args::{GapAction, GapArguments};
use crate::failure::Failure;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &GapArguments) -> Result<(), Failure> {
    match &arguments.action {
        GapAction::Effects => effects::list(ui),
    }
}
