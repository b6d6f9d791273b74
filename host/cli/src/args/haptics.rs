//! Arguments of `cathforce haptics`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::Changes;

#[derive(Debug, Args)]
pub struct HapticsArguments {
    /// Trial bundle.
    pub bundle: PathBuf,
    /// Axis of the operator whose loop is closed.
    #[arg(long, value_enum, default_value_t = OperatorAxis::Linear)]
    pub axis: OperatorAxis,
    /// Delay of frames to the device and from it, each way [ms]
    #[arg(long, value_name = "MS", default_value_t = 2, value_parser = clap::value_parser!(u32).range(0..=100))]
    pub delay: u32,
    /// Frames come up to so much later than that [ms]
    #[arg(long, value_name = "MS", default_value_t = 1, value_parser = clap::value_parser!(u32).range(0..=20))]
    pub jitter: u32,
    /// Mass of the handle [kg] [default: 0.15], or its moment of inertia [kg·m²] [default: 1.7e-5]
    #[arg(long, value_name = "NUMBER", value_parser = positive)]
    pub inertia: Option<f64>,
    /// Stiffness of the operator's hand [N/m] [default: 30, 100, 300, 1000], or [N·m/rad] [default: 0.01, 0.03,
    /// 0.1, 0.3]. May be repeated.
    #[arg(long = "hand", value_name = "NUMBER", value_parser = positive)]
    pub hands: Vec<f64>,
    /// Gain of the force or torque [default: 1, 2, 5, 10, 20]. May be repeated.
    #[arg(long = "gain", value_name = "NUMBER", value_parser = gain)]
    pub gains: Vec<f32>,
    #[command(flatten)]
    pub changes: Changes,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OperatorAxis {
    /// Insertion.
    Linear,
    /// Rotation.
    Rotary,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("it must be a number above 0".to_owned()),
    }
}

/// Within what the setting `force_gain` takes.
fn gain(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if (0.0..=20.0).contains(&value) => Ok(value),
        _ => Err("it must be a number from 0 to 20".to_owned()),
    }
}
