//! Stress and stiffness of the material at a deformation.
//!
//! The energy is split into a part that feels the shape and one that feels the volume:
//!
//!   Ψ(F, p) = W(λ̄₁, λ̄₂, λ̄₃) + p (J − 1) − p²/(2κ)      λ̄ᵢ = J^(−1/3) λᵢ      J = λ₁ λ₂ λ₃
//!
//! with W of `cathforce_material`, the principal stretches λᵢ of F, the pressure p (positive in
//! tension) and the bulk modulus κ. The first Piola–Kirchhoff stress is ∂Ψ/∂F. Its derivative is
//! known in the frame of the principal stretches (Smith, de Goes and Kim, "Analytic eigensystems for
//! isotropic distortion energies", ACM Trans. Graph. 38, 2019): with Pᵢ = ∂Ψ/∂λᵢ,
//!
//!   Aᵢᵢⱼⱼ = ∂²Ψ/∂λᵢ∂λⱼ      Aᵢⱼᵢⱼ = (a + b)/2      Aᵢⱼⱼᵢ = (a − b)/2
//!   a = (Pᵢ − Pⱼ)/(λᵢ − λⱼ)      b = (Pᵢ + Pⱼ)/(λᵢ + λⱼ)

use cathforce_material::{Law, Material};
use nalgebra::{Matrix3, SymmetricEigen};

/// Principal stretches closer than this take the limit of a: the difference quotient has lost six
/// digits of sixteen there, and the limit is off by the square of the difference.
const ALIKE: f64 = 1e-5;

/// How strains are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kinematics {
    /// The symmetric part of the displacement's gradient; the result is proportional to the load.
    Small,
    /// Stretches and rotations of any size.
    Large,
}

/// A law, how strains are measured, and the resistance to a change of volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallMaterial {
    pub law: Material,
    pub kinematics: Kinematics,
    pub poissons_ratio: f64,
}

impl WallMaterial {
    /// Its name in a table. The elastic law with large strains is Hencky's.
    pub fn name(&self) -> &'static str {
        match (self.law.law(), self.kinematics) {
            (Law::Elastic, Kinematics::Large) => "hencky",
            (law, _) => law.name(),
        }
    }

    /// Shear modulus \[MPa\]. Young's modulus is what a tensile test measures; the shear modulus is
    /// what the other laws' parameters state.
    pub(crate) fn shear_mpa(&self) -> f64 {
        1e-6 * self.law.shear_modulus_pa() * self.shear_factor()
    }

    fn shear_factor(&self) -> f64 {
        match self.law.law() {
            Law::Elastic => 1.5 / (1.0 + self.poissons_ratio),
            _ => 1.0,
        }
    }

    /// Bulk modulus \[MPa\].
    pub(crate) fn bulk_mpa(&self) -> f64 {
        let nu = self.poissons_ratio;
        2.0 * self.shear_mpa() * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu))
    }
}

/// At one point.
pub(crate) struct Response {
    /// ∂Ψ/∂F \[MPa\].
    pub stress: Matrix3<f64>,
    /// ∂J/∂F.
    pub cofactor: Matrix3<f64>,
    /// J − 1.
    pub growth: f64,
    /// ∂²Ψ/∂F∂F \[MPa\]: row 3i + J, column 3k + L.
    pub tangent: [[f64; 9]; 9],
}

impl Response {
    /// `deformation`: F; `pressure_mpa`: p. `None` where the material is turned inside out.
    pub fn new(
        material: &WallMaterial,
        deformation: &Matrix3<f64>,
        pressure_mpa: f64,
    ) -> Option<Self> {
        match material.kinematics {
            Kinematics::Small => Some(Self::small(material, deformation, pressure_mpa)),
            Kinematics::Large => Self::large(material, deformation, pressure_mpa),
        }
    }

