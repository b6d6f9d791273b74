//! The machine that the figures were measured on.

use std::num::NonZero;
use std::process::Command;

use serde::Serialize;

/// Processor, system and compiler.
#[derive(Debug, Serialize)]
pub struct Machine {
    pub processor: String,
    pub cores: usize,
    pub system: String,
    pub compiler: String,
}

impl Machine {
    /// This machine.
    pub fn this() -> Self {
        let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = cpuinfo.lines().find_map(|line| line.strip_prefix("model name"));
        let processor = model.map(|rest| rest.trim_start_matches([' ', '\t', ':']).to_owned());
        Self {
            processor: processor.unwrap_or_else(|| std::env::consts::ARCH.into()),
            cores: std::thread::available_parallelism().map_or(1, NonZero::get),
            system: std::env::consts::OS.into(),
            compiler: first_line(Command::new("rustc").arg("--version")),
        }
    }
}

/// The first line that a program prints, or a note that it cannot be run.
fn first_line(command: &mut Command) -> String {
    let unknown = || format!("{} not found", command.get_program().to_string_lossy());
    let unknown = unknown();
    let output = command.output().ok().filter(|output| output.status.success());
    let text = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    text.and_then(|text| text.lines().next().map(str::to_owned)).unwrap_or(unknown)
}
