//! Buckling: of a free column, of one pushed against a wall, of one in a tube.

use core::f64::consts::PI;

use cathforce_mechanics::*;

use crate::Chain;
use crate::rod::{FREE_TIP, free_space, inserted, rest, rod};
use crate::wall::{StoredWall, Vector, add, dot, norm, plane, tube};

/// EI of the solid catheter (radius 0.825 mm), 26 and 50 MPa.
const EI_N_M2: [f64; 2] = [9.459736155740662e-6, 1.8191800299501273e-5];

/// Complete elliptic integral of the first kind, by the arithmetic-geometric mean.
fn elliptic_k(modulus: f64) -> f64 {
    let (mut a, mut g) = (1.0, (1.0 - modulus * modulus).sqrt());
    for _ in 0..8 {
        (a, g) = (0.5 * (a + g), (a * g).sqrt());
    }
    PI / (2.0 * a)
}

#[test]
fn a_free_column_buckles_at_eulers_load() {
    // ../shared/references/buckling.json, `catheter_numbers`: E, L, euler_clamped_free_N.
    for (ei, length_m, euler_n) in [
        (EI_N_M2[0], 0.02, 0.058352),
        (EI_N_M2[0], 0.05, 0.009336),
        (EI_N_M2[0], 0.1, 0.002334),
        (EI_N_M2[1], 0.03, 0.049874),
        (EI_N_M2[1], 0.1, 0.004489),
    ] {
        for over in [1.02, 1.1, 1.4] {
            let force_n = over * euler_n;
            let model = Chain::new(rod(length_m, 64, ei)).unwrap();
            let (wall, mut state) = (free_space(), State::new());
            let lumen = wall.lumen();
            // Pushed aside, then only along its axis.
            let push = |aside_n| Loads { tip_force_n: [-force_n, 0.0, aside_n], ..FREE_TIP };
            for _ in 0..200 {
                let loads = push(0.3 * force_n);
                step_loaded(&model, &lumen, &mut state, inserted(length_m), &loads);
            }
            rest(&model, &lumen, &mut state, inserted(length_m), &push(0.0));
            // Tip deflection 2 sin(α/2) √(EI/P); L √(P/EI) = K(sin(α/2)): what load would have
            // bent the column so far, and with it Euler's.
            let aside_m = state.node_position_m(0).unwrap()[2].abs();
            let modulus = 0.5 * aside_m * (force_n / ei).sqrt();
            let found = force_n / (2.0 * elliptic_k(modulus) / PI).powi(2);
            println!("L {length_m} m, {over} of Euler's load: {found:.6} N ({euler_n:.6} N)");
            assert!((found / euler_n - 1.0).abs() < 0.01, "{found} N, not {euler_n} N");
        }
    }
}

#[test]
fn a_column_pushed_against_a_wall_buckles_at_the_load_of_clamped_and_pinned() {
    // ../shared/references/buckling.json, `catheter_numbers`: euler_clamped_pinned_N.
    const EA_N: f64 = 1e3;
    for (ei, free_m, euler_n) in [
        (EI_N_M2[0], 0.02, 0.477497),
        (EI_N_M2[0], 0.05, 0.076399),
        (EI_N_M2[1], 0.03, 0.408117),
        (EI_N_M2[1], 0.1, 0.036731),
    ] {
        let normal = [-1.0, 0.0, 0.0];
        let at = [free_m, 0.0, 0.0];
        let bounds = [[0.5 * free_m, -0.01, -0.01], [free_m + 0.01, 0.01, 0.01]];
        let wall = StoredWall::sampled(bounds, 1e-3, 3e-3, |p| plane(p, at, normal));
        let mut rod = rod(1.03 * free_m, 62, ei);
        // So thin that the tip turns about the point that it touches.
        rod.instrument.outer_radius_m = 1e-5;
        // Compression of the column would lower the load by its strain.
        rod.instrument.sections[0].axial_stiffness_n = EA_N;
        rod.wall = Wall {
            line_stiffness_n_per_m2: 1.0,
            end_stiffness_n_per_m: 1e5,
            tangential_ratio: 10.0,
            friction_coefficient: 2.0,
            onset_m: 1e-7,
            damping_s: 0.0,
        };
        // A breath of imperfection.
        rod.gravity_m_per_s2 = [0.0, 0.0, 1e-4];
        let (model, lumen, mut state) = (Chain::new(rod).unwrap(), wall.lumen(), State::new());
        let mut insertion_m = 0.999 * free_m;
        while !settle(&model, &lumen, &mut state, inserted(insertion_m)) {}
        // Fed until the column is 0.1 % too long for its gap, compression included.
        let last_m = free_m * (1.001 + euler_n / EA_N);
        let feed_m = (last_m - insertion_m) / 4000.0;
        for _ in 0..4000 {
            insertion_m += feed_m;
            step(&model, &lumen, &mut state, inserted(insertion_m));
        }
        let outputs = rest(&model, &lumen, &mut state, inserted(last_m), &FREE_TIP);
        let found = outputs.force_on_vessel_n[0];
        println!("L {free_m} m: {found:.6} N ({euler_n:.6} N)");
        assert!((found / euler_n - 1.0).abs() < 0.01, "{found} N, not {euler_n} N");
    }
}

