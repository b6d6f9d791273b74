//! Every effect is free when it is off and does something when it is on, on the example bundle.

use cathforce_bundle::{Bundle, SolverDefaults, lumen_from_bundle, to_description};
use cathforce_effect_catalogue::{Channel, Effect, Parameter, Plant, Role, all};
use cathforce_mechanics::{
    Description, Drive, Lumen, LumenHeader, Measurement, Model, State, settle, step,
};

const START_M: f64 = 0.02;
const TICKS: u32 = 1500;

/// Force, drive force, tip.
type Row = [f64; 7];

/// 40 mm at 40 mm/s, the pre-curved tip coming out of the guide, while the drive turns by 1 rad, 5 mm back, a short rest.
fn drive(tick: u32) -> Drive<f64> {
    let t_s = f64::from(tick) * 1e-3;
    let there = t_s.min(1.0) * 0.04;
    let back = (t_s - 1.0).clamp(0.0, 0.25) * 0.02;
    Drive { insertion_m: START_M + there - back, rotation_rad: t_s.min(1.0) }
}

fn nominal() -> (Description<f64>, LumenHeader, Vec<u8>) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/tapered-none");
    let bundle = Bundle::open(path).expect("the example");
    let description = to_description(&bundle, &SolverDefaults::default()).expect("trials");
    let (header, bytes, _) = lumen_from_bundle(&bundle, 2e-3).expect("a vessel");
    (description, header, bytes)
}

/// Readings of the sensors.
fn run(description: &Description<f64>, lumen: &Lumen<'_>, start: &State<f64>) -> Vec<Row> {
    let model = Model::new(description.clone()).expect("within the ranges");
    let (mut state, mut sensor) = (start.clone(), Measurement::new());
    (1..=TICKS)
        .map(|tick| {
            let found = step(&model, lumen, &mut state, drive(tick));
            let force = sensor.read(&description.effects.sensor, 1e-3, found.force_on_vessel_n);
            let tip = state.node_position_m(0).expect("inside");
            let [fx, fy, fz] = force;
            let row = [fx, fy, fz, found.drive_force_n, tip[0], tip[1], tip[2]];
            assert!(row.iter().all(|x| x.is_finite()));
            row
        })
        .collect()
}

/// Largest difference of a channel.
fn difference(a: &[Row], b: &[Row], channel: Channel) -> f64 {
    let columns = match channel {
        Channel::Force => 0..3,
        Channel::DriveForce => 3..4,
        _ => 4..7,
    };
    let rows = a.iter().zip(b);
    rows.flat_map(|(a, b)| columns.clone().map(|k| (a[k] - b[k]).abs())).fold(0.0, f64::max)
}

#[test]
fn each_effect_changes_what_it_says_and_off_changes_no_bit() {
    let (mut nominal, header, bytes) = nominal();
    let lumen = Lumen::new(header, &bytes).expect("just built");
    let model = Model::new(nominal.clone()).expect("the example's");
    let mut start = State::new();
    while !settle(&model, &lumen, &mut start, drive(0)) {}
    let base = run(&nominal, &lumen, &start);

    // The rig has a tendon that is not pulled, so that effects of a tendon can act.
    let tendon = [
        ("tendon.pull_m", 2e-3),
        ("tendon.stiffness_n_per_m", 2e3),
        ("tendon.offset_m", 5e-4),
        ("tendon.length_m", 0.03),
        ("tendon.angle_rad", 1.0),
    ];
    for effect in all().filter(|effect| effect.plant == Plant::Catheter) {
        let untouched = nominal.clone();
        let mut without = base.clone();
        if effect.id.starts_with("tendon.") {
            for (key, value) in tendon {
                nominal.set_parameter(key, value).expect("within the range");
            }
            without = run(&nominal, &lumen, &start);
            assert!(difference(&without, &base, Channel::Tip) > 1e-3, "a pulled tendon bends");
        }
        let off: Vec<_> =
            effect.parameters.iter().map(|p| (p, p.off(&nominal).expect("a key"))).collect();

        let starts = effect.starts();
        let start_from = &starts[starts.len() / 2];
        let mut values = effect.start(&nominal, start_from);
        values.extend(places(effect, &base));
        Effect::apply(&mut nominal, &values).expect("within the range");
        let with = run(&nominal, &lumen, &start);
        let least = |channel| if channel == Channel::Tip { 2e-6 } else { 2e-4 };
        let seen = effect
            .channels
            .iter()
            .filter(|c| **c != Channel::Shape)
            .any(|&channel| difference(&with, &without, channel) > least(channel));
        let sizes: Vec<_> =
            effect.channels.iter().map(|&c| (c, difference(&with, &without, c))).collect();
        assert!(seen, "{} {start_from:?}: {sizes:?}", effect.id);
        for channel in [Channel::Force, Channel::DriveForce, Channel::Tip] {
            let says = effect.channels.contains(&channel);
            assert!(says || difference(&with, &without, channel) == 0.0, "{}", effect.id);
        }

        Effect::apply(&mut nominal, &off).expect("its own values");
        assert_eq!(run(&nominal, &lumen, &start), without, "{} is off again", effect.id);
        nominal = untouched;
    }
}

/// A place on the tip's way, for effects that have one.
fn places(effect: &'static Effect, base: &[Row]) -> Vec<(&'static Parameter, f64)> {
    let tip = &base[base.len() / 3][4..];
    let coordinates = effect.parameters.iter().filter(|p| p.role == Role::Place);
    coordinates.zip(tip).map(|(parameter, &x)| (parameter, x)).collect()
}
