//! What the device's model must reach against the reference solver.

use cathforce_accuracy::{Case, Kind, cases, compare, export, play_on_device, solve};
use cathforce_reference::Numerics;

/// A case with friction 0.3, the reference on a mesh that is coarse and still good to a tenth of the
/// targets.
fn quick(name: &str) -> Case {
    let mut case = cases().into_iter().find(|case| case.name == name).unwrap();
    let numerics = case.problem.numerics;
    case.problem.numerics = Numerics { spacing_m: 1e-3, step_s: 4e-3, ..numerics };
    case
}

#[test]
fn force_errors_meet_their_targets() {
    for (name, kind, target) in [
        ("feed", Kind::Feed, 0.02),
        // Without half ticks it chatters, and misses this.
        ("feed, near-rigid wall", Kind::Feed, 0.02),
        ("reversal", Kind::Reversal, 0.04),
        ("rotation", Kind::Rotation, 0.05),
    ] {
        let case = quick(name);
        assert_eq!(case.kind, kind);
        let (reference, _) = solve(&case).unwrap();
        let device = play_on_device(&case).unwrap();
        let score = compare(&reference, &device, case.scored_from_s);
        let error = score.outside_snaps.drive_force_share;
        println!("{name}: {:.2} % of {:.1} mN", 100.0 * error, 1e3 * score.peak_drive_force_n);
        assert!(score.peak_drive_force_n > 5e-3, "{name} must load the wall");
        assert!(score.outside_share > 0.7, "{name} must not be all snaps");
        assert!(error < target, "{name}: {error}");
    }
}

#[test]
fn an_export_is_the_same_every_time() {
    let mut case = quick("feed");
    case.schedule =
        cathforce_reference::Schedule::starting_at(0.03, 0.0).then(0.2, 0.0, 0.013, 0.0);
    let folder = std::env::temp_dir().join(format!("cathforce-accuracy-{}", std::process::id()));
    let files = || {
        let (solution, _) = solve(&case).unwrap();
        export(&folder, &case, &solution, &[]).unwrap();
        ["feed.json", "feed.csv"].map(|name| std::fs::read(folder.join(name)).unwrap())
    };
    let (first, second) = (files(), files());
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(first, second);
    let rows = String::from_utf8(first[1].clone()).unwrap();
    assert_eq!(rows.lines().count(), 51);
}
