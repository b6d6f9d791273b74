//! Buckling in a tube: into a helix without weight, into waves on its floor, into a helix
//! against its weight.

use core::f64::consts::PI;

use cathforce_mechanics::*;

use crate::Chain;
use crate::rod::{FREE_TIP, inserted, rod};
use crate::wall::{StoredWall, Vector, add, dot, norm, tube};

/// EI of the solid catheter, 26 MPa.
const EI_N_M2: f64 = 9.459736155740662e-6;
const RADIUS_M: f64 = 0.825e-3;
const WEIGHT_N_PER_M: f64 = 0.02289;

#[test]
fn a_column_in_a_tube_buckles_into_a_helix() {
    // ../shared/references/buckling.json, `tube`: contact force r F²/4EI per length and pitch
    // π √(8EI/F) of a helix whose angle β is small; of one that is not, with F = 2EI sin²β
    // cos β/r² of the same energy, r F²/(4EI cos²β), and per length it turns by sin β/r.
    let (ei, clearance_m, length_m, links) = (EI_N_M2, 0.002175, 0.25, 64);
    let force_n = 0.1;
    let radius_m = RADIUS_M;
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
    let (ei, weight_n_per_m, radius_m) = (EI_N_M2, WEIGHT_N_PER_M, RADIUS_M);
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
        let model = Model::<f64, MOST_LINKS>::new(rod).unwrap();
        let (lumen, mut state) = (wall.lumen(), State::<f64, MOST_LINKS>::new());
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

/// What bends per arc of the middle of a helix that `force_n` makes without weight \[J/m\], and by
/// how much it is shorter than its arc \[1\].
fn helix(clearance_m: f64, force_n: f64) -> [f64; 2] {
    let ei = EI_N_M2;
    let turn_per_m = (force_n / (2.0 * ei)).sqrt();
    let length_m = 5.0 * 2.0 * PI / turn_per_m;
    let bounds = [[-0.02, -8e-3, -8e-3], [length_m + 0.02, 8e-3, 8e-3]];
    let tube_m = clearance_m + RADIUS_M;
    let wall = StoredWall::sampled(bounds, 1e-3, 3e-3, |p| tube(p, [p[0], 0.0, 0.0], tube_m));
    let lumen = wall.lumen();
    let mut rod = rod(length_m, LONG, ei);
    rod.instrument.outer_radius_m = RADIUS_M;
    rod.wall.line_stiffness_n_per_m2 = 1e5;
    rod.wall.end_stiffness_n_per_m = 0.0;
    (rod.solver.tick_s, rod.solver.drag) = (1e-3, Drag::constant(0.5));
    let free = Model::<f64, MOST_LINKS>::new(rod.clone()).unwrap();
    // The helix that it will be, 100 times weaker, as an imperfection; at last without it.
    let hint = PrecurvePiece {
        length_m,
        curvature_per_m: 0.01 * clearance_m * turn_per_m * turn_per_m,
        lateral_curvature_per_m: 0.0,
        torsion_per_m: turn_per_m,
    };
    rod.instrument.precurve.push(hint).unwrap();
    let hinted = Model::<f64, MOST_LINKS>::new(rod).unwrap();
    let mut state = State::<f64, MOST_LINKS>::new();
    while !settle(&hinted, &lumen, &mut state, inserted(length_m)) {}
    for tick in 0..8_000 {
        let model = if tick < 4_000 { &hinted } else { &free };
        let share = f64::min(f64::from(tick) / 2_000.0, 1.0);
        let loads = Loads { tip_force_n: [-force_n * share, 0.0, 0.0], ..FREE_TIP };
        step_loaded(model, &lumen, &mut state, inserted(length_m), &loads);
    }
    let at = |node| state.node_position_m(node).unwrap();
    // Two turns in the middle, away from what the ends take.
    let (first, last) = (LONG * 3 / 10, LONG * 7 / 10);
    let along = |node| unit(add(at(node), at(node + 1), -1.0));
    let link_m = length_m / LONG as f64;
    let bends = (first..last).map(|node| norm(add(along(node), along(node + 1), -1.0)));
    let energy_j: f64 = bends.map(|bend| 0.5 * ei / link_m * bend * bend).sum();
    let arc_m = link_m * (last - first) as f64;
    [energy_j / arc_m, 1.0 - (at(first)[0] - at(last)[0]) / arc_m]
}

#[test]
fn a_helix_lifts_its_weight_from_chens_force_on() {
    // ../shared/references/buckling.json, `tube_numbers`: clearance and F_helical, 2 √2 √(EI w/r).
    // Chen's is the force from which on its work on the shortening of a helix is more than what
    // bends it and lifts it off the floor by r. A helix that sags would cost 2.5 % less: the
    // model's is bent without weight, as Chen's.
    for (clearance_m, exact_n) in [(0.004175, 0.020369), (0.002175, 0.028221)] {
        let [bending, shortening] = helix(clearance_m, exact_n);
        let left = exact_n * shortening - bending;
        // Both grow with the square of the force.
        let found = exact_n * (WEIGHT_N_PER_M * clearance_m / left).sqrt();
        println!(
            "clearance {clearance_m} m: bending {bending:.3e} J/m, shorter by {shortening:.5}; \
             {found:.6} N ({exact_n:.6} N)"
        );
        assert!((found / exact_n - 1.0).abs() < 0.01, "{found} N, not {exact_n} N");
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
