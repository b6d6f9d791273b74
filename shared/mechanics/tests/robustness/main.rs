//! Whatever it is told to do, the model stays finite, and single precision stays close to
//! its double-precision twin.

use cathforce_mechanics::*;

/// A straight tube along x of the given radius, with a 60° bend, as a device would store it.
fn bent_tube(radius_m: f64) -> (LumenHeader, Vec<u8>) {
    let (cell, unit) = (1e-3, 2.5e-7);
    let (low, size) = ([-0.012, -0.012, -0.012], [36, 24, 6]);
    // Centre line: 60 mm along x, then an arc of 40 mm radius towards +y, then straight.
    let distance = |p: [f64; 3]| -> (f64, [f64; 3]) {
        let (start, bend) = (0.06, 0.04);
        let relative = [p[0] - start, p[1] - bend];
        let angle = relative[0].atan2(-relative[1]).clamp(0.0, core::f64::consts::FRAC_PI_3);
        let on_arc = [start + bend * angle.sin(), bend - bend * angle.cos()];
        let anchor = if p[0] <= start && angle == 0.0 {
            [p[0], 0.0]
        } else if angle < core::f64::consts::FRAC_PI_3 {
            on_arc
        } else {
            let t = [angle.cos(), angle.sin()];
            let s = (p[0] - on_arc[0]) * t[0] + (p[1] - on_arc[1]) * t[1];
            [on_arc[0] + s * t[0], on_arc[1] + s * t[1]]
        };
        let off = [p[0] - anchor[0], p[1] - anchor[1], p[2]];
        let r = (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]).sqrt().max(1e-9);
        (radius_m - r, [-off[0] / r, -off[1] / r, -off[2] / r])
    };
    let (mut directory, mut bricks, mut stored) = (Vec::new(), Vec::new(), 0u16);
    for bz in 0..size[2] {
        for by in 0..size[1] {
            for bx in 0..size[0] {
                let mut nodes = Vec::new();
                let (mut nearest, mut deepest) = (f64::MAX, f64::MIN);
                for n in 0..BRICK_NODES {
                    let at =
                        [n % BRICK_EDGE, n / BRICK_EDGE % BRICK_EDGE, n / BRICK_EDGE / BRICK_EDGE];
                    let first = [bx, by, bz];
                    let p = core::array::from_fn(|i| {
                        low[i] + cell * (BRICK_CELLS * first[i] + at[i]) as f64
                    });
                    let (d, normal) = distance(p);
                    (nearest, deepest) = (nearest.min(d.abs()), deepest.max(d));
                    nodes.extend(((d / unit).clamp(-32767.0, 32767.0) as i16).to_le_bytes());
                    nodes.extend(normal.map(|c| (c * 127.0).round() as i8 as u8));
                    nodes.push(NOMINAL_WALL);
                }
                if nearest < 4e-3 {
                    directory.extend(stored.to_le_bytes());
                    bricks.extend(nodes);
                    stored += 1;
                } else {
                    directory.extend((if deepest > 0.0 { FREE } else { OUTSIDE }).to_le_bytes());
                }
            }
        }
    }
    directory.extend(bricks);
    let header = LumenHeader {
        origin_m: low.map(|x| x as f32),
        cell_m: cell as f32,
        distance_unit_m: unit as f32,
        bricks: size.map(|x| x as u16),
        stored,
    };
    (header, directory)
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
        tendon: Tendon::none(),
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
            tick_s: T::lit(1e-3),
            substeps: 1,
            solves: 1,
            predictor_gain: T::lit(0.1),
            bending_damping_s: T::zero(),
            drag_n_s_per_m2: T::lit(0.01),
        },
    }
}

/// Axial drive force over an insertion at 13 mm/s, one sample a tick.
fn insertion<T: Real>(description: Description<T>, lumen: &Lumen<'_>, to_m: f64) -> Vec<f64> {
    let model: Model<_> = Model::new(description).unwrap();
    let mut state = State::new();
    let start = 0.02;
    let mut drive = Drive { insertion_m: T::lit(start), rotation_rad: T::zero() };
    while !settle(&model, lumen, &mut state, drive) {}
    let ticks = ((to_m - start) / 13e-6) as usize;
    (1..=ticks)
        .map(|tick| {
            drive.insertion_m = T::lit(start + 13e-6 * tick as f64);
            step(&model, lumen, &mut state, drive).drive_force_n.to_f64()
        })
        .collect()
}

