//! Eight vessels. Every case has its own lengths, radii, angles and planes.

use cathforce_reference_solver::Station;
use nalgebra::{Rotation3, Vector3};
use rand::Rng;

use super::path::Path;

/// A vessel's kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Vessel {
    /// Narrows round one bend.
    TaperedBend,
    /// Two bends in planes that are turned against each other.
    DoubleBend,
    /// Divides into two of like width.
    Wye,
    /// A wide arch whose geometry is known from a scan.
    ScannedArch,
    /// A wide bulge in a bend.
    Aneurysm,
    /// A wide trunk that divides into two bent branches, as the aorta does.
    Iliac,
    /// A tight turn back.
    Hook,
    /// Three bends one after the other, known from a scan.
    ScannedSiphon,
}

/// Where branches meet, edges are rounded over this \[m\]: what the reader of bundles does, too.
const BLEND_M: f64 = 1e-3;
/// Lengths, radii and angles vary by this share from case to case.
const VARIES: f64 = 0.15;
/// The plane of the first bend is turned about the entry by up to this \[rad\], so that the weight acts
/// another way in every case.
const PLANE_RAD: f64 = 0.7;

/// A vessel that was drawn.
#[derive(Clone, Debug)]
pub struct Anatomy {
    /// Centre line and radius of each branch, the trunk first.
    pub branches: Vec<Vec<Station>>,
    /// Edges between branches are rounded over this; 0 without branches \[m\].
    pub blend_m: f64,
}

impl Vessel {
    /// All of them.
    #[cfg(test)]
    pub const ALL: [Self; 8] = [
        Self::TaperedBend,
        Self::DoubleBend,
        Self::Wye,
        Self::ScannedArch,
        Self::Aneurysm,
        Self::Iliac,
        Self::Hook,
        Self::ScannedSiphon,
    ];

    /// As the rig of a label begins.
    pub fn name(self) -> &'static str {
        match self {
            Self::TaperedBend => "tapered-bend",
            Self::DoubleBend => "double-bend",
            Self::Wye => "wye",
            Self::ScannedArch => "scanned-arch",
            Self::Aneurysm => "aneurysm",
            Self::Iliac => "iliac",
            Self::Hook => "hook",
            Self::ScannedSiphon => "scanned-siphon",
        }
    }

    /// Whether it divides.
    pub fn divides(self) -> bool {
        matches!(self, Self::Wye | Self::Iliac)
    }

    /// Whether its stated geometry is a scan's, with the errors of a segmentation.
    pub fn is_scanned(self) -> bool {
        matches!(self, Self::ScannedArch | Self::ScannedSiphon)
    }

    /// One of its kind. It begins at the origin along x.
    pub fn draw(self, rng: &mut impl Rng) -> Anatomy {
        let plane = Rotation3::new(Vector3::x() * rng.random_range(-PLANE_RAD..PLANE_RAD));
        let mut v = |value: f64| value * rng.random_range(1.0 - VARIES..1.0 + VARIES);
        let (up, side) = (plane * Vector3::y(), plane * Vector3::z());
        let start = |radius_m: f64, v: &mut dyn FnMut(f64) -> f64| {
            Path::from(Vector3::zeros(), Vector3::x(), v(radius_m))
        };
        let deg = f64::to_radians;
        let single = |path: Path| Anatomy { branches: vec![path.stations()], blend_m: 0.0 };
        match self {
            Self::TaperedBend => single(
                start(5.2e-3, &mut v)
                    .straight(v(0.03), v(5.0e-3))
                    .arc(v(0.032), v(deg(75.0)), up, v(3.6e-3))
                    .straight(v(0.06), v(3.0e-3)),
            ),
            Self::DoubleBend => single(
                start(4.6e-3, &mut v)
                    .straight(v(0.028), v(4.4e-3))
                    .arc(v(0.030), v(deg(60.0)), -up, v(4.0e-3))
                    .arc(v(0.032), v(deg(65.0)), up + 0.6 * side, v(3.4e-3))
                    .straight(v(0.05), v(3.2e-3)),
            ),
            Self::Wye => {
                let trunk = start(4.8e-3, &mut v).straight(v(0.028), v(4.8e-3)).arc(
                    v(0.08),
                    v(deg(14.0)),
                    up,
                    v(4.6e-3),
                );
                let left = [v(0.045), v(deg(42.0)), v(3.3e-3), v(0.045)];
                let right = [v(0.05), v(deg(36.0)), v(3.0e-3), v(0.045)];
                divided(trunk, [(up + 0.2 * side, left), (-up, right)])
            }
            Self::ScannedArch => single(
                start(4.6e-3, &mut v)
                    .straight(v(0.026), v(4.6e-3))
                    .arc(v(0.036), v(deg(115.0)), up, v(3.8e-3))
                    .straight(v(0.05), v(3.5e-3)),
            ),
            Self::Aneurysm => {
                let (straight_m, bend_m, angle) = (v(0.03), v(0.036), v(deg(80.0)));
                let path = start(3.9e-3, &mut v)
                    .straight(straight_m, v(3.9e-3))
                    .arc(bend_m, angle, up, v(3.6e-3))
                    .straight(v(0.06), v(3.3e-3));
                let middle_m = straight_m + 0.55 * bend_m * angle;
                single(path.wider_around(middle_m, v(3.6e-3), v(7e-3)))
            }
            Self::Iliac => {
                let trunk = start(6.2e-3, &mut v).straight(v(0.036), v(5.8e-3));
                let left = [v(0.055), v(deg(30.0)), v(4.2e-3), v(0.05)];
                let right = [v(0.06), v(deg(26.0)), v(4.0e-3), v(0.05)];
                divided(trunk, [(up, left), (-up + 0.4 * side, right)])
            }
            Self::Hook => single(
                start(4.5e-3, &mut v)
                    .straight(v(0.03), v(4.3e-3))
                    .arc(v(0.023), v(deg(145.0)), up, v(3.7e-3))
                    .straight(v(0.05), v(3.4e-3)),
            ),
            Self::ScannedSiphon => single(
                start(4.3e-3, &mut v)
                    .straight(v(0.026), v(4.2e-3))
                    .arc(v(0.027), v(deg(48.0)), up, v(3.9e-3))
                    .arc(v(0.026), v(deg(58.0)), -up + 0.5 * side, v(3.5e-3))
                    .arc(v(0.028), v(deg(46.0)), side, v(3.3e-3))
                    .straight(v(0.045), v(3.1e-3)),
            ),
        }
    }
}

