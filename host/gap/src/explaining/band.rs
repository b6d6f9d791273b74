//! How far the forces of a device may be off: a band in which nine of ten true forces lie,
//! tabulated over what a device knows in every tick.
//!
//! The error that a model makes on a trial which it has not seen has a variance that is estimated
//! twice, by what is known of the model and by what was found (docs/explanation/diagnosis.md (D17)):
//!
//! > v = ½ (j Σ jᵀ + Σ_k s_k² + m²) + ½ (e² − n²)₊
//!
//! with j the derivatives with respect to the fitted parameters and Σ their posterior
//! (see `estimate`), s_k what a standard deviation of each nuisance
//! does (a device knows none of them), m what the model leaves open (resolution, uncertain wall), e
//! the error where the sample's trial was held out, and n the sensor's noise. The mean of v is
//! taken over neighbouring insertions, apart for feed and withdrawal. What a band lacks or has too
//! much of is mended by one factor κ a channel, so that it holds nine of ten held-out samples:
//!
//! > |e| ≤ √(κ² v + (1.645 n)²)
//!
//! The band that is stated, κ √v, is of the force: noise of the sensor is no part of it. None is stated in
//! rows of which a fork decides more than a tenth of the forces.

use cathforce_recording::{COLUMNS, Coverage};
use serde::{Deserialize, Serialize};

use crate::deciding::interval::{NORMAL_NINETY, posterior};
use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::Problem;
use crate::plant::{At, Plant, Quantity};
use crate::scoring::candidate::Candidate;
use crate::scoring::folds::Folds;
use crate::scoring::metric::Metric;
use crate::scoring::score::fold_steps;

/// Insertions at which a band is stated, as many as a device takes.
pub const ROWS: usize = 24;
/// Share of the true forces that a band holds.
const HELD: f64 = 0.9;
/// Fewest samples that say how wide a channel's band is.
const FEWEST: usize = 40;
/// Rows to either side that a row is averaged with, with weights of a bell one row wide.
const AROUND: usize = 3;
/// Share of a row's samples, decided by forks, from which on no band is stated there: nine of ten forces
/// would not lie in it.
const FORKED: f64 = 1.0 - HELD;
/// The narrowest step between two rows \[m\].
const LEAST_STEP_M: f64 = 1e-3;

/// Half widths at one insertion \[N\]; `None` where nothing was measured near it, or a fork decides.
pub type Row = [Option<f64>; COLUMNS];

/// Half widths of the band in which nine of ten true forces lie.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Insertion of the first row, and between two \[m\].
    pub from_m: f64,
    pub step_m: f64,
    /// While the instrument was last fed, and while it was last withdrawn.
    pub feed: Vec<Row>,
    pub withdrawal: Vec<Row>,
    /// Of samples whose trial was held out: from the band as from the parameters.
    pub coverage: Coverage,
}

/// One held-out sample of a force.
struct Error {
    column: usize,
    fold: usize,
    at: At,
    error_n: f64,
    noise_n: f64,
    /// v of the module's comment.
    variance_n2: f64,
}

/// The band of a model, and how many held-out samples it holds. `None` for plants without three
/// force channels, and without anything held out.
pub fn of(problem: &Problem<'_>, folds: &Folds, model: &Candidate) -> Option<Band> {
    let base: Vec<_> = model.fit.trials.iter().map(|trial| trial.raw.clone()).collect();
    let nuisances = Nuisances::at(problem, &model.fit.point, &base)?;
    let errors = errors(problem, folds, model, &nuisances)?;
    let forks = problem.plant.trials().iter().flat_map(|trial| trial.forks.iter().copied());
    let grid = Grid::of(&errors, &forks.collect::<Vec<_>>())?;
    let mut coverage = Coverage::default();
    for fold in 0..folds.count {
        let (own, others): (Vec<&Error>, Vec<&Error>) =
            errors.iter().partition(|error| error.fold == fold);
        let table = Table::of(grid, &others);
        for error in own {
            let width = table.half_width_n(error.at, error.column);
            coverage.channels[error.column].count(width, error.error_n, error.noise_n);
        }
    }
    let table = Table::of(grid, &errors.iter().collect::<Vec<_>>());
    let [feed, withdrawal] = [false, true].map(|withdrawn| table.rows(withdrawn));
    Some(Band { from_m: grid.from_m, step_m: grid.step_m, feed, withdrawal, coverage })
}

