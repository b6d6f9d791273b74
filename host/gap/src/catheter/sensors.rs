//! Checks of sensor columns: their noise, whether they are connected, whether they are at a limit.

use cathforce_bundle::bundle::VectorColumn;

use super::column::{Column, Source};
use crate::plant::Quantity;

/// Fewest rows of which it means something that they are all the same.
const DEAD_ROWS: usize = 20;
/// Rows in a row with the same reading that no sensor with noise has.
const HELD_ROWS: usize = 10;
/// Shares of the rows that are held: at the largest or smallest reading from which on it is a
/// limit, and elsewhere from which on the sensor is only coarse.
const AT_LIMIT: f64 = 0.02;
const COARSE: f64 = 0.002;

/// A reading at which a sensor has stuck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    pub source: Source,
    pub value: f64,
    /// Share of the rows.
    pub share: f64,
}

/// Takes out what never changes, which no sensor with noise does.
pub fn take_dead(columns: &mut Vec<Column>) -> Vec<&'static str> {
    let mut dead = Vec::new();
    for (quantity, what) in [
        (Quantity::Force, "the force"),
        (Quantity::DriveForce, "the drive force"),
        (Quantity::Tip, "the tip"),
    ] {
        let own = |column: &Column| column.source.channel().quantity == quantity;
        let still = |column: &Column| {
            column.rows.len() >= DEAD_ROWS
                && column.rows.iter().all(|(_, value)| *value == column.rows[0].1)
        };
        if columns.iter().any(own) && columns.iter().filter(|c| own(c)).all(still) {
            columns.retain(|column| !own(column));
            dead.push(what);
        }
    }
    dead
}

/// The largest and the smallest reading, where a column stays at them and nowhere else.
pub fn limits(column: &Column) -> Vec<Limit> {
    let values: Vec<f64> = column.rows.iter().map(|(_, value)| *value).collect();
    let rows = values.len() as f64;
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
    let (mut at, mut elsewhere) = ([0_usize; 2], 0);
    for run in values.chunk_by(|a, b| a == b).filter(|run| run.len() >= HELD_ROWS) {
        match run[0] {
            value if value == largest => at[0] += run.len(),
            value if value == smallest => at[1] += run.len(),
            _ => elsewhere += run.len(),
        }
    }
    if largest == smallest || elsewhere as f64 > COARSE * rows {
        return Vec::new();
    }
    let limit = |(value, held): (f64, usize)| {
        let share = held as f64 / rows;
        (share >= AT_LIMIT).then_some(Limit { source: column.source, value, share })
    };
    [(largest, at[0]), (smallest, at[1])].into_iter().filter_map(limit).collect()
}

/// White noise of the points on a shape \[m\], from the last of them: it is the entry, where the
/// instrument is clamped, so that all of its spread is noise. The other points move between two
/// shapes by more than their noise.
///
/// `None`: too few shapes, or an entry that was put there and not measured.
pub fn shape_noise_m(shape_m: &[VectorColumn]) -> Option<f64> {
    /// Fewest shapes; three axes of so many give the noise to a fifth.
    const SHAPES: usize = 6;
    let entry: Vec<[f64; 3]> = shape_m.last()?.iter().copied().flatten().collect();
    if entry.len() < SHAPES {
        return None;
    }
    let count = entry.len() as f64;
    let squares = |axis: usize| {
        let mean = entry.iter().map(|p| p[axis]).sum::<f64>() / count;
        entry.iter().map(|p| (p[axis] - mean).powi(2)).sum::<f64>()
    };
    let variance = (0..3).map(squares).sum::<f64>() / (3.0 * (count - 1.0));
    Some(variance.sqrt()).filter(|noise| *noise > 0.0)
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn column(value: impl Fn(usize) -> f64) -> Column {
        let rows = (0..400).map(|row| (row, value(row))).collect();
        Column { source: Source::Force(0), rows, noise: 0.01, estimated: false }
    }

    fn noisy(row: usize) -> f64 {
        (row as f64 * 0.02).sin() + 1e-3 * ((row * 7919) % 101) as f64
    }

    #[test]
    fn a_reading_cut_off_at_both_ends_has_two_limits() {
        let limits = limits(&column(|row| noisy(row).clamp(-0.5, 0.7)));
        let values: Vec<f64> = limits.iter().map(|limit| limit.value).collect();
        assert_eq!(values, [0.7, -0.5]);
        assert!(limits.iter().all(|limit| limit.share > 0.1 && limit.share < 0.5));
    }

    #[test]
    fn noise_and_coarse_steps_have_no_limit() {
        assert_eq!(limits(&column(noisy)), []);
        assert_eq!(limits(&column(|row| (4.0 * noisy(row)).round())), []);
    }

    #[test]
    fn only_a_quantity_that_never_changes_on_any_axis_is_dead() {
        let axis =
            |axis, value: fn(usize) -> f64| Column { source: Source::Force(axis), ..column(value) };
        let mut columns = vec![axis(0, noisy), axis(1, |_| 0.0), axis(2, |_| 0.0)];
        assert_eq!(take_dead(&mut columns), Vec::<&str>::new());
        columns[0] = axis(0, |_| 0.1);
        assert_eq!(take_dead(&mut columns), ["the force"]);
        assert!(columns.is_empty());
    }

    #[test]
    fn the_noise_of_a_shape_is_that_of_its_entry_however_the_tip_moves() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut noise = || [(); 3].map(|()| 5e-4 * 12.0_f64.sqrt() * rng.random_range(-0.5..0.5));
        let entry: VectorColumn = (0..80).map(|_| Some(noise())).collect();
        let tip: VectorColumn =
            (0..80).map(|k| Some([0.02 + 6e-3 * f64::from(k), 0.0, 0.0])).collect();
        let found = shape_noise_m(&[tip.clone(), entry.clone()]).unwrap();
        assert!((found / 5e-4 - 1.0).abs() < 0.15, "{found}");
        assert_eq!(shape_noise_m(&[tip.clone(), entry[..5].to_vec()]), None);
        assert_eq!(shape_noise_m(&[tip, vec![Some([0.0; 3]); 80]]), None);
        assert_eq!(shape_noise_m(&[]), None);
    }
}
