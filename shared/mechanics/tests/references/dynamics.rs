//! Free vibration of a cantilever: natural frequencies and decay. Drag against a whirling motion.
//!
//! Implicit Euler integrates a mode x″ + (c/ρA + ω²τ) x′ + ω² x = 0 to x ∝ zᵏ, where u = (1 − 1/z)/dt is a root
//! of u² + (c/ρA + ω²τ) u + ω² = 0. A measured z therefore gives the frequency ω of the rod and its damping
//! without the contribution of the time step.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, assert_second_order, free_space, inserted, rest, rod};

/// βL of the clamped-free modes: cos βL cosh βL = −1.
const MODES: [f64; 4] =
    [1.875_104_068_711_961, 4.694_091_132_974_174, 7.854_757_438_237_613, 10.995_540_734_875_467];

/// Solid section of radius 0.825 mm, 1091.237 kg/m³.
///
/// A tick is about a twelfth of the period, in four parts.
fn catheter(
    youngs_modulus_pa: f64,
    length_m: f64,
    links: usize,
    period_s: f64,
) -> Description<f64> {
    let area = core::f64::consts::PI * 0.825e-3 * 0.825e-3;
    let mut description =
        rod(length_m, links, youngs_modulus_pa * area * 0.825e-3 * 0.825e-3 / 4.0);
    description.instrument.sections[0].mass_kg_per_m = 1091.237 * area;
    description.solver.tick_s = (0.08 * period_s).clamp(1e-4, 1e-2);
    description.solver.substeps = 4;
    description
}

/// Shape of a mode at s/L, and its curvature over β².
fn mode(beta_l: f64, s: f64) -> (f64, f64) {
    let ratio = (beta_l.cosh() + beta_l.cos()) / (beta_l.sinh() + beta_l.sin());
    let x = beta_l * s;
    let (even, odd) = (x.cosh() - ratio * x.sinh(), x.cos() - ratio * x.sin());
    (even - odd, even + odd)
}

/// A complex root u of the step's characteristic equation.
struct Root {
    re: f64,
    im: f64,
}

impl Root {
    fn natural_frequency_hz(&self) -> f64 {
        self.re.hypot(self.im) / core::f64::consts::TAU
    }

    /// c/ρA + ω²τ \[1/s\].
    fn damping_per_s(&self) -> f64 {
        -2.0 * self.re
    }
}

/// Releases the rod from a slight bend in the shape of one mode. Returns the root of the mode, and its
/// apparent frequency \[Hz\], which includes the effect of the time step.
fn vibration(description: Description<f64>, beta_l: f64) -> (Root, f64) {
    let length = description.instrument.sections[0].length_m;
    let links = (length / description.solver.link_length_m).round() as usize;
    let wall = free_space();
    let lumen = wall.lumen();
    let released = Model::new(description.clone()).unwrap();
    let mut held = description.clone();
    (held.solver.tick_s, held.solver.substeps) = (1e-2, 1);
    for piece in 0..MAX_PRECURVE {
        let piece_m = length / MAX_PRECURVE as f64;
        let s = 1.0 - (piece as f64 + 0.5) / MAX_PRECURVE as f64;
        let curvature_per_m = 1e-3 / length * mode(beta_l, s).1;
        let piece = PrecurvePiece {
            length_m: piece_m,
            curvature_per_m,
            lateral_curvature_per_m: 0.0,
            torsion_per_m: 0.0,
        };
        held.instrument.precurve.push(piece).unwrap();
    }
    let held = Model::new(held).unwrap();
    let mut state = State::new();
    rest(&held, &lumen, &mut state, inserted(length), &FREE_TIP);

    let weight = |j: usize| {
        let share = if j == 0 { 0.5 } else { 1.0 };
        share * mode(beta_l, 1.0 - j as f64 / links as f64).0
    };
    let weights: Vec<f64> = (0..links).map(weight).collect();
    let samples: Vec<f64> = (0..40)
        .map(|_| {
            step(&released, &lumen, &mut state, inserted(length));
            let node = |j: usize| state.node_position_m(j).unwrap()[2];
            weights.iter().enumerate().map(|(j, w)| w * node(j)).sum()
        })
        .collect();
    // Least squares of x₊ = 2 Re(Z) x − |Z|² x₋, Z = z over one tick.
    let (mut m, mut r) = ([[0.0; 2]; 2], [0.0; 2]);
    for x in samples.windows(3) {
        let row = [x[1], -x[0]];
        for i in 0..2 {
            for j in 0..2 {
                m[i][j] += row[i] * row[j];
            }
            r[i] += row[i] * x[2];
        }
    }
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    let twice_re = (r[0] * m[1][1] - m[0][1] * r[1]) / determinant;
    let squared = (m[0][0] * r[1] - r[0] * m[1][0]) / determinant;
    let tick = description.solver.tick_s;
    let decay = -0.5 * squared.ln() / tick;
    let omega = (0.5 * twice_re / squared.sqrt()).acos() / tick;
    // 1/z = exp((decay − i omega) dt)
    let dt = tick / f64::from(description.solver.substeps);
    let (sin, cos) = (omega * dt).sin_cos();
    let inverse = (decay * dt).exp();
    let u = Root { re: (1.0 - inverse * cos) / dt, im: inverse * sin / dt };
    (u, omega / core::f64::consts::TAU)
}

