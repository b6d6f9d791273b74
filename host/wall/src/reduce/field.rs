//! The stiffness of a wall along its centre lines.

use cathforce_bundle::geometry::{Branch, Wall};
use nalgebra::Vector3;

use super::errors::Errors;
use crate::error::SolveError;
use crate::load::Patch;
use crate::mesh::WallMesh;
use crate::response::WallMaterial;
use crate::solve::Solver;

/// Directions around a station in which it is pressed.
const DIRECTIONS: usize = 3;
/// A wall farther from the centre line than this many radii belongs to another branch.
const FAR: f64 = 1.6;
/// Steps and end \[m\] of the way to the wall.
const MARCH: usize = 60;
const THERE_M: f64 = 5e-6;
/// The lumen stores a stiffness in sixteenths of a doubling.
const CODES_A_DOUBLING: f64 = 16.0;

/// A place on a centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    pub position_m: Vector3<f64>,
    pub tangent: Vector3<f64>,
    pub radius_m: f64,
    /// Length of the branch that it stands for \[m\].
    pub length_m: f64,
}

/// A piece of instrument on the wall beside a station.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    pub station: usize,
    pub patch: Patch,
}

/// A station and the stiffness of one contact point there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StationStiffness {
    pub station: Station,
    /// \[N/m\], from the mean compliance of its directions.
    pub stiffness_n_per_m: f64,
    pub directions: usize,
}

/// The stiffness field of a wall.
#[derive(Clone, Debug)]
pub struct Field {
    pub stations: Vec<StationStiffness>,
    /// Median of the stations \[N/m\].
    pub nominal_n_per_m: f64,
    /// Displacement by the field over that by finite elements, less 1, at the directions of each
    /// station.
    pub around: Errors,
    /// Likewise half-way between stations, which no station has seen.
    pub between: Errors,
    /// Displacement one contact spacing beside a load over that under it, median.
    pub spread: f64,
}

/// Displacement by 1 N under a probe, and beside it where there is a wall \[mm/N\].
type Compliance = (f64, Option<f64>);

/// Stations in the middle of equal parts of each branch, at most `every_m` long.
pub fn stations(branches: &[Branch], every_m: f64) -> Vec<Station> {
    let mut all = Vec::new();
    for branch in branches {
        let ([first, ..], [.., last]) = (&branch.stations[..], &branch.stations[..]) else {
            continue;
        };
        let length_m = last.s_m - first.s_m;
        let parts = (length_m / every_m).ceil().max(1.0) as usize;
        let part_m = length_m / parts as f64;
        all.extend((0..parts).filter_map(|k| {
            let s_m = first.s_m + part_m * (k as f64 + 0.5);
            let after = branch.stations.iter().position(|station| station.s_m >= s_m)?.max(1);
            let (a, b) = (&branch.stations[after - 1], &branch.stations[after]);
            let share = (s_m - a.s_m) / (b.s_m - a.s_m);
            Some(Station {
                position_m: a.position_m.lerp(&b.position_m, share),
                tangent: (b.position_m - a.position_m).try_normalize(1e-12)?,
                radius_m: a.radius_m + (b.radius_m - a.radius_m) * share,
                length_m: part_m,
            })
        }));
    }
    all
}

/// Pieces of instrument around each station, `half_axes_mm` along it and across it. A station in
/// whose direction another branch opens has none there.
pub fn probes(wall: &dyn Wall, stations: &[Station], half_axes_mm: [f64; 2]) -> Vec<Probe> {
    let around = |(station, place): (usize, &Station)| {
        let least = Vector3::ith(place.tangent.iamin(), 1.0);
        let across = place.tangent.cross(&least).normalize();
        let beside = place.tangent.cross(&across);
        let place = *place;
        (0..DIRECTIONS).filter_map(move |k| {
            // A station is turned against the one before, so that no side is always missed.
            let angle =
                std::f64::consts::TAU * (k as f64 / DIRECTIONS as f64 + 0.15 * station as f64);
            let outwards = across * angle.cos() + beside * angle.sin();
            let patch = patch_on(wall, &place, &outwards, half_axes_mm)?;
            Some(Probe { station, patch })
        })
    };
    stations.iter().enumerate().flat_map(around).collect()
}

