//! A table on made transmissions whose truth is known: how often a diagnosis is right about them.
//!
//! `cargo run -p cathforce-gap --release --example transmissions -- 12` makes 12 transmissions, each read by fine sensors
//! and by ones of 12 bit. They are what is drawn: a gain, slack or hysteresis of one form or none, a tendon in a sheath,
//! a compliance under a load, a lag.

#[path = "../tests/transmission/made.rs"]
mod made;

use cathforce_gap::diagnose;
use cathforce_gap::report::Verdict;

use made::{Lost, Made, Sensors};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// One of all that a seed may be.
fn draw(seed: u64) -> Made {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let travel = rng.random_range(0.005..0.05);
    let gain = [1.0, 25.0, -1.0][rng.random_range(0..3)];
    let off = if rng.random_bool(0.5) { rng.random_range(0.02..0.1) } else { 0.0 };
    let lost = match seed % 6 {
        0 => Lost::DeadZone(rng.random_range(0.01..0.08), 0.0),
        1 => {
            let length = rng.random_range(0.02..0.06);
            Lost::BoucWen(length * rng.random_range(0.4..0.9), length)
        }
        2 => {
            let radius = rng.random_range(0.05..0.15);
            Lost::PrandtlIshlinskii(radius * rng.random_range(0.2..0.45), radius)
        }
        3 => Lost::Sheath(rng.random_range(0.05..0.25)),
        4 => Lost::DeadZone(rng.random_range(0.02..0.08), rng.random_range(0.2..0.5)),
        _ => Lost::Nothing,
    };
    let compliance = if rng.random_bool(0.3) { rng.random_range(0.01..0.05) } else { 0.0 };
    let lag_s = if rng.random_bool(0.25) { rng.random_range(0.02..0.1) } else { 0.0 };
    let plain = Made::plain();
    Made { travel, gain: gain * plain.gain, off, lost, compliance, lag_s }
}

/// What came of some transmissions.
#[derive(Default)]
struct Counts {
    terms: usize,
    within: usize,
    exact: usize,
    in_set: usize,
    clean: usize,
    slowest_s: f64,
}

fn main() {
    let count = std::env::args().nth(1).and_then(|own| own.parse().ok()).unwrap_or(6_u64);
    println!(
        "| sensors | transmissions | named terms within their 90 % interval | the true set is named | named or in the \
         set | nothing named that is not there | slowest |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for (name, sensors) in [("fine", Sensors::Fine), ("12 bit", Sensors::TwelveBit)] {
        let mut counts = Counts::default();
        for seed in 0..count {
            let made = draw(seed);
            let plant = made.plant(sensors, seed);
            let answer = diagnose(&plant, "made", &cathforce_gap::unwatched);
            let truth = made.truth();
            let named: Vec<&str> = answer.effects.iter().map(|own| own.id.as_str()).collect();
            let is_there = |id: &str| truth.iter().any(|(own, ..)| *own == id);
            let stands_for = |id: &str| {
                answer.confusable.iter().any(|set| {
                    set.iter().any(|own| own == id) && set.iter().any(|own| is_there(own))
                })
            };
            for (id, parameter, value) in &truth {
                let Some(effect) = answer.effects.iter().find(|own| own.id == *id) else {
                    continue;
                };
                let own = &effect.parameters[*parameter];
                counts.terms += 1;
                counts.within += usize::from((own.low..=own.high).contains(value));
            }
            let is_exact = matches!(answer.verdict, Verdict::Named | Verdict::NoGap)
                && named.len() == truth.len()
                && named.iter().all(|id| is_there(id));
            let is_in = is_exact
                || named.len() == truth.len()
                    && named.iter().all(|id| is_there(id) || stands_for(id));
            counts.exact += usize::from(is_exact);
            counts.in_set += usize::from(is_in);
            counts.clean += usize::from(named.iter().all(|id| is_there(id) || stands_for(id)));
            counts.slowest_s = counts.slowest_s.max(answer.seconds);
            eprintln!(
                "{name} {seed}: {truth:?}\n    {:.1} s {:?} {}",
                answer.seconds, answer.verdict, answer.sentence
            );
            if let Some(of) = answer.gap.force_rms_n {
                let range = made.travel * made.gain.abs();
                eprintln!(
                    "    left {:.1e} of the range, floor {:.1e}",
                    of.after / range,
                    of.floor / range
                );
            }
            if !is_in {
                for own in &answer.effects {
                    eprintln!("      {} {:?}", own.id, own.confidence);
                }
                for remark in &answer.remarks {
                    eprintln!("      - {remark}");
                }
            }
        }
        let Counts { terms, within, exact, in_set, clean, slowest_s } = counts;
        println!(
            "| {name} | {count} | {within} of {terms} | {exact} | {in_set} | {clean} | {slowest_s:.1} s |"
        );
    }
}
