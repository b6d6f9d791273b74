//! `cathforce gap`: the gap between model and measurement.

mod ablation;
pub mod apply;
mod band_text;
mod blind_test;
mod compensate;
pub mod coverage;
mod diagnose;
mod effects;
mod explanation;
pub mod hash;
mod isolability;
mod names;
mod protocol;
pub mod source;
mod spike_in;
mod verify;
pub mod watched;

use crate::args::{GapAction, GapArguments};
use crate::failure::Failure;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &GapArguments) -> Result<(), Failure> {
    match &arguments.action {
        GapAction::Diagnose(arguments) => diagnose::run(ui, arguments),
        GapAction::Apply(arguments) => apply::run(ui, arguments),
        GapAction::Verify(arguments) => verify::run(ui, arguments),
        GapAction::Coverage(arguments) => coverage::run(ui, arguments),
        GapAction::Ablation(arguments) => ablation::run(ui, arguments),
        GapAction::SpikeIn(arguments) => spike_in::run(ui, arguments),
        GapAction::Isolability(arguments) => isolability::run(ui, arguments),
        GapAction::Protocol(arguments) => protocol::run(ui, arguments),
        GapAction::Compensate(arguments) => compensate::run(ui, arguments),
        GapAction::Effects(file) => effects::list(ui, file),
        GapAction::BlindTest(arguments) => blind_test::run(ui, arguments),
    }
}
