//! Bending and torsion where two edges of the discrete elastic rod meet.
//!
//! Bergou et al., "Discrete Viscous Threads", ACM Trans. Graph. 29 (2010) 116: the curvature
//! of a joint is its binormal κb = 2 t_e × t_f/(1 + t_e·t_f) in the mean material frame, its
//! twist the angle between the material frames after parallel transport; e is the edge
//! towards the guide, f the one towards the tip.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// A straight edge between two nodes with its material frame (first director, second director,
/// tangent).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub length: f64,
    pub tangent: Vector3<f64>,
    pub first: Vector3<f64>,
}

impl Edge {
    /// The director across the first one.
    pub fn second(&self) -> Vector3<f64> {
        self.tangent.cross(&self.first)
    }

    /// Moves to a new edge vector without turning about it, then turns by `twist` about it.
    pub fn carried_to(&self, vector: &Vector3<f64>, twist: f64) -> Self {
        let length = vector.norm();
        let tangent = vector / length;
        let first = transported(&self.first, &self.tangent, &tangent);
        // Removes rounding errors along the tangent, which would grow otherwise.
        let first = (first - tangent * tangent.dot(&first)).normalize();
        let (sin, cos) = twist.sin_cos();
        Self { length, tangent, first: first * cos + tangent.cross(&first) * sin }
    }
}

/// `v` turned by the smallest rotation that takes `from` to `to` (unit vectors).
pub(crate) fn transported(
    v: &Vector3<f64>,
    from: &Vector3<f64>,
    to: &Vector3<f64>,
) -> Vector3<f64> {
    let axis = from.cross(to);
    let cos = from.dot(to);
    if cos < -0.999_999 {
        return *v;
    }
    v * cos + axis.cross(v) + axis * (axis.dot(v) / (1.0 + cos))
}

/// Curvatures towards the first and the second director, and the twist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Strain {
    pub up: f64,
    pub side: f64,
    pub twist: f64,
}

/// Energy of a joint, its gradient and its Hessian over (f, θ_f, e, θ_e): the two edge vectors
/// and the twists of their frames.
#[derive(Clone, Debug)]
pub(crate) struct Bend {
    /// Curvatures less the unloaded ones, and twist.
    pub strain: Strain,
    pub gradient: SVector<f64, 8>,
    pub hessian: SMatrix<f64, 8, 8>,
}

/// Rows of (f, θ_f, e, θ_e).
const F: usize = 0;
const THETA_F: usize = 3;
const E: usize = 4;
const THETA_E: usize = 7;

/// The discrete curvature of a circular arc that turns by `angle`.
pub(crate) fn arc_curvature(angle: f64) -> f64 {
    2.0 * (0.5 * angle).tan()
}

pub(crate) fn strain(e: &Edge, f: &Edge, unloaded: &[f64; 2]) -> Strain {
    let chi = 1.0 + e.tangent.dot(&f.tangent);
    let kb = e.tangent.cross(&f.tangent) * (2.0 / chi);
    let carried = transported(&e.first, &e.tangent, &f.tangent);
    let twist = f.tangent.dot(&carried.cross(&f.first)).atan2(carried.dot(&f.first));
    Strain {
        up: 0.5 * kb.dot(&(e.second() + f.second())) - unloaded[0],
        side: -0.5 * kb.dot(&(e.first + f.first)) - unloaded[1],
        twist,
    }
}

