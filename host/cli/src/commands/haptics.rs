//! `cathforce haptics`: where the operator's loop is stable.

use cathforce_bundle::Bundle;
use cathforce_config::image::decode;
use cathforce_haptics::{Axis, Delay, Hand, Handle, Map, Operation};

use crate::args::{HapticsArguments, OperatorAxis};
use crate::failure::{Code, Failure};
use crate::image;
use crate::ui::Ui;

/// Where the insertion begins and ends, as shares of the deepest trial: an overshoot stays within it.
const FROM: f64 = 0.2;
const TO: f64 = 0.95;
/// As surgeons feed and turn.
const SPEED_M_PER_S: f64 = 0.03;
const TURN_RAD: f64 = 3.0;
const TURN_RAD_PER_S: f64 = 2.0;
/// In 2 s the slowest hand of the maps swings four times.
const HOLD_TICKS: usize = 2000;
/// Fingers are badly damped where they hold something lightly.
const DAMPING_RATIO: f64 = 0.2;
const SEED: u64 = 1;

pub fn run(ui: &Ui, arguments: &HapticsArguments) -> Result<(), Failure> {
    let bundle = Bundle::open(&arguments.bundle)?;
    let options = image::options(ui, &bundle, &arguments.changes)?;
    let (bytes, _) = image::image_with(ui, &bundle, &options)?;
    let config = decode(&bytes)
        .map_err(|error| Failure::input(format!("{}: {error}", arguments.bundle.display())))?;
    if config.model.description().guidewire.is_some()
        || !config.model.description().tendons.is_empty()
    {
        return Err(Failure::new(
            Code::Usage,
            format!(
                "{}: this rig has a guidewire or driven tendons, and the simulated master has one drive\n  \
                 fix: name a bundle with a catheter alone",
                arguments.bundle.display()
            ),
        ));
    }
    let deepest_m = bundle.largest_insertion_m().unwrap_or_default();
    let axis = match arguments.axis {
        OperatorAxis::Linear => Axis::Linear,
        OperatorAxis::Rotary => Axis::Rotary,
    };
    let usual = Handle::of(axis);
    let handle = Handle { inertia: arguments.inertia.unwrap_or(usual.inertia), ..usual };
    let hands = match (&arguments.hands[..], axis) {
        ([], Axis::Linear) => &[30.0, 100.0, 300.0, 1000.0][..],
        ([], Axis::Rotary) => &[0.01, 0.03, 0.1, 0.3],
        (own, _) => own,
    };
    let gains = match &arguments.gains[..] {
        [] => &[1.0, 2.0, 5.0, 10.0, 20.0][..],
        own => own,
    };
    let operation = Operation {
        axis,
        handle,
        hand: Hand { stiffness: hands[0], damping_ratio: DAMPING_RATIO },
        delay: Delay { ticks: arguments.delay, jitter_ticks: arguments.jitter },
        from_m: FROM * deepest_m,
        to_m: TO * deepest_m,
        speed_m_per_s: SPEED_M_PER_S,
        turn_rad: TURN_RAD,
        turn_rad_per_s: TURN_RAD_PER_S,
        hold_ticks: HOLD_TICKS,
        seed: SEED,
    };
    let map = Map::of(operation, &config, hands, gains)
        .map_err(|error| Failure::new(Code::Failed, error.to_string()))?;
    let unit = match axis {
        Axis::Linear => "N",
        Axis::Rotary => "N·m",
    };
    let text = format!(
        "{}\nstable: at rest, whether or not the passivity observer is on. held: at rest only because it limits \
         the output to {} J.\nswings: the handle swings on, or faster than the drive can be, which ends the \
         operation.\nlargest step that is felt where it is stable: {:.2} {unit}\n",
        map.table(),
        config.settings.energy_limit_j,
        map.largest_step()
    );
    ui.data(&map, text)
}
