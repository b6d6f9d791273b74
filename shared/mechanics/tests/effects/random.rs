//! With any effects switched on, the model stays finite.

use cathforce_mechanics::*;

use crate::rod::rod;
use crate::wall::{StoredWall, tube};

/// A small random generator. A failure reports its seed, so that it can be repeated.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[test]
fn random_effects_stay_finite() {
    // A straight tube along x.
    let bounds = [[-0.02, -0.012, -0.012], [0.14, 0.012, 0.012]];
    let tube = StoredWall::sampled(bounds, 2e-3, 0.01, |p| tube(p, [p[0], 0.0, 0.0], 5e-3));
    let keys: Vec<_> = parameters().collect();
    // Without and with a vessel that stands elsewhere.
    let mut placed = [0, 0];
    for seed in 0..60 {
        let mut random = Random(seed);
        let mut description = rod(0.12, 60, 2e-5);
        description.solver.tick_s = 1e-3;
        description.solver.predictor_gain = 0.1;
        description.solver.drag = Drag::constant(2.0);
        description.wall.friction_coefficient = 0.3;
        description.wall.damping_s = 5e-3;
        // A third of all parameters anywhere in their ranges.
        for info in &keys {
            if random.next() < 0.33 {
                let value = info.min + (info.max - info.min) * random.next();
                let value = if info.whole { value.round() } else { value };
                description.set_parameter(info.key, value).unwrap();
            }
        }
        assert_eq!(description.validate(), Ok(()));
        let model: Model<f64> = Model::new(description).unwrap();
        let mut state = State::new();
        let mut drive: Drive<f64> = Drive::default();
        let (mut feed, mut spin) = (0.0, 0.0);
        for tick in 0..1500 {
            if tick % 250 == 0 {
                feed = -50e-6 + 150e-6 * random.next();
                spin = -3e-3 + 6e-3 * random.next();
            }
            drive.insertion_m = (drive.insertion_m + feed).clamp(0.0, 0.1);
            drive.rotation_rad += spin;
            let found = step(&model, &tube.lumen(), &mut state, drive);
            assert!(!found.lost, "seed {seed}, tick {tick}: {found:?}");
            let tip = state.node_position_m(0).unwrap_or_default();
            assert!(tip.iter().all(|x| x.abs() < 0.5), "seed {seed}, tick {tick}: {tip:?}");
        }
        // All nodes at once are those one by one, where the vessel stands elsewhere in its frame.
        let all: Vec<_> = state.node_results().collect();
        let is_placed = all.len() > state.nodes();
        assert_eq!(all.len(), state.nodes() + usize::from(is_placed), "seed {seed}");
        placed[usize::from(is_placed)] += 1;
        let tip_m = state.node_position_m(0).unwrap_or_default();
        let apart =
            |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
        let own_tip_m = all.first().map_or([0.0; 3], |&[x, y, z, ..]| [x, y, z]);
        for (node, [x, y, z, fx, fy, fz]) in all.into_iter().take(state.nodes()).enumerate() {
            let (position_m, force_n) = (state.node_position_m(node), state.node_force_n(node));
            if !is_placed {
                assert_eq!(
                    (position_m, force_n),
                    (Some([x, y, z]), Some([fx, fy, fz])),
                    "seed {seed}"
                );
                continue;
            }
            // Turned, neither forces nor ways to the tip change their length.
            let of_rig = apart(force_n.unwrap_or_default(), [0.0; 3]);
            let force_differs = (apart([fx, fy, fz], [0.0; 3]) - of_rig).abs();
            assert!(force_differs < 1e-9 * (1.0 + of_rig), "seed {seed}, {node}");
            let way_m = apart(position_m.unwrap_or_default(), tip_m);
            assert!((apart([x, y, z], own_tip_m) - way_m).abs() < 1e-9, "seed {seed}, {node}");
        }
    }
    assert!(placed.iter().all(|&count| count > 0), "{placed:?}");
}
