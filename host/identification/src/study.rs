//! Records of a description, and what is identified from them.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use cathforce_calibration::Parameter;
use cathforce_mechanics::Lumen;
use cathforce_reference_solver::{Drive, Flow, Problem, Simulation};
use nalgebra::{DMatrix, Vector3};
use serde::Serialize;

use crate::clamped::{Chamber, Mesh, TipTendon};
use crate::description::{Description, Range, Surroundings, TrialFiles};
use crate::error::IdentificationError;
use crate::expected::{
    NoisyLoops, NoisyReleases, Repeats, Whitened, of_release, whitened_measured,
};
use crate::hysteresis::{LoopError, PulledTip};
use crate::pulse::{
    FlowSetup, FlowValues, InFlow, PulseError, PulseFeatures, PulseRecord, measured_pulse,
    pulse_features,
};
use crate::quantity::Quantity;
use crate::record::{HEIGHT, POSITION, Sampled, TENDON, TIP};
use crate::rod::{ReleaseSetup, Releases, measured_releases};
use crate::search::{Effort, Experiment, Identified, Measured, SearchError, identify};
use crate::spread::Spread;
use crate::tendon::{LoopRecord, OpenVessel, measured_loops};
use crate::weight_release::{Release, ReleaseError};

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

/// Samples of a record at least; what is fewer has no features.
const FEWEST_SAMPLES: usize = 20;
/// Steps of two records of one catheter may differ by this share; they are simulated with one step.
const SAME_STEP: f64 = 1e-3;

/// Coarse simulations of the multi-start and of each local search; `reproduce` takes as many.
const EFFORT: [usize; 2] = [120, 60];
/// About how many coarse and fine simulations a trial takes, and what a fine one costs in coarse ones;
/// for the progress.
const SIMULATIONS: [u64; 2] = [300, 10];
const FINE_COSTS: u64 = 20;

/// Standard deviations of a normal distribution on either side within which 95 of 100 lie.
const NINETY_FIVE: f64 = 1.959_964;
/// A value is at a bound when it is nearer to it than this share of the way between both.
const AT_BOUND: f64 = 1e-2;

/// Trials with their records and measured features.
#[derive(Clone, Debug)]
pub struct Study {
    description: Description,
    trials: Vec<Trial>,
    /// Between samples of releases, and width of the narrowest peak \[s\].
    release: [f64; 2],
}

#[derive(Clone, Debug)]
struct Trial {
    records: Records,
    /// Features times L⁻¹.
    measured: Measured,
    /// L of each record.
    triangles: Vec<DMatrix<f64>>,
    count: usize,
}

#[derive(Clone, Debug)]
enum Records {
    /// With the samples of each.
    Releases(ReleaseSetup, usize),
    Loops(Vec<LoopRecord>, Vec<f64>),
    Flow,
}

/// How a parameter's value is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Known {
    /// From the records.
    Found,
    /// The description states it.
    Given,
    /// The records do not tell it.
    NotTold,
}

/// A parameter after a search.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterFound {
    pub name: &'static str,
    pub unit: &'static str,
    pub known: Known,
    /// `None` of one that is not told.
    pub value: Option<f64>,
    /// By the noise of the sensor, in the parameter's unit; of one that is not told, how far it would have
    /// to change for these records to show it.
    pub sd: Option<f64>,
    /// Within the bounds.
    pub interval_95: Option<[f64; 2]>,
    pub bounds: Option<[f64; 2]>,
    /// Whether the value is at one of its bounds, and may lie beyond.
    pub at_bound: bool,
    /// What would tell a parameter that is not told.
    pub advice: Option<String>,
}

/// Two parameters of which the records tell a combination only.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairFound {
    pub first: String,
    pub second: String,
    /// Of their errors, from −1 to 1.
    pub correlation: f64,
    /// What to measure to tell them apart.
    pub advice: String,
}

/// What one trial tells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrialFound {
    /// From 1.
    pub trial: usize,
    pub records: usize,
    pub features: usize,
    pub parameters: Vec<ParameterFound>,
    pub inseparable: Vec<PairFound>,
    /// Sum of the squared differences of features over their noise, by feature: near 1 where the model
    /// explains the records.
    pub cost_per_feature: f64,
    /// Coarse and fine ones.
    pub simulations: [usize; 2],
}

/// What several trials make of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpreadFound {
    pub name: &'static str,
    pub unit: &'static str,
    /// Trials that tell it.
    pub trials: usize,
    /// Mean, least and largest value over those trials, and standard deviation among them.
    pub nominal: f64,
    pub lower: f64,
    pub upper: f64,
    pub sd: f64,
}

