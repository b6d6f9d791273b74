//! Young's modulus and Poisson's ratio whose cross-sections overlap best with the masks.
//!
//! As published, the mean overlap is maximised by the cross-entropy method with 8 agents, of which 2
//! explore, until the standard deviations are below 5 kPa and 0.005. That says where the best point is
//! no closer than so; a simplex (Nelder and Mead 1965) then goes to the top from there.

use std::sync::atomic::AtomicBool;

use cathforce_calibration::{
    Cost, CrossEntropy, Optimiser, Parameter, RunError, Simplex, Stop, optimise,
};
use serde::Serialize;

use crate::certainty::{Interval, Known, intervals};
use crate::error::UltrasoundError;
use crate::response::{Response, Tissue};
use crate::study::{Bounds, Prepared, Study};

/// Agents, and those of them that are drawn anywhere.
const AGENTS: usize = 8;
const EXPLORERS: usize = 2;
/// Standard deviations at which the search has converged.
const CONVERGED_KPA: f64 = 5.0;
const CONVERGED_RATIO: f64 = 0.005;
/// A search that is no narrower after so many epochs ends; published are at most 10.
const MOST_EPOCHS: usize = 40;
/// Of the simplex.
const MOST_EVALUATIONS: usize = 200;
/// Poisson's ratios at which the profile is computed.
const PROFILE: usize = 9;

/// The agents after one epoch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Epoch {
    pub youngs_modulus_kpa: f64,
    pub youngs_modulus_sd_kpa: f64,
    pub poissons_ratio: f64,
    pub poissons_ratio_sd: f64,
}

/// One image under the stiffness that was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Overlapped {
    pub name: String,
    /// Number of the pose, from 1.
    pub pose: usize,
    pub force_n: f64,
    pub overlap: f64,
}

/// The best Young's modulus for a given Poisson's ratio.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Profiled {
    pub poissons_ratio: f64,
    pub youngs_modulus_kpa: f64,
    pub overlap: f64,
}

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    pub tissue: Tissue,
    pub youngs_modulus_kpa: Interval,
    pub poissons_ratio: Interval,
    pub poissons_ratio_known: Known,
    pub mean_overlap: f64,
    pub images: Vec<Overlapped>,
    /// By pose: what its images are moved by against the block, laterally and down \[mm\].
    pub shifts_mm: Vec<[f64; 2]>,
    /// How far the masks' outlines lie too far out \[mm\].
    pub outlines_out_mm: f64,
    /// Epochs of the cross-entropy method, with its agents after each.
    pub epochs: Vec<Epoch>,
    /// Whether it converged, and did not end for the number of its epochs.
    pub converged: bool,
    /// Stiffnesses that were tried, the simplex's among them.
    pub evaluations: usize,
    pub profile: Vec<Profiled>,
    /// Whether the largest load lies within what was solved at large strains.
    pub solved: bool,
}

/// Fits a study. `interrupted` ends it between two epochs.
pub fn fit(study: &Study, interrupted: &AtomicBool) -> Result<Fit, UltrasoundError> {
    Ok(fit_reusing(study, None, interrupted)?.0)
}

/// Fits a study with the response of another one of the same block, poses, forces, law and bounds, if
/// there is one; gives the response back.
pub fn fit_reusing(
    study: &Study,
    known: Option<Response>,
    interrupted: &AtomicBool,
) -> Result<(Fit, Response), UltrasoundError> {
    let mut prepared = Prepared::new(study, known)?;
    let (epochs, best, converged) = search(&prepared, interrupted)?;
    let mut evaluations = AGENTS * epochs.len();
    let mut tissue = polish(&prepared, best, interrupted, &mut evaluations)?;
    // Softer than what was solved at large strains: solve more, and climb once more.
    if !is_solved(&prepared, tissue) {
        prepared.solve_large_strains(tissue.youngs_modulus_kpa)?;
        tissue = polish(&prepared, tissue, interrupted, &mut evaluations)?;
    }
    let explained = prepared.explained(tissue).ok_or(RunError::Nowhere(evaluations))?;
    let overlaps = prepared.overlaps(&explained);
    let [youngs_modulus_kpa, poissons_ratio] = intervals(&prepared, tissue);
    let images = study.images.iter().zip(&overlaps).map(|(image, overlap)| Overlapped {
        name: image.name.clone(),
        pose: image.pose + 1,
        force_n: image.force_n,
        overlap: *overlap,
    });
    let found = Fit {
        tissue,
        youngs_modulus_kpa,
        poissons_ratio,
        poissons_ratio_known: Known::of(&poissons_ratio, study.bounds.poissons_ratio),
        mean_overlap: overlaps.iter().sum::<f64>() / overlaps.len() as f64,
        images: images.collect(),
        shifts_mm: explained.shifts_mm.iter().map(|shift| (*shift).into()).collect(),
        outlines_out_mm: explained.growth_mm,
        epochs,
        converged,
        evaluations,
        profile: profile(&prepared, tissue),
        solved: is_solved(&prepared, tissue),
    };
    Ok((found, prepared.response))
}

fn is_solved(prepared: &Prepared<'_>, tissue: Tissue) -> bool {
    prepared.study.images.iter().all(|image| prepared.response.is_solved(tissue, image.force_n))
}

