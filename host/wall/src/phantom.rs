//! The region around the left iliac artery of the box phantom.
//!
//! Published are the diameters, 19 mm of the iliac arteries and 31 mm of the abdominal aorta (Li 2023,
//! figure 2.3), that the wall is held where it meets the box (section 2.4.1), and the thickness of the
//! tensile specimen, 2 mm (Pescio et al. 2025). Everything else here is an assumption: straight
//! arteries in one plane, the angle between them, how far from the crotch they are held, the
//! fillet between them, and where the catheter pressed.

use cathforce_bundle::geometry::{Wall, WallPoint};
use cathforce_material::{Form, Law, LawError, Material};
use nalgebra::Vector3;

use crate::response::{Kinematics, WallMaterial};

/// Diameters of the lumen \[m\]: Li 2023, figure 2.3.
pub const ILIAC_DIAMETER_M: f64 = 19e-3;
pub const AORTA_DIAMETER_M: f64 = 31e-3;
/// Thickness of the wall \[m\]: that of the tensile specimen, Pescio et al. 2025.
pub const THICKNESS_M: f64 = 2e-3;
/// Angle of each iliac artery with the axis of the aorta \[rad\]; assumed: 25°.
const ILIAC_ANGLE_RAD: f64 = 25.0 * std::f64::consts::PI / 180.0;
/// From the crotch to where the wall is held \[m\]; assumed. The left one is loaded in its middle; the
/// others end where the load is no longer felt.
const LEFT_M: f64 = 100e-3;
const RIGHT_M: f64 = 45e-3;
const AORTA_M: f64 = 45e-3;
/// Width over which the arteries run into each other \[m\]; assumed.
const FILLET_M: f64 = 10e-3;

/// What the publications do not say.
pub const ASSUMED: &str = "straight arteries in one plane, 25° between iliac artery and aorta; held 100 mm \
                           (left), 45 mm (right) and 45 mm (aorta) from the crotch; pressed in the middle of \
                           the left artery, on the outer side; the place that is pressed is round";
/// Size of elements along the wall \[mm\]. Elements of 7 mm give 6 % more displacement
/// (`cargo run --release -p cathforce-wall --example pressed -- 7 5`).
pub const ELEMENT_MM: f64 = 5.0;
/// Radius of the place that is pressed \[mm\]; it is not published.
pub const PATCH_MM: f64 = 2.0;
/// Poisson's ratio; it is not published.
pub const POISSONS_RATIO: f64 = 0.49;

/// Forces of the static test \[N\]: those of the text of Pescio et al. 2025; their Table 3 rounds two.
pub const FORCES_N: [f64; 3] = [0.56, 1.10, 1.63];
/// Displacements that were measured \[mm\]: Table 3.
pub const MEASURED_MM: [f64; 3] = [3.34, 4.61, 4.92];

/// A row of Table 3.
#[derive(Clone, Copy, Debug)]
pub struct PublishedRow {
    /// With the parameters of Table 2.
    pub material: WallMaterial,
    /// Displacements of the published simulation \[mm\], at [`FORCES_N`].
    pub simulated_mm: [f64; 3],
}

/// The laws of Table 3 with the parameters of Table 2, put into the energies (7) to (9) of the paper.
///
/// The elastic law comes twice: with small strains, and with rotations of any size, as a corotational
/// element has them.
pub fn table_3(poissons_ratio: f64) -> Result<[PublishedRow; 5], LawError> {
    const ELASTIC_MM: [f64; 3] = [2.20, 5.24, 7.80];
    let elastic = Material::Elastic { youngs_modulus_pa: 0.46e6 };
    let row = |law, kinematics, simulated_mm| PublishedRow {
        material: WallMaterial { law, kinematics, poissons_ratio },
        simulated_mm,
    };
    let hyperelastic = |law, parameters: &[f64], simulated_mm| {
        let law = Form::Printed.material(law, parameters)?;
        Ok::<_, LawError>(row(law, Kinematics::Large, simulated_mm))
    };
    Ok([
        row(elastic, Kinematics::Small, ELASTIC_MM),
        row(elastic, Kinematics::Large, ELASTIC_MM),
        hyperelastic(Law::NeoHookean, &[0.04e6], [0.85, 1.75, 2.72])?,
        hyperelastic(Law::MooneyRivlin, &[0.02e6, 0.09e6], [0.39, 0.83, 1.28])?,
        hyperelastic(Law::Ogden, &[0.20e6, 1.4], [0.31, 0.64, 1.00])?,
    ])
}

