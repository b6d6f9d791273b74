//! Commands that this program was built without: they say so.

#![cfg_attr(
    all(
        feature = "camera",
        feature = "dash",
        feature = "hardware",
        feature = "meshes",
        feature = "monitor",
        feature = "parquet",
        feature = "wall"
    ),
    allow(dead_code)
)]

use crate::failure::{Code, Failure};

/// Names the feature of this package that a command needs.
fn without(command: &str, feature: &str) -> Failure {
    let message = format!(
        "this program was built without `{command}`\n  fix: build it with its feature `{feature}`, \
         which is on by default: `cargo install --path host/cli`"
    );
    Failure::new(Code::Usage, message)
}

#[cfg(not(feature = "camera"))]
pub mod camera {
    use crate::args::ImportCameraArguments;
    use crate::failure::Failure;
    use crate::ui::Ui;

    pub fn run(_: &Ui, _: &ImportCameraArguments) -> Result<(), Failure> {
        Err(super::without("cathforce import camera", "camera"))
    }
}

#[cfg(not(feature = "dash"))]
pub mod dash {
    use crate::args::DashArguments;
    use crate::failure::Failure;
    use crate::ui::Ui;

    pub fn run(_: &Ui, _: &DashArguments) -> Result<(), Failure> {
        Err(super::without("cathforce dash", "dash"))
    }
}

#[cfg(not(feature = "dash"))]
pub mod web {
    use crate::commands::gap::watched::Onlooker;
    use crate::failure::Failure;
    use crate::ui::Ui;

    pub fn while_it_runs(
        _: &Ui,
        _: std::net::SocketAddr,
        _: &str,
        _: impl FnOnce(&crate::log::Watch) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        Err(super::without("cathforce run --dash", "dash"))
    }

    pub fn while_diagnosing(
        _: &Ui,
        _: std::net::SocketAddr,
        _: &str,
        _: impl FnOnce(&dyn Onlooker) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        Err(super::without("cathforce gap diagnose --dash", "dash"))
    }
}

#[cfg(not(feature = "meshes"))]
pub mod mesh {
    use crate::args::{ImportCentrelineArguments, ImportMeshArguments};
    use crate::failure::Failure;
    use crate::ui::Ui;

    pub fn surface(_: &Ui, _: &ImportMeshArguments) -> Result<(), Failure> {
        Err(super::without("cathforce import mesh", "meshes"))
    }

    pub fn centreline(_: &Ui, _: &ImportCentrelineArguments) -> Result<(), Failure> {
        Err(super::without("cathforce import centreline", "meshes"))
    }
}

#[cfg(not(feature = "monitor"))]
pub mod monitor {
    use crate::args::MonitorArguments;
    use crate::failure::Failure;
    use crate::ui::Ui;

    pub fn run(_: &Ui, _: &MonitorArguments) -> Result<(), Failure> {
        Err(super::without("cathforce monitor", "monitor"))
    }
}

#[cfg(not(feature = "wall"))]
pub mod material {
    use crate::args::MaterialArguments;
    use crate::failure::Failure;
    use crate::ui::Ui;

    pub fn run(_: &Ui, _: &MaterialArguments) -> Result<(), Failure> {
        Err(super::without("cathforce material", "wall"))
    }
}

#[cfg(not(feature = "wall"))]
pub mod ultrasound {
    use crate::args::UltrasoundArguments;
    use crate::failure::Failure;
    use crate::ui::Ui;

    pub fn run(_: &Ui, _: &UltrasoundArguments) -> Result<(), Failure> {
        Err(super::without("cathforce ultrasound", "wall"))
    }
}

#[cfg(not(feature = "wall"))]
pub mod wall {
    use crate::args::WallArguments;
    use crate::failure::Failure;
    use crate::ui::Ui;

    pub fn run(_: &Ui, _: &WallArguments) -> Result<(), Failure> {
        Err(super::without("cathforce wall", "wall"))
    }
}

#[cfg(not(feature = "hardware"))]
pub mod import_dbc {
    use crate::args::ConfigImportDbcArguments;
    use crate::failure::Failure;
    use crate::ui::Ui;

    pub fn run(_: &Ui, _: &ConfigImportDbcArguments) -> Result<(), Failure> {
        Err(super::without("cathforce config import-dbc", "hardware"))
    }
}

#[cfg(not(feature = "parquet"))]
pub fn write_parquet(
    _: &cathforce_recording::Recording,
    _: &[cathforce_recording::TickEstimate],
    _: [f32; 3],
    _: &std::path::Path,
) -> Result<(), Failure> {
    Err(without("cathforce export --parquet", "parquet"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_command_that_was_left_out_says_which_feature_it_needs() {
        let message = super::without("cathforce monitor", "monitor").message;
        assert!(message.contains("`monitor`, which is on by default"), "{message}");
    }
}