/// What all trials tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    pub trials: Vec<TrialFound>,
    /// Empty of a single trial.
    pub spread: Vec<SpreadFound>,
}

impl Description {
    /// Reads the records, and takes their features. `folder`: of the description. Errors name the record,
    /// with its line where there is one.
    pub fn study(&self, folder: &Path) -> Result<Study, IdentificationError> {
        let mut release: Option<[f64; 2]> = None;
        let mut trials = Vec::new();
        for files in &self.trials {
            let own = match files {
                TrialFiles::Releases(files) => {
                    let files: Vec<(f64, std::path::PathBuf)> =
                        files.iter().map(|(kg, file)| (*kg, folder.join(file))).collect();
                    self.releases(&files, &mut release)?
                }
                TrialFiles::Loops(files) => self.loops(files, folder)?,
                TrialFiles::Flow { record, rest_m } => self.pulse(&folder.join(record), *rest_m)?,
            };
            trials.push(own);
        }
        let release = release.unwrap_or_default();
        Ok(Study { description: self.clone(), trials, release })
    }

    fn sampled(&self, path: &Path, names: &[&str]) -> Result<Sampled, IdentificationError> {
        let own = Sampled::read(path, names, self.catheter.length_m)?;
        match own.samples() {
            samples if samples < FEWEST_SAMPLES => Err(own.refused(
                format!("the record has {samples} samples"),
                "record longer, or sample faster: 20 samples at least, 10 a swing are good",
            )),
            _ => Ok(own),
        }
    }

    fn releases(
        &self,
        files: &[(f64, std::path::PathBuf)],
        known: &mut Option<[f64; 2]>,
    ) -> Result<Trial, IdentificationError> {
        let sampled: Result<Vec<Sampled>, _> =
            files.iter().map(|(_, file)| self.sampled(file, &[HEIGHT])).collect();
        let sampled = sampled?;
        let step_s = known
            .map_or_else(|| sampled.first().map_or(0.0, |own| own.step_s), |[step_s, _]| step_s);
        for own in &sampled {
            if (own.step_s / step_s - 1.0).abs() > SAME_STEP {
                let cause = format!(
                    "its rows are {:.6} s apart, and those of the first record {step_s:.6} s",
                    own.step_s
                );
                return Err(own.refused(cause, "resample all records to the same step"));
            }
        }
        // All releases of a trial are compared over the shortest one's time.
        let count = sampled.iter().map(Sampled::samples).min().unwrap_or(0);
        let cut = |own: &Sampled| Release { position_m: own.columns[0][..count].to_vec(), step_s };
        let records: Vec<Release> = sampled.iter().map(cut).collect();
        let measured =
            measured_releases(&records, self.noise_m, self.seed).map_err(|(k, error)| {
                sampled[k].refused(cause_of_release(error), fix_of_release(error))
            })?;
        // The fifth of six features.
        let peaks = measured.features.iter().skip(4).step_by(6).copied();
        let narrowest_s = peaks.fold(known.map_or(f64::INFINITY, |[_, s]| s), f64::min);
        *known = Some([step_s, narrowest_s]);
        let setup = ReleaseSetup {
            diameter_m: self.catheter.bending_diameter_m,
            poisson: self.catheter.poisson,
            length_m: self.catheter.length_m,
            weights_kg: files.iter().map(|(weight_kg, _)| *weight_kg).collect(),
            duration_s: (count - 1) as f64 * step_s,
            sample_s: step_s,
        };
        let repeats = Repeats::new(self.noise_m, count, self.seed);
        let triangle = |(k, own): (usize, &Release)| {
            repeats.triangle(&own.position_m, &measured.sd[6 * k..6 * k + 6], |own| {
                of_release(own, step_s)
            })
        };
        let triangles = records.iter().enumerate().map(triangle).collect();
        self.trial(Records::Releases(setup, count), &measured, triangles, &sampled)
    }

    fn loops(
        &self,
        files: &[std::path::PathBuf],
        folder: &Path,
    ) -> Result<Trial, IdentificationError> {
        let read = |file: &std::path::PathBuf| self.sampled(&folder.join(file), &[TENDON, TIP]);
        let sampled: Vec<Sampled> = files.iter().map(read).collect::<Result<_, _>>()?;
        let record = |own: &Sampled| LoopRecord {
            tendon_m: own.columns[0].clone(),
            tip_m: own.columns[1].clone(),
        };
        let records: Vec<LoopRecord> = sampled.iter().map(record).collect();
        let measured = measured_loops(&records, self.noise_m, self.seed)
            .map_err(|(k, error)| sampled[k].refused(cause_of_loop(error), FIX_OF_LOOP))?;
        let steps_s = sampled.iter().map(|own| own.step_s).collect();
        let repeats = self.repeats(&records);
        let triangle = |(k, own): (usize, &LoopRecord)| {
            repeats.triangle(&own.tip_m, &measured.sd[5 * k..5 * k + 5], |tip_m| {
                own.features_of(tip_m)
            })
        };
        let triangles = records.iter().enumerate().map(triangle).collect();
        self.trial(Records::Loops(records, steps_s), &measured, triangles, &sampled)
    }

