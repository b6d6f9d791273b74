//! Links that are half as long at the tip, against links that are all short: the results must not depend
//! on where the lengths change.

use cathforce_mechanics::*;

use crate::{bent_tube, catheter};

/// Arc of the tip within the bend when the instrument is completely inside.
const FINE_TIP_M: f64 = 0.02;
/// Insertion of the catheter, and additional insertion of a guidewire.
const FAR_M: f64 = 0.09;
const AHEAD_M: f64 = 0.012;
const FEED_M: f64 = 2e-5;
const TURN_RAD: f64 = 5e-4;
const TURNING_TICKS: usize = 1000;

/// Mean force and torque at the drives of catheter and guidewire, and mean position of the tip, in the
/// second half of the feed and in the second half of a rotation.
fn played(description: Description<f64>) -> [[f64; 7]; 2] {
    let wall = bent_tube(4e-3);
    let model: Model<f64, MOST_LINKS> = Model::new(description).unwrap();
    let (lumen, mut state) = (wall.lumen(), State::new());
    let ticks = (FAR_M / FEED_M) as usize;
    let mut means = [[0.0; 7]; 2];
    for tick in 1..=ticks + TURNING_TICKS {
        let turned = tick.saturating_sub(ticks);
        let insertion_m = FEED_M * tick.min(ticks) as f64;
        let rotation_rad = TURN_RAD * turned as f64;
        let drives = Drives {
            catheter: Drive { insertion_m, rotation_rad },
            guidewire: Drive { insertion_m: insertion_m + AHEAD_M, rotation_rad },
            ..Drives::default()
        };
        let o = step(&model, &lumen, &mut state, drives);
        assert!(!o.lost, "tick {tick}");
        let [x, y, z] = state.node_position_m(0).unwrap();
        let found = [
            o.drive_force_n,
            o.drive_torque_n_m,
            o.guidewire_force_n,
            o.guidewire_torque_n_m,
            x,
            y,
            z,
        ];
        let (phase, last) = if turned == 0 { (0, ticks) } else { (1, TURNING_TICKS) };
        let within = if turned == 0 { tick } else { turned };
        if within > last / 2 {
            for (mean, found) in means[phase].iter_mut().zip(found) {
                *mean += found / (last - last / 2) as f64;
            }
        }
    }
    means
}

/// A run with links of this length, and with half as long ones at the tip.
fn with_links(
    description: &Description<f64>,
    link_length_m: f64,
    fine_tip_m: f64,
) -> [[f64; 7]; 2] {
    let mut description = description.clone();
    description.solver.link_length_m = link_length_m;
    description.solver.fine_tip_m = fine_tip_m;
    played(description)
}

/// Tolerances: forces 2 % (of at least 1.5 mN), torques 1 % (of at least 0.1 µN·m), the tip 10 µm; or a
/// quarter of the error with long links only.
fn assert_alike(what: &str, change: impl Fn(&mut Description<f64>)) {
    const UNITS: [(&str, f64, [f64; 2]); 7] = [
        ("drive force, mN", 1e3, [0.02, 1.5]),
        ("torque, µN·m", 1e6, [0.01, 0.1]),
        ("of the guidewire, mN", 1e3, [0.02, 1.5]),
        ("its torque, µN·m", 1e6, [0.01, 0.1]),
        ("tip x, mm", 1e3, [0.0, 0.01]),
        ("tip y, mm", 1e3, [0.0, 0.01]),
        ("tip z, mm", 1e3, [0.0, 0.01]),
    ];
    let mut description = catheter(0.3, 1e-5, 40.0);
    change(&mut description);
    let short = with_links(&description, 1e-3, 0.0);
    // Slightly more than the links need, so that rounding loses none.
    let finer = with_links(&description, 2e-3, FINE_TIP_M + 1e-4);
    let long = with_links(&description, 2e-3, 0.0);
    for (phase, name) in ["fed", "turned"].into_iter().enumerate() {
        for (k, (unit, scale, [share, least])) in UNITS.into_iter().enumerate() {
            let [short, finer, long] = [&short, &finer, &long].map(|of| scale * of[phase][k]);
            let off = if share > 0.0 { share * short.abs().max(least) } else { least };
            let off = off.max(0.25 * (long - short).abs());
            let told = format!("{what}, {name}: {unit}: {finer:.4}, of short links {short:.4}");
            println!("{told}");
            assert!((finer - short).abs() < off, "{told}");
        }
    }
}

#[test]
fn where_lengths_change_the_instrument_goes_on_with_every_effect_of_the_recursion() {
    let set = |d: &mut Description<f64>, values: &[(&str, f64)]| {
        for (key, value) in values {
            d.set_parameter(key, *value).unwrap();
        }
    };
    assert_alike("plain", |_| ());
    assert_alike("guidewire", |d| {
        let mut wire = d.instrument.clone();
        wire.outer_radius_m *= 0.4;
        wire.sections[0].bending_stiffness_n_m2 *= 0.5;
        wire.sections[0].torsional_stiffness_n_m2 *= 0.5;
        d.guidewire = Some(wire);
    });
    assert_alike("tendon", |d| {
        d.tendon = Tendon {
            pull_m: 8e-4,
            stiffness_n_per_m: 2e3,
            offset_m: 5e-4,
            length_m: 0.03,
            angle_rad: 0.4,
        };
    });
    assert_alike("straightened", |d| set(d, &[("effects.entry.guide.straightened_m", 0.08)]));
    assert_alike("windup", |d| {
        set(d, &[("effects.instrument.torsional_windup.free_length_m", 0.3)]);
    });
    assert_alike("viscous", |d| set(d, &[("effects.instrument.viscoelastic.time_s", 0.01)]));
    assert_alike("stream", |d| set(d, &[("effects.fluid.drag.along_n_per_m", 0.03)]));
}