/// The column of every channel of a plant, if it is one of a band's.
pub fn columns(plant: &dyn Plant) -> Option<Vec<Option<usize>>> {
    let mut forces = 0..COLUMNS - 1;
    let column = |quantity| match quantity {
        Quantity::Force => forces.next(),
        Quantity::DriveForce => Some(COLUMNS - 1),
        Quantity::Tip | Quantity::Shape => None,
    };
    let columns = plant.channels().iter().map(|channel| channel.quantity).map(column).collect();
    forces.is_empty().then_some(columns)
}

fn errors(
    problem: &Problem<'_>,
    folds: &Folds,
    model: &Candidate,
    nuisances: &Nuisances,
) -> Option<Vec<Error>> {
    let columns = columns(problem.plant)?;
    let metric = Metric::new(nuisances, &model.score);
    let posterior = posterior(problem, folds, model, &metric);
    let steps = fold_steps(problem, folds, &model.fit);
    let mut errors = Vec::new();
    for (t, (trial, fitted)) in problem.plant.trials().iter().zip(&model.fit.trials).enumerate() {
        let places = At::of_samples(&trial.samples);
        for (i, sample) in trial.samples.iter().enumerate() {
            let Some(column) = columns[sample.channel].filter(|_| folds.scored[t][i]) else {
                continue;
            };
            let fold = folds.of_sample[t][i];
            let sd = 1.0 / problem.weights(t)[i];
            let by_parameters = fitted.raw_jacobian.row(i);
            let error_n = sd * (fitted.raw[i] + (by_parameters * &steps[fold])[(0, 0)]);
            let open = (by_parameters * &posterior * by_parameters.transpose())[(0, 0)].max(0.0)
                + nuisances.scaled(t).row(i).norm_squared();
            let known = sd * sd * open + sample.model.powi(2);
            let found = (error_n.powi(2) - sample.noise.powi(2)).max(0.0);
            errors.push(Error {
                column,
                fold,
                at: places[i],
                error_n,
                noise_n: sample.noise,
                variance_n2: 0.5 * (known + found),
            });
        }
    }
    Some(errors)
}

/// Insertions of the rows.
#[derive(Clone, Copy)]
struct Grid {
    from_m: f64,
    step_m: f64,
    /// By direction and row, whether a fork decides the forces there.
    forked: [[bool; ROWS]; 2],
}

impl Grid {
    fn of(errors: &[Error], forks: &[At]) -> Option<Self> {
        let insertions = || errors.iter().map(|error| error.at.insertion_m);
        let from_m = insertions().reduce(f64::min)?.max(0.0);
        let to_m = insertions().reduce(f64::max)?;
        let step_m = ((to_m - from_m) / (ROWS - 1) as f64).max(LEAST_STEP_M);
        let mut grid = Self { from_m, step_m, forked: [[false; ROWS]; 2] };
        let mut counts = [[[0_usize; 2]; ROWS]; 2];
        let compared = errors.iter().map(|error| (error.at, 0));
        for (at, which) in compared.chain(forks.iter().map(|at| (*at, 1))) {
            counts[usize::from(at.withdrawn)][grid.row(at.insertion_m)][which] += 1;
        }
        let is_forked =
            |[compared, decided]: [usize; 2]| decided as f64 > FORKED * (compared + decided) as f64;
        grid.forked = counts.map(|rows| rows.map(is_forked));
        Some(grid)
    }