/// ../shared/references/cantilever_dynamics.json: E \[Pa\], L \[m\], f = (βL)²/2π √(EI/ρAL⁴) \[Hz\].
const ROWS: [(f64, f64, [f64; 4]); 6] = [
    (26e6, 0.03, [39.589452, 248.102863, 694.695199, 1361.325328]),
    (26e6, 0.05, [14.252203, 89.317031, 250.090272, 490.077118]),
    (26e6, 0.15, [1.583578, 9.924115, 27.787808, 54.453013]),
    (50e6, 0.03, [54.900692, 344.056766, 963.368908, 1887.818567]),
    (50e6, 0.05, [19.764249, 123.860436, 346.812807, 679.614684]),
    (50e6, 0.15, [2.196028, 13.762271, 38.534756, 75.512743]),
];

#[test]
fn natural_frequencies_are_those_of_the_continuous_cantilever() {
    for (youngs_modulus_pa, length_m, frequencies_hz) in ROWS {
        for (beta_l, expected) in MODES.into_iter().zip(frequencies_hz) {
            let rod = catheter(youngs_modulus_pa, length_m, 64, 1.0 / expected);
            let (u, seen) = vibration(rod, beta_l);
            let found = u.natural_frequency_hz();
            println!("{expected:.3} Hz: {found:.3} Hz, seen as {seen:.3} Hz");
            assert!((found / expected - 1.0).abs() < 0.01, "{found} Hz, not {expected} Hz");
        }
    }
}

#[test]
fn natural_frequencies_converge_with_second_order() {
    let (youngs_modulus_pa, length_m, frequencies_hz) = ROWS[2];
    for (beta_l, expected) in MODES.into_iter().zip(frequencies_hz) {
        let errors = [8, 16, 32].map(|links| {
            let rod = catheter(youngs_modulus_pa, length_m, links, 1.0 / expected);
            (vibration(rod, beta_l).0.natural_frequency_hz() / expected - 1.0).abs()
        });
        assert_second_order(errors, &format!("{expected} Hz"));
    }
}

#[test]
fn the_first_frequency_is_right_at_the_devices_tick() {
    // Implicit Euler lowers it by (ω dt)²/3: 0.3 % at 14 Hz and 1 ms.
    for (youngs_modulus_pa, length_m, frequencies_hz) in [ROWS[1], ROWS[2], ROWS[4], ROWS[5]] {
        let mut rod = catheter(youngs_modulus_pa, length_m, 64, 0.0);
        (rod.solver.tick_s, rod.solver.substeps) = (1e-3, 1);
        let (_, seen) = vibration(rod, MODES[0]);
        println!("{} Hz: seen as {seen:.3} Hz", frequencies_hz[0]);
        assert!((seen / frequencies_hz[0] - 1.0).abs() < 0.01, "{seen} Hz");
    }
}

