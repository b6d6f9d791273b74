//! The plane elastica: a clamped rod under its own weight, bent as far as it likes.
//!
//! > EI (θ′ − κ)′ = q (L − s) cos θ,  θ(0) = 0,  θ′(L) = κ(L)
//!
//! θ: angle above the horizontal, κ: unloaded curvature, q: weight per length. Segments of constant
//! angle turn it into as many equations, solved by Newton's method; it shares nothing with the
//! solvers in three dimensions.

use cathforce_reference_solver::Rod;

/// Segments: at 825 mm each is 0.41 mm long, a twentieth of the radius of the hook.
const SEGMENTS: usize = 2000;
/// The weight is applied in this many steps, from the tip's unloaded shape on.
const LOADS: usize = 40;
const MOST_ITERATIONS: usize = 30;
/// Change of every angle below which Newton's method ends \[rad\].
const RESTING_RAD: f64 = 1e-11;

/// Centre line of the last `length_m` of a uniform rod that is clamped horizontally \[m\]: the tip
/// first, along the clamp and upwards. `None` if Newton's method finds no balance.
pub fn hanging(rod: &Rod, length_m: f64, gravity_m_per_s2: f64) -> Option<Vec<[f64; 2]>> {
    let section = rod.sections.first()?;
    let h = length_m / SEGMENTS as f64;
    let weight_n_per_m = section.mass_kg_per_m * gravity_m_per_s2;
    let bends: Vec<f64> = (0..SEGMENTS).map(|i| unloaded(rod, length_m, h, i)).collect();
    // The clamp is half a segment from the middle of the first one.
    let stiffness = |joint: usize| section.bending_n_m2 / if joint == 0 { 0.5 * h } else { h };
    let mut angles: Vec<f64> = bends
        .iter()
        .scan(0.0, |angle, bend| {
            *angle += bend;
            Some(*angle)
        })
        .collect();
    for load in 1..=LOADS {
        let q = weight_n_per_m * load as f64 / LOADS as f64;
        relax(&mut angles, &bends, &stiffness, |i| q * (length_m - (i as f64 + 0.5) * h) * h)?;
    }
    let mut line = vec![[0.0, 0.0]];
    for angle in angles {
        let [x, y] = line[line.len() - 1];
        line.push([x + h * angle.cos(), y + h * angle.sin()]);
    }
    line.reverse();
    Some(line)
}

/// Unloaded angle at the joint before segment `i` \[rad\].
fn unloaded(rod: &Rod, length_m: f64, h: f64, i: usize) -> f64 {
    let middle = length_m - i as f64 * h;
    let (low, high) = (middle - 0.5 * h, (middle + 0.5 * h).min(length_m));
    let mut start = 0.0;
    let mut angle = 0.0;
    for curve in &rod.curves {
        let end = start + curve.length_m;
        angle += curve.up_per_m * (high.min(end) - low.max(start)).max(0.0);
        start = end;
    }
    angle
}

/// Newton's method to the balance of moments of every segment.
fn relax(
    angles: &mut [f64],
    bends: &[f64],
    stiffness: &impl Fn(usize) -> f64,
    load: impl Fn(usize) -> f64,
) -> Option<()> {
    let n = angles.len();
    for _ in 0..MOST_ITERATIONS {
        let moment = |angles: &[f64], joint: usize| {
            let before = if joint == 0 { 0.0 } else { angles[joint - 1] };
            stiffness(joint) * (angles[joint] - before - bends[joint])
        };
        let mut diagonal = Vec::with_capacity(n);
        let mut residual = Vec::with_capacity(n);
        for i in 0..n {
            let after = if i + 1 < n { moment(angles, i + 1) } else { 0.0 };
            residual.push(after - moment(angles, i) - load(i) * angles[i].cos());
            let next = if i + 1 < n { stiffness(i + 1) } else { 0.0 };
            diagonal.push(-next - stiffness(i) + load(i) * angles[i].sin());
        }
        // Thomas' algorithm; the entries beside the diagonal are the stiffnesses of the joints.
        for i in 1..n {
            let factor = stiffness(i) / diagonal[i - 1];
            diagonal[i] -= factor * stiffness(i);
            residual[i] -= factor * residual[i - 1];
        }
        let mut largest: f64 = 0.0;
        let mut next = 0.0;
        for i in (0..n).rev() {
            let beside = if i + 1 < n { stiffness(i + 1) * next } else { 0.0 };
            next = (-residual[i] - beside) / diagonal[i];
            angles[i] += next;
            largest = if next.abs() > largest || next.is_nan() { next.abs() } else { largest };
        }
        if largest < RESTING_RAD {
            return Some(());
        }
        if !largest.is_finite() {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use cathforce_reference_solver::{Curve, Section};

    use super::*;

    /// Length 1, EI 1: the weight is the load qL³/EI.
    fn rod(weight: f64, curves: Vec<Curve>) -> Rod {
        let section = Section {
            length_m: 1.0,
            bending_n_m2: 1.0,
            torsion_n_m2: 1.0,
            axial_n: 1.0,
            mass_kg_per_m: weight,
        };
        Rod { radius_m: 1e-3, sections: vec![section], curves }
    }

    /// Against a Runge–Kutta shooting solution of the same equation with a tolerance of 1e-12.
    #[test]
    fn a_straight_rod_sags_as_the_exact_solution() {
        for (load, sag, shortening) in [
            (0.5, 0.062305768, 0.002221),
            (4.0, 0.425159284, 0.109889253),
            (16.0, 0.797019638, 0.49000508),
        ] {
            let [x, y] = hanging(&rod(load, Vec::new()), 1.0, 1.0).unwrap()[0];
            assert!((y + sag).abs() < 1e-6 && (1.0 - x - shortening).abs() < 1e-6, "{x} {y}");
        }
    }

    #[test]
    fn without_weight_a_hook_is_a_half_circle() {
        let radius = 0.1;
        let length_m = radius * std::f64::consts::PI;
        let curve = Curve { length_m, up_per_m: 1.0 / radius, side_per_m: 0.0 };
        let [x, y] = hanging(&rod(1e-12, vec![curve]), 1.0, 1.0).unwrap()[0];
        assert!((x - (1.0 - length_m)).abs() < 1e-3 && (y - 2.0 * radius).abs() < 1e-4, "{x} {y}");
    }
}