    /// The nearest row.
    fn row(&self, insertion_m: f64) -> usize {
        (self.place(insertion_m).round().max(0.0) as usize).min(ROWS - 1)
    }

    fn place(&self, insertion_m: f64) -> f64 {
        (insertion_m - self.from_m) / self.step_m
    }
}

/// Mean variances by direction and row, and the factor that a channel's widths take.
struct Table {
    grid: Grid,
    variance_n2: [Vec<Row>; 2],
    factor: [Option<f64>; COLUMNS],
}

impl Table {
    fn of(grid: Grid, errors: &[&Error]) -> Self {
        let mut sums = vec![[[(0.0, 0.0); COLUMNS]; ROWS]; 2];
        for error in errors {
            let row = grid.row(error.at.insertion_m);
            let sum = &mut sums[usize::from(error.at.withdrawn)][row][error.column];
            *sum = (sum.0 + error.variance_n2, sum.1 + 1.0);
        }
        let mean = |direction: usize, row: usize, column: usize| {
            let (mut sum, mut count) = (0.0, 0.0);
            for (near, own) in sums[direction].iter().enumerate() {
                let away = near.abs_diff(row);
                if away <= AROUND {
                    let weight = (-0.5 * (away as f64).powi(2)).exp();
                    let own: (f64, f64) = own[column];
                    (sum, count) = (sum + weight * own.0, count + weight * own.1);
                }
            }
            (count > 0.0 && !grid.forked[direction][row]).then(|| sum / count)
        };
        let row = |direction, row| std::array::from_fn(|column| mean(direction, row, column));
        let variance_n2 = [0, 1].map(|d| (0..ROWS).map(|k| row(d, k)).collect());
        let mut table = Self { grid, variance_n2, factor: [None; COLUMNS] };
        table.factor = std::array::from_fn(|column| table.factor(column, errors));
        table
    }

    /// Between two rows; `None` outside of them.
    fn variance_n2(&self, at: At, column: usize) -> Option<f64> {
        let rows = &self.variance_n2[usize::from(at.withdrawn)];
        between(rows, self.grid.place(at.insertion_m), column)
    }

    /// κ.
    fn factor(&self, column: usize, errors: &[&Error]) -> Option<f64> {
        let own = errors.iter().filter(|error| error.column == column);
        // The factor at which each of them would be at the edge.
        let edge = |error: &&Error| {
            let beyond = error.error_n.powi(2) - (NORMAL_NINETY * error.noise_n).powi(2);
            Some((beyond.max(0.0) / self.variance_n2(error.at, column)?.max(1e-18)).sqrt())
        };
        let mut edges: Vec<f64> = own.filter_map(edge).collect();
        edges.sort_by(f64::total_cmp);
        let ninety = (HELD * edges.len() as f64).ceil() as usize;
        if edges.len() < FEWEST { None } else { edges.get(ninety.min(edges.len() - 1)).copied() }
    }

    fn half_width_n(&self, at: At, column: usize) -> Option<f64> {
        Some(self.factor[column]? * self.variance_n2(at, column)?.sqrt())
    }

    fn rows(&self, withdrawn: bool) -> Vec<Row> {
        let row = |row: &Row| {
            std::array::from_fn(|column| Some(self.factor[column]? * row[column]?.sqrt()))
        };
        self.variance_n2[usize::from(withdrawn)].iter().map(row).collect()
    }
}

impl Band {
    /// The half width at a place \[N\], as a device has it.
    pub fn half_width_n(&self, at: At, column: usize) -> Option<f64> {
        let rows = if at.withdrawn { &self.withdrawal } else { &self.feed };
        between(rows, (at.insertion_m - self.from_m) / self.step_m, column)
    }
}

