//! Whether a vessel and an entry belong together: can the instrument enter?

use nalgebra::Vector3;
use thiserror::Error;

use crate::geometry::{Opening, Wall};
use crate::rig::CatheterRig;

/// No vessel has its wall farther from the entry than this \[m\].
const FARTHEST_WALL_M: f64 = 0.06;
/// The entry plane and its opening are no farther apart than this \[m\], or than four radii of the
/// opening: a wide one may be cut askew.
const FARTHEST_OPENING_M: f64 = 0.01;
/// The axis of the entry may miss the rim of its opening by this share of the radius: a rim is a
/// polygon inside the circle that it stands for.
const BESIDE_RIM: f64 = 0.1;
/// Least cosine between the axes of entry and opening at which the instrument can pass.
const LEAST_ALONG: f64 = 0.2;
/// Distance past the entry plane at which the nearest wall is beside the instrument, not behind it \[m\].
const PAST_PLANE_M: f64 = 1e-3;
/// Distance ahead of the entry plane and behind it at which the vessel is looked for \[m\].
const FACING_M: f64 = 5e-3;

/// Why a vessel and an entry do not belong together.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum VesselCause {
    #[error(
        "the entry ({:.1}, {:.1}, {:.1}) mm is {distance_mm:.1} mm from the wall, farther than any \
         vessel is wide", entry_mm[0], entry_mm[1], entry_mm[2]
    )]
    EntryFarFromWall { entry_mm: [f64; 3], distance_mm: f64 },
    #[error("the surface has no opening near the entry{}, so a wall closes the vessel in front of \
             the instrument", nearest_rim(.rim_mm))]
    NoOpeningAtEntry { rim_mm: Option<f64> },
    #[error(transparent)]
    EntryBesideOpening(Box<BesideOpening>),
    #[error(
        "the wall is {distance_mm:.2} mm from the axis of the entry, the instrument's radius is \
         {radius_mm:.2} mm: it cannot enter"
    )]
    EntryTooNarrow { distance_mm: f64, radius_mm: f64 },
    #[error(
        "[vessel] wall_regions[{index}] holds no wall: the nearest is {distance_mm:.1} mm from its \
         centre, its radius is {radius_mm:.1} mm"
    )]
    RegionWithoutWall { index: usize, distance_mm: f64, radius_mm: f64 },
    #[error("the vessel lies behind the entry plane: `direction` of [entry] leads out of it")]
    EntryLeadsOut,
}

/// An entry whose axis goes through no opening.
#[derive(Clone, Debug, PartialEq, Error)]
#[error(
    "[entry] position_m = ({:.1}, {:.1}, {:.1}) mm does not lead into the vessel: {}, and its axis \
     passes {aside_mm:.1} mm beside the middle of the nearest opening, at ({:.1}, {:.1}, {:.1}) mm \
     and of {radius_mm:.2} mm radius", entry_mm[0], entry_mm[1], entry_mm[2], side(.depth_mm),
    opening_mm[0], opening_mm[1], opening_mm[2]
)]
pub struct BesideOpening {
    pub entry_mm: [f64; 3],
    /// Negative outside the wall.
    pub depth_mm: f64,
    pub opening_mm: [f64; 3],
    pub radius_mm: f64,
    pub aside_mm: f64,
}

fn nearest_rim(rim_mm: &Option<f64>) -> String {
    match rim_mm {
        Some(rim_mm) => format!(": the nearest rim is {rim_mm:.1} mm away"),
        None => " nor anywhere else".into(),
    }
}

fn side(depth_mm: &f64) -> String {
    match *depth_mm {
        depth_mm if depth_mm < 0.0 => format!("it is {:.1} mm outside the wall", -depth_mm),
        depth_mm => format!("it is {depth_mm:.1} mm from the wall"),
    }
}

impl VesselCause {
    pub(crate) fn fix(&self) -> String {
        match self {
            VesselCause::EntryFarFromWall { .. } | VesselCause::EntryTooNarrow { .. } => {
                "vessel and [entry] position_m do not belong together: STL is in millimetres, \
                 everything else in metres, all in the vessel's frame"
                    .into()
            }
            VesselCause::RegionWithoutWall { .. } => {
                "move centre_m to the wall, widen radius_m, or take the region out; both are in \
                 metres, in the vessel's frame"
                    .into()
            }
            VesselCause::NoOpeningAtEntry { .. } => {
                "cut the vessel open where the instrument enters, or correct [entry] position_m"
                    .into()
            }
            VesselCause::EntryBesideOpening(beside) => {
                let [x, y, z] = beside.opening_mm.map(|mm| 1e-3 * mm);
                format!(
                    "correct [entry] position_m and direction, in the vessel's frame; the middle of \
                     that opening is [{x:.4}, {y:.4}, {z:.4}] in metres"
                )
            }
            VesselCause::EntryLeadsOut => {
                "turn the signs of [entry] direction, or correct position_m: the instrument goes \
                 along direction, in the vessel's frame"
                    .into()
            }
        }
    }

    /// Whether the fault is in rig.toml and not in the vessel's file.
    pub(crate) fn is_of_rig(&self) -> bool {
        matches!(self, VesselCause::EntryBesideOpening(_) | VesselCause::RegionWithoutWall { .. })
    }
}

