//! A tip that catches on a ledge and is released.

use core::f64::consts::PI;

use cathforce_mechanics::*;

use crate::catheter;
use crate::sets::flagged_spikes;
use crate::wall::{Seen, StoredWall, Vector, plane, tube};

/// Position of the ledge \[m\].
const LEDGE_M: f64 = 0.06;
/// 13 mm/s, half a turn in a second.
const FEED_M: f64 = 13e-6;
const TURN_RAD: f64 = 3e-3;

/// A tube along x of 4 mm radius, behind a ledge on its lower side of 2.5 mm.
fn ledge() -> StoredWall {
    let bounds = [[-0.02, -8e-3, -8e-3], [0.12, 8e-3, 8e-3]];
    StoredWall::sampled(bounds, 5e-4, 3e-3, |p: Vector| -> Seen {
        let wide = tube(p, [p[0], 0.0, 0.0], 4e-3);
        let narrow = tube(p, [p[0], 1.5e-3, 0.0], 2.5e-3);
        let face = plane(p, [LEDGE_M, 0.0, 0.0], [-1.0, 0.0, 0.0]);
        let before = if wide.0 < face.0 { wide } else { face };
        if before.0 > narrow.0 { before } else { narrow }
    })
}

/// A catheter with a curved tip, and the record of its run.
struct Run {
    model: Model<f32>,
    state: State<f32>,
    wall: StoredWall,
    at: [f64; 2],
    /// Force \[N\] and flag of every tick.
    forces: Vec<(f32, bool)>,
    /// Initial energy plus the work of the drive \[J\].
    put_in_j: f32,
}

impl Run {
    /// At rest, with the tip down.
    fn new(friction: f64, insertion_m: f64) -> Self {
        let mut description = catheter(friction, 1e-5, 40.0);
        description.gravity_m_per_s2 = [0.0, -9.81, 0.0];
        let (model, wall, mut state) = (Model::new(description).unwrap(), ledge(), State::new());
        let drive = Drive { insertion_m: insertion_m as f32, rotation_rad: PI as f32 };
        while !settle(&model, &wall.lumen(), &mut state, drive) {}
        let put_in_j = state.elastic_energy_j(&model);
        Self { model, state, wall, at: [insertion_m, PI], forces: Vec::new(), put_in_j }
    }

    /// Moves to an insertion and rotation, and waits there for 0.5 s.
    fn to(&mut self, insertion_m: f64, rotation_rad: f64) -> Outputs<f32> {
        let [from_m, from_rad] = self.at;
        let (by_m, by_rad) = (insertion_m - from_m, rotation_rad - from_rad);
        let moving = f64::max(by_m.abs() / FEED_M, by_rad.abs() / TURN_RAD).ceil();
        let mut last = Outputs::default();
        for tick in 1..=moving as usize + 500 {
            let share = f64::min(tick as f64 / moving, 1.0);
            let drive = Drive {
                insertion_m: (from_m + by_m * share) as f32,
                rotation_rad: (from_rad + by_rad * share) as f32,
            };
            last = step(&self.model, &self.wall.lumen(), &mut self.state, drive);
            if share < 1.0 {
                self.put_in_j += (last.drive_force_n * (by_m / moving) as f32).abs()
                    + (last.drive_torque_n_m * (by_rad / moving) as f32).abs();
            }
            let energy_j =
                self.state.kinetic_energy_j(&self.model) + self.state.elastic_energy_j(&self.model);
            // The tolerance covers the use of the force at the end of a tick for the whole tick, and the
            // work of weight: 1.5 g/m on 70 mm that fall by 8 mm.
            let most_j = if last.unresolved { 4.0 } else { 1.5 } * self.put_in_j + 1e-5;
            assert!(!last.lost, "tick {tick}: {last:?}");
            assert!(energy_j <= most_j, "{energy_j} J, put in {most_j} J; tick {tick}: {last:?}");
            self.forces.push((force_n(&last), last.unresolved));
        }
        self.at = [insertion_m, rotation_rad];
        let mn = 1e3 * force_n(&last);
        println!(
            "{insertion_m} m, {rotation_rad:.2} rad: {mn:.2} mN, tip at {:.4} m",
            self.tip_m()
        );
        last
    }

    fn tip_m(&self) -> f64 {
        f64::from(self.state.node_position_m(0).unwrap()[0])
    }

    fn unresolved(&self) -> usize {
        self.forces.iter().filter(|(_, unresolved)| *unresolved).count()
    }
}

fn force_n(outputs: &Outputs<f32>) -> f32 {
    outputs.force_on_vessel_n.iter().map(|f| f * f).sum::<f32>().sqrt()
}

/// Feeds the tip against the ledge until it bends by `bent_m`, and releases it with a snap by moves to
/// other insertions past the ledge and rotations.
fn catch_and_let_go(friction: f64, bent_m: f64, moves: &[(f64, f64)], beyond: bool) {
    let (start_m, before_m) = (0.03, 0.05);
    let mut run = Run::new(friction, start_m);
    let before = run.to(before_m, PI);
    let caught = run.to(LEDGE_M + bent_m, PI);
    assert!(run.tip_m() < LEDGE_M, "the tip is not caught: {caught:?}");
    assert!(force_n(&caught) > 20.0 * force_n(&before), "it does not press: {caught:?}");
    let unresolved = run.unresolved();
    assert!(!caught.unresolved, "the flag is still that of being caught: {caught:?}");
    for (past_m, rotation_rad) in moves {
        run.to(LEDGE_M + past_m, *rotation_rad);
    }
    let free = run.to(run.at[0] - 2e-3, run.at[1]);
    assert!(force_n(&free) < 0.05 * force_n(&caught), "it is not let go: {free:?}");
    assert_eq!(run.tip_m() > LEDGE_M, beyond, "on the wrong side of the ledge: {free:?}");
    println!("unresolved: {unresolved} ticks caught, {} in all", run.unresolved());
    assert!(run.unresolved() > unresolved, "what lets go in one tick is to be flagged");
    // Back to the start on the same path.
    run.to(start_m, PI);
    let after = run.to(before_m, PI);
    assert!(!free.unresolved && !after.unresolved, "{free:?}, {after:?}");
    for i in 0..3 {
        let off = (after.force_on_vessel_n[i] - before.force_on_vessel_n[i]).abs();
        assert!(off < 0.01 * force_n(&before), "{after:?}, before it {before:?}");
    }
    assert!((after.drive_force_n - before.drive_force_n).abs() < 0.01 * force_n(&before));
    // Forces far below the holding force are ignored.
    let spikes = flagged_spikes(&run.forces, 0.1 * force_n(&caught), |_, _| false);
    println!("jumped out and flagged: {spikes:?}");
    assert!(spikes.is_ok(), "not flagged, tick, force and usual force: {spikes:?}");
    assert!(run.unresolved() * 20 < run.forces.len(), "{} ticks unresolved", run.unresolved());
}

#[test]
fn a_tip_caught_on_a_ledge_and_withdrawn_finds_its_forces_again() {
    // Bent slightly, and into a wave that the wall supports.
    for bent_m in [3e-3, 12e-3] {
        catch_and_let_go(0.3, bent_m, &[(-0.01, PI)], false);
    }
}

#[test]
fn a_tip_caught_on_a_ledge_and_turned_off_it_finds_its_forces_again() {
    catch_and_let_go(0.1, 3e-3, &[(3e-3, 2.0 * PI), (0.02, 2.0 * PI)], true);
}