#[test]
fn a_column_in_a_tube_buckles_into_a_helix() {
    // ../shared/references/buckling.json, `tube`: contact force r F²/4EI per length and pitch
    // π √(8EI/F) of a helix whose angle β is small; of one that is not, with F = 2EI sin²β
    // cos β/r² of the same energy, r F²/(4EI cos²β), and per length it turns by sin β/r.
    let (ei, clearance_m, length_m, links) = (EI_N_M2[0], 0.002175, 0.25, 64);
    let force_n = 0.1;
    let radius_m = 0.825e-3;
    let bounds = [[-0.02, -6e-3, -6e-3], [length_m + 0.02, 6e-3, 6e-3]];
    let tube_m = clearance_m + radius_m;
    let wall = StoredWall::sampled(bounds, 1e-3, 3e-3, |p| tube(p, [p[0], 0.0, 0.0], tube_m));
    let mut rod = rod(length_m, links, ei);
    rod.instrument.outer_radius_m = radius_m;
    rod.instrument.sections[0].axial_stiffness_n = 1e3;
    rod.wall.line_stiffness_n_per_m2 = 1e6;
    rod.wall.end_stiffness_n_per_m = 0.0;
    // In longer ticks the free tip never comes to rest.
    (rod.solver.tick_s, rod.solver.drag) = (1e-3, Drag::constant(0.5));
    // The helix that it will be, 200 times weaker, as an imperfection.
    let pitch_m = PI * (8.0 * ei / force_n).sqrt();
    let hint = PrecurvePiece {
        length_m,
        curvature_per_m: 0.05,
        lateral_curvature_per_m: 0.0,
        torsion_per_m: 2.0 * PI / pitch_m,
    };
    rod.instrument.precurve.push(hint).unwrap();
    let (model, lumen, mut state) = (Chain::new(rod).unwrap(), wall.lumen(), State::new());
    while !settle(&model, &lumen, &mut state, inserted(length_m)) {}
    for tick in 0..10_000 {
        let share = f64::min(f64::from(tick) / 5_000.0, 1.0);
        let loads = Loads { tip_force_n: [-force_n * share, 0.0, 0.0], ..FREE_TIP };
        step_loaded(&model, &lumen, &mut state, inserted(length_m), &loads);
    }

    let mut cos = 1.0;
    for _ in 0..20 {
        cos = (1.0 - force_n * clearance_m * clearance_m / (2.0 * ei * cos)).sqrt();
    }
    let turn_per_m = (1.0 - cos * cos).sqrt() / clearance_m;
    let line_n_per_m = clearance_m * force_n * force_n / (4.0 * ei * cos * cos);
    // The middle, away from what the ends take.
    let middle = 18..46;
    let link_m = length_m / links as f64;
    let (mut turned, mut pressing_n) = (0.0, 0.0);
    for node in middle.clone() {
        let angle = |node| {
            let [_, y, z] = state.node_position_m(node).unwrap();
            z.atan2(y)
        };
        let turn = angle(node + 1) - angle(node);
        turned += turn - (turn / (2.0 * PI)).round() * 2.0 * PI;
        pressing_n += norm(state.node_force_n(node).unwrap());
    }
    let arc_m = link_m * middle.len() as f64;
    // Either hand will do.
    let (turned, pressing) = (turned.abs() / arc_m, pressing_n / arc_m);
    println!("{turned:.3} rad/m ({turn_per_m:.3}), {pressing:.4} N/m ({line_n_per_m:.4})");
    println!("small angle: {:.3} rad/m, {:.4} N/m", 2.0 * PI / pitch_m, line_n_per_m * cos * cos);
    assert!((turned / turn_per_m - 1.0).abs() < 0.01, "{turned} rad/m, not {turn_per_m}");
    assert!((pressing / line_n_per_m - 1.0).abs() < 0.01, "{pressing} N/m, not {line_n_per_m}");
}

