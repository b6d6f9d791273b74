//! `cathforce`: arguments in, a library call, text or JSON out.

// What only a command uses that was left out stays where it is.
#![cfg_attr(
    not(all(
        feature = "camera",
        feature = "dash",
        feature = "hardware",
        feature = "monitor",
        feature = "parquet",
        feature = "wall"
    )),
    allow(dead_code)
)]

mod args;
mod canopen;
mod commands;
mod difference;
mod failure;
mod image;
mod log;
#[cfg(feature = "monitor")]
mod monitor;
mod open;
mod output;
#[cfg(test)]
mod reference;
mod run_info;
mod session;
mod settings;
mod ui;
#[cfg(feature = "dash")]
mod web;

use std::process::ExitCode;

use args::{Arguments, Command};

fn main() -> ExitCode {
    let arguments = Arguments::read();
    let ui = ui::Ui::new(arguments.json, arguments.quiet);
    cathforce_link::set_remarks(move |remark| ui.say(remark));
    let result = match arguments.command {
        Command::Run(arguments) => commands::run::run(&ui, &arguments),
        Command::Simulate(arguments) => commands::simulate::run(&ui, &arguments),
        Command::Replay(arguments) => commands::replay::run(&ui, &arguments),
        Command::Info(arguments) => commands::info::run(&ui, &arguments),
        Command::Config(arguments) => commands::config::run(&ui, &arguments),
        Command::Bundle(arguments) => commands::bundle::run(&ui, &arguments),
        Command::Link(arguments) => commands::link::run(&ui, &arguments),
        Command::Doctor(arguments) => commands::doctor::run(&ui, &arguments),
        Command::Demo(arguments) => commands::demo::run(&ui, &arguments),
        Command::Flash(arguments) => commands::flash::run(&ui, &arguments),
        Command::Fault(arguments) => commands::fault::run(&ui, &arguments),
        Command::Lumen(arguments) => commands::lumen::run(&ui, &arguments),
        Command::Material(arguments) => commands::material::run(&ui, &arguments),
        Command::Wall(arguments) => commands::wall::run(&ui, &arguments),
        Command::Ultrasound(arguments) => commands::ultrasound::run(&ui, &arguments),
        Command::Identify(arguments) => commands::identify::run(&ui, &arguments),
        Command::Haptics(arguments) => commands::haptics::run(&ui, &arguments),
        Command::Tips => commands::tips::list(&ui),
        Command::Gap(arguments) => commands::gap::run(&ui, &arguments),
        Command::Calibrate(arguments) => commands::calibrate::run(&ui, &arguments),
        Command::Reproduce(arguments) => commands::reproduce::run(&ui, &arguments),
        Command::Report(arguments) => commands::report::run(&ui, &arguments),
        Command::Check(arguments) => commands::check::run(&ui, &arguments),
        Command::Export(arguments) => commands::export::run(&ui, &arguments),
        Command::Import(arguments) => commands::import::run(&ui, &arguments.from),
        Command::Filter(arguments) => commands::filter::run(&ui, &arguments),
        Command::Play(arguments) => commands::play::run(&ui, &arguments),
        Command::Monitor(arguments) => commands::monitor::run(&ui, &arguments),
        Command::Dash(arguments) => commands::dash::run(&ui, &arguments),
        Command::Latency(arguments) => commands::latency::run(&ui, &arguments),
        Command::Completions(arguments) => commands::shell::completions(&ui, &arguments),
        Command::Man(arguments) => commands::shell::man(&ui, &arguments),
    };
    result.map_or_else(
        |failure| {
            ui.error(&failure.message);
            failure.into()
        },
        |()| ExitCode::SUCCESS,
    )
}
