//! The records of a description as trials: read, checked, and turned into features.

use std::path::Path;

use nalgebra::DMatrix;

use crate::description::{Description, Surroundings, TrialFiles};
use crate::error::IdentificationError;
use crate::expected::{Repeats, of_release, whitened_measured};
use crate::hysteresis::LoopError;
use crate::pulse::{PulseError, PulseFeatures, PulseRecord, measured_pulse, pulse_features};
use crate::record::{HEIGHT, POSITION, Sampled, TENDON, TIP};
use crate::rod::{ReleaseSetup, measured_releases};
use crate::search::Measured;
use crate::tendon::{LoopRecord, measured_loops};
use crate::weight_release::{Release, ReleaseError};

/// Samples of a record at least; what is fewer has no features.
const FEWEST_SAMPLES: usize = 20;
/// Steps of two records of one catheter may differ by this share; they are simulated with one step.
const SAME_STEP: f64 = 1e-3;

#[derive(Clone, Debug)]
pub(crate) struct Trial {
    pub records: Records,
    /// Features times L⁻¹.
    pub measured: Measured,
    /// L of each record.
    pub triangles: Vec<DMatrix<f64>>,
    pub count: usize,
}

#[derive(Clone, Debug)]
pub(crate) enum Records {
    /// With the samples of each.
    Releases(ReleaseSetup, usize),
    Loops(Vec<LoopRecord>, Vec<f64>),
    Flow,
}

impl Description {
    /// The trials, and between samples of releases and the width of the narrowest peak \[s\].
    pub(crate) fn read_trials(
        &self,
        folder: &Path,
    ) -> Result<(Vec<Trial>, [f64; 2]), IdentificationError> {
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
        Ok((trials, release.unwrap_or_default()))
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
    pub(crate) fn repeats(&self, records: &[LoopRecord]) -> Repeats {
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
