//! The error of the nominal model over inserted length and time.
//!
//! A point on the shape is shown at its arc length from the entry. A force comes from the whole inserted
//! length and cannot be localised by one sample, so it is shown at the inserted length.

use crate::explaining::locate::arc_range;
use crate::fitting::problem::Problem;
use crate::plant::{Quantity, Units};
use crate::scoring::score::{Score, root_mean_square};

/// Columns and rows at most; where there are fewer times or points, no more than these.
const COLUMNS: usize = 40;
const ROWS: usize = 12;
/// Trials that are drawn at most: those with the largest error.
const TRIALS: usize = 6;

/// A quantity of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    pub quantity: Quantity,
    pub units: Units,
    pub trial: u32,
    /// Of the first and the last column's outer edge.
    pub t_s: [f64; 2],
    /// Of the first and the last row's outer edge: arc length from the entry, or position of a
    /// drive.
    pub arc_m: [f64; 2],
    /// Root mean square of the held-out error, of a vector its norm, in the quantity's unit.
    pub rms: f64,
    /// The same of the floor.
    pub floor: f64,
    /// The same of the error by row, by column; `None` where nothing was compared.
    pub cells: Vec<Vec<Option<f64>>>,
}

/// Maps of the force and of the shape as far as they were measured, trial by trial. `score`: the
/// nominal model's.
pub fn maps(problem: &Problem<'_>, score: &Score) -> Vec<Map> {
    let [low, high] = arc_range(problem.plant);
    let arc_m = [low.min(0.0), high];
    let of = |quantity: Quantity| {
        let trials = 0..problem.plant.trials().len();
        let mut own: Vec<Map> =
            trials.filter_map(|trial| map(problem, score, quantity, trial, arc_m)).collect();
        own.sort_by(|a, b| b.rms.total_cmp(&a.rms));
        own.truncate(TRIALS);
        own.sort_by_key(|map| map.trial);
        own
    };
    let mut forces = of(Quantity::Force);
    if forces.is_empty() {
        forces = of(Quantity::DriveForce);
    }
    forces.into_iter().chain(of(Quantity::Shape)).collect()
}

/// `None` where nothing of the quantity was compared.
fn map(
    problem: &Problem<'_>,
    score: &Score,
    quantity: Quantity,
    trial: usize,
    arc_m: [f64; 2],
) -> Option<Map> {
    let plant = problem.plant;
    let channels = plant.channels();
    let count = channels.iter().filter(|channel| channel.quantity == quantity).count();
    // Three channels are one point in space.
    let axes = count.min(3);
    let errors: Vec<(f64, f64, f64)> = plant.trials()[trial]
        .samples
        .iter()
        .enumerate()
        .filter(|(_, sample)| channels[sample.channel].quantity == quantity)
        .filter_map(|(i, sample)| {
            let at_m = sample.arc_m * plant.along(trial, sample.channel);
            Some((sample.t_s, at_m, score.error(problem, trial, i)?))
        })
        .collect();
    let (t_s, columns) = columns(errors.iter().map(|(t_s, ..)| *t_s))?;
    let rows = match quantity {
        // As many as there are points: between two of them no row is left out.
        Quantity::Shape => (count / axes).clamp(1, ROWS),
        _ => ROWS,
    };
    let mut sums = vec![vec![(0.0, 0_usize); columns]; rows];
    for (at_s, at_m, error) in &errors {
        let sum = &mut sums[part(arc_m, rows, *at_m)][part(t_s, columns, *at_s)];
        *sum = (sum.0 + error * error, sum.1 + 1);
    }
    let cell = |&(sum, count): &(f64, usize)| {
        (count > 0).then(|| (axes as f64 * sum / count as f64).sqrt())
    };
    Some(Map {
        quantity,
        units: plant.units(),
        trial: plant.trials()[trial].number,
        t_s,
        arc_m,
        rms: score.rms_of(problem, quantity, trial)?,
        floor: root_mean_square(problem, quantity, |t, i| {
            (t == trial && score.residuals[t][i].is_some()).then(|| 1.0 / problem.weights(t)[i])
        })?,
        cells: sums.iter().map(|row| row.iter().map(cell).collect()).collect(),
    })
}

