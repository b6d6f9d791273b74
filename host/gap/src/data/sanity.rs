//! Finds measurements whose axes or units are not those of the model, so that no effect can explain them.
//!
//! Each quantity is checked separately. Forces are compared as they are, because they are zeroed with no
//! instrument inside. Positions are compared as displacements from their mean, because the origin of a frame
//! says nothing about its axes.

use std::ops::Range;

use nalgebra::DVector;

use crate::fitting::problem::Problem;
use crate::noise::floor::Floor;
use crate::plant::{Plant, Quantity, Trial};
use crate::scoring::candidate::Candidate;

/// Other axes must leave less than this share of what the stated ones leave, and of what was
/// measured.
const MUCH_BETTER: f64 = 0.2;
/// A factor between measured and predicted beyond which it is a unit, not a gain.
const UNIT_FACTOR: f64 = 100.0;
/// Correlation from which on the factor means anything.
const ALIKE: f64 = 0.8;
/// Other units of force, and how many of them are a newton: far from what any gain or stiffness makes
/// of it. Found within this share, by a correlation of at least this much.
const FORCE_UNITS: [(&str, f64); 2] = [("kilogram-force", 0.101_972), ("pound-force", 0.224_809)];
const SAME_UNIT: f64 = 0.03;
const ALIKE_IN_UNIT: f64 = 0.95;

const QUANTITIES: [Quantity; 4] =
    [Quantity::Force, Quantity::DriveForce, Quantity::Tip, Quantity::Shape];
const AXES: [&str; 3] = ["x", "y", "z"];
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// What was measured and what was predicted along one axis, sample by sample.
#[derive(Clone, Debug, Default)]
struct Axis {
    measured: Vec<f64>,
    predicted: Vec<f64>,
}

impl Axis {
    fn push(&mut self, measured: f64, predicted: f64) {
        self.measured.push(measured);
        self.predicted.push(predicted);
    }

    /// Displacements in the place of positions.
    fn centred(self) -> Self {
        let centred = |values: Vec<f64>| {
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            values.into_iter().map(|value| value - mean).collect()
        };
        Self { measured: centred(self.measured), predicted: centred(self.predicted) }
    }

    fn append(&mut self, other: Self) {
        self.measured.extend(other.measured);
        self.predicted.extend(other.predicted);
    }
}

/// Why these measurements carry no verdict; empty when nothing is the matter.
pub fn complaints(problem: &Problem<'_>, nominal: &Candidate) -> Vec<String> {
    let residuals: Vec<_> = nominal.fit.trials.iter().map(|trial| Some(&trial.raw)).collect();
    complaints_of(problem, &residuals)
}

/// The same of one trial, by a model's prediction of its samples as it is: what nuisances do turns
/// no axis.
pub fn complaints_of_trial(plant: &dyn Plant, trial: usize, predicted: &[f64]) -> Vec<String> {
    let problem = Problem::new(plant, &Floor::of(plant), &crate::unwatched);
    let samples = plant.trials()[trial].samples.iter();
    let errors = samples.zip(predicted).map(|(sample, predicted)| sample.value - predicted);
    let own = DVector::from_iterator(predicted.len(), errors).component_mul(problem.weights(trial));
    let of = |other: usize| (other == trial).then_some(&own);
    let residuals: Vec<_> = (0..plant.trials().len()).map(of).collect();
    complaints_of(&problem, &residuals)
}

/// `residuals`: (y − f)/σ by trial, of those that are looked at.
fn complaints_of(problem: &Problem<'_>, residuals: &[Option<&DVector<f64>>]) -> Vec<String> {
    let complaint = |quantity: Quantity| {
        let own = axes_of(problem, residuals, quantity);
        unit(&own, quantity).or_else(|| axes(&own, quantity))
    };
    QUANTITIES.into_iter().filter_map(complaint).collect()
}