/// A trunk with two branches, each of which bends away along an arc (its radius, its angle), becomes so
/// wide, and then goes straight on for a length.
fn divided(trunk: Path, branches: [(Vector3<f64>, [f64; 4]); 2]) -> Anatomy {
    let (at_m, direction) = trunk.end();
    let branch =
        |(towards, [bend_m, angle_rad, radius_m, straight_m]): (Vector3<f64>, [f64; 4])| {
            Path::from(at_m, direction.into_inner(), radius_m)
                .arc(bend_m, angle_rad, towards, radius_m)
                .straight(straight_m, 0.95 * radius_m)
                .stations()
        };
    let [left, right] = branches.map(branch);
    Anatomy { branches: vec![trunk.stations(), left, right], blend_m: BLEND_M }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strangers::path::arcs_m;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn every_vessel_is_wide_and_long_enough_for_every_instrument() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for vessel in Vessel::ALL {
            for _ in 0..20 {
                let anatomy = vessel.draw(&mut rng);
                assert_eq!(anatomy.branches.len() > 1, vessel.divides());
                assert_eq!(anatomy.blend_m > 0.0, vessel.divides());
                let trunk = &anatomy.branches[0];
                assert_eq!(trunk[0].position_m, Vector3::zeros());
                let radii = anatomy.branches.iter().flatten().map(|station| station.radius_m);
                let least_m = radii.fold(f64::INFINITY, f64::min);
                assert!(least_m > 2.4e-3, "{}: {least_m}", vessel.name());
                let length_m = |branch: &Vec<Station>| arcs_m(branch)[branch.len() - 1];
                let children = anatomy.branches[1..].iter().map(length_m);
                let most_m = length_m(trunk) + children.fold(0.0, f64::max);
                assert!(most_m > 0.1, "{}: {most_m}", vessel.name());
            }
        }
    }

    #[test]
    fn no_two_of_a_kind_are_alike() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut end = || Vessel::Hook.draw(&mut rng).branches[0].last().copied().unwrap();
        let (one, other) = (end(), end());
        assert!((one.position_m - other.position_m).norm() > 1e-4);
        assert_ne!(one.radius_m, other.radius_m);
    }
}