    fn pulse(&self, path: &Path, rest_m: f64) -> Result<Trial, IdentificationError> {
        let own = self.sampled(path, &[POSITION])?;
        let frequency_hz = match self.surroundings {
            Surroundings::Flow { frequency_hz, .. } => frequency_hz,
            _ => 0.0,
        };
        let record = PulseRecord {
            position_m: own.columns[0].clone(),
            step_s: own.step_s,
            from_s: own.from_s,
            frequency_hz,
            rest_m,
        };
        let measured = measured_pulse(&record, self.noise_m, self.seed)
            .map_err(|error| own.refused(cause_of_pulse(error), fix_of_pulse(error)))?;
        let repeats = Repeats::new(self.noise_m, record.position_m.len(), self.seed);
        let triangle = repeats.triangle(&record.position_m, &measured.sd, |position_m| {
            let noisy = PulseRecord { position_m: position_m.to_vec(), ..record.clone() };
            pulse_features(&noisy).ok().map(PulseFeatures::to_array)
        });
        let triangles = triangle.map(|own| vec![own]);
        self.trial(Records::Flow, &measured, triangles, std::slice::from_ref(&own))
    }

    /// Noise for records of loops.
    fn repeats(&self, records: &[LoopRecord]) -> Repeats {
        let samples = records.iter().map(|own| own.tip_m.len()).max().unwrap_or(0);
        Repeats::new(self.noise_m, samples, self.seed)
    }

    fn trial(
        &self,
        records: Records,
        measured: &Measured,
        triangles: Option<Vec<DMatrix<f64>>>,
        sampled: &[Sampled],
    ) -> Result<Trial, IdentificationError> {
        let whole = triangles.and_then(|own| Some((whitened_measured(measured, &own)?, own)));
        let Some((measured, triangles)) = whole else {
            let fix = "check that `noise_m` is in metres, and that the record is no drawing";
            return Err(sampled[0].refused("the noise of its features has no spread", fix));
        };
        Ok(Trial { records, measured, triangles, count: sampled.len() })
    }
}

fn cause_of_release(error: ReleaseError) -> String {
    match error {
        ReleaseError::NoSwing => {
            "the tip does not swing: after its first peak it has no valley and no second peak"
                .into()
        }
        ReleaseError::NoRise => "the tip does not rise from where it hung".into(),
        error => error.to_string(),
    }
}

fn fix_of_release(error: ReleaseError) -> &'static str {
    match error {
        ReleaseError::NoSwing => {
            "record longer, sample faster, or release a heavier weight; check that `noise_m` is in metres"
        }
        ReleaseError::NoRise => {
            "let `height_m` point up, and begin the record while the weight still hangs"
        }
        _ => "record from the release until the tip is at rest again",
    }
}

const FIX_OF_LOOP: &str = "pull the tendon to its end, let it out, and pull it to its end again; check the sign of `tendon_m`, and \
     that `noise_m` is in metres";

fn cause_of_loop(error: LoopError) -> String {
    match error {
        LoopError::NoLoop => "the tendon is not pulled, let out and pulled again".into(),
        error => error.to_string(),
    }
}

fn cause_of_pulse(error: PulseError) -> String {
    let whole = error.to_string();
    whole.split(';').next().unwrap_or_default().to_owned()
}