    fn small(material: &WallMaterial, deformation: &Matrix3<f64>, pressure_mpa: f64) -> Self {
        let twice = 2.0 * material.shear_mpa();
        let gradient = deformation - Matrix3::identity();
        let strain = (gradient + gradient.transpose()) * 0.5;
        let growth = strain.trace();
        let shape = strain - Matrix3::identity() * (growth / 3.0);
        let mut tangent = [[0.0; 9]; 9];
        for i in 0..3 {
            for j in 0..3 {
                tangent[3 * i + j][3 * i + j] += 0.5 * twice;
                tangent[3 * i + j][3 * j + i] += 0.5 * twice;
                tangent[4 * i][4 * j] -= twice / 3.0;
            }
        }
        let stress = shape * twice + Matrix3::identity() * pressure_mpa;
        Self { stress, cofactor: Matrix3::identity(), growth, tangent }
    }

    fn large(
        material: &WallMaterial,
        deformation: &Matrix3<f64>,
        pressure_mpa: f64,
    ) -> Option<Self> {
        let volume = deformation.determinant();
        if volume.is_nan() || volume <= 0.0 {
            return None;
        }
        let squares = SymmetricEigen::new(deformation.transpose() * deformation);
        let (v, stretch) = (squares.eigenvectors, squares.eigenvalues.map(|x| x.max(0.0).sqrt()));
        if stretch.iter().any(|stretch| stretch.is_nan() || *stretch <= 0.0) {
            return None;
        }
        let mut u = deformation * v;
        for (mut column, stretch) in u.column_iter_mut().zip(stretch.iter()) {
            column /= *stretch;
        }
        let stretch: [f64; 3] = stretch.into();
        let principal = Principal::new(material, stretch, volume, pressure_mpa);
        let mut stress = Matrix3::zeros();
        let mut cofactor = Matrix3::zeros();
        for (i, stretch) in stretch.iter().enumerate() {
            let dyad = u.column(i) * v.column(i).transpose();
            stress += dyad * principal.stress[i];
            cofactor += dyad * (volume / stretch);
        }
        Some(Self { stress, cofactor, growth: volume - 1.0, tangent: principal.tangent(&u, &v) })
    }
}

/// Derivatives of Ψ by the principal stretches.
struct Principal {
    stretch: [f64; 3],
    stress: [f64; 3],
    second: [[f64; 3]; 3],
}

impl Principal {
    fn new(material: &WallMaterial, stretch: [f64; 3], volume: f64, pressure_mpa: f64) -> Self {
        let scale = 1e-6 * material.shear_factor();
        let mean = volume.cbrt();
        let (mut first, mut second) = ([0.0; 3], [0.0; 3]);
        for i in 0..3 {
            let (one, two) = material.law.log_derivatives_pa(stretch[i] / mean);
            (first[i], second[i]) = (scale * one, scale * two);
        }
        let (mean_first, sum) = (first.iter().sum::<f64>() / 3.0, second.iter().sum::<f64>());
        let lifted = pressure_mpa * volume;
        let mut principal = Self { stretch, stress: [0.0; 3], second: [[0.0; 3]; 3] };
        for i in 0..3 {
            let shape = first[i] - mean_first;
            principal.stress[i] = (shape + lifted) / stretch[i];
            for j in 0..3 {
                let mut c = sum / 9.0 - (second[i] + second[j]) / 3.0;
                c += if i == j { second[i] - shape } else { lifted };
                principal.second[i][j] = c / (stretch[i] * stretch[j]);
            }
        }
        principal
    }

    /// ∂²Ψ/∂F∂F, from the frame of the stretches to that of the vessel.
    fn tangent(&self, u: &Matrix3<f64>, v: &Matrix3<f64>) -> [[f64; 9]; 9] {
        // Dyads u_i v_j as nine numbers.
        let dyad = |i: usize, j: usize| {
            let mut flat = [0.0; 9];
            for r in 0..3 {
                for c in 0..3 {
                    flat[3 * r + c] = u[(r, i)] * v[(c, j)];
                }
            }
            flat
        };
        let mut tangent = [[0.0; 9]; 9];
        let mut add = |factor: f64, left: &[f64; 9], right: &[f64; 9]| {
            for (row, left) in tangent.iter_mut().zip(left) {
                for (entry, right) in row.iter_mut().zip(right) {
                    *entry += factor * left * right;
                }
            }
        };
        for i in 0..3 {
            for j in 0..3 {
                add(self.second[i][j], &dyad(i, i), &dyad(j, j));
                if i == j {
                    continue;
                }
                let (a, b) = (self.slope(i, j), self.spin(i, j));
                add(0.5 * (a + b), &dyad(i, j), &dyad(i, j));
                add(0.5 * (a - b), &dyad(i, j), &dyad(j, i));
            }
        }
        tangent
    }

