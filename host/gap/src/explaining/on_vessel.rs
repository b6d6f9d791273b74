//! The error of the nominal model on the vessel.
//!
//! A point on the shape is shown where it was. One sample does not tell where along the instrument a force
//! arose, so a force is shown where the tip was.

use std::collections::BTreeMap;

use crate::fitting::problem::Problem;
use crate::plant::Quantity;
use crate::plant::Silhouette;
use crate::scoring::score::{Score, root_mean_square};

/// Squares along the longer side of the vessel.
const SQUARES: f64 = 64.0;

/// Errors over the vessel, seen from one side.
#[derive(Clone, Debug, PartialEq)]
pub struct OnVessel {
    pub silhouette: Silhouette,
    /// Of a square.
    pub side_m: f64,
    /// One a quantity.
    pub maps: Vec<VesselMap>,
}

/// A quantity of all trials.
#[derive(Clone, Debug, PartialEq)]
pub struct VesselMap {
    pub quantity: Quantity,
    pub squares: Vec<Square>,
    /// Root mean square of the held-out error, of a vector its norm, in the quantity's unit.
    pub rms: f64,
    /// The same of the floor.
    pub floor: f64,
}

/// What was compared while the tip, or a point on the shape, was in a square of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Square {
    pub centre_m: [f64; 2],
    /// As [`VesselMap::rms`].
    pub rms: f64,
    /// Of the quantity's gap above the floor.
    pub gap_share: f64,
    /// Of the quantity's samples.
    pub time_share: f64,
}

/// Maps of the force and of the shape, or of the tip where no shape was measured; `None` without a
/// vessel. `score`: the nominal model's.
pub fn on_vessel(problem: &Problem<'_>, score: &Score) -> Option<OnVessel> {
    let silhouette = problem.plant.vessel()?;
    let [width_m, height_m] = silhouette.size_m();
    let side_m = width_m.max(height_m) / SQUARES;
    let trials = 0..problem.plant.trials().len();
    let places: Vec<Vec<[f64; 3]>> = trials.map(|t| problem.plant.places_m(t)).collect();
    let of = |quantity| map(problem, score, quantity, &places, (&silhouette, side_m));
    let first = |quantities: &[Quantity]| quantities.iter().find_map(|quantity| of(*quantity));
    let maps =
        [first(&[Quantity::Force, Quantity::DriveForce]), first(&[Quantity::Shape, Quantity::Tip])];
    let maps: Vec<VesselMap> = maps.into_iter().flatten().collect();
    (!maps.is_empty()).then_some(OnVessel { silhouette, side_m, maps })
}

/// Energy above the floor, squares of errors, and how many.
type Sums = (f64, f64, usize);

/// `None` where nothing of the quantity was compared.
fn map(
    problem: &Problem<'_>,
    score: &Score,
    quantity: Quantity,
    places: &[Vec<[f64; 3]>],
    (silhouette, side_m): (&Silhouette, f64),
) -> Option<VesselMap> {
    let channels = problem.plant.channels();
    let count = channels.iter().filter(|channel| channel.quantity == quantity).count();
    // Three channels are one point in space.
    let axes = count.min(3) as f64;
    let mut squares: BTreeMap<[i64; 2], Sums> = BTreeMap::new();
    for (t, trial) in problem.plant.trials().iter().enumerate() {
        for (i, (sample, place_m)) in trial.samples.iter().zip(&places[t]).enumerate() {
            let own = channels[sample.channel].quantity == quantity;
            let found = score.error(problem, t, i).zip(score.counts(problem, t, i));
            let Some((error, counts)) = found.filter(|_| own) else { continue };
            let at = silhouette.project(*place_m).map(|x| (x / side_m).floor() as i64);
            let sums = squares.entry(at).or_default();
            *sums = (sums.0 + counts - 1.0, sums.1 + error * error, sums.2 + 1);
        }
    }
    let whole: f64 = squares.values().map(|(energy, ..)| energy.max(0.0)).sum();
    let samples: usize = squares.values().map(|(.., count)| count).sum();
    let square = |(at, (energy, sum, count)): (&[i64; 2], &Sums)| Square {
        centre_m: at.map(|k| (k as f64 + 0.5) * side_m),
        rms: (axes * sum / *count as f64).sqrt(),
        gap_share: energy.max(0.0) / whole.max(f64::MIN_POSITIVE),
        time_share: *count as f64 / samples.max(1) as f64,
    };
    (samples > 0).then_some(())?;
    Some(VesselMap {
        quantity,
        squares: squares.iter().map(square).collect(),
        rms: score.rms(problem, quantity)?,
        floor: root_mean_square(problem, quantity, |t, i| {
            score.residuals[t][i].map(|_| 1.0 / problem.weights(t)[i])
        })?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::{Toy, explained_by};

    #[test]
    fn an_error_stands_where_the_tip_was() {
        // From one end to the other in ten steps of 10 mm, in the last two 0.5 N more than predicted.
        let step = |i: usize| i / 100;
        let measured = (0..1000).map(|i| if step(i) < 8 { 0.0 } else { 0.5 });
        let mut toy = Toy::new(0.01, 0.01, measured, |_, _| 0.0).times(2);
        let explained = |toy: &Toy<_>| {
            explained_by(toy, &[], |selector, selection| {
                on_vessel(selector.problem, &selection.nominal.score)
            })
        };
        assert_eq!(explained(&toy), None, "no vessel, no figure");
        toy.vessel = Some(Silhouette::rectangle([0.0, 0.1], [-0.01, 0.01]));
        toy.places_m = (0..1000).map(|i| [0.005 + 0.01 * step(i) as f64, 0.0, 0.3]).collect();
        let found = explained(&toy).unwrap();
        let [map] = found.maps.as_slice() else { panic!("{} maps", found.maps.len()) };
        assert_eq!((map.quantity, map.squares.len()), (Quantity::Force, 10));
        for (k, square) in map.squares.iter().enumerate() {
            let off = if k < 8 { 0.0 } else { 0.5 };
            assert!((square.centre_m[0] - toy.places_m[100 * k][0]).abs() < 0.51 * found.side_m);
            assert!((square.rms - off).abs() < 1e-9 && (square.time_share - 0.1).abs() < 1e-9);
            assert!((square.gap_share - off).abs() < 1e-9, "{square:?}");
        }
        assert!((map.rms - 0.05_f64.sqrt()).abs() < 1e-9 && (map.floor - 0.01).abs() < 1e-9);
    }
}
