//! How visible every effect is: gap over noise on all rigs, weak and strong.
//!
//!     cargo run --release -p cathforce-challenge --example severities [-- PART-OF-A-NAME…]

use cathforce_challenge::{
    Change, LIBRARY, OUTSIDE, Rig, TRIALS, gap_over_noise, play, rigs, single,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn main() {
    let parts: Vec<String> = std::env::args().skip(1).collect();
    let wanted = |id: &str| parts.is_empty() || parts.iter().any(|part| id.contains(part));
    let all = |rig: &Rig, changes: &[Change]| -> Option<Vec<_>> {
        (0..TRIALS).map(|trial| play(rig, changes, trial).ok()).collect()
    };
    for rig in rigs() {
        let Some(nominal) = all(&rig, &[]) else { return println!("{}: no solution", rig.name) };
        let peak = nominal.iter().flatten().map(|row| row.force_n.norm()).fold(0.0, f64::max);
        println!("{}: peak force {:.1} mN", rig.name, 1e3 * peak);
        for id in LIBRARY.iter().chain(&OUTSIDE).filter(|id| wanted(id)) {
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let gaps: Vec<String> = [0.0, 1.0]
                .into_iter()
                .map(|severity| {
                    let change = single(id, severity, &mut rng).into_iter().collect::<Vec<_>>();
                    all(&rig, &change).map_or("no solution".into(), |real| {
                        format!("{:.1}", gap_over_noise(&real, &nominal))
                    })
                })
                .collect();
            println!("  {id:<28} {}", gaps.join("  "));
        }
    }
}