#[test]
fn single_precision_costs_less_than_the_sensor_sees() {
    let (header, bytes) = bent_tube(4e-3);
    let lumen = Lumen::new(header, &bytes).unwrap();
    let single = insertion(catheter::<f32>(0.3, 1e-5, 20.0), &lumen, 0.11);
    let double = insertion(catheter::<f64>(0.3, 1e-5, 20.0), &lumen, 0.11);
    let peak = double.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let squares: f64 = single.iter().zip(&double).map(|(a, b)| (a - b) * (a - b)).sum();
    let rms = (squares / double.len() as f64).sqrt();
    println!("peak {:.2} mN, f32 against f64 {:.4} mN RMS", peak * 1e3, rms * 1e3);
    assert!(peak > 3e-3, "the insertion must load the wall: {peak}");
    assert!(rms < 0.01 * peak, "rms {rms}, peak {peak}");
}

#[test]
fn friction_resists_and_reverses_with_the_feed() {
    let (header, bytes) = bent_tube(4e-3);
    let lumen = Lumen::new(header, &bytes).unwrap();
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
    let (header, bytes) = bent_tube(4e-3);
    let lumen = Lumen::new(header, &bytes).unwrap();
    let model: Model<_> = Model::new(catheter::<f32>(0.3, 1e-5, 0.0)).unwrap();
    for links in 1..60 {
        let mut state: State<f32> = State::new();
        // Whatever the rounding of encoder and link length makes of it.
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

/// A small generator, so that a failure names its seed and can be repeated.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// Uniform in the logarithm.
    fn scale(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.next())
    }
}

#[test]
fn random_instruments_and_step_feeds_stay_finite_and_bounded() {
    let (header, bytes) = bent_tube(4e-3);
    let lumen = Lumen::new(header, &bytes).unwrap();
    let trials: u64 =
        std::env::var("CATHFORCE_RANDOM_SETS").ok().and_then(|n| n.parse().ok()).unwrap_or(40);
    for seed in 0..trials {
        let mut random = Random(seed);
        let mut description = catheter::<f32>(
            random.between(0.0, 0.7),
            random.scale(1e-6, 1e-4),
            random.between(-120.0, 120.0),
        );
        description.wall.line_stiffness_n_per_m2 = random.scale(1e4, 1e7) as f32;
        description.solver.bending_damping_s = random.between(0.0, 0.01) as f32;
        let model: Model<_> = Model::new(description).unwrap();
        let mut state = State::new();
        let (mut insertion, mut rotation, mut speed, mut spin) = (0.0f32, 0.0f32, 0.0f32, 0.0f32);
        for tick in 0..4000 {
            if tick % 250 == 0 {
                speed = random.between(-100e-6, 150e-6) as f32;
                spin = random.between(-6e-3, 6e-3) as f32;
                // A step of the encoder, as a slipping drive or a lost frame gives.
                insertion += random.between(-2e-3, 2e-3) as f32;
            }
            insertion = (insertion + speed).clamp(0.0, 0.12);
            rotation += spin;
            let drive = Drive { insertion_m: insertion, rotation_rad: rotation };
            let outputs = step(&model, &lumen, &mut state, drive);
            let force = outputs.force_on_vessel_n;
            assert!(force.iter().all(|f| f.is_finite()), "seed {seed}, tick {tick}: {force:?}");
            assert!(
                outputs.unresolved || force.iter().all(|f| f.abs() < 1e3),
                "seed {seed}, tick {tick}: {force:?}"
            );
            for node in 0..state.nodes() {
                let position = state.node_position_m(node).unwrap();
                assert!(
                    position.iter().all(|x| x.abs() < 0.2),
                    "seed {seed}, tick {tick}, node {node}: {position:?}"
                );
            }
        }
    }
}