/// Why the instrument cannot enter; `None` if it can. `openings`: those of a mesh.
pub(crate) fn no_entry(
    wall: &dyn Wall,
    openings: Option<&[Opening]>,
    rig: &CatheterRig,
) -> Option<VesselCause> {
    let position = Vector3::from(rig.entry.position_m);
    let direction = Vector3::from(rig.entry.direction);
    let nearest = wall.sample(&(position + direction * PAST_PLANE_M));
    let distance_m = nearest.distance_m.hypot(nearest.beyond_m);
    let beyond_m = |ahead_m: f64| wall.sample(&(position + direction * ahead_m)).beyond_m;
    let radius_m = 0.5 * rig.instrument.outer_diameter_m;
    if distance_m > FARTHEST_WALL_M {
        let entry_mm = (position * 1e3).into();
        return Some(VesselCause::EntryFarFromWall { entry_mm, distance_mm: distance_m * 1e3 });
    }
    let beside = |openings| beside_openings(openings, &position, &direction, nearest.distance_m);
    if let Some(cause) = openings.and_then(beside) {
        return Some(cause);
    }
    if beyond_m(FACING_M) > beyond_m(-FACING_M) + 0.5 * FACING_M {
        return Some(VesselCause::EntryLeadsOut);
    }
    let distance_mm = nearest.distance_m * 1e3;
    (nearest.distance_m < radius_m)
        .then_some(VesselCause::EntryTooNarrow { distance_mm, radius_mm: radius_m * 1e3 })
}

/// Why the axis of the entry goes through no opening near it; `None` if it does.
///
/// `depth_m`: distance of the entry from the wall, negative outside \[m\].
fn beside_openings(
    openings: &[Opening],
    position: &Vector3<f64>,
    direction: &Vector3<f64>,
    depth_m: f64,
) -> Option<VesselCause> {
    let rim_m = |opening: &Opening| {
        let corners = opening.rim_m.iter().map(|corner| (corner - position).norm());
        corners.fold(f64::INFINITY, f64::min)
    };
    let reach_m = |opening: &Opening| FARTHEST_OPENING_M.max(4.0 * opening.radius_m);
    let Some(nearest) = openings.iter().min_by(|a, b| rim_m(a).total_cmp(&rim_m(b))) else {
        return Some(VesselCause::NoOpeningAtEntry { rim_mm: None });
    };
    let goes_through = |opening: &Opening| {
        let (ahead_m, from_centre) = crossing(opening, position, direction);
        ahead_m.abs() <= reach_m(opening) && is_within_rim(opening, &from_centre)
    };
    if openings.iter().any(goes_through) {
        return None;
    }
    if depth_m >= 0.0 && rim_m(nearest) > reach_m(nearest) {
        return Some(VesselCause::NoOpeningAtEntry { rim_mm: Some(1e3 * rim_m(nearest)) });
    }
    let (_, from_centre) = crossing(nearest, position, direction);
    Some(VesselCause::EntryBesideOpening(Box::new(BesideOpening {
        entry_mm: (position * 1e3).into(),
        depth_mm: 1e3 * depth_m,
        opening_mm: (nearest.centre_m * 1e3).into(),
        radius_mm: 1e3 * nearest.radius_m,
        aside_mm: 1e3 * from_centre.norm(),
    })))
}

/// Where the axis of the entry crosses the plane of an opening: the distance ahead of the entry
/// \[m\], and the point, from the opening's centre and normal to its axis \[m\].
fn crossing(
    opening: &Opening,
    position: &Vector3<f64>,
    direction: &Vector3<f64>,
) -> (f64, Vector3<f64>) {
    let along = direction.dot(&opening.axis);
    let ahead_m = match along.abs() < LEAST_ALONG {
        true => 0.0,
        false => (opening.centre_m - position).dot(&opening.axis) / along,
    };
    let from_centre = position + direction * ahead_m - opening.centre_m;
    (ahead_m, from_centre - opening.axis * opening.axis.dot(&from_centre))
}

/// Whether a point lies within the rim seen along the opening's axis, or just beside it.
///
/// `point`: from the opening's centre, normal to its axis \[m\].
fn is_within_rim(opening: &Opening, point: &Vector3<f64>) -> bool {
    let across = |corner: &Vector3<f64>| {
        let from_centre = corner - opening.centre_m;
        from_centre - opening.axis * opening.axis.dot(&from_centre) - point
    };
    let corners: Vec<_> = opening.rim_m.iter().map(across).collect();
    let edges = || corners.iter().zip(corners.iter().cycle().skip(1));
    let turn =
        |(a, b): (&Vector3<f64>, &Vector3<f64>)| opening.axis.dot(&a.cross(b)).atan2(a.dot(b));
    let is_around = edges().map(turn).sum::<f64>().abs() > std::f64::consts::PI;
    let distance_m = |(a, b): (&Vector3<f64>, &Vector3<f64>)| {
        let along = b - a;
        let share = (-a.dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (a + along * share).norm()
    };
    is_around || edges().map(distance_m).any(|m| m < BESIDE_RIM * opening.radius_m)
}
