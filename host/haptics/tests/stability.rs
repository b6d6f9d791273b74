//! The loop with the device's own code and the vessel of the example.

use std::path::Path;

use cathforce_bundle::{Bundle, ImageOptions, device_image};
use cathforce_control::Config;
use cathforce_haptics::{Axis, Delay, Hand, Handle, Map, Operation, Outcome};

fn with_config(energy_limit_j: f32, test: impl Fn(&Config<'_>, Operation)) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/tapered-none");
    let bundle = Bundle::open(Path::new(path)).unwrap();
    let (image, _) = device_image(&bundle, &ImageOptions::default()).unwrap();
    let mut config = cathforce_config::image::decode(&image).unwrap();
    config.settings.energy_limit_j = energy_limit_j;
    let operation = Operation {
        axis: Axis::Linear,
        handle: Handle::of(Axis::Linear),
        hand: Hand { stiffness: 100.0, damping_ratio: 0.2 },
        delay: Delay { ticks: 0, jitter_ticks: 0 },
        from_m: 0.02,
        to_m: 0.95 * bundle.largest_insertion_m().unwrap(),
        speed_m_per_s: 0.03,
        turn_rad: 3.0,
        turn_rad_per_s: 2.0,
        hold_ticks: 1000,
        seed: 1,
    };
    test(&config, operation);
}

#[test]
fn p08_a_small_budget_holds_what_swings_without_the_observer() {
    const BUDGET_J: f32 = 0.001;
    with_config(BUDGET_J, |config, operation| {
        let map = Map::of(operation, config, &[100.0, 1000.0], &[1.0, 20.0]).unwrap();
        let outcomes: Vec<Outcome> = map.cells.iter().map(|cell| cell.outcome()).collect();
        assert_eq!(
            outcomes,
            [Outcome::Stable, Outcome::Held, Outcome::Stable, Outcome::Stable],
            "{:#?}",
            map.cells
        );
        let held = &map.cells[1];
        assert!(held.with.was_limited && !held.without.was_limited);
        // Half of the budget is each axis's; a count of the force and of the encoder are rounded on the way.
        assert!(held.with.energy_j < 0.55 * f64::from(BUDGET_J), "{:?}", held.with);
        assert!(held.without.energy_j > 2.0 * f64::from(BUDGET_J), "{:?}", held.without);
        assert!(map.table().contains("| 100 | stable | held |"), "{}", map.table());
        assert!(map.largest_step() > 0.0);
    });
}

#[test]
fn frames_that_come_late_do_not_stop_an_operation_and_jitter_is_the_same_each_time() {
    with_config(0.1, |config, operation| {
        let operation = Operation { delay: Delay { ticks: 5, jitter_ticks: 1 }, ..operation };
        let passed = operation.run(config).unwrap();
        assert!(passed.is_stable && passed.stopped.is_none(), "{passed:?}");
        assert!(passed.largest > 0.03, "the wall is felt: {passed:?}");
        assert_eq!(operation.run(config).unwrap(), passed);
    });
}

#[test]
fn a_knob_that_is_turned_feels_the_torque() {
    with_config(0.1, |config, operation| {
        let operation = Operation {
            axis: Axis::Rotary,
            handle: Handle::of(Axis::Rotary),
            hand: Hand { stiffness: 0.1, damping_ratio: 0.2 },
            ..operation
        };
        let passed = operation.run(config).unwrap();
        assert!(passed.is_stable && passed.largest > 1e-5, "{passed:?}");
    });
}
