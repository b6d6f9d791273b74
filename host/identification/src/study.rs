//! The search for the parameters of a description's trials.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use cathforce_calibration::Parameter;
use cathforce_mechanics::Lumen;
use cathforce_reference_solver::{Drive, Flow, Problem, Simulation};
use nalgebra::Vector3;

use crate::clamped::{Chamber, Mesh, TipTendon};
use crate::description::{Description, Range, Surroundings};
use crate::error::IdentificationError;
use crate::expected::{NoisyLoops, NoisyReleases, Repeats, Whitened};
use crate::found::{Found, TrialFound, spread};
use crate::hysteresis::PulledTip;
use crate::pulse::{FlowSetup, FlowValues, InFlow};
use crate::rod::Releases;
use crate::search::{Effort, Experiment, SearchError, identify};
use crate::tendon::OpenVessel;
use crate::trials::{Records, Trial};

/// Edges of the coarse and of the fine rod. `reproduce ice` measures what they change.
const ROD_EDGES: [usize; 2] = [6, 32];
/// Time steps within half a swing, which is as long as the first peak is wide at half of its height: a
/// method of second order with 28 steps a period is late by (2π/28)²/12, half a per cent of it, which
/// defect correction takes out; with 160 by a hundredth of a per cent.
const STEPS_A_PEAK: [f64; 2] = [14.0, 80.0];
/// Links of the coarse and of the fine chain, and longest tick \[s\]; the device allows 10 ms. A tick of
/// 8 ms moves the thickness of a loop by 1 µm from that of one of 1 ms; 12 links instead of 60 move its
/// height by 2 %, 48 by 0.1 %.
const CHAIN_LINKS: [usize; 2] = [12, 60];
const TICK_S: f64 = 25e-3 / 3.0;
/// The device's longest link \[m\].
const LONGEST_LINK_M: f64 = 2e-2;
/// Time steps of a beat, and longest ones \[s\]: the tip follows its own swing of some hertz, too.
const STEPS_A_BEAT: [f64; 2] = [64.0, 384.0];
const FLOW_STEPS_S: [f64; 2] = [12.5e-3, 12.5e-3 / 6.0];
/// Time after which the tip only follows the beats \[s\], and beats that are simulated then: the fit of
/// their harmonics needs two.
const LEAD_S: f64 = 2.5;
const BEATS: f64 = 2.0;

/// Coarse simulations of the multi-start and of each local search; `reproduce` takes as many.
const EFFORT: [usize; 2] = [120, 60];
/// About how many coarse and fine simulations a trial takes, and what a fine one costs in coarse ones;
/// for the progress.
const SIMULATIONS: [u64; 2] = [300, 10];
const FINE_COSTS: u64 = 20;

/// Trials with their records and measured features.
#[derive(Clone, Debug)]
pub struct Study {
    description: Description,
    trials: Vec<Trial>,
    /// Between samples of releases, and width of the narrowest peak \[s\].
    release: [f64; 2],
}

impl Description {
    /// Reads the records, and takes their features. `folder`: of the description. Errors name the record,
    /// with its line where there is one.
    pub fn study(&self, folder: &Path) -> Result<Study, IdentificationError> {
        let (trials, release) = self.read_trials(folder)?;
        Ok(Study { description: self.clone(), trials, release })
    }
}

impl Study {
    /// Records of all trials, and number of trials.
    pub fn counts(&self) -> [usize; 2] {
        [self.trials.iter().map(|own| own.count).sum(), self.trials.len()]
    }

    /// About how much a search computes, in coarse simulations.
    pub fn work(&self) -> u64 {
        self.trials.len() as u64 * (SIMULATIONS[0] + FINE_COSTS * SIMULATIONS[1])
    }

    /// Identifies the parameters of each trial.
    ///
    /// `tell` is called from many threads, with the work done so far. Ends early with
    /// [`IdentificationError::Interrupted`] once `interrupted` is true.
    pub fn fit(
        &self,
        interrupted: &AtomicBool,
        tell: &(dyn Fn(u64) + Sync),
    ) -> Result<Found, IdentificationError> {
        let done = AtomicU64::new(0);
        let tell = |fine: bool| {
            let own = if fine { FINE_COSTS } else { 1 };
            tell(done.fetch_add(own, Ordering::Relaxed) + own);
        };
        let trials = match self.description.surroundings {
            Surroundings::Air => self.fit_releases(interrupted, &tell),
            Surroundings::Tendon(tendon) => self.fit_loops(&tendon, interrupted, &tell),
            Surroundings::Flow { chamber, frequency_hz, width_m } => {
                self.fit_flow(&chamber, frequency_hz, width_m, interrupted, &tell)
            }
        }?;
        Ok(Found { spread: spread(&trials), trials })
    }

