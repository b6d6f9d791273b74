//! A catheter in a pulsating flow: features of its tip's record, and amplitude, phase and drag from them.

use std::f64::consts::TAU;

use cathforce_calibration::Parameter;
use cathforce_reference_solver::{Drive, Flow, Problem, Simulation, SolveError};
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

use crate::noise::feature_sd;
use crate::search::{Experiment, Measured};

/// Harmonics of the pulse that are fitted to a record. The force of a pulse (1 + Z sin)² has two; the
/// third is what the catheter's own motion and its bent shape add.
const HARMONICS: usize = 3;
/// Unknowns of that fit: the mean, and a cosine and a sine of each.
const UNKNOWNS: usize = 1 + 2 * HARMONICS;
/// Places over a beat at which the fitted pulse is looked at for its peak and its trough: the parabola
/// between two of them rises by (π/200)²/2, a hundredth of a per cent of the amplitude.
const PLACES: usize = 200;

/// Five features of a record of the tip in a pulsating flow. Displacements are along the flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseFeatures {
    /// Mean displacement from where the tip rests without flow \[m\].
    pub shift_m: f64,
    /// Largest and least displacement from that mean over a beat \[m\].
    pub peak_m: f64,
    pub trough_m: f64,
    /// Amplitudes of cos ωt and of sin ωt at the frequency of the beats: they tell the phase \[m\].
    pub cosine_m: f64,
    pub sine_m: f64,
}

impl PulseFeatures {
    /// The features in the order of their declaration.
    pub fn to_array(self) -> [f64; 5] {
        let Self { shift_m, peak_m, trough_m, cosine_m, sine_m } = self;
        [shift_m, peak_m, trough_m, cosine_m, sine_m]
    }
}

/// Why a record has no pulse.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum PulseError {
    #[error(
        "the record lasts {beats:.2} beats of {frequency_hz} Hz; record two whole ones at least"
    )]
    TooShort { beats: f64, frequency_hz: f64 },
    #[error("the record has {0:.1} samples a beat; sample {UNKNOWNS} times a beat at least")]
    TooSparse(f64),
    #[error("sample {0} is not a finite number")]
    NotFinite(usize),
    #[error("step {step_s} s and frequency {frequency_hz} Hz have to be above 0")]
    Clock { step_s: f64, frequency_hz: f64 },
}

/// A record of the tip's displacement along a flow.
#[derive(Clone, Debug, PartialEq)]
pub struct PulseRecord {
    /// From the entry, along the flow \[m\].
    pub position_m: Vec<f64>,
    pub step_s: f64,
    /// Time of the first sample on the clock of the beats \[s\].
    pub from_s: f64,
    /// Frequency of the beats \[Hz\].
    pub frequency_hz: f64,
    /// Position of the tip without flow \[m\].
    pub rest_m: f64,
}

/// Features of a record, by a least-squares fit of three harmonics of the beat.
pub fn pulse_features(record: &PulseRecord) -> Result<PulseFeatures, PulseError> {
    let PulseRecord { step_s, from_s, frequency_hz, rest_m, ref position_m } = *record;
    if !(step_s > 0.0 && frequency_hz > 0.0) {
        return Err(PulseError::Clock { step_s, frequency_hz });
    }
    if let Some(sample) = position_m.iter().position(|x| !x.is_finite()) {
        return Err(PulseError::NotFinite(sample));
    }
    let beats = position_m.len() as f64 * step_s * frequency_hz;
    if beats < 2.0 {
        return Err(PulseError::TooShort { beats, frequency_hz });
    }
    let each = position_m.len() as f64 / beats;
    if each < UNKNOWNS as f64 {
        return Err(PulseError::TooSparse(each));
    }
    let wave = |beat: f64, column: usize| match column {
        0 => 1.0,
        odd if odd % 2 == 1 => (TAU * beat * odd.div_ceil(2) as f64).cos(),
        even => (TAU * beat * (even / 2) as f64).sin(),
    };
    let beat = |k: usize| (from_s + k as f64 * step_s) * frequency_hz;
    let waves = DMatrix::from_fn(position_m.len(), UNKNOWNS, |k, column| wave(beat(k), column));
    let normal = waves.tr_mul(&waves);
    let right = waves.tr_mul(&DVector::from_column_slice(position_m));
    let fitted = normal.cholesky().ok_or(PulseError::TooSparse(each))?.solve(&right);
    let over = |place: usize| {
        let beat = place as f64 / PLACES as f64;
        (1..UNKNOWNS).map(|column| fitted[column] * wave(beat, column)).sum::<f64>()
    };
    let (trough_m, peak_m) = (0..PLACES)
        .map(over)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    Ok(PulseFeatures {
        shift_m: fitted[0] - rest_m,
        peak_m,
        trough_m,
        cosine_m: fitted[1],
        sine_m: fitted[2],
    })
}