fn fix_of_pulse(error: PulseError) -> &'static str {
    match error {
        PulseError::TooShort { .. } => "record two whole beats at least; check `frequency_hz`",
        PulseError::TooSparse(_) => "sample seven times a beat at least; check `frequency_hz`",
        _ => "check the record",
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
        Ok(self.told(k, trial, &found))
    }

    fn told(&self, k: usize, trial: &Trial, found: &Identified) -> TrialFound {
        let Description { kind, parameters, .. } = &self.description;
        let mut searched = 0;
        let parameter = |(own, range): (&Quantity, &Range)| match *range {
            Range::Known(value) => given(own, value),
            Range::Within(bounds) => {
                let k = searched;
                searched += 1;
                parameter_found(own, bounds, found.values[k], found.sd[k], found.told[k])
            }
        };
        let parameters = kind.quantities().iter().zip(parameters).map(parameter).collect();
        let inseparable = found.inseparable.iter().map(|pair| {
            let advice = [&pair.first, &pair.second].map(|name| {
                let own = kind.quantities().iter().find(|own| own.name == name);
                format!("give `{name}` as a number ({})", own.map_or("", |own| own.alone))
            });
            PairFound {
                first: pair.first.clone(),
                second: pair.second.clone(),
                correlation: pair.correlation,
                advice: advice.join(", or "),
            }
        });
        let features = trial.measured.features.len();
        TrialFound {
            trial: k + 1,
            records: trial.count,
            features,
            parameters,
            inseparable: inseparable.collect(),
            cost_per_feature: found.cost / features as f64,
            simulations: found.evaluations,
        }
    }
}

fn given(own: &Quantity, value: f64) -> ParameterFound {
    ParameterFound {
        name: own.name,
        unit: own.unit,
        known: Known::Given,
        value: Some(value),
        sd: None,
        interval_95: None,
        bounds: None,
        at_bound: false,
        advice: None,
    }
}

fn parameter_found(
    own: &Quantity,
    bounds: [f64; 2],
    value: f64,
    sd: f64,
    told: bool,
) -> ParameterFound {
    let [low, high] = bounds;
    let margin = AT_BOUND * (high - low);
    let ends = [value - NINETY_FIVE * sd, value + NINETY_FIVE * sd];
    ParameterFound {
        name: own.name,
        unit: own.unit,
        known: if told { Known::Found } else { Known::NotTold },
        value: told.then_some(value),
        sd: Some(sd),
        interval_95: told.then_some(ends.map(|end| end.clamp(low, high))),
        bounds: Some(bounds),
        at_bound: told && (value - low < margin || high - value < margin),
        advice: (!told).then(|| format!("{}; or {}, and give it as a number", own.more, own.alone)),
    }
}

/// Nominal value and bounds over trials; empty of a single one.
fn spread(trials: &[TrialFound]) -> Vec<SpreadFound> {
    let Some(first) = trials.first().filter(|_| trials.len() > 1) else { return Vec::new() };
    let of = |(k, own): (usize, &ParameterFound)| {
        let all = trials.iter().map(|trial| &trial.parameters[k]);
        let values: Vec<f64> =
            all.filter(|own| own.known == Known::Found).filter_map(|own| own.value).collect();
        let Spread { nominal, lower, upper, sd } = Spread::of(&values)?;
        let (name, unit, trials) = (own.name, own.unit, values.len());
        Some(SpreadFound { name, unit, trials, nominal, lower, upper, sd })
    };
    first.parameters.iter().enumerate().filter_map(of).collect()
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
    use crate::quantity::OF_RELEASE;

    #[test]
    fn a_step_fits_into_a_sample_or_holds_whole_ones() {
        assert!((fitting(0.025, 0.01) - 0.025 / 3.0).abs() < 1e-12);
        assert!((fitting(0.001, 0.0125) - 0.012).abs() < 1e-12);
        assert!((fitting(0.01, 0.01) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_told_has_advice_and_what_is_has_an_interval_within_its_bounds() {
        let own = &OF_RELEASE[4];
        let found = parameter_found(own, [1e-3, 9e-3], 2e-3, 1e-3, true);
        let [low, high] = found.interval_95.unwrap();
        assert!(low == 1e-3 && (high - 3.96e-3).abs() < 1e-5 && !found.at_bound, "{found:?}");
        let found = parameter_found(own, [1e-3, 9e-3], 5e-3, 1.0, false);
        assert!(found.value.is_none() && found.advice.unwrap().contains("weigh"));
        assert!(parameter_found(own, [1e-3, 9e-3], 8.99e-3, 1e-3, true).at_bound);
    }

    #[test]
    fn trials_have_a_spread_and_one_trial_has_none() {
        let trial = |value: f64| TrialFound {
            trial: 1,
            records: 1,
            features: 6,
            parameters: vec![
                parameter_found(&OF_RELEASE[0], [0.0, 10.0], value, 1.0, true),
                parameter_found(&OF_RELEASE[1], [0.0, 10.0], value, 1.0, false),
            ],
            inseparable: Vec::new(),
            cost_per_feature: 1.0,
            simulations: [1, 1],
        };
        assert!(spread(&[trial(1.0)]).is_empty());
        let [own] = spread(&[trial(1.0), trial(3.0)])[..] else { panic!("the told one only") };
        assert_eq!((own.nominal, own.lower, own.upper, own.trials), (2.0, 1.0, 3.0, 2));
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
