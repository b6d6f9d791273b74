//! For any drives, the model stays finite, and single precision stays close to double precision.

#[path = "../common/wall.rs"]
mod wall;

mod caught;
mod grid;
mod passed;
mod path;
mod random;
mod sets;
mod steps;
mod stops;

use cathforce_mechanics::*;
use path::Path;
use wall::StoredWall;

/// 60 mm along x, a bend by 60° towards +y over a radius of 40 mm, then straight on.
fn bent_path() -> Path {
    let (start, x, y) = ([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    Path::new(start, x).straight(0.06).bend(0.04, core::f64::consts::FRAC_PI_3, y).straight(0.04)
}

/// A tube around that path.
fn bent_tube(radius_m: f64) -> StoredWall {
    let path = bent_path();
    let reach = radius_m + 3e-3;
    StoredWall::sampled([[-0.02, -reach, -reach], [0.14, 0.07, reach]], 1e-3, 4e-3, |p| {
        path.tube(p, radius_m)
    })
}

fn catheter<T: Real>(friction: f64, stiffness: f64, precurve: f64) -> Description<T> {
    let section = Section {
        length_m: T::lit(0.6),
        bending_stiffness_n_m2: T::lit(stiffness),
        torsional_stiffness_n_m2: T::lit(stiffness * 0.7),
        axial_stiffness_n: T::lit(stiffness * 3.5e6),
        mass_kg_per_m: T::lit(1.5e-3),
    };
    let piece = PrecurvePiece {
        length_m: T::lit(0.02),
        curvature_per_m: T::lit(precurve),
        lateral_curvature_per_m: T::zero(),
        torsion_per_m: T::zero(),
    };
    Description {
        instrument: Instrument {
            outer_radius_m: T::lit(0.825e-3),
            sections: [section].into_iter().collect(),
            precurve: [piece].into_iter().collect(),
        },
        guidewire: None,
        tendon: Tendon::none(),
        tendons: [].into_iter().collect(),
        entry: Entry {
            position_m: [T::zero(); 3],
            direction: [T::one(), T::zero(), T::zero()],
            up: [T::zero(), T::one(), T::zero()],
        },
        wall: Wall {
            line_stiffness_n_per_m2: T::lit(8e5),
            end_stiffness_n_per_m: T::lit(2e3),
            tangential_ratio: T::lit(3.0),
            friction_coefficient: T::lit(friction),
            onset_m: T::lit(1e-5),
            damping_s: T::lit(5e-3),
        },
        effects: Effects::off(),
        gravity_m_per_s2: [T::zero(), T::zero(), T::lit(-9.81)],
        solver: Solver {
            link_length_m: T::lit(2e-3),
            fine_tip_m: T::zero(),
            tick_s: T::lit(1e-3),
            substeps: 1,
            solves: 1,
            predictor_gain: T::lit(0.1),
            bending_damping_s: T::zero(),
            drag: Drag::constant(T::lit(0.01)),
        },
    }
}

/// Axial drive force over an insertion at 13 mm/s, and then over a rotation by ± 1 rad; one sample a
/// tick.
fn insertion<T: Compiled<MAX_LINKS>>(
    description: Description<T>,
    lumen: &Lumen<'_>,
    to_m: f64,
) -> [Vec<f64>; 2] {
    let model: Model<_> = Model::new(description).unwrap();
    let mut state = State::new();
    let start = 0.02;
    let mut drive = Drive { insertion_m: T::lit(start), rotation_rad: T::zero() };
    while !settle(&model, lumen, &mut state, drive) {}
    let ticks = ((to_m - start) / 13e-6) as usize;
    let mut force_n = |drive| step(&model, lumen, &mut state, drive).drive_force_n.to_f64();
    let fed = (1..=ticks).map(|tick| {
        drive.insertion_m = T::lit(start + 13e-6 * tick as f64);
        force_n(drive)
    });
    let fed = fed.collect();
    let turned = (1..=4000).map(|tick| {
        drive.rotation_rad = T::lit((std::f64::consts::TAU * f64::from(tick) / 4000.0).sin());
        force_n(drive)
    });
    [fed, turned.collect()]
}

#[test]
fn single_precision_costs_less_than_the_sensor_sees() {
    let wall = bent_tube(4e-3);
    let lumen = wall.lumen();
    let single = insertion(catheter::<f32>(0.3, 1e-5, 20.0), &lumen, 0.11);
    let double = insertion(catheter::<f64>(0.3, 1e-5, 20.0), &lumen, 0.11);
    for ((what, most_n), (single, double)) in
        [("fed", 6e-6), ("turned", 3e-5)].into_iter().zip(single.iter().zip(&double))
    {
        let peak = double.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let squares: f64 = single.iter().zip(double).map(|(a, b)| (a - b) * (a - b)).sum();
        let rms = (squares / double.len() as f64).sqrt();
        println!("{what}: peak {:.2} mN, f32 against f64 {:.4} mN RMS", peak * 1e3, rms * 1e3);
        assert!(peak > 3e-3, "{what}: the wall must be loaded: {peak}");
        assert!(rms < most_n, "{what}: rms {rms}, peak {peak}");
    }
}

#[test]
fn friction_resists_and_reverses_with_the_feed() {
    let wall = bent_tube(4e-3);
    let lumen = wall.lumen();
    let model: Model<_> = Model::new(catheter::<f32>(0.3, 1e-5, 0.0)).unwrap();
    let mut state = State::new();
    let mut at = 0.02;
    let mut drive = |state: &mut State<f32>, feed_m: f32, ticks: usize| {
        let mut last = Outputs::default();
        for _ in 0..ticks {
            at += feed_m;
            last = step(&model, &lumen, state, Drive { insertion_m: at, rotation_rad: 0.0 });
        }
        last
    };
    drive(&mut state, 0.0, 200);
    let forward = drive(&mut state, 13e-6, 6500).drive_force_n;
    let backward = drive(&mut state, -13e-6, 1500).drive_force_n;
    println!("forward {:.2} mN, backward {:.2} mN", forward * 1e3, backward * 1e3);
    assert!(forward > backward + 5e-3);
}

#[test]
fn a_drive_at_rest_on_a_whole_number_of_links_keeps_them() {
    let wall = bent_tube(4e-3);
    let lumen = wall.lumen();
    let model: Model<_> = Model::new(catheter::<f32>(0.3, 1e-5, 0.0)).unwrap();
    for links in 1..60 {
        let mut state: State<f32> = State::new();
        // The reach depends on the rounding of encoder and link length.
        for ulps in [-1i32, 0, 1] {
            let insertion_m =
                f32::from_bits((links as f32 * 2e-3).to_bits().wrapping_add_signed(ulps));
            let drive = Drive { insertion_m, rotation_rad: 0.0 };
            step(&model, &lumen, &mut state, drive);
            let nodes = state.nodes();
            for _ in 0..3 {
                step(&model, &lumen, &mut state, drive);
                assert_eq!(state.nodes(), nodes, "{links} links, {ulps} ulp");
            }
        }
    }
}

#[test]
fn an_instrument_that_was_out_enters_as_it_did_at_first() {
    let wall = bent_tube(4e-3);
    let lumen = wall.lumen();
    let model: Model<_> = Model::new(catheter::<f32>(0.3, 1e-5, 40.0)).unwrap();
    let mut state = State::new();
    let mut fed = |from_m: f32, to_m: f32| -> Vec<Outputs<f32>> {
        let ticks = 3000;
        let at = |tick: i32| from_m + (to_m - from_m) * (tick as f32 / ticks as f32);
        let mut to = |insertion_m| {
            step(&model, &lumen, &mut state, Drive { insertion_m, rotation_rad: 0.0 })
        };
        (1..=ticks).map(|tick| to(at(tick))).collect()
    };
    let first = fed(0.0, 0.11);
    let out = fed(0.11, 0.0);
    assert_eq!(out.last().map(|outputs| outputs.links), Some(0));
    let second = fed(0.0, 0.11);
    assert!(first.iter().any(|outputs| outputs.peak_contact_force_n > 1e-3));
    for (tick, (a, b)) in first.iter().zip(&second).enumerate() {
        assert_eq!(a, b, "tick {tick}");
    }
}

#[test]
fn a_lost_number_is_flagged_and_the_run_begins_again() {
    let wall = bent_tube(4e-3);
    let lumen = wall.lumen();
    let model: Model<_> = Model::new(catheter::<f32>(0.3, 1e-5, 40.0)).unwrap();
    let drive = Drive { insertion_m: 0.08, rotation_rad: 0.5 };
    let mut fresh = State::new();
    while !settle(&model, &lumen, &mut fresh, drive) {}
    let settled = step(&model, &lumen, &mut fresh, drive);

    for lost in [f32::NAN, f32::INFINITY, f32::MAX] {
        let mut state = fresh.clone();
        let loads = Loads { tip_force_n: [0.0, lost, 0.0], ..Loads::default() };
        let outputs = step_loaded(&model, &lumen, &mut state, drive, &loads);
        let nothing = Outputs { unresolved: true, lost: true, ..Outputs::default() };
        assert_eq!(outputs, nothing, "{lost}");
        let mut ticks = 0;
        let again = loop {
            let outputs = step(&model, &lumen, &mut state, drive);
            if !outputs.lost {
                break outputs;
            }
            assert!(outputs.unresolved);
            assert_eq!(outputs.force_on_vessel_n, [0.0; 3]);
            ticks += 1;
            assert!(ticks < 1000, "{lost}: still {outputs:?}");
        };
        assert_eq!(again, settled, "{lost}, after {ticks} ticks");
    }
}

#[test]
fn a_turn_that_is_no_number_is_lost_where_nothing_is_past_the_mouth_too() {
    let wall = bent_tube(4e-3);
    let model: Model<_> = Model::new(catheter::<f32>(0.3, 1e-5, 40.0)).unwrap();
    for lost in [f32::NAN, f32::INFINITY] {
        let mut state = State::new();
        let drive = Drive { insertion_m: 0.0, rotation_rad: lost };
        assert!(step(&model, &wall.lumen(), &mut state, drive).lost, "{lost}");
        let drive = Drive { insertion_m: 0.0, rotation_rad: 0.0 };
        let again = (0..1000).any(|_| !step(&model, &wall.lumen(), &mut state, drive).lost);
        assert!(again, "{lost} is forgotten");
    }
}