/// What a flow does that is searched for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowValues {
    /// Z, the amplitude of the pulse over the mean \[1\].
    pub pulse_ratio: f64,
    /// Φ, at time 0 \[rad\].
    pub phase_rad: f64,
    /// C, the drag coefficient \[1\].
    pub coefficient: f64,
    /// M, the largest mean velocity of the profile \[m/s\].
    pub velocity_m_per_s: f64,
}

impl FlowValues {
    /// Names in the order of [`FlowValues::to_array`], with their units.
    pub const NAMES: [&'static str; 4] =
        ["pulse_ratio", "phase_rad", "drag_coefficient", "velocity_m_per_s"];

    /// In the order of their declaration.
    pub fn to_array(self) -> [f64; 4] {
        let Self { pulse_ratio, phase_rad, coefficient, velocity_m_per_s } = self;
        [pulse_ratio, phase_rad, coefficient, velocity_m_per_s]
    }

    /// From the same order.
    pub fn of_array([pulse_ratio, phase_rad, coefficient, velocity_m_per_s]: [f64; 4]) -> Self {
        Self { pulse_ratio, phase_rad, coefficient, velocity_m_per_s }
    }

    /// Parameters to search for between two sets of values, from their middle. The velocity is the last
    /// one; without it a search leaves it at what is known.
    pub fn parameters(low: Self, high: Self) -> Vec<Parameter> {
        let bounds = low.to_array().into_iter().zip(high.to_array());
        let named = Self::NAMES.into_iter().zip(bounds);
        named.map(|(name, (low, high))| Parameter::new(name, low, high)).collect()
    }
}

/// How the tip is recorded in a flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowSetup {
    /// Free length \[m\].
    pub length_m: f64,
    /// Density of the fluid, area, direction, frequency and profile; what is searched for is replaced.
    pub flow: Flow,
    /// Time that the flow has run before the record begins, and the record's duration \[s\].
    pub lead_s: f64,
    pub duration_s: f64,
    /// Between samples of the sensor \[s\].
    pub sample_s: f64,
}

impl FlowSetup {
    /// The record of a sensor without noise.
    ///
    /// `problem` holds the catheter, the chamber and the numerics, and no flow; its step fits a whole
    /// number of times into `sample_s`. `rest`: at rest in it.
    pub fn record(
        &self,
        values: &FlowValues,
        problem: &Problem,
        rest: &Simulation<'_>,
    ) -> Result<PulseRecord, SolveError> {
        let along = self.flow.velocity_m_per_s.normalize();
        let mut own = problem.clone();
        own.beyond.flow = Flow {
            coefficient: values.coefficient,
            velocity_m_per_s: along * values.velocity_m_per_s,
            pulse_ratio: values.pulse_ratio,
            phase_rad: values.phase_rad,
            ..self.flow
        };
        let at = Drive { insertion_m: self.length_m, rotation_rad: 0.0 };
        let place = |simulation: &Simulation<'_>| {
            (simulation.sample().tip_m - own.entry.position_m).dot(&along)
        };
        let rest_m = place(rest);
        let mut simulation = rest.clone().released(&own);
        let step_s = own.numerics.step_s;
        let every = ((self.sample_s / step_s).round() as usize).max(1);
        let lead = (self.lead_s / step_s).round() as usize;
        let mut position_m = Vec::new();
        for k in 0..lead + (self.duration_s / step_s).round() as usize {
            simulation.step(step_s, at)?;
            if k >= lead && (k - lead).is_multiple_of(every) {
                position_m.push(place(&simulation));
            }
        }
        Ok(PulseRecord {
            position_m,
            step_s: step_s * every as f64,
            from_s: (lead + 1) as f64 * step_s,
            frequency_hz: self.flow.frequency_hz,
            rest_m,
        })
    }
}