/// Links of a rod that is many waves long.
const LONG: usize = 256;

#[test]
fn a_rod_on_the_floor_of_a_tube_buckles_into_waves() {
    // ../shared/references/buckling.json, `tube_numbers`: clearance and F_sinusoidal, 2 √(EI w/r)
    // with waves of (w/EI r)^¼ rad/m. That is for a rod without ends: held ends add 2π²/(kL)²,
    // 0.5 % at kL = 60.
    let (ei, weight_n_per_m, radius_m) = (EI_N_M2[0], 0.02289, 0.825e-3);
    for (clearance_m, critical_n) in [(0.004175, 0.014403), (0.002175, 0.019956)] {
        let wave_per_m = (weight_n_per_m / (ei * clearance_m)).powf(0.25);
        let length_m = 60.0 / wave_per_m;
        // Along no axis of the grid, so that what the stored normals are rounded by averages out.
        let along = unit([1.0, 0.04, 0.025]);
        let side = unit([-along[1], along[0], 0.0]);
        let down = cross(side, along);
        let bounds = [[-0.02; 3], add([0.02; 3], along, length_m)];
        let tube_m = clearance_m + radius_m;
        let nearest = |p| add([0.0; 3], along, dot(p, along));
        let wall = StoredWall::sampled(bounds, 1e-3, 3e-3, |p| tube(p, nearest(p), tube_m));

        let mut rod = rod(length_m, LONG, ei);
        rod.instrument.outer_radius_m = radius_m;
        let section = rod.instrument.sections[0];
        let (gravity, mass_kg_per_m) = (10.0, 0.1 * weight_n_per_m);
        // Its ends are held, by the guide and by a heavy tip.
        rod.instrument.sections = [
            Section { length_m: 1.0 / wave_per_m, mass_kg_per_m: 20.0 * mass_kg_per_m, ..section },
            Section { mass_kg_per_m, ..section },
        ]
        .into_iter()
        .collect();
        rod.gravity_m_per_s2 = down.map(|x| gravity * x);
        // A breath of the waves to come.
        let half_wave = |lateral_curvature_per_m| PrecurvePiece {
            length_m: PI / wave_per_m,
            curvature_per_m: 0.0,
            lateral_curvature_per_m,
            torsion_per_m: 0.0,
        };
        rod.instrument.precurve =
            (0..16).map(|i| half_wave(if i % 2 == 0 { 0.01 } else { -0.01 })).collect();
        rod.entry = Entry {
            position_m: down.map(|x| clearance_m * x),
            direction: along,
            up: down.map(|x| -x),
        };
        rod.wall.end_stiffness_n_per_m = 0.0;
        // In longer ticks with less drag the contacts never come to rest.
        (rod.solver.tick_s, rod.solver.drag) = (3e-3, Drag::constant(0.2));
        let model = Model::<f64, LONG>::new(rod).unwrap();
        let (lumen, mut state) = (wall.lumen(), State::<f64, LONG>::new());
        let mut amplitude_at = |share: f64| {
            let tip_force_n = along.map(|x| -share * critical_n * x);
            let loads = Loads { tip_force_n, ..FREE_TIP };
            for _ in 0..2000 {
                step_loaded(&model, &lumen, &mut state, inserted(length_m), &loads);
            }
            let aside = (0..LONG).map(|j| dot(state.node_position_m(j).unwrap(), side));
            let (low, high) =
                aside.fold((0.0, 0.0), |(low, high), x: f64| (x.min(low), x.max(high)));
            high - low
        };
        // Southwell's line: amplitudes grow as 1/(critical − force).
        let shares = [0.93, 0.96];
        let [low, high] = shares.map(&mut amplitude_at);
        let found = critical_n * (shares[1] * high - shares[0] * low) / (high - low);
        println!("clearance {clearance_m} m: {found:.6} N ({critical_n:.6} N)");
        assert!((found / critical_n - 1.0).abs() < 0.01, "{found} N, not {critical_n} N");
    }
}

fn unit(v: Vector) -> Vector {
    v.map(|x| x / norm(v))
}

fn cross(a: Vector, b: Vector) -> Vector {
    core::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}
