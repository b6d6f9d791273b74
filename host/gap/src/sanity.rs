//! Measurements that no effect can explain, because their axes or units are not the model's.

use crate::plant::{Plant, Quantity};
use crate::problem::Problem;
use crate::select::Candidate;

/// Other axes must leave less than this share of the error that the stated ones leave, and of
/// what was measured.
const MUCH_BETTER: f64 = 0.2;
/// A factor between measured and predicted beyond which it is a unit, not a gain.
const UNIT_FACTOR: f64 = 100.0;
/// Correlation from which on the factor means anything.
const ALIKE: f64 = 0.8;

const AXES: [&str; 3] = ["x", "y", "z"];
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Measured and predicted values of the force channels, sample by sample.
struct Forces {
    measured: Vec<Vec<f64>>,
    predicted: Vec<Vec<f64>>,
}

/// Why these measurements carry no verdict; `None` when nothing is the matter.
pub fn complaint(problem: &Problem<'_>, nominal: &Candidate) -> Option<String> {
    let forces = forces(problem, nominal);
    units(&forces).or_else(|| axes(&forces))
}

fn forces(problem: &Problem<'_>, nominal: &Candidate) -> Forces {
    let plant: &dyn Plant = problem.plant;
    let force = |channel: usize| plant.channels()[channel].quantity == Quantity::Force;
    let columns: Vec<usize> = (0..plant.channels().len()).filter(|&c| force(c)).collect();
    let empty = vec![Vec::new(); columns.len()];
    let mut forces = Forces { measured: empty.clone(), predicted: empty };
    for (t, trial) in plant.trials().iter().enumerate() {
        for (i, sample) in trial.samples.iter().enumerate() {
            let Some(k) = columns.iter().position(|&c| c == sample.channel) else { continue };
            let error = nominal.fit.trials[t].raw[i] / problem.weights(t)[i];
            forces.measured[k].push(sample.value);
            forces.predicted[k].push(sample.value - error);
        }
    }
    forces
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn units(forces: &Forces) -> Option<String> {
    let sum =
        |a: &[Vec<f64>], b: &[Vec<f64>]| -> f64 { a.iter().zip(b).map(|(x, y)| dot(x, y)).sum() };
    let (yy, ff) =
        (sum(&forces.measured, &forces.measured), sum(&forces.predicted, &forces.predicted));
    let yf = sum(&forces.measured, &forces.predicted);
    if yy * ff <= 0.0 || yf.abs() < ALIKE * (yy * ff).sqrt() {
        return None;
    }
    let factor = (yy / ff).sqrt();
    (!(1.0 / UNIT_FACTOR..=UNIT_FACTOR).contains(&factor)).then(|| {
        format!(
            "the measured force is {factor:.3e} times the predicted one and otherwise alike: its \
             unit is not newton; nothing is concluded from it"
        )
    })
}

/// Whether the axes would fit far better in another order or with other signs.
fn axes(forces: &Forces) -> Option<String> {
    let (y, f) = (&forces.measured, &forces.predicted);
    if y.len() != 3 || y.iter().any(|column| column.len() != y[0].len()) {
        return None;
    }
    let power: f64 = y.iter().map(|column| dot(column, column)).sum();
    let left = |order: &[usize; 3], signs: usize| -> f64 {
        let axis = |k: usize| {
            let sign = if signs >> k & 1 == 1 { -1.0 } else { 1.0 };
            let own = &f[order[k]];
            dot(&y[k], &y[k]) - 2.0 * sign * dot(&y[k], own) + dot(own, own)
        };
        (0..3).map(axis).sum()
    };
    let stated = left(&ORDERS[0], 0);
    let all = ORDERS.iter().flat_map(|order| (0..8).map(move |signs| (order, signs)));
    let (order, signs) = all.min_by(|a, b| left(a.0, a.1).total_cmp(&left(b.0, b.1)))?;
    let best = left(order, signs);
    (best < MUCH_BETTER * stated && best < MUCH_BETTER * power).then(|| {
        let name =
            |k: usize| format!("{}{}", if signs >> k & 1 == 1 { "−" } else { "" }, AXES[order[k]]);
        format!(
            "the measured forces along x, y, z look like those along {}, {}, {} of the vessel's \
             frame: the axes are not those that rig.toml states; nothing is concluded from them",
            name(0),
            name(1),
            name(2)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forces(change: impl Fn([f64; 3]) -> [f64; 3]) -> Forces {
        let mut forces = Forces { measured: vec![Vec::new(); 3], predicted: vec![Vec::new(); 3] };
        for i in 0..200 {
            let t = f64::from(i) * 0.05;
            let force = [0.3 + 0.1 * t.sin(), 0.05 * (2.0 * t).cos(), -0.1 * t.cos()];
            for (k, value) in change(force).into_iter().enumerate() {
                forces.measured[k].push(value);
                forces.predicted[k].push(force[k]);
            }
        }
        forces
    }

    #[test]
    fn forces_as_predicted_are_not_complained_of() {
        let near = forces(|[x, y, z]| [1.4 * x, 1.4 * y, 1.4 * z + 0.02]);
        assert_eq!((units(&near), axes(&near)), (None, None));
    }

    #[test]
    fn swapped_and_turned_axes_are_named() {
        let complaint = axes(&forces(|[x, y, z]| [z, y, -x])).unwrap();
        assert!(complaint.contains("along z, y, −x"), "{complaint}");
    }

    #[test]
    fn millinewtons_are_no_newtons() {
        let complaint = units(&forces(|force| force.map(|f| 1e3 * f))).unwrap();
        assert!(complaint.contains("unit"), "{complaint}");
    }
}