/// Edges of the first and last column and how many there are, not narrower than the times are
/// usually apart, and the first and the last time in the middle of theirs.
fn columns(times: impl Iterator<Item = f64>) -> Option<([f64; 2], usize)> {
    let mut times: Vec<f64> = times.collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let (first, last) = (*times.first()?, *times.last()?);
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
    let t_s = [first - 0.5 * step, last + 0.5 * step];
    Some((t_s, (((t_s[1] - t_s[0]) / step).round() as usize).clamp(1, COLUMNS)))
}

/// Which of equal parts a value is in; what is between two is in the lower one, so that points that
/// are as far apart as parts are wide leave none out between the entry and the last of them.
fn part(range: [f64; 2], parts: usize, value: f64) -> usize {
    /// Of a part; less is rounding.
    const ROUNDING: f64 = 1e-6;
    let share = (value - range[0]) / (range[1] - range[0]).max(f64::MIN_POSITIVE);
    let above = (share * parts as f64 - ROUNDING).max(0.0).floor() as usize;
    above.min(parts - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::toy::{Toy, explained_by};

    #[test]
    fn an_error_stands_where_and_when_it_was_made() {
        // 4 s of which 0.1 m are fed; from 3 s on what is measured is 0.5 N more than predicted.
        let at = |i: usize| i as f64 * 1e-3;
        let measured = (0..4000).map(|i| if at(i) < 3.0 { 0.0 } else { 0.5 });
        let toy = Toy::new(1e-3, 0.01, measured, |_, _| 0.0).fed(|i| 0.025 * at(i)).times(2);
        let maps = explained_by(&toy, &[], |selector, selection| {
            maps(selector.problem, &selection.nominal.score)
        });
        let [first, second] = maps.as_slice() else { panic!("{} maps", maps.len()) };
        assert_eq!([first.trial, second.trial], [0, 1]);
        assert_eq!(*first, Map { trial: 0, ..second.clone() });
        assert!((first.rms - 0.25).abs() < 1e-9, "{}", first.rms);
        assert!((first.floor - 0.01).abs() < 1e-9, "{}", first.floor);
        assert!((first.t_s[0] + 5e-4).abs() < 1e-9 && (first.t_s[1] - 3.9995).abs() < 1e-9);
        assert_eq!([first.cells.len(), first.cells[0].len()], [ROWS, COLUMNS]);
        for (k, row) in first.cells.iter().enumerate() {
            for (c, cell) in row.iter().enumerate() {
                // A straight line from the entry at the beginning to the top at the end.
                let apart = (k as f64 + 0.5) / ROWS as f64 - (c as f64 + 0.5) / COLUMNS as f64;
                let is_near = apart.abs() < 0.5 / ROWS as f64 - 0.5 / COLUMNS as f64;
                let is_far = apart.abs() > 0.5 / ROWS as f64 + 0.5 / COLUMNS as f64 + 1e-3;
                let expected = if c < 30 { 0.0 } else { 0.5 };
                match cell {
                    Some(error) => {
                        assert!(!is_far && (error - expected).abs() < 1e-3, "{k}, {c}: {error}");
                    }
                    None => assert!(!is_near, "{k}, {c}"),
                }
            }
        }
    }

    #[test]
    fn columns_are_not_narrower_than_measurements_are_apart() {
        let (t_s, count) = columns([0.5, 0.0, 1.0, 0.5, 2.5, 2.0].into_iter()).unwrap();
        assert_eq!((t_s, count), ([-0.25, 2.75], 6));
        assert_eq!(columns((0..500).map(f64::from)).unwrap(), ([-0.5, 499.5], COLUMNS));
        assert_eq!(columns([3.0].into_iter()).unwrap(), ([2.5, 3.5], 1));
        assert!(columns(std::iter::empty()).is_none());
    }

    #[test]
    fn points_along_what_is_inside_leave_no_part_of_it_out() {
        const POINTS: usize = 7;
        for inside_m in [0.01, 0.055, 0.11, 0.12] {
            let range = [0.0, 0.12];
            let mut parts: Vec<usize> = (1..=POINTS)
                .map(|k| part(range, POINTS, inside_m * k as f64 / POINTS as f64))
                .collect();
            parts.dedup();
            let last = part(range, POINTS, inside_m);
            assert_eq!(parts, (0..=last).collect::<Vec<_>>(), "{inside_m}");
        }
        assert_eq!(part([1.0, 1.0], 3, 1.0), 0);
    }
}