    fn fit_releases(
        &self,
        interrupted: &AtomicBool,
        tell: &(dyn Fn(bool) + Sync),
    ) -> Result<Vec<TrialFound>, IdentificationError> {
        let Description { catheter, rod, .. } = &self.description;
        let [sample_s, peak_s] = self.release;
        let problem = |k: usize| {
            let step_s = fitting(sample_s, peak_s / STEPS_A_PEAK[k]);
            catheter.in_air(rod, Mesh { edges: ROD_EDGES[k], step_s })
        };
        let problems = [problem(0), problem(1)];
        let [coarse, fine] = rests(&problems, catheter.length_m)?;
        let one = |(k, own): (usize, &Trial)| {
            let Records::Releases(setup, samples) = &own.records else { return Ok(None) };
            let repeats = Repeats::new(self.description.noise_m, *samples, self.description.seed);
            let experiment = NoisyReleases {
                releases: Releases {
                    setup,
                    coarse: (&problems[0], &coarse),
                    fine: (&problems[1], &fine),
                },
                samples: *samples,
                repeats: &repeats,
            };
            self.search(k, own, &experiment, interrupted, tell).map(Some)
        };
        self.trials.iter().enumerate().map(one).filter_map(Result::transpose).collect()
    }

    fn fit_loops(
        &self,
        tendon: &TipTendon,
        interrupted: &AtomicBool,
        tell: &(dyn Fn(bool) + Sync),
    ) -> Result<Vec<TrialFound>, IdentificationError> {
        let Description { catheter, rod, .. } = &self.description;
        let vessel = OpenVessel::new();
        let failed = |error: String| IdentificationError::Simulation(error);
        let lumen: Lumen<'_> = vessel.lumen().ok_or_else(|| failed("no open vessel".into()))?;
        let fewest = (catheter.length_m / LONGEST_LINK_M).ceil() as usize;
        let rest = |k: usize| {
            let mesh = Mesh { edges: CHAIN_LINKS[k].max(fewest), step_s: TICK_S };
            let description = catheter.pulled(rod, tendon, mesh);
            PulledTip::new(description, catheter.length_m, &lumen)
                .map_err(|error| failed(format!("{error:?}")))
        };
        let (coarse, fine) = (rest(0)?, rest(1)?);
        let one = |(k, own): (usize, &Trial)| {
            let Records::Loops(records, steps_s) = &own.records else { return Ok(None) };
            let repeats = self.description.repeats(records);
            let experiment = NoisyLoops {
                records,
                steps_s,
                coarse: &coarse,
                fine: &fine,
                lumen: &lumen,
                repeats: &repeats,
            };
            self.search(k, own, &experiment, interrupted, tell).map(Some)
        };
        self.trials.iter().enumerate().map(one).filter_map(Result::transpose).collect()
    }

    fn fit_flow(
        &self,
        chamber: &Chamber,
        frequency_hz: f64,
        width_m: f64,
        interrupted: &AtomicBool,
        tell: &(dyn Fn(bool) + Sync),
    ) -> Result<Vec<TrialFound>, IdentificationError> {
        let Description { catheter, rod, .. } = &self.description;
        let step_s = |k: usize| FLOW_STEPS_S[k].min(1.0 / (STEPS_A_BEAT[k] * frequency_hz));
        let problem = |k: usize| {
            let mesh = Mesh { edges: ROD_EDGES[k], step_s: step_s(k) };
            catheter.in_chamber(rod, chamber, mesh)
        };
        let problems = [problem(0), problem(1)];
        let [coarse, fine] = rests(&problems, catheter.length_m)?;
        let flow = Flow {
            density_kg_per_m3: chamber.fluid_density_kg_per_m3,
            // Its size is searched for; this is its direction.
            velocity_m_per_s: Vector3::y(),
            width_m,
            frequency_hz,
            lumen_radius_m: chamber.radius_m,
            ..Flow::default()
        };
        // A sample more, so that rounding leaves two whole beats.
        let sample_s = step_s(0);
        let duration_s = BEATS / frequency_hz + sample_s;
        let length_m = catheter.length_m;
        let setup = FlowSetup { length_m, flow, lead_s: LEAD_S, duration_s, sample_s };
        let values: Vec<f64> = self.description.parameters.iter().map(|own| own.start()).collect();
        let middle = FlowValues::of_array(std::array::from_fn(|k| values[k]));
        let experiment = InFlow {
            setup: &setup,
            coarse: (&problems[0], &coarse),
            fine: (&problems[1], &fine),
            velocity_m_per_s: middle.velocity_m_per_s,
        };
        let one = |(k, own): (usize, &Trial)| self.search(k, own, &experiment, interrupted, tell);
        self.trials.iter().enumerate().map(one).collect()
    }

