//! The catheter of tables I and II, and how the printed numbers are read.

use cathforce_identification::ClampedCatheter;

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

/// The catheter, whose surface has this radius \[m\].
pub const fn catheter(outer_radius_m: f64) -> ClampedCatheter {
    ClampedCatheter {
        length_m: LENGTH_M,
        outer_radius_m,
        bending_diameter_m: BENDING_DIAMETER_M,
        poisson: POISSON,
    }
}
