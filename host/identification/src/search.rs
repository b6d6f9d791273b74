//! The search: what the features do not tell is held, a multi-start finds the valleys of a coarse
//! simulation, and from the best of them a local search follows the fine one by defect correction.
//!
//! Defect correction (Stetter, Numer. Math. 29, 1978; in design, "manifold mapping"): at the values that
//! are known so far both simulations are computed once, and their difference is added to the coarse
//! features in the next local search. Where the values no longer move, the corrected features are the
//! fine ones. The coarse simulation needs only slopes that are right to a few per cent, and the fine
//! one, which costs a hundred times as much, is computed a few times.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use cathforce_calibration::{
    Certainty, Descent, MultiStart, Parameter, ParameterError, Residuals, RunError, jacobian,
    optimise,
};
use nalgebra::DMatrix;
use thiserror::Error;

/// Valleys of the coarse simulation from which the fine one is followed, the best ones first. The true
/// one may come second where the coarse simulation is off by more than the noise.
const POLISHED: usize = 2;
/// A local search ends when a step lowers the sum of squares by less than this share: of about 20
/// features that is less than a fiftieth of a standard deviation.
const LEAST_GAIN: f64 = 1e-3;
/// Local searches from a valley at most, each with the defect where the last one ended. With slopes
/// that are right to a tenth, four of them leave a ten-thousandth of the first defect.
const MOST_ROUNDS: usize = 5;
/// They end once no value moves by more than this share of the way between its bounds.
const SETTLED: f64 = 1e-3;
/// Share of the way between the bounds over which slopes are taken. The features of a simulation jump
/// by rounding and by the tolerance of its solver, which a smaller step would show.
const SLOPE_STEP: f64 = 5e-3;

/// Features of an experiment, as functions of the parameters.
///
/// They are called from many threads.
pub trait Experiment: Sync {
    /// What the features of the simulated experiment are at these values, in the order of the
    /// measured ones. `fine` asks for the fine simulation, else for the coarse one. `None` where the
    /// simulation or its record has none.
    fn features(&self, values: &[f64], fine: bool) -> Option<Vec<f64>>;
}

/// Measured features with the standard deviations of their noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    pub features: Vec<f64>,
    pub sd: Vec<f64>,
}

/// How much a search may compute, and its seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Coarse simulations at most of the multi-start.
    pub global: usize,
    /// Coarse simulations at most of each local search.
    pub local: usize,
    pub seed: u64,
}

/// Two parameters that the features do not tell apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Inseparable {
    pub first: String,
    pub second: String,
    /// Of their errors, from −1 to 1.
    pub correlation: f64,
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Identified {
    /// By parameter, in its unit; one that is not told is at its start.
    pub values: Vec<f64>,
    /// Standard deviation of each by the noise of the features, in its unit: of one that is told beside
    /// the others that are, of one that is not told beside all others.
    pub sd: Vec<f64>,
    /// Whether the features tell it: its way from bound to bound moves them by more than their noise.
    pub told: Vec<bool>,
    pub inseparable: Vec<Inseparable>,
    /// Sum of the squared differences between simulated and measured features, over their noise.
    pub cost: f64,
    /// Valleys that the multi-start knows.
    pub valleys: usize,
    /// Coarse and fine simulations.
    pub evaluations: [usize; 2],
}

/// Why nothing was identified.
#[derive(Debug, Error)]
pub enum SearchError {
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    #[error(
        "{features} measured features have {sd} standard deviations; give one above 0 for each feature"
    )]
    Noise { features: usize, sd: usize },
    #[error(
        "the simulation at the start of the search ({0}) has no features; move the start or narrow the bounds \
         to where the experiment works"
    )]
    Start(String),
    #[error(
        "no parameter is told: from bound to bound each of them moves all features by less than their noise. \
         Measure more exactly, or excite the catheter more"
    )]
    NothingTold,
    #[error("the multi-start: {0}")]
    Global(RunError),
    #[error("the local search: {0}")]
    Local(RunError),
    #[error(
        "beside the values that were found the simulation has no features; narrow the bounds to where the \
         experiment works"
    )]
    NoSlope,
    #[error("the search was interrupted")]
    Interrupted,
}