#[test]
fn vibration_decays_as_drag_and_viscous_bending_say() {
    let (youngs_modulus_pa, length_m, frequencies_hz) = ROWS[1];
    for (beta_l, expected) in MODES.into_iter().zip(frequencies_hz).take(3) {
        let omega = core::f64::consts::TAU * expected;
        // A damping ratio of 3 % from either.
        let per_s = 0.06 * omega;
        let rod = catheter(youngs_modulus_pa, length_m, 64, 1.0 / expected);
        let mut dragged = rod.clone();
        dragged.solver.drag = Drag::constant(per_s * rod.instrument.sections[0].mass_kg_per_m);
        let mut viscous = rod.clone();
        viscous.solver.bending_damping_s = per_s / (omega * omega);
        let [none, drag, bending] =
            [rod, dragged, viscous].map(|rod| vibration(rod, beta_l).0.damping_per_s() / per_s);
        println!("{expected} Hz: {none:.4} none, {drag:.4} drag, {bending:.4} viscous bending");
        assert!(none.abs() < 0.01, "undamped: {none}");
        assert!((drag - 1.0).abs() < 0.01, "drag: {drag}");
        assert!((bending - 1.0).abs() < 0.01, "viscous bending: {bending}");
    }
}

#[test]
fn drag_grows_with_the_square_of_a_nodes_speed_until_it_is_swift() {
    let (length_m, links, per_s) = (0.05, 32, 4.0);
    let mut bent = rod(length_m, links, 1e-1);
    let piece = PrecurvePiece {
        length_m,
        curvature_per_m: 20.0,
        lateral_curvature_per_m: 0.0,
        torsion_per_m: 0.0,
    };
    bent.instrument.precurve.push(piece).unwrap();
    bent.solver.tick_s = 1e-3;
    bent.solver.drag = Drag { at_rest_n_s_per_m2: 0.2, swift_n_s_per_m2: 2.0, swift_m_per_s: 0.05 };
    let model = Model::new(bent.clone()).unwrap();
    let (wall, mut state) = (free_space(), State::new());
    rest(&model, &wall.lumen(), &mut state, inserted(length_m), &FREE_TIP);
    let mut found = 0.0;
    for tick in 1..=200 {
        let drive = Drive { insertion_m: length_m, rotation_rad: per_s * 1e-3 * f64::from(tick) };
        found = step(&model, &wall.lumen(), &mut state, drive).drive_torque_n_m;
    }
    let (mut expected, mut fastest) = (0.0, 0.0_f64);
    for node in 0..links {
        let [_, y, z] = state.node_position_m(node).unwrap();
        let (radius_m, share) = (y.hypot(z), if node == 0 { 0.5 } else { 1.0 });
        let speed = per_s * radius_m;
        let drag = 0.2 + 1.8 * (speed / 0.05).powi(2).min(1.0);
        expected += share * bent.solver.link_length_m * drag * speed * radius_m;
        fastest = fastest.max(speed);
    }
    println!("{found} N·m, {expected} expected, up to {fastest} m/s");
    assert!(fastest > 0.06, "no node is swift: {fastest} m/s");
    assert!((found / expected - 1.0).abs() < 0.01, "{found} N·m, not {expected} N·m");
}

#[test]
fn more_drag_at_rest_than_of_a_swift_node_is_refused() {
    let mut slower = rod(0.05, 32, 1e-4);
    slower.solver.drag = Drag { at_rest_n_s_per_m2: 2.0, ..Drag::constant(0.2) };
    let refused = Model::<f64>::new(slower).err();
    assert_eq!(refused, Some(DescriptionError::Range("solver.drag.at_rest_n_s_per_m2")));
}