/// Three axes of a quantity, or the one that it has.
fn axes_of(
    problem: &Problem<'_>,
    residuals: &[Option<&DVector<f64>>],
    quantity: Quantity,
) -> Vec<Axis> {
    let plant: &dyn Plant = problem.plant;
    let own = |channel: &usize| plant.channels()[*channel].quantity == quantity;
    let channels: Vec<usize> = (0..plant.channels().len()).filter(own).collect();
    // A shape has three of each of its points.
    let count = if channels.len().is_multiple_of(3) { 3 } else { 1 };
    let mut all = vec![Axis::default(); count];
    for point in channels.chunks_exact(count) {
        let mut axes = vec![Axis::default(); count];
        for (t, (trial, residual)) in plant.trials().iter().zip(residuals).enumerate() {
            let Some(residual) = residual else { continue };
            for samples in together(trial, point) {
                for (axis, i) in axes.iter_mut().zip(samples) {
                    let error = residual[i] / problem.weights(t)[i];
                    let measured = trial.samples[i].value;
                    axis.push(measured, measured - error);
                }
            }
        }
        for (all, axis) in all.iter_mut().zip(axes) {
            all.append(if quantity.is_force() { axis } else { axis.centred() });
        }
    }
    all
}

/// Samples of some channels at the times at which all have one: what a fork decides, or a sensor
/// reads at its limit, may be left out along one axis and not along another.
fn together(trial: &Trial, channels: &[usize]) -> Vec<Vec<usize>> {
    let ranges = trial.channel_ranges();
    let range = |channel: &usize| {
        let own = |range: &&Range<usize>| trial.samples[range.start].channel == *channel;
        ranges.iter().find(own).cloned()
    };
    let Some(ranges) = channels.iter().map(range).collect::<Option<Vec<_>>>() else {
        return Vec::new();
    };
    let [first, others @ ..] = ranges.as_slice() else { return Vec::new() };
    let with_others = |i: usize| {
        let t_s = trial.samples[i].t_s;
        let at = |range: &Range<usize>| {
            let own = &trial.samples[range.clone()];
            let k = own.partition_point(|sample| sample.t_s < t_s);
            own.get(k).filter(|sample| sample.t_s == t_s).map(|_| range.start + k)
        };
        std::iter::once(Some(i)).chain(others.iter().map(at)).collect::<Option<Vec<usize>>>()
    };
    first.clone().filter_map(with_others).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Of what was measured and of what was predicted, summed over axes and samples.
fn squares(axes: &[Axis]) -> (f64, f64) {
    let sum = |of: fn(&Axis) -> &[f64]| axes.iter().map(|axis| dot(of(axis), of(axis))).sum();
    (sum(|axis| &axis.measured), sum(|axis| &axis.predicted))
}

fn unit(axes: &[Axis], quantity: Quantity) -> Option<String> {
    let (yy, ff) = squares(axes);
    let yf: f64 = axes.iter().map(|axis| dot(&axis.measured, &axis.predicted)).sum();
    if yy * ff <= 0.0 || yf.abs() < ALIKE * (yy * ff).sqrt() {
        return None;
    }
    let factor = (yy / ff).sqrt();
    let (what, unit) = match quantity {
        Quantity::Force => ("force", "newton"),
        Quantity::DriveForce => ("drive force", "newton"),
        Quantity::Tip => ("way of the tip", "metre"),
        Quantity::Shape => ("way of the shape's points", "metre"),
    };
    let slope = yf / ff;
    let is_one = |(_, per_newton): &&(&str, f64)| (slope / per_newton - 1.0).abs() < SAME_UNIT;
    let alike = quantity.is_force() && yf >= ALIKE_IN_UNIT * (yy * ff).sqrt();
    if let Some((other, _)) = FORCE_UNITS.iter().filter(|_| alike).find(is_one) {
        return Some(format!(
            "the measured {what} is {slope:.4} times the predicted one and otherwise alike, as it is \
             in {other}s; nothing is concluded from it: give its columns in newtons, or, if they \
             are, state a stiffness nearer to the instrument's"
        ));
    }
    (!(1.0 / UNIT_FACTOR..=UNIT_FACTOR).contains(&factor)).then(|| {
        format!(
            "the measured {what} is {factor:.3e} times the predicted one and otherwise alike: its \
             unit is not {unit}; nothing is concluded from it: give its columns in {unit}s"
        )
    })
}

/// Whether the axes would fit far better in another order or with other signs. Of a drive on its
/// own, which has one, its inertia tells more.
fn axes(axes: &[Axis], quantity: Quantity) -> Option<String> {
    let orders = match (axes.len(), quantity) {
        (3, _) => &ORDERS[..],
        (1, Quantity::DriveForce) => &ORDERS[..1],
        _ => return None,
    };
    let (yy, ff) = squares(axes);
    let yf = |order: &[usize; 3], signs: usize| -> f64 {
        let axis = |(k, own): (usize, &Axis)| {
            let sign = if signs >> k & 1 == 1 { -1.0 } else { 1.0 };
            sign * dot(&own.measured, &axes[order[k]].predicted)
        };
        axes.iter().enumerate().map(axis).sum()
    };
    // What is left of what was measured, by the gain of all axes that leaves least: a stiffer
    // instrument turns no axis, but would hide that a small one is turned.
    let left = |yf: f64| yy - yf.max(0.0).powi(2) / ff.max(f64::MIN_POSITIVE);
    let all = orders.iter().flat_map(|order| (0..1 << axes.len()).map(move |signs| (order, signs)));
    let (order, signs) = all.min_by(|a, b| yf(b.0, b.1).total_cmp(&yf(a.0, a.1)))?;
    let (stated, best) = (left(yf(&ORDERS[0], 0)), left(yf(order, signs)));
    if best >= MUCH_BETTER * stated || best >= MUCH_BETTER * yy {
        return None;
    }
    let name =
        |k: usize| format!("{}{}", if signs >> k & 1 == 1 { "−" } else { "" }, AXES[order[k]]);
    let (what, fix) = match quantity {
        Quantity::DriveForce => {
            let says = "the measured drive force looks like the predicted one with the other sign; \
                        nothing is concluded from it: drive_fx_N is positive when the drive pushes";
            return Some(says.to_owned());
        }
        Quantity::Force => (
            "forces along x, y, z look like those",
            "fx_N, fy_N, fz_N are those of the instrument on the phantom, along the vessel's axes",
        ),
        Quantity::Tip => (
            "ways of the tip along x, y, z look like those",
            "tip_x_m, tip_y_m, tip_z_m are positions in the vessel's frame",
        ),
        Quantity::Shape => (
            "ways of the shape's points along x, y, z look like those",
            "p00_x_m, p00_y_m, p00_z_m … are positions in the vessel's frame",
        ),
    };
    Some(format!(
        "the measured {what} along {}, {}, {} of the vessel's frame: the axes are not those that \
         rig.toml states; nothing is concluded from them: {fix}, as are direction and up of \
         [entry]",
        name(0),
        name(1),
        name(2)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::diagnose;
    use crate::diagnosis::report::{Diagnosis, Verdict};
    use crate::plant::{Channel, Point};
    use crate::toy::{Toy, effect, noise, parameter};

    const ROWS: usize = 200;
    const NOISE: f64 = 1e-3;

    /// What the model says of a row, along x, y and z.
    fn model(row: usize) -> [f64; 3] {
        let t = 0.05 * row as f64;
        [0.3 + 0.1 * t.sin(), 0.05 * (2.0 * t).cos(), -0.1 * t.cos()]
    }

    /// What is answered where so many axes of a quantity were measured with a change, of which y
    /// lacks rows that x and z have, as where a fork decides them, and x others.
    fn answer(
        quantity: Quantity,
        axes: usize,
        measured: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Diagnosis {
        let is_left_out = |axis: usize, row: usize| {
            (axis == 1 && (50..80).contains(&row)) || (axis == 0 && row < 10)
        };
        let of_axis = |axis: usize| (0..ROWS).map(move |row| (axis, row));
        let samples = (0..axes).flat_map(of_axis).filter(|&(axis, row)| !is_left_out(axis, row));
        let samples: Vec<(usize, usize)> = samples.collect();
        let values = samples.iter().enumerate();
        let values = values.map(|(i, &(axis, row))| measured(model(row))[axis] + NOISE * noise(i));
        let channel = |axis: usize| Channel { name: AXES[axis].to_owned(), quantity };
        let predict = |i: usize, point: &Point| {
            model(samples[i].1)[samples[i].0] * (1.0 + point.effects[0][0])
        };
        let toy = Toy::new(0.05, NOISE, values.collect::<Vec<f64>>(), predict);
        let at = |i: usize| (samples[i].0, 0.05 * samples[i].1 as f64);
        let mut toy = toy.placed((0..axes).map(channel).collect(), at).times(2);
        toy.effects = vec![effect("gain", vec![parameter("gain")], vec![vec![0.1]])];
        diagnose(&toy, "toy", &crate::unwatched)
    }

    #[track_caller]
    fn assert_refused(answer: &Diagnosis, says: &str) {
        assert_eq!(answer.verdict, Verdict::Unknown);
        assert!(answer.effects.is_empty());
        assert!(answer.remarks.iter().any(|remark| remark.contains(says)), "{:?}", answer.remarks);
    }

    #[test]
    fn what_is_as_predicted_is_not_complained_of() {
        for (quantity, axes) in
            [(Quantity::Force, 3), (Quantity::DriveForce, 1), (Quantity::Tip, 3)]
        {
            let answer = answer(quantity, axes, |force| force.map(|f| 1.4 * f));
            assert_eq!(answer.verdict, Verdict::Named, "{quantity:?}: {:?}", answer.remarks);
        }
    }

    #[test]
    fn swapped_and_turned_axes_are_named_though_samples_are_left_out_unequally() {
        let turned = |[x, y, z]: [f64; 3]| [z, y, -x];
        assert_refused(
            &answer(Quantity::Force, 3, turned),
            "forces along x, y, z look like those along z, y, −x",
        );
        let opposite = |force: [f64; 3]| force.map(|f| -f);
        assert_refused(&answer(Quantity::Force, 3, opposite), "along −x, −y, −z");
        assert_refused(&answer(Quantity::DriveForce, 1, opposite), "with the other sign");
        let swapped = |[x, y, z]: [f64; 3]| [x, z, y];
        assert_refused(&answer(Quantity::Force, 3, swapped), "along x, z, y");
        // Though most of the error is that of a gain.
        let stiffer = |[x, y, z]: [f64; 3]| [1.5 * x, -1.5 * y, 1.5 * z];
        assert_refused(&answer(Quantity::Force, 3, stiffer), "along x, −y, z");
    }

    #[test]
    fn positions_are_turned_about_where_they_are() {
        // Another origin is no other axis.
        let swapped = |[x, y, z]: [f64; 3]| [y + 0.2, x - 0.1, z];
        for quantity in [Quantity::Tip, Quantity::Shape] {
            assert_refused(&answer(quantity, 3, swapped), "along y, x, z");
        }
    }

    #[test]
    fn thousandths_and_other_units_are_refused() {
        let thousandths = |values: [f64; 3]| values.map(|x| 1e3 * x);
        for (quantity, axes, unit) in [
            (Quantity::Force, 3, "not newton"),
            (Quantity::DriveForce, 1, "not newton"),
            (Quantity::Tip, 3, "not metre"),
            (Quantity::Shape, 3, "not metre"),
        ] {
            assert_refused(&answer(quantity, axes, thousandths), unit);
        }
        for (newtons, unit) in [(9.806_65, "kilogram-force"), (4.448_222, "pound-force")] {
            let other = |force: [f64; 3]| force.map(|f| f / newtons);
            assert_refused(&answer(Quantity::Force, 3, other), unit);
            assert_refused(&answer(Quantity::DriveForce, 1, other), unit);
            // A way has no such unit, and a tenth is none.
            assert_eq!(answer(Quantity::Tip, 3, other).verdict, Verdict::Named);
        }
        assert_eq!(answer(Quantity::Force, 3, |f| f.map(|f| 0.11 * f)).verdict, Verdict::Named);
    }
}
