//! `cathforce gap`: what is between the model and the measurement.

mod apply;
mod challenge;
mod diagnose;
mod effects;
mod explanation;
mod hash;
mod isolability;
mod protocol;
mod verify;

use cathforce_gap::catheter::Catheter;
use cathforce_gap::drive::Drive;
use cathforce_gap::plant::Plant;
use cathforce_rig::Bundle;
use cathforce_rig::bundle::Plant as RigPlant;

use crate::args::{GapAction, GapArguments};
use crate::failure::Failure;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &GapArguments) -> Result<(), Failure> {
    match &arguments.action {
        GapAction::Diagnose(arguments) => diagnose::run(ui, arguments),
        GapAction::Apply(arguments) => apply::run(ui, arguments),
        GapAction::Verify(arguments) => verify::run(ui, arguments),
        GapAction::Isolability(arguments) => isolability::run(ui, arguments),
        GapAction::Protocol(arguments) => protocol::run(ui, arguments),
        GapAction::Effects => effects::list(ui),
        GapAction::Challenge(arguments) => challenge::run(ui, arguments),
    }
}

/// The plant of a bundle.
fn plant(bundle: &Bundle) -> Result<Box<dyn Plant>, Failure> {
    let refuse = |error: &dyn std::fmt::Display| {
        Failure::input(format!("{}: {error}", bundle.path.display()))
    };
    match &bundle.rig.plant {
        RigPlant::Drive(_) => Ok(Box::new(Drive::new(bundle).map_err(|e| refuse(&e))?)),
        RigPlant::Catheter(_) => Ok(Box::new(catheter(bundle)?)),
    }
}

fn catheter(bundle: &Bundle) -> Result<Catheter, Failure> {
    let refuse = |e| Failure::input(format!("{}: {e}", bundle.path.display()));
    Catheter::new(bundle).map_err(refuse)
}