/// Identifies parameters from measured features.
///
/// `parameters`: names, bounds and starts; their steps are not used. Ends early with
/// [`SearchError::Interrupted`] once `interrupted` is true. `tell` is called after every simulation,
/// with whether it was a fine one.
/// A parameter of which the whole way between its bounds moves the features by less than one standard
/// deviation in all is held at its start and reported as not told.
pub fn identify(
    parameters: &[Parameter],
    experiment: &dyn Experiment,
    measured: &Measured,
    effort: Effort,
    interrupted: &AtomicBool,
    tell: &(dyn Fn(bool) + Sync),
) -> Result<Identified, SearchError> {
    cathforce_calibration::check(parameters)?;
    let fits = measured.features.len() == measured.sd.len();
    if !fits || measured.sd.iter().any(|sd| sd.is_nan() || *sd <= 0.0) {
        let sd = measured.sd.iter().filter(|sd| **sd > 0.0).count();
        return Err(SearchError::Noise { features: measured.features.len(), sd });
    }
    let done = [AtomicUsize::new(0), AtomicUsize::new(0)];
    let residuals = |values: &[f64], fine: bool| -> Option<Vec<f64>> {
        let features = experiment.features(values, fine);
        done[usize::from(fine)].fetch_add(1, Ordering::Relaxed);
        tell(fine);
        let pairs = measured.features.iter().zip(&measured.sd);
        let over = |(own, (measured, sd)): (f64, (&f64, &f64))| (own - measured) / sd;
        let features = features.filter(|own| own.len() == measured.features.len())?;
        Some(features.into_iter().zip(pairs).map(over).collect())
    };
    let start: Vec<f64> = parameters.iter().map(|own| own.start).collect();
    let told = told(parameters, &start, &|values| residuals(values, false))?;
    let searched: Vec<usize> = (0..parameters.len()).filter(|k| told[*k]).collect();
    if searched.is_empty() {
        return Err(SearchError::NothingTold);
    }
    let free = searched.iter().map(|&k| stepped(&parameters[k], true)).collect();
    let search = Search { free, searched, start, residuals: &residuals, effort, interrupted };
    search.go_on()?;
    let valleys = search.valleys()?;
    let mut found: Option<Followed> = None;
    for at in valleys.iter().take(POLISHED) {
        let own = search.followed(at)?;
        if own.as_ref().is_some_and(|own| found.as_ref().is_none_or(|best| own.cost < best.cost)) {
            found = own;
        }
    }
    let found = found.ok_or(SearchError::NoSlope)?;
    let (sd, inseparable) = search.intervals(parameters, &told, &found)?;
    let evaluations = done.map(AtomicUsize::into_inner);
    let valleys = valleys.len();
    let Followed { values, cost, .. } = found;
    Ok(Identified { values, sd, told, inseparable, cost, valleys, evaluations })
}

/// Residuals at the values of all parameters, by the coarse (`false`) or the fine simulation.
type Simulated<'a> = dyn Fn(&[f64], bool) -> Option<Vec<f64>> + Sync + 'a;

/// A search for the parameters that are told.
struct Search<'a> {
    free: Vec<Parameter>,
    /// Place of each among all parameters, and where the others are held.
    searched: Vec<usize>,
    start: Vec<f64>,
    residuals: &'a Simulated<'a>,
    effort: Effort,
    interrupted: &'a AtomicBool,
}

/// Where the fine simulation was computed, with what the coarse one lacks there.
struct Followed {
    values: Vec<f64>,
    cost: f64,
    defect: Vec<f64>,
}