fn patch_on(
    wall: &dyn Wall,
    station: &Station,
    outwards: &Vector3<f64>,
    half_axes_mm: [f64; 2],
) -> Option<Patch> {
    let mut at_m = station.position_m;
    for _ in 0..MARCH {
        let seen = wall.sample(&at_m);
        if seen.beyond_m > 0.0 || (at_m - station.position_m).norm() > FAR * station.radius_m {
            return None;
        }
        if seen.distance_m.abs() < THERE_M {
            let direction = -seen.normal.try_normalize(1e-6)?;
            let along = station.tangent - direction * station.tangent.dot(&direction);
            let along = along.try_normalize(1e-3)?;
            return Some(Patch { centre_mm: at_m * 1e3, direction, along, half_axes_mm });
        }
        at_m += outwards * seen.distance_m.max(-THERE_M);
    }
    None
}

/// Presses every probe with a small force; one factorisation serves all.
///
/// `between`: probes half-way between the stations, whose `station` is the one that stands for them.
pub fn stiffness_field(
    mesh: &WallMesh,
    solver: &mut Solver,
    material: &WallMaterial,
    stations: &[Station],
    [probes, between]: [&[Probe]; 2],
    spacing_mm: f64,
) -> Result<Field, SolveError> {
    let pressed = compliances(mesh, solver, material, probes, spacing_mm)?;
    let mut found = Vec::new();
    let mut of_station = vec![None; stations.len()];
    for (index, station) in stations.iter().enumerate() {
        let own = probes.iter().zip(&pressed).filter(|(probe, _)| probe.station == index);
        let own: Vec<f64> = own.filter_map(|(_, pressed)| Some(pressed.as_ref()?.0)).collect();
        if own.is_empty() {
            continue;
        }
        let mean = own.iter().sum::<f64>() / own.len() as f64;
        of_station[index] = Some(found.len());
        let stiffness_n_per_m = 1e3 / mean;
        found.push(StationStiffness {
            station: *station,
            stiffness_n_per_m,
            directions: own.len(),
        });
    }
    let nominal_n_per_m = median(found.iter().map(|s| s.stiffness_n_per_m)).unwrap_or(0.0);
    let stored = |index: usize| {
        let at: usize = of_station[index]?;
        Some(nominal_n_per_m * stored_ratio(found[at].stiffness_n_per_m / nominal_n_per_m))
    };
    let errors = |probes: &[Probe], pressed: &[Option<Compliance>]| {
        Errors::of(probes.iter().zip(pressed).filter_map(|(probe, pressed)| {
            let compliance = pressed.as_ref()?.0;
            Some(1e3 / stored(probe.station)? / compliance - 1.0)
        }))
    };
    let around = errors(probes, &pressed);
    let between_pressed = compliances(mesh, solver, material, between, spacing_mm)?;
    let spreads = pressed.iter().flatten().filter_map(|(own, beside)| Some(beside.as_ref()? / own));
    Ok(Field {
        nominal_n_per_m,
        around,
        between: errors(between, &between_pressed),
        spread: median(spreads).unwrap_or(0.0),
        stations: found,
    })
}

/// Displacement by 1 N under each probe \[mm/N\], and one spacing beside it; `None` off the mesh.
fn compliances(
    mesh: &WallMesh,
    solver: &mut Solver,
    material: &WallMaterial,
    probes: &[Probe],
    spacing_mm: f64,
) -> Result<Vec<Option<Compliance>>, SolveError> {
    let shares: Vec<Option<Vec<f64>>> =
        probes.iter().map(|probe| probe.patch.shares(mesh).ok()).collect();
    let loaded = probes.iter().zip(&shares);
    let loads: Vec<_> = loaded
        .filter_map(|(probe, shares)| Some(probe.patch.forces_n(shares.as_ref()?, 1.0)))
        .collect();
    let mut solutions = solver.small(material, &loads)?.into_iter();
    let pressed = probes.iter().zip(&shares).map(|(probe, shares)| {
        let (shares, solution) = (shares.as_ref()?, solutions.next()?);
        let patch = &probe.patch;
        let beside = Patch { centre_mm: patch.centre_mm + patch.along * spacing_mm, ..*patch };
        let beside = beside.shares(mesh).ok().map(|s| patch.displacement_mm(&s, &solution));
        Some((patch.displacement_mm(shares, &solution), beside))
    });
    Ok(pressed.collect())
}

/// A ratio as the lumen stores it.
pub(crate) fn stored_ratio(ratio: f64) -> f64 {
    let code = (CODES_A_DOUBLING * ratio.clamp(0.01, 100.0).log2()).round();
    (code / CODES_A_DOUBLING).exp2()
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