fn between(rows: &[Row], place: f64, column: usize) -> Option<f64> {
    let last = rows.len().checked_sub(1)?;
    // A place between the last row and the rounding of its own insertion is at it.
    if !(-1e-9..=last as f64 + 1e-9).contains(&place) {
        return None;
    }
    let low = (place.max(0.0) as usize).min(last);
    let (from, to) = (rows[low][column]?, rows[(low + 1).min(last)][column]?);
    Some(from + (place - low as f64).clamp(0.0, 1.0) * (to - from))
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Errors whose size grows with insertion and is twice as large in withdrawal.
    fn errors(folds: usize) -> Vec<Error> {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        // Of variance 1.
        let mut normal = || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
        let mut errors = Vec::new();
        for k in 0..folds * 2000 {
            let share = (k / folds) as f64 / 2000.0;
            let withdrawn = k % 3 == 0;
            let sd = 0.01 * (1.0 + share) * if withdrawn { 2.0 } else { 1.0 };
            let noise_n = 0.004;
            errors.push(Error {
                column: k % 2,
                fold: k % folds,
                at: At { insertion_m: 0.05 + 0.1 * share, withdrawn },
                error_n: sd * normal() + noise_n * normal(),
                noise_n,
                // What is known is wrong by a factor that is the same everywhere.
                variance_n2: (0.3 * sd).powi(2),
            });
        }
        errors
    }

    #[test]
    fn a_band_holds_nine_of_ten_forces_and_follows_their_spread() {
        let errors = errors(1);
        let grid = Grid::of(&errors, &[]).unwrap();
        let table = Table::of(grid, &errors.iter().collect::<Vec<_>>());
        let width =
            |insertion_m, withdrawn| table.half_width_n(At { insertion_m, withdrawn }, 0).unwrap();
        for (insertion_m, withdrawn, sd) in
            [(0.05, false, 0.01), (0.149, false, 0.0198), (0.1, true, 0.03)]
        {
            let ratio = width(insertion_m, withdrawn) / (NORMAL_NINETY * sd);
            assert!((ratio - 1.0).abs() < 0.1, "{insertion_m} {withdrawn}: {ratio}");
        }
        assert_eq!(table.half_width_n(At { insertion_m: 0.05, withdrawn: false }, 2), None);
        assert_eq!(table.half_width_n(At { insertion_m: 0.16, withdrawn: false }, 0), None);
    }

    #[test]
    fn no_band_is_stated_where_a_fork_decides() {
        let errors = errors(1);
        let own: Vec<&Error> = errors.iter().collect();
        let at = |insertion_m| At { insertion_m, withdrawn: false };
        let near = own.iter().filter(|e| (e.at.insertion_m - 0.1).abs() < 0.002 && !e.at.withdrawn);
        let few = vec![at(0.1); near.count() / 20];
        let table = Table::of(Grid::of(&errors, &few).unwrap(), &own);
        assert!(table.half_width_n(at(0.1), 0).is_some());
        let many = vec![at(0.1); 5 * few.len()];
        let forked = Table::of(Grid::of(&errors, &many).unwrap(), &own);
        assert_eq!(forked.half_width_n(at(0.1), 0), None);
        assert!(forked.half_width_n(At { withdrawn: true, ..at(0.1) }, 0).is_some());
        assert!(forked.half_width_n(at(0.12), 0).is_some());
        assert_eq!(forked.rows(false).iter().filter(|row| row[0].is_none()).count(), 1);
    }

    #[test]
    fn what_is_outside_of_a_band_is_counted_apart() {
        let mut covered = cathforce_recording::Covered::default();
        for (width, error) in [(Some(0.01), 0.012), (Some(0.01), -0.02), (None, 0.0)] {
            covered.count(width, error, 0.005);
        }
        assert_eq!((covered.stated, covered.within, covered.unknown), (2, 1, 1));
        assert_eq!(covered.share(), Some(0.5));
        assert!((covered.half_width_n().unwrap() - 0.01).abs() < 1e-12);
    }
}