fn parameters(bounds: &Bounds) -> [Parameter; 2] {
    let [[soft, stiff], [low, high]] = [bounds.youngs_modulus_kpa, bounds.poissons_ratio];
    [Parameter::new("youngs_modulus", soft, stiff), Parameter::new("poissons_ratio", low, high)]
}

fn tissue([youngs_modulus_kpa, poissons_ratio]: [f64; 2]) -> Tissue {
    Tissue { youngs_modulus_kpa, poissons_ratio }
}

/// The epochs, the best agent of all, and whether they converged.
fn search(
    prepared: &Prepared<'_>,
    interrupted: &AtomicBool,
) -> Result<(Vec<Epoch>, Tissue, bool), UltrasoundError> {
    let own = parameters(&prepared.study.bounds);
    let width = |k: usize| own[k].high - own[k].low;
    let enough = vec![CONVERGED_KPA / width(0), CONVERGED_RATIO / width(1)];
    let agents = CrossEntropy::new(AGENTS, EXPLORERS, enough, prepared.study.seed);
    let mut told = Told { agents, epochs: Vec::new(), parameters: own.clone() };
    let budget = AGENTS * MOST_EPOCHS;
    let (best, stop) = climb(prepared, &mut told, budget, interrupted, &mut 0)?;
    Ok((told.epochs, best, stop == Stop::Converged))
}

/// Climbs from a stiffness to the top of the overlap.
fn polish(
    prepared: &Prepared<'_>,
    from: Tissue,
    interrupted: &AtomicBool,
    evaluations: &mut usize,
) -> Result<Tissue, UltrasoundError> {
    let [youngs, poisson] = parameters(&prepared.study.bounds);
    let from =
        vec![youngs.coordinate(from.youngs_modulus_kpa), poisson.coordinate(from.poissons_ratio)];
    let mut simplex = Simplex::from(from);
    Ok(climb(prepared, &mut simplex, MOST_EVALUATIONS, interrupted, evaluations)?.0)
}

fn climb(
    prepared: &Prepared<'_>,
    search: &mut dyn Optimiser,
    budget: usize,
    interrupted: &AtomicBool,
    evaluations: &mut usize,
) -> Result<(Tissue, Stop), UltrasoundError> {
    let lost = Cost(|values: &[f64]| {
        prepared.overlap(tissue([values[0], values[1]])).map(|own| 1.0 - own)
    });
    let parameters = parameters(&prepared.study.bounds);
    let (best, _, spent, stop) =
        optimise(&parameters, &lost, search, budget, interrupted, &|_| ())?;
    *evaluations += spent;
    match stop {
        Stop::Interrupted => Err(UltrasoundError::Interrupted),
        stop => Ok((tissue([best[0], best[1]]), stop)),
    }
}

/// The cross-entropy method, and its agents after each epoch.
struct Told {
    agents: CrossEntropy,
    epochs: Vec<Epoch>,
    parameters: [Parameter; 2],
}

impl Optimiser for Told {
    fn ask(&mut self) -> Vec<cathforce_calibration::Question> {
        self.agents.ask()
    }

    fn tell(&mut self, answers: &[cathforce_calibration::Answer]) {
        self.agents.tell(answers);
        let (mean, sd) = self.agents.distribution();
        let [youngs, poisson] = &self.parameters;
        let width = |own: &Parameter| own.high - own.low;
        self.epochs.push(Epoch {
            youngs_modulus_kpa: youngs.value(mean[0]),
            youngs_modulus_sd_kpa: sd[0] * width(youngs),
            poissons_ratio: poisson.value(mean[1]),
            poissons_ratio_sd: sd[1] * width(poisson),
        });
    }

    fn has_converged(&self) -> bool {
        self.agents.has_converged()
    }
}

/// The mean overlap over Poisson's ratio, with the Young's modulus that suits each best.
fn profile(prepared: &Prepared<'_>, best: Tissue) -> Vec<Profiled> {
    let [low, high] = prepared.study.bounds.poissons_ratio;
    let at = |k: usize| low + (high - low) * k as f64 / (PROFILE - 1) as f64;
    (0..PROFILE).map(|k| best_modulus(prepared, best, at(k))).collect()
}

/// By golden section over Young's modulus, within a quarter of the best one: Poisson's ratio changes
/// what a force does to the vessel by less.
fn best_modulus(prepared: &Prepared<'_>, best: Tissue, poissons_ratio: f64) -> Profiled {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    /// 0.618¹⁶ of the interval is 0.02 % of the modulus.
    const STEPS: usize = 16;
    let overlap = |youngs_modulus_kpa: f64| {
        prepared.overlap(Tissue { youngs_modulus_kpa, poissons_ratio }).unwrap_or(0.0)
    };
    let [mut low, mut high] = [0.75, 1.25].map(|share| share * best.youngs_modulus_kpa);
    for _ in 0..STEPS {
        let (left, right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if overlap(left) > overlap(right) { high = right } else { low = left }
    }
    let youngs_modulus_kpa = 0.5 * (low + high);
    Profiled { poissons_ratio, youngs_modulus_kpa, overlap: overlap(youngs_modulus_kpa) }
}