    /// Searches for the parameters of one trial.
    fn search(
        &self,
        k: usize,
        trial: &Trial,
        experiment: &dyn Experiment,
        interrupted: &AtomicBool,
        tell: &(dyn Fn(bool) + Sync),
    ) -> Result<TrialFound, IdentificationError> {
        let searched = self.description.searched();
        let parameters: Vec<Parameter> =
            searched.map(|(own, [low, high])| Parameter::new(own.name, low, high)).collect();
        let whitened = Whitened { experiment, triangles: &trial.triangles };
        let held = Held { experiment: &whitened, ranges: &self.description.parameters };
        let seed = self.description.seed.wrapping_add(k as u64);
        let effort = Effort { global: EFFORT[0], local: EFFORT[1], seed };
        let found = identify(&parameters, &held, &trial.measured, effort, interrupted, tell)
            .map_err(|error| match error {
                SearchError::Interrupted => IdentificationError::Interrupted,
                // What was interrupted may have come to no end.
                _ if interrupted.load(Ordering::Relaxed) => IdentificationError::Interrupted,
                error => IdentificationError::Search { trial: k + 1, error },
            })?;
        let counts = [trial.count, trial.measured.features.len()];
        Ok(TrialFound::of(&self.description, k + 1, counts, &found))
    }
}

/// A step that is at most as long as the wanted one and fits a whole number of times into a sample's, or a
/// whole number of samples that is nearest below it.
fn fitting(sample_s: f64, wanted_s: f64) -> f64 {
    match sample_s > wanted_s {
        true => sample_s / (sample_s / wanted_s).ceil(),
        false => sample_s * (wanted_s / sample_s).floor(),
    }
}

/// The catheter at rest on the coarse and on the fine mesh.
fn rests(
    problems: &[Problem; 2],
    length_m: f64,
) -> Result<[Simulation<'_>; 2], IdentificationError> {
    let at = Drive { insertion_m: length_m, rotation_rad: 0.0 };
    let (coarse, fine) = rayon::join(
        || Simulation::settled(&problems[0], at),
        || Simulation::settled(&problems[1], at),
    );
    let failed = |error| IdentificationError::Simulation(format!("it finds no rest: {error}"));
    Ok([coarse.map_err(failed)?, fine.map_err(failed)?])
}

/// An experiment of which some parameters are known.
struct Held<'a> {
    experiment: &'a dyn Experiment,
    ranges: &'a [Range],
}

impl Experiment for Held<'_> {
    fn features(&self, values: &[f64], fine: bool) -> Option<Vec<f64>> {
        let mut free = values.iter();
        let value = |own: &Range| match *own {
            Range::Known(value) => Some(value),
            Range::Within(_) => free.next().copied(),
        };
        let all: Option<Vec<f64>> = self.ranges.iter().map(value).collect();
        self.experiment.features(&all?, fine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_fits_into_a_sample_or_holds_whole_ones() {
        assert!((fitting(0.025, 0.01) - 0.025 / 3.0).abs() < 1e-12);
        assert!((fitting(0.001, 0.0125) - 0.012).abs() < 1e-12);
        assert!((fitting(0.01, 0.01) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn what_is_known_is_not_searched_for() {
        struct Sum;
        impl Experiment for Sum {
            fn features(&self, values: &[f64], _: bool) -> Option<Vec<f64>> {
                Some(values.to_vec())
            }
        }
        let ranges = [Range::Known(7.0), Range::Within([0.0, 1.0]), Range::Known(8.0)];
        let held = Held { experiment: &Sum, ranges: &ranges };
        assert_eq!(held.features(&[0.5], true), Some(vec![7.0, 0.5, 8.0]));
    }
}
