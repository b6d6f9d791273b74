//! The next recording: the segment of the protocol that best separates two rival explanations.
//!
//! T-optimality: the parameters of the rival, the bias of the sensor and a shift in time are refitted to the
//! prediction of the other explanation. What remains is the distance of the two, in standard deviations of
//! the measurement.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::parallel::each_some;
use crate::plant::{Plant, Point};
use crate::scoring::metric::Projection;

/// Distances below this separate nothing.
const SEPARATED: f64 = 5.0;
/// Nuisances that cost no simulation of the mechanics.
const SLIGHT: [&str; 2] = ["sensor.bias", "drive.latency"];
/// Step of a difference in standard deviations of the prior.
const STEP_SD: f64 = 0.02;

/// A recommendation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Experiment {
    pub segment: String,
    /// Effects that it tells apart.
    pub separates: Vec<String>,
    /// What to do.
    #[serde(skip)]
    pub what: String,
    /// Distance of the two explanations in it, in standard deviations.
    #[serde(skip)]
    pub distance: f64,
}

/// The best segment to tell two explanations apart; `None` when none does.
///
/// `chosen` and `rival`: a point each, and the effect of it that is in question.
pub fn next(
    plant: &dyn Plant,
    chosen: (&Point, usize),
    rival: (&Point, usize),
) -> Option<Experiment> {
    let distance = |segment: usize| separation(plant, segment, chosen.0, rival);
    let distances = each_some(0..plant.segments().len(), |s| Some((distance(s)?, s)));
    let (distance, segment) = distances.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let id = |effect: usize| plant.effects()[effect].id.to_owned();
    (distance >= SEPARATED).then(|| Experiment {
        segment: plant.segments()[segment].name.to_owned(),
        separates: vec![id(chosen.1), id(rival.1)],
        what: plant.segments()[segment].what.to_owned(),
        distance,
    })
}

fn separation(
    plant: &dyn Plant,
    segment: usize,
    chosen: &Point,
    (rival, effect): (&Point, usize),
) -> Option<f64> {
    let simulate = |point: &Point| {
        let predicted = plant.simulate_segment(segment, point)?;
        Some(DVector::from_vec(predicted))
    };
    let base = simulate(rival)?;
    // A constant is what the sensor's bias could do.
    let mut columns = vec![DVector::repeat(base.len(), 1.0)];
    for (i, p) in plant.effects()[effect].parameters.iter().enumerate() {
        let mut moved = rival.clone();
        moved.effects[effect][i] += STEP_SD * p.scale;
        columns.push(simulate(&moved)? - &base);
    }
    for (k, nuisance) in plant.nuisances().iter().enumerate() {
        if SLIGHT.iter().any(|slight| nuisance.effect == Some(slight)) {
            let mut moved = rival.clone();
            moved.nuisances[k] += nuisance.sd;
            columns.push(simulate(&moved)? - &base);
        }
    }
    let apart = simulate(chosen)? - base;
    let (apart, span) = (DMatrix::from_columns(&[apart]), DMatrix::from_columns(&columns));
    let mut projection = Projection::new(span.ncols());
    projection.add(&span.tr_mul(&span), &span.tr_mul(&apart), apart.norm_squared());
    Some(projection.distance())
}
