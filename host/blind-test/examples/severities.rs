//! How visible every effect is: gap over noise on all rigs, weak and strong.
//!
//!     cargo run --release -p cathforce-blind-test --example severities [-- PART-OF-A-NAME…]

use cathforce_blind_test::{LIBRARY, OUTSIDE, Stand, single};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn main() {
    let parts: Vec<String> = std::env::args().skip(1).collect();
    let wanted = |id: &str| parts.is_empty() || parts.iter().any(|part| id.contains(part));
    for stand in Stand::all_own() {
        let name = &stand.rig.name;
        let Ok(nominal) = stand.play(&[]) else { return println!("{name}: no solution") };
        let peak = nominal.iter().flatten().map(|row| row.force_n.norm()).fold(0.0, f64::max);
        println!("{name}: peak force {:.1} mN", 1e3 * peak);
        for id in LIBRARY.iter().chain(&OUTSIDE).filter(|id| wanted(id)) {
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let gaps: Vec<String> = [0.0, 1.0]
                .into_iter()
                .map(|severity| {
                    let change = single(id, severity, &mut rng).into_iter().collect::<Vec<_>>();
                    stand.play(&change).map_or("no solution".into(), |real| {
                        format!("{:.1}", stand.gap_over_noise(&real, &nominal))
                    })
                })
                .collect();
            println!("  {id:<28} {}", gaps.join("  "));
        }
    }
}
