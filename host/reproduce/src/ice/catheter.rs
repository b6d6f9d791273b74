//! The catheter of tables I and II, and how the printed numbers are read.

use cathforce_reference_solver::{
    Beyond, Entry, Integrator, Lumen, Numerics, Problem, Rod, Section, TipLoad, WallLaw,
};
use nalgebra::Vector3;

/// Arc length of table II \[m\].
pub const LENGTH_M: f64 = 0.135;
/// Radius of table II \[m\]. The flow meets it.
pub const RADIUS_M: f64 = 4.1e-3;
/// Diameter of the solid rod that bends like the catheter \[m\]: twice a tenth of the printed radius. With
/// the printed radius and 30.20 GPa, E I is 6.7 N·m², and the heaviest weight, 20 g, bends 135 mm by
/// F L³/(3 E I) = 24 µm, which no electromagnetic sensor sees; the printed viscous damping over that E I is
/// 0.7 µs, which damps nothing. With a tenth of it E I is 6.7·10⁻⁴ N·m², as catheters have it, the weights
/// bend it by centimetres, and it swings at 2 to 3 Hz with a twentieth of the critical damping.
pub const BENDING_DIAMETER_M: f64 = 0.82e-3;
/// Poisson's ratio of table I \[1\].
pub const POISSON: f64 = 0.2;
/// Between samples of an electromagnetic tracker at 40 Hz, and white noise of a position \[m\]. The
/// publication names the maker (NDI) and neither number; 40 Hz and some tenths of a millimetre are usual.
pub const SAMPLE_S: f64 = 0.025;
pub const NOISE_M: f64 = 0.2e-3;

/// How the section is read, for the rows.
pub const SECTION_READ: &str = "E I and mass from a solid rod of a tenth of the printed radius (with 4.1 mm, 20 g would bend it by 24 µm)";
/// How the sensor is read, for the rows.
pub const SENSOR_READ: &str = "tip read at 40 Hz with 0.2 mm of white noise (neither is printed)";

/// How finely a catheter is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mesh {
    pub edges: usize,
    pub step_s: f64,
}

/// The catheter in air, clamped along the horizontal.
pub fn in_air(youngs_pa: f64, density_kg_per_m3: f64, mesh: Mesh) -> Problem {
    let section =
        Section::tube(1.0, BENDING_DIAMETER_M, 0.0, youngs_pa, POISSON, density_kg_per_m3);
    Problem {
        rod: Rod { radius_m: RADIUS_M, sections: vec![section], curves: Vec::new() },
        entry: Entry { position_m: Vector3::zeros(), direction: Vector3::x(), up: Vector3::z() },
        lumen: Lumen::open(),
        beyond: Beyond::default(),
        // Nothing is touched.
        wall: WallLaw {
            line_stiffness_n_per_m2: 8e5,
            end_stiffness_n_per_m: 2e3,
            tangential_ratio: 3.0,
            friction_coefficient: 0.0,
        },
        gravity_m_per_s2: Vector3::z() * -9.81,
        drag_n_s_per_m2: 0.0,
        tip_load: TipLoad::default(),
        numerics: Numerics {
            spacing_m: LENGTH_M / mesh.edges as f64,
            step_s: mesh.step_s,
            // Between the printed limits −0.5 and 0.
            integrator: Integrator::BdfAlpha { alpha: -0.3 },
            // 1 N bends the tip by L³/(3 E I) = 1.2 m, so that this is 0.1 µm.
            tolerance_n: 1e-7,
        },
    }
}
