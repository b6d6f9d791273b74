//! `cargo run -p cathforce-hil-tests --example effect_costs`: what each effect costs on the
//! emulated board, as a table. With `-- ID …` only of these.
//!
//! The example's instrument with all its links inside the vessel, fed and turned for a tenth of
//! a second: instructions of the worst tick, with the effect off and on. Needs the firmware
//! (`cargo xtask firmware`) and QEMU.

use cathforce_bundle::{ImageOptions, SolverDefaults, to_description};
use cathforce_effect_catalogue::{Plant, all};
use cathforce_hil_tests::{Bench, Drive, bundle, encoder, image_with};
use cathforce_link::qemu::Qemu;

/// Where the tip lies in the first branch.
const INSERTION_M: f64 = 0.06;
const LINKS: f64 = 63.5;
const TICKS: u32 = 100;

fn worst_instructions(parameters: Vec<(String, f32)>) -> u32 {
    let image = image_with(&ImageOptions {
        link_length_m: Some(SolverDefaults::default().link_length_over(INSERTION_M, LINKS)),
        parameters,
        ..ImageOptions::default()
    });
    let at = |tick: u32| Drive {
        insertion_m: INSERTION_M - 2e-3 + 2e-5 * f64::from(tick),
        rotation_rad: 2e-3 * f64::from(tick),
    };
    let mut bench = Bench::<Qemu>::armed(&image, at(0));
    bench.play((1..=TICKS).map(|tick| vec![encoder(at(tick))]));
    bench.report().load.worst_instructions
}

fn main() {
    let nominal = to_description::<f64>(bundle(), &SolverDefaults::default());
    let nominal = nominal.expect("the example has trials");
    // A tendon that is pulled, for the effects that act on one.
    let tendon = [
        ("tendon.pull_m", 2e-3),
        ("tendon.stiffness_n_per_m", 2e3),
        ("tendon.offset_m", 5e-4),
        ("tendon.length_m", 0.03),
    ]
    .map(|(key, value)| (key.to_owned(), value));

    let off = worst_instructions(Vec::new());
    println!("| effect | instructions of the worst tick | more than without |");
    println!("| --- | --- | --- |\n| none | {off} | |");
    let with_tendon = worst_instructions(tendon.to_vec());
    println!("| none, of an instrument with a tendon | {with_tendon} | |");
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let is_wanted = |id: &str| wanted.is_empty() || wanted.iter().any(|wanted| wanted == id);
    let effects = all().filter(|effect| effect.plant == Plant::Catheter && is_wanted(effect.id));
    for effect in effects {
        // Sensor effects act where readings are compared, on the host.
        if effect.id.starts_with("sensor.") {
            println!("| {} | {off} | none: on the host |", effect.id);
            continue;
        }
        let values = effect.start(&nominal, &effect.starts()[0]);
        let mut parameters: Vec<_> =
            values.iter().map(|(p, value)| (p.key.to_owned(), *value as f32)).collect();
        let is_of_tendon = effect.id.starts_with("tendon.");
        if is_of_tendon {
            parameters.extend(tendon.clone());
        }
        let without = if is_of_tendon { with_tendon } else { off };
        let on = worst_instructions(parameters);
        let more = 100.0 * (f64::from(on) / f64::from(without) - 1.0);
        println!("| {} | {on} | {more:+.1} % |", effect.id);
    }
}
