//! The 45° bend: an arc in a plane, loaded out of it, so that it bends and twists.

use cathforce_mechanics::*;

use crate::rod::{FREE_TIP, hang, rod};

/// Radius of the arc; the reference has 100 units of length for it.
const RADIUS_M: f64 = 0.1;
const UNIT_M: f64 = RADIUS_M / 100.0;

/// EI, GJ, EA in the reference's units.
type Stiffness = [f64; 3];

/// Tip, and torque at the root about the tangent there, in the reference's units.
fn bent([ei, gj, ea]: Stiffness, force: f64, links: usize) -> ([f64; 3], f64) {
    // EI/L² and EA are forces: all scaled alike, to an EI of 1e-3 N·m².
    let to_n = 1e-3 / ei / (UNIT_M * UNIT_M);
    let length_m = RADIUS_M * core::f64::consts::FRAC_PI_4;
    let mut rod = rod(length_m, links, 1e-3);
    rod.instrument.sections[0].torsional_stiffness_n_m2 = 1e-3 * gj / ei;
    rod.instrument.sections[0].axial_stiffness_n = ea * to_n;
    rod.entry.up = [0.0, 1.0, 0.0];
    // What is still in the guide is bent as well.
    let arc = PrecurvePiece {
        length_m: 2.0 * length_m,
        curvature_per_m: 1.0 / RADIUS_M,
        lateral_curvature_per_m: 0.0,
        torsion_per_m: 0.0,
    };
    rod.instrument.precurve.push(arc).unwrap();
    let loads = Loads { tip_force_n: [0.0, 0.0, force * to_n], ..FREE_TIP };
    let (tip_m, outputs) = hang(rod, &loads);
    (tip_m.map(|x| x / UNIT_M), outputs.drive_torque_n_m / (to_n * UNIT_M))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn an_arc_loaded_out_of_its_plane_bends_and_twists_as_published() {
    // ../shared/references/bend45_bathe_bolourchi.json: geometrically exact rod by shooting;
    // its shear (GA ≥ 4e6) moves the tip by 0.02 of 53.
    let square = [833333.3333333334, 703000.0, 1e7];
    let equal = [833333.3333333334, 833333.3333333334, 1e7];
    for (stiffness, force, exact, root_torque) in [
        (square, 300.0, [58.535959, 22.112657, 40.48046], 6633.7971),
        (square, 450.0, [51.969699, 18.369314, 48.705141], 8266.1913),
        (square, 600.0, [46.89185, 15.557815, 53.60785], 9334.6888),
        (equal, 300.0, [58.779122, 22.244781, 40.191892], 6673.4343),
        (equal, 450.0, [52.238558, 18.508179, 48.502927], 8328.6805),
        (equal, 600.0, [47.150439, 15.684801, 53.474859], 9410.8803),
    ] {
        let [(coarse, _), (middle, _), (fine, torque)] =
            [8, 16, 32].map(|links| bent(stiffness, force, links));
        let moved = distance(exact, [70.710678, 29.289322, 0.0]);
        let off = distance(fine, exact) / moved;
        // The reference has shear, which the model has not: the order is that of the
        // differences between numbers of links.
        let order = (distance(coarse, middle) / distance(middle, fine)).log2();
        let what = format!("GJ {}, F {force}", stiffness[1]);
        println!("{what}: tip {fine:.4?}, off by {off:.5}, order {order:.2}, torque {torque:.1}");
        assert!(off < 0.01, "{what}: {fine:?}, not {exact:?}");
        assert!(order >= 1.9, "{what}: order {order}");
        assert!((torque.abs() / root_torque - 1.0).abs() < 0.01, "{what}: root torque {torque}");
    }
}

#[test]
fn the_published_tips_of_the_arc_are_met_within_1_percent() {
    // Simo & Vu-Quoc 1986, in their order: short leg, long leg, out of plane.
    let square = [833333.3333333334, 703000.0, 1e7];
    for (force, [y, x, z]) in [
        (300.0, [22.33, 58.84, 40.08]),
        (450.0, [18.62, 52.32, 48.39]),
        (600.0, [15.79, 47.23, 53.37]),
    ] {
        let (found, _) = bent(square, force, 32);
        println!("F {force}: {found:.2?}, published {x} {y} {z}");
        assert!(distance(found, [x, y, z]) < 0.01 * 71.0);
    }
}