    fn slope(&self, i: usize, j: usize) -> f64 {
        let difference = self.stretch[i] - self.stretch[j];
        if difference.abs() > ALIKE * self.stretch[i] {
            (self.stress[i] - self.stress[j]) / difference
        } else {
            0.5 * (self.second[i][i] + self.second[j][j]) - self.second[i][j]
        }
    }

    fn spin(&self, i: usize, j: usize) -> f64 {
        (self.stress[i] + self.stress[j]) / (self.stretch[i] + self.stretch[j])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn materials() -> Vec<WallMaterial> {
        let laws = [
            Material::Elastic { youngs_modulus_pa: 0.46e6 },
            Material::NeoHookean { c10_pa: 0.04e6 },
            Material::MooneyRivlin { c10_pa: 0.02e6, c01_pa: 0.09e6 },
            Material::Ogden { mu_pa: 0.14e6, alpha: 1.4 },
        ];
        let of = |law, kinematics| WallMaterial { law, kinematics, poissons_ratio: 0.49 };
        let large = laws.into_iter().map(|law| of(law, Kinematics::Large));
        large.chain([of(laws[0], Kinematics::Small)]).collect()
    }

    /// Stress is the derivative of energy is tested in the material; here the tangent is the
    /// derivative of the stress, at stretches that differ and at such that are equal.
    #[test]
    fn the_tangent_is_the_derivative_of_the_stress() {
        let turned = nalgebra::Rotation3::from_euler_angles(0.4, -0.2, 1.0).into_inner();
        let squeezed = Matrix3::new(1.4, 0.2, 0.0, -0.1, 0.7, 0.05, 0.0, 0.3, 1.1);
        let equal = turned * Matrix3::from_diagonal_element(1.1);
        for material in materials() {
            for f in [squeezed, equal, turned, Matrix3::identity()] {
                let at = |f: &Matrix3<f64>| Response::new(&material, f, 0.02).unwrap();
                let tangent = at(&f).tangent;
                for k in 0..9 {
                    let mut step = Matrix3::zeros();
                    step[(k / 3, k % 3)] = 1e-6;
                    let slope = (at(&(f + step)).stress - at(&(f - step)).stress) / 2e-6;
                    let growth = (at(&(f + step)).growth - at(&(f - step)).growth) / 2e-6;
                    assert!((growth - at(&f).cofactor[(k / 3, k % 3)]).abs() < 1e-8);
                    for r in 0..9 {
                        let off = tangent[r][k] - slope[(r / 3, r % 3)];
                        assert!(off.abs() < 2e-7, "{material:?}: {r} {k} off by {off:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_rotation_causes_no_stress() {
        let turned = nalgebra::Rotation3::from_euler_angles(0.4, -0.2, 1.0).into_inner();
        for material in &materials()[..4] {
            let stress = Response::new(material, &turned, 0.0).unwrap().stress;
            assert!(stress.norm() < 1e-14, "{material:?}: {stress}");
        }
    }

    /// Free sides: the pressure is what makes the stress across vanish.
    #[test]
    fn uniaxial_stress_is_that_of_the_law() {
        for material in &materials()[1..4] {
            let stretch = 2.5_f64;
            let f = Matrix3::from_diagonal(&nalgebra::Vector3::new(
                stretch,
                stretch.powf(-0.5),
                stretch.powf(-0.5),
            ));
            let free = Response::new(material, &f, 0.0).unwrap();
            let pressure = -free.stress[(1, 1)] / free.cofactor[(1, 1)];
            let stress = Response::new(material, &f, pressure).unwrap().stress;
            let expected = 1e-6 * material.law.nominal_stress_pa(stretch);
            assert!((stress[(0, 0)] - expected).abs() < 1e-12 && stress[(1, 1)].abs() < 1e-15);
        }
    }
}
