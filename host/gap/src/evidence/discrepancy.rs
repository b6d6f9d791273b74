//! The evidence of a fit: ln p(data) over a grid of the discrepancy's amplitudes.

use nalgebra::DVector;

use super::binned::{Binned, BinnedTrial, bin_means};
use super::density::{Fitted, Products, distance, log_densities};
use super::noise::Noise;
use crate::fitting::fit::Fit;
use crate::fitting::nuisance::Nuisances;
use crate::fitting::problem::{Coordinate, Problem};

/// ln p(trial | the others) at one choice of the amplitudes, but for a constant.
#[derive(Clone, Debug)]
pub struct Cell {
    pub amplitude: f64,
    pub kappa: f64,
    pub looseness: f64,
    /// By trial.
    pub log_densities: Vec<f64>,
}

/// How much was measured.
#[derive(Clone, Debug, Default)]
pub struct Size {
    /// Of each trial, over all channels.
    pub bins: Vec<usize>,
    pub channels: usize,
}

/// What a fit is worth.
#[derive(Clone, Debug)]
pub struct Evidence {
    pub cells: Vec<Cell>,
    pub size: Size,
    /// Whether a channel scatters far more than its sensor is said to, which no effect explains.
    pub is_beyond_stated: bool,
}

/// The evidence of a fit. `nuisances`: linearised there.
pub fn evidence(
    problem: &Problem<'_>,
    noise: &Noise,
    fit: &Fit,
    nuisances: &Nuisances,
) -> Evidence {
    let fitted = fitted(problem, fit);
    let binned = Binned::of(problem, noise, fit, nuisances);
    let mut cells = Vec::new();
    let rules = &problem.rules.evidence;
    let least = problem.plant.least_amplitude();
    for amplitude in rules.amplitude.into_iter().filter(|own| *own >= least) {
        for kappa in rules.kappa {
            let products = products(&binned, amplitude, kappa);
            for looseness in rules.looseness {
                if let Some(log_densities) = log_densities(&products, &fitted, looseness) {
                    cells.push(Cell { amplitude, kappa, looseness, log_densities });
                }
            }
        }
    }
    Evidence { cells, size: size(problem, &binned), is_beyond_stated: noise.is_beyond_stated }
}

fn size(problem: &Problem<'_>, binned: &Binned) -> Size {
    let bins = binned.trials.iter().map(|own| own.bins.len()).collect();
    Size { bins, channels: problem.plant.channels().len() }
}

/// The products of every trial at these amplitudes.
fn products(binned: &Binned, amplitude: f64, kappa: f64) -> Vec<Products> {
    let of = |trial: &BinnedTrial| {
        let (weights, log_determinant) = trial.weights(amplitude, kappa);
        Products::of(trial, &weights, log_determinant)
    };
    binned.trials.iter().map(of).collect()
}

/// By how much an effect promises to make a fit more probable, to first order.
pub struct Screen<'a> {
    problem: &'a Problem<'a>,
    binned: Binned,
    at: Cell,
    products: Vec<Products>,
    fitted: Vec<Fitted>,
    /// ln p(trial | the others), by trial.
    without: Vec<f64>,
}

impl<'a> Screen<'a> {
    /// Of a fit, with the amplitudes that it has. `None` where its derivatives are of no use.
    pub fn of(
        problem: &'a Problem<'a>,
        noise: &Noise,
        (fit, nuisances): (&Fit, &Nuisances),
        at: Cell,
    ) -> Option<Self> {
        let fitted = fitted(problem, fit);
        let binned = Binned::of(problem, noise, fit, nuisances);
        let products = products(&binned, at.amplitude, at.kappa);
        let without = log_densities(&products, &fitted, at.looseness)?;
        Some(Self { problem, binned, at, products, fitted, without })
    }

    /// How far a change of the whitened residuals, by trial, is from what nuisances and parameters can do,
    /// in standard deviations.
    pub fn distance(&self, does: &[DVector<f64>]) -> Option<f64> {
        distance(&self.with(does), &self.fitted, self.at.looseness)
    }

    pub fn size(&self) -> Size {
        size(self.problem, &self.binned)
    }

    /// What the tempered ln p(data) grows by with a change of the whitened residuals, by trial, that may come in any
    /// size. `None` as for [`Screen::of`].
    pub fn gain(&self, does: &[DVector<f64>]) -> Option<f64> {
        let free = Fitted { deviation: 0.0, scale: 1.0, room: [f64::NEG_INFINITY, f64::INFINITY] };
        let fitted: Vec<Fitted> = self.fitted.iter().copied().chain([free]).collect();
        let with = log_densities(&self.with(does), &fitted, self.at.looseness)?;
        let grows: Vec<f64> =
            with.iter().zip(&self.without).map(|(with, own)| with - own).collect();
        Some(self.problem.rules.prior.tempered(&grows, &self.size()))
    }

    fn with(&self, does: &[DVector<f64>]) -> Vec<Products> {
        let of = |(t, (products, does)): (usize, (&Products, &DVector<f64>))| {
            let trial = &self.binned.trials[t];
            let column = bin_means(&trial.bins, &does.component_div(self.problem.weights(t)));
            products.with(trial, &trial.weights(self.at.amplitude, self.at.kappa).0, &column)
        };
        self.products.iter().zip(does).enumerate().map(of).collect()
    }
}

/// The parameters of a fit.
fn fitted(problem: &Problem<'_>, fit: &Fit) -> Vec<Fitted> {
    let of = |coordinate: &Coordinate| match *coordinate {
        Coordinate::Effect { effect, parameter } => {
            let p = problem.parameter(effect, parameter);
            let value = fit.point.effects[effect][parameter];
            let room = [(p.low - value).min(0.0), (p.high - value).max(0.0)];
            Some(Fitted { deviation: value - p.off, scale: p.scale, room })
        }
        Coordinate::Nuisance(_) => None,
    };
    fit.coordinates.iter().filter_map(of).collect()
}