/// ½ bending (up² + side²) + ½ torsion twist², differentiated.
pub(crate) fn bend(e: &Edge, f: &Edge, unloaded: &[f64; 2], bending: f64, torsion: f64) -> Bend {
    let strain = strain(e, f, unloaded);
    let (te, tf) = (&e.tangent, &f.tangent);
    let chi = 1.0 + te.dot(tf);
    let kb = te.cross(tf) * (2.0 / chi);
    let mean = (te + tf) / chi;
    let (e1, e2, f1, f2) = (e.first, e.second(), f.first, f.second());
    let (re, rf) = (1.0 / e.length, 1.0 / f.length);
    let kappa = [strain.up + unloaded[0], strain.side + unloaded[1]];
    // up = ½ κb·(e2 + f2), side = ½ κb·(d_e + d_f) with d = −(first director): one formula.
    let directors = [(e2, f2, e1, f1), (-e1, -f1, e2, f2)];

    let mut hessian = SMatrix::<f64, 8, 8>::zeros();
    let mut gradient = SVector::<f64, 8>::zeros();
    let identity = Matrix3::identity();
    for (index, (de, df, turned_e, turned_f)) in directors.iter().enumerate() {
        let k = kappa[index];
        let excess = bending * (k - unloaded[index]);
        let d = (de + df) / chi;
        let (tf_d, te_d) = (tf.cross(&d), te.cross(&d));

        let mut g = SVector::<f64, 8>::zeros();
        g.fixed_rows_mut::<3>(E).copy_from(&((tf_d - mean * k) * re));
        g.fixed_rows_mut::<3>(F).copy_from(&((-te_d - mean * k) * rf));
        g[THETA_E] = -0.5 * kb.dot(turned_e);
        g[THETA_F] = -0.5 * kb.dot(turned_f);
        hessian += g * g.transpose() * bending;
        gradient += g * excess;

        // Second derivatives of the curvature, times the moment.
        let mm = mean * mean.transpose() * (2.0 * k);
        let tfd_m = tf_d * mean.transpose();
        let ted_m = te_d * mean.transpose();
        let ee = (mm - tfd_m - tfd_m.transpose()) * (re * re)
            - (identity - te * te.transpose()) * (k / chi * re * re)
            + symmetric(&kb, de) * (0.25 * re * re);
        let ff = (mm + ted_m + ted_m.transpose()) * (rf * rf)
            - (identity - tf * tf.transpose()) * (k / chi * rf * rf)
            + symmetric(&kb, df) * (0.25 * rf * rf);
        let ef = (mm - tfd_m + ted_m.transpose() - d.cross_matrix()) * (re * rf)
            - (identity + te * tf.transpose()) * (k / chi * re * rf);
        add_block(&mut hessian, E, E, &(ee * excess));
        add_block(&mut hessian, F, F, &(ff * excess));
        add_block(&mut hessian, E, F, &(ef * excess));
        add_block(&mut hessian, F, E, &(ef.transpose() * excess));
        for (theta, director, turned) in [(THETA_E, de, turned_e), (THETA_F, df, turned_f)] {
            hessian[(theta, theta)] -= 0.5 * kb.dot(director) * excess;
            let along = mean * (0.5 * kb.dot(turned));
            let de = (along - tf.cross(turned) / chi) * (re * excess);
            let df = (along + te.cross(turned) / chi) * (rf * excess);
            add_border(&mut hessian, E, theta, &de);
            add_border(&mut hessian, F, theta, &df);
        }
    }

    let torque = torsion * strain.twist;
    let mut g = SVector::<f64, 8>::zeros();
    g.fixed_rows_mut::<3>(E).copy_from(&(kb * (0.5 * re)));
    g.fixed_rows_mut::<3>(F).copy_from(&(kb * (0.5 * rf)));
    g[THETA_E] = -1.0;
    g[THETA_F] = 1.0;
    hessian += g * g.transpose() * torsion;
    gradient += g * torque;
    let ee = symmetric(&kb, &(te + mean)) * (-0.25 * re * re);
    let ff = symmetric(&kb, &(tf + mean)) * (-0.25 * rf * rf);
    let ef = (te.cross_matrix() * (2.0 / chi) - kb * mean.transpose()) * (0.5 * re * rf);
    add_block(&mut hessian, E, E, &(ee * torque));
    add_block(&mut hessian, F, F, &(ff * torque));
    add_block(&mut hessian, E, F, &(ef * torque));
    add_block(&mut hessian, F, E, &(ef.transpose() * torque));
    Bend { strain, gradient, hessian }
}

/// u vᵀ + v uᵀ
fn symmetric(u: &Vector3<f64>, v: &Vector3<f64>) -> Matrix3<f64> {
    u * v.transpose() + v * u.transpose()
}

fn add_block(hessian: &mut SMatrix<f64, 8, 8>, row: usize, column: usize, block: &Matrix3<f64>) {
    let mut view = hessian.fixed_view_mut::<3, 3>(row, column);
    view += block;
}

fn add_border(hessian: &mut SMatrix<f64, 8, 8>, row: usize, column: usize, v: &Vector3<f64>) {
    for i in 0..3 {
        hessian[(row + i, column)] += v[i];
        hessian[(column, row + i)] += v[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges() -> (Edge, Edge, [Vector3<f64>; 2]) {
        let (ve, vf) = (Vector3::new(1.1, 0.2, -0.3), Vector3::new(0.7, 0.6, 0.5));
        let edge = |v: &Vector3<f64>, twist: f64| {
            let along_x = Edge { length: 1.0, tangent: Vector3::x(), first: Vector3::y() };
            along_x.carried_to(v, twist)
        };
        (edge(&ve, 0.3), edge(&vf, 0.9), [vf, ve])
    }

    /// The edges after a small change of (f, θ_f, e, θ_e).
    fn moved(change: &SVector<f64, 8>) -> (Edge, Edge) {
        let (e, f, [vf, ve]) = edges();
        let part = |at: usize| Vector3::new(change[at], change[at + 1], change[at + 2]);
        (
            e.carried_to(&(ve + part(E)), change[THETA_E]),
            f.carried_to(&(vf + part(F)), change[THETA_F]),
        )
    }

    #[test]
    fn gradient_and_hessian_are_those_of_the_energy() {
        let (unloaded, bending, torsion) = ([0.2, -0.1], 1.7, 0.6);
        let energy = |change: &SVector<f64, 8>| {
            let (e, f) = moved(change);
            let s = strain(&e, &f, &unloaded);
            0.5 * bending * (s.up * s.up + s.side * s.side) + 0.5 * torsion * s.twist * s.twist
        };
        let (e, f, _) = edges();
        let exact = bend(&e, &f, &unloaded, bending, torsion);
        let h = 1e-4;
        for i in 0..8 {
            let mut step = SVector::<f64, 8>::zeros();
            step[i] = h;
            let slope = (energy(&step) - energy(&-step)) / (2.0 * h);
            assert!((slope - exact.gradient[i]).abs() < 1e-7, "{i}: {slope}");
            for j in 0..8 {
                let mut other = SVector::<f64, 8>::zeros();
                other[j] = h;
                let second =
                    (energy(&(step + other)) - energy(&(step - other)) - energy(&(other - step))
                        + energy(&(-step - other)))
                        / (4.0 * h * h);
                let found = exact.hessian[(i, j)];
                assert!((second - found).abs() < 1e-5, "{i} {j}: {second} {found}");
            }
        }
    }
}