/// Records in a flow, simulated on a coarse and on a fine mesh.
pub struct InFlow<'a> {
    pub setup: &'a FlowSetup,
    /// Problem and rest on the coarse and on the fine mesh.
    pub coarse: (&'a Problem, &'a Simulation<'a>),
    pub fine: (&'a Problem, &'a Simulation<'a>),
    /// M where it is not searched for \[m/s\].
    pub velocity_m_per_s: f64,
}

impl Experiment for InFlow<'_> {
    fn features(&self, values: &[f64], fine: bool) -> Option<Vec<f64>> {
        let values = match *values {
            [ratio, phase, coefficient] => [ratio, phase, coefficient, self.velocity_m_per_s],
            [ratio, phase, coefficient, velocity] => [ratio, phase, coefficient, velocity],
            _ => return None,
        };
        let (problem, rest) = if fine { self.fine } else { self.coarse };
        let record = self.setup.record(&FlowValues::of_array(values), problem, rest).ok()?;
        Some(pulse_features(&record).ok()?.to_array().to_vec())
    }
}

/// Features of a measured record, and what white noise of standard deviation `noise_m` makes of them.
pub fn measured_pulse(
    record: &PulseRecord,
    noise_m: f64,
    seed: u64,
) -> Result<Measured, PulseError> {
    let found = pulse_features(record)?;
    let features = |position_m: &[f64]| {
        let noisy = PulseRecord { position_m: position_m.to_vec(), ..record.clone() };
        pulse_features(&noisy).ok().map(PulseFeatures::to_array)
    };
    let sd = feature_sd(&record.position_m, noise_m, seed, features);
    let sd = sd.ok_or(PulseError::TooShort { beats: 0.0, frequency_hz: record.frequency_hz })?;
    Ok(Measured { features: found.to_array().to_vec(), sd: sd.to_vec() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(of: impl Fn(f64) -> f64) -> PulseRecord {
        let (step_s, from_s) = (0.025, 3.0);
        let position_m = (0..200).map(|k| of(from_s + f64::from(k) * step_s)).collect();
        PulseRecord { position_m, step_s, from_s, frequency_hz: 1.2, rest_m: 1e-3 }
    }

    #[test]
    fn a_pulse_of_two_harmonics_has_the_features_of_its_closed_form() {
        let omega = TAU * 1.2;
        // sin² = (1 − cos 2ωt)/2, as in the force of a pulse.
        let found = pulse_features(&record(|t| {
            let s = (omega * t + 0.4).sin();
            1e-3 * (3.0 + 2.0 * s + s * s)
        }))
        .unwrap();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}: {found:?}");
        near(found.shift_m, 2.5e-3);
        // s² + 2 s − ½ over s from −1 to 1.
        near(found.peak_m, 2.5e-3);
        near(found.trough_m, -1.5e-3);
        near(found.cosine_m, 2e-3 * 0.4f64.sin());
        near(found.sine_m, 2e-3 * 0.4f64.cos());
    }

    #[test]
    fn what_has_no_pulse_says_why() {
        let whole = record(|t| t);
        let short = PulseRecord { position_m: whole.position_m[..30].to_vec(), ..whole.clone() };
        assert!(matches!(pulse_features(&short), Err(PulseError::TooShort { .. })));
        let sparse = PulseRecord { step_s: 0.2, ..whole.clone() };
        assert!(matches!(pulse_features(&sparse), Err(PulseError::TooSparse(_))));
        let still = PulseRecord { step_s: 0.0, ..whole.clone() };
        assert!(matches!(pulse_features(&still), Err(PulseError::Clock { .. })));
        let mut broken = whole;
        broken.position_m[9] = f64::NAN;
        assert_eq!(pulse_features(&broken), Err(PulseError::NotFinite(9)));
    }
}