/// An artery from the crotch on.
#[derive(Clone, Copy, Debug)]
struct Artery {
    axis: Vector3<f64>,
    radius_m: f64,
    length_m: f64,
}

/// The lumen; its origin is where the axes meet, x points along the aorta to the legs.
#[derive(Clone, Debug)]
pub struct Phantom {
    arteries: [Artery; 3],
}

impl Default for Phantom {
    fn default() -> Self {
        let (sin, cos) = ILIAC_ANGLE_RAD.sin_cos();
        let iliac = |side: f64, length_m: f64| Artery {
            axis: Vector3::new(cos, side * sin, 0.0),
            radius_m: 0.5 * ILIAC_DIAMETER_M,
            length_m,
        };
        let aorta =
            Artery { axis: -Vector3::x(), radius_m: 0.5 * AORTA_DIAMETER_M, length_m: AORTA_M };
        Self { arteries: [iliac(1.0, LEFT_M), iliac(-1.0, RIGHT_M), aorta] }
    }
}

impl Phantom {
    /// The middle of the left iliac artery, on the side away from the other, and the direction out of
    /// the lumen there; \[mm\].
    pub fn pressed(&self) -> (Vector3<f64>, Vector3<f64>) {
        let left = &self.arteries[0];
        let outwards = Vector3::new(-left.axis.y, left.axis.x, 0.0);
        let at = left.axis * (0.55 * left.length_m) + outwards * left.radius_m;
        (at * 1e3, outwards)
    }

    /// Direction of the left iliac artery.
    pub fn left_axis(&self) -> Vector3<f64> {
        self.arteries[0].axis
    }

    /// \[m\], positive in the lumen, and how far past an end.
    fn distance(&self, p: &Vector3<f64>) -> (f64, f64) {
        let (mut union, mut nearest) = (f64::NEG_INFINITY, (f64::NEG_INFINITY, 0.0));
        for artery in &self.arteries {
            let s = p.dot(&artery.axis).max(0.0);
            let depth = artery.radius_m - (p - artery.axis * s).norm();
            if depth > nearest.0 {
                nearest = (depth, s - artery.length_m);
            }
            union = if union == f64::NEG_INFINITY { depth } else { smooth_larger(union, depth) };
        }
        (union, nearest.1.max(0.0))
    }
}

/// The larger of two distances, with a fillet where they are alike.
fn smooth_larger(a: f64, b: f64) -> f64 {
    let share = (0.5 + 0.5 * (a - b) / FILLET_M).clamp(0.0, 1.0);
    b + (a - b) * share + FILLET_M * share * (1.0 - share)
}

impl Wall for Phantom {
    fn sample(&self, p: &Vector3<f64>) -> WallPoint {
        /// Small against every radius, large against rounding.
        const STEP_M: f64 = 1e-6;
        let (distance_m, beyond_m) = self.distance(p);
        let slope = |axis: usize| {
            let step = Vector3::ith(axis, STEP_M);
            self.distance(&(p + step)).0 - self.distance(&(p - step)).0
        };
        let gradient = Vector3::new(slope(0), slope(1), slope(2)) / (2.0 * STEP_M);
        let steepness = gradient.norm().max(1e-3);
        // In the fillet the blend is no longer a distance; over its slope it is one to first order.
        WallPoint { distance_m: distance_m / steepness, normal: gradient / steepness, beyond_m }
    }

    fn bounds_m(&self) -> (Vector3<f64>, Vector3<f64>) {
        let (mut low, mut high) = (Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN));
        for artery in &self.arteries {
            for end in [Vector3::zeros(), artery.axis * artery.length_m] {
                low = low.inf(&(end - Vector3::repeat(artery.radius_m)));
                high = high.sup(&(end + Vector3::repeat(artery.radius_m)));
            }
        }
        (low, high)
    }
}
