//! Twins of the practice bundles: realities of this crate on their rigs, with their motions, rates
//! and noise. Another simulator made the bundles, so that a twin without any effect shows what two
//! realities of one rig differ by, and twins with effects are what a stranger's data are like.
//!
//!     cargo run --release -p cathforce-blind-test --example twins -- BUNDLE OUT [EFFECT[+EFFECT][:SEVERITY]]…
//!
//! Each argument makes one case, `none` one without effects; `all` stands for every effect of the
//! library. A severity is from 0 to 1, 0.5 unless given.

use std::error::Error;
use std::path::Path;

use cathforce_blind_test::{Change, LIBRARY, Stand, Trial, single};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SEED: u64 = 1;

/// Root mean squares of what changed: force, drive force \[N\], tip \[m\].
fn changed(real: &[Trial], nominal: &[Trial]) -> [f64; 3] {
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    for (a, b) in real.iter().zip(nominal).flat_map(|(a, b)| a.iter().zip(b)) {
        sums[0] += (a.force_n - b.force_n).norm_squared();
        sums[1] += (a.drive_force_n - b.drive_force_n).powi(2);
        sums[2] += (a.tip_m - b.tip_m).norm_squared();
        count += 1.0;
    }
    sums.map(|sum| (sum / f64::max(count, 1.0)).sqrt())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [bundle, out, cases @ ..] = &arguments[..] else {
        return Err("give a bundle, a folder to write to, and cases".into());
    };
    let (bundle, out) = (Path::new(bundle), Path::new(out));
    let mut stand = Stand::of_bundle(bundle)?;
    // A twin has the bundle's own trials alone.
    stand.motions.pop();
    let nominal = stand.play(&[])?;
    let all = LIBRARY.map(str::to_owned);
    let cases = cases.iter().flat_map(|case| match case.as_str() {
        "all" => all.to_vec(),
        _ => vec![case.clone()],
    });
    for (number, case) in cases.enumerate() {
        let (ids, severity) = case.split_once(':').unwrap_or((&case, "0.5"));
        let severity: f64 = severity.parse()?;
        let mut rng = ChaCha8Rng::seed_from_u64(SEED + number as u64);
        let effects = ids.split('+').filter(|id| *id != "none");
        let changes = effects.map(|id| single(id, severity, &mut rng).ok_or(id.to_owned()));
        let changes: Vec<Change> =
            changes.collect::<Result<_, _>>().map_err(|id| format!("there is no effect {id}"))?;
        let Ok(real) = stand.play(&changes) else {
            println!("{ids}: the solver finds no balance; left out");
            continue;
        };
        let folder = out.join(ids.replace('+', "-and-"));
        stand.write(&folder, ids, &real, rng.random())?;
        let [force_n, drive_n, tip_m] = changed(&real, &nominal);
        println!(
            "{}: changes force {:.1} mN, drive force {:.1} mN, tip {:.2} mm; {changes:?}",
            folder.display(),
            1e3 * force_n,
            1e3 * drive_n,
            1e3 * tip_m
        );
    }
    Ok(())
}