impl Search<'_> {
    fn go_on(&self) -> Result<(), SearchError> {
        match self.interrupted.load(Ordering::Relaxed) {
            true => Err(SearchError::Interrupted),
            false => Ok(()),
        }
    }

    /// The values of all parameters, from those that are searched for.
    fn whole(&self, free: &[f64]) -> Vec<f64> {
        let mut values = self.start.clone();
        self.searched.iter().zip(free).for_each(|(&k, value)| values[k] = *value);
        values
    }

    fn coordinates(&self, free: &[f64]) -> Vec<f64> {
        self.free.iter().zip(free).map(|(own, value)| own.coordinate(*value)).collect()
    }

    /// Coordinates of the coarse simulation's valleys, the lowest first; there is one at least.
    fn valleys(&self) -> Result<Vec<Vec<f64>>, SearchError> {
        let coarse = Residuals(|own: &[f64]| (self.residuals)(&self.whole(own), false));
        let middle = self.free.iter().map(|own| own.coordinate(own.start)).collect();
        let mut global = MultiStart::new(middle, true, self.effort.seed);
        let (best, ..) = optimise(
            &self.free,
            &coarse,
            &mut global,
            self.effort.global,
            self.interrupted,
            &|_| (),
        )
        .map_err(SearchError::Global)?;
        self.go_on()?;
        let valleys: Vec<Vec<f64>> = global.minima().iter().map(|(_, at)| at.clone()).collect();
        Ok(if valleys.is_empty() { vec![self.coordinates(&best)] } else { valleys })
    }

    /// Follows the fine simulation from a valley of the coarse one, by defect correction. `None` where
    /// the fine one has no features.
    fn followed(&self, valley: &[f64]) -> Result<Option<Followed>, SearchError> {
        let mut at = valley.to_vec();
        let mut found: Option<Followed> = None;
        for _ in 0..MOST_ROUNDS {
            let own: Vec<f64> = self.free.iter().zip(&at).map(|(own, at)| own.value(*at)).collect();
            let values = self.whole(&own);
            let both = rayon::join(
                || (self.residuals)(&values, true),
                || (self.residuals)(&values, false),
            );
            self.go_on()?;
            let (Some(fine), Some(coarse)) = both else { break };
            let cost = fine.iter().map(|r| r * r).sum();
            let defect: Vec<f64> = fine.iter().zip(&coarse).map(|(a, b)| a - b).collect();
            let corrected = Residuals(|own: &[f64]| self.corrected(&self.whole(own), &defect));
            let mut local = Descent::from(at.clone()).with_least_gain(LEAST_GAIN);
            let budget = self.effort.local;
            let (next, ..) =
                optimise(&self.free, &corrected, &mut local, budget, self.interrupted, &|_| ())
                    .map_err(SearchError::Local)?;
            self.go_on()?;
            if found.as_ref().is_none_or(|best| cost < best.cost) {
                found = Some(Followed { values, cost, defect });
            }
            let next = self.coordinates(&next);
            let moved = next.iter().zip(&at).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            at = next;
            if moved < SETTLED {
                break;
            }
        }
        Ok(found)
    }

    /// Residuals of the coarse simulation with what it lacks.
    fn corrected(&self, values: &[f64], defect: &[f64]) -> Option<Vec<f64>> {
        let coarse = (self.residuals)(values, false)?;
        Some(coarse.iter().zip(defect).map(|(own, lacks)| own + lacks).collect())
    }

    /// Standard deviations of all `parameters`, and the pairs of those that are told that cannot be
    /// told apart, from the slopes at what was found.
    fn intervals(
        &self,
        parameters: &[Parameter],
        told: &[bool],
        found: &Followed,
    ) -> Result<(Vec<f64>, Vec<Inseparable>), SearchError> {
        // What is not told is moved over all its way, so that its slope is not rounding.
        let slopes: Vec<Parameter> =
            parameters.iter().zip(told).map(|(own, told)| stepped(own, *told)).collect();
        let all = Residuals(|own: &[f64]| self.corrected(own, &found.defect));
        let (off, slopes) = jacobian(&slopes, &all, &found.values).ok_or(SearchError::NoSlope)?;
        let every: Vec<usize> = (0..parameters.len()).collect();
        // What is told is known beside what is held within its bounds; what is not told, beside all
        // others.
        let mut sd = certainty(parameters, &every, &slopes, &off).sd;
        let of_told = certainty(parameters, &self.searched, &slopes, &off);
        self.searched.iter().zip(&of_told.sd).for_each(|(&k, own)| sd[k] = *own);
        let pairs = of_told.pairs.iter().map(|pair| Inseparable {
            first: self.free[pair.first].name.clone(),
            second: self.free[pair.second].name.clone(),
            correlation: pair.correlation,
        });
        Ok((sd, pairs.collect()))
    }
}

/// Whether each parameter moves the residuals by one standard deviation in all on its way between its
/// bounds, with the others at their starts.
fn told(
    parameters: &[Parameter],
    start: &[f64],
    residuals: &(dyn Fn(&[f64]) -> Option<Vec<f64>> + Sync),
) -> Result<Vec<bool>, SearchError> {
    use rayon::prelude::*;
    let named = || {
        let each = parameters.iter().zip(start).map(|(own, at)| format!("{} = {at}", own.name));
        each.collect::<Vec<_>>().join(", ")
    };
    let at_start = residuals(start).ok_or_else(|| SearchError::Start(named()))?;
    let at = |k: usize, value: f64| {
        let mut values = start.to_vec();
        values[k] = value;
        // At a bound where nothing can be computed it does make a difference.
        residuals(&values).map_or(f64::INFINITY, |own| {
            own.iter().zip(&at_start).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
        })
    };
    let moved = (0..parameters.len()).into_par_iter().map(|k| {
        let own = &parameters[k];
        at(k, own.low).max(at(k, own.high)) > 1.0
    });
    Ok(moved.collect())
}

/// The parameter with the step of its slope.
fn stepped(own: &Parameter, told: bool) -> Parameter {
    let share = if told { SLOPE_STEP } else { 1.0 };
    Parameter { step: share * (own.high - own.low), ..own.clone() }
}

/// Intervals and inseparable pairs of some of the parameters, from the slopes of all.
fn certainty(
    parameters: &[Parameter],
    some: &[usize],
    slopes: &DMatrix<f64>,
    residuals: &[f64],
) -> Certainty {
    let one_each: Vec<usize> = (0..residuals.len()).collect();
    let scales: Vec<f64> = some.iter().map(|&k| parameters[k].high - parameters[k].low).collect();
    Certainty::of(&slopes.select_columns(some), residuals, &one_each, &scales, false)
}

#[cfg(test)]
mod tests {
    use super::*;

    static NEVER: AtomicBool = AtomicBool::new(false);
    const EFFORT: Effort = Effort { global: 400, local: 200, seed: 1 };

    /// Values → features; the coarse ones are off by a hundredth.
    struct Toy<F>(F);

    impl<F: Fn(&[f64]) -> Vec<f64> + Sync> Experiment for Toy<F> {
        fn features(&self, values: &[f64], fine: bool) -> Option<Vec<f64>> {
            let off = if fine { 1.0 } else { 1.01 };
            Some((self.0)(values).into_iter().map(|own| own * off).collect())
        }
    }

    fn search(
        names: &[&str],
        experiment: &dyn Experiment,
        features: &[f64],
        sd: f64,
    ) -> Result<Identified, SearchError> {
        let parameters: Vec<_> = names.iter().map(|own| Parameter::new(*own, 0.0, 4.0)).collect();
        let measured = Measured { features: features.to_vec(), sd: vec![sd; features.len()] };
        identify(&parameters, experiment, &measured, EFFORT, &NEVER, &|_| ())
    }

    #[test]
    fn the_fine_simulation_decides_and_the_idle_parameter_is_held() {
        let toy = Toy(|x: &[f64]| vec![x[0] * x[0] + x[1], x[0] - x[1], 1e-3 * x[2], x[1]]);
        let found = search(&["a", "b", "idle"], &toy, &[2.0, 0.0, 2e-3, 1.0], 0.01).unwrap();
        assert_eq!(found.told, [true, true, false]);
        assert!((found.values[0] - 1.0).abs() < 1e-3 && (found.values[1] - 1.0).abs() < 1e-3);
        assert_eq!(found.values[2], 2.0);
        // Its interval is what a thousandth of it leaves of the noise; the coarse slopes are 1 % off.
        assert!((found.sd[2] / 10.0 - 1.0).abs() < 0.02, "{found:?}");
        assert!(found.inseparable.is_empty() && found.cost < 1e-3, "{found:?}");
    }

    #[test]
    fn a_product_is_told_and_its_factors_are_not() {
        let toy = Toy(|x: &[f64]| vec![x[0] * x[1], 1e-3 * x[0]]);
        let found = search(&["mass", "length"], &toy, &[2.0, 1e-3], 0.01).unwrap();
        let pair = &found.inseparable[0];
        assert_eq!((pair.first.as_str(), pair.second.as_str()), ("mass", "length"));
        assert!(pair.correlation < -0.99 && found.sd[0] > 1.0, "{found:?}");
    }

    #[test]
    fn what_cannot_be_searched_says_why() {
        let toy = Toy(|x: &[f64]| vec![1e-6 * x[0]]);
        let nothing = search(&["a"], &toy, &[1e-6], 0.01).unwrap_err();
        assert!(matches!(nothing, SearchError::NothingTold), "{nothing}");
        let noise = search(&["a"], &toy, &[1e-6], 0.0).unwrap_err();
        assert!(noise.to_string().contains("1 measured features have 0"), "{noise}");
        struct Broken;
        impl Experiment for Broken {
            fn features(&self, _: &[f64], _: bool) -> Option<Vec<f64>> {
                None
            }
        }
        let start = search(&["a"], &Broken, &[1.0], 0.1).unwrap_err();
        assert!(start.to_string().contains("a = 2"), "{start}");
    }
}
