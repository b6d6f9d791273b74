//! A transmission as a [`Plant`]: prepared trials, and their predicted outputs.

use cathforce_bundle::bundle::{
    Axis, Bundle, Plant as RigPlant, RigPriors, TransmissionRig, TrialData, columns,
};

use super::effects::{Is, MOST_SLACK, Scale, at_point, library};
use super::model::Model;
use super::prepare::{Measured, Motion, Rows, grid_s};
use super::segments;
use crate::data::duplicate_trials::without_copies;
use crate::drive::effects::follow;
use crate::plant::{
    Channel, Effect, Nuisance, Plant, Point, Quantity, Repeat, Sample, Segment, Trial, Units,
};
use crate::rounding::significant;

/// Slower than this share of the largest speed is standing; slow, and fast.
const STANDING_SHARE: f64 = 0.01;
const SLOW_SHARE: f64 = 1.0 / 3.0;
const FAST_SHARE: f64 = 2.0 / 3.0;
/// Share of the output's range that models of hysteresis leave of a real transmission. Models of Prandtl and Ishlinskii
/// leave 1 to 2 % RMS of cables and sheaths; the amplitude of the discrepancy goes up to four times this.
const OPEN_SHARE: f64 = 4e-3;
/// What the true model leaves of the output, over its range: between two rows an input is taken for a straight line, and
/// the corners of a branch lie between grid points. Made transmissions with rows 5 ms apart are left 1e-5 to 3e-5.
const RESOLUTION: f64 = 3e-5;
/// Share of the range from which on a floor hides slack that matters.
const HIDING: f64 = 0.01;
/// Standard deviations beyond which a residual is what the corner of a branch leaves, as of a drive.
const FAR_OFF: f64 = 10.0;
/// Standard deviation of the output's zero in a trial, over its range, and of a shift in time \[s\].
const ZERO_SHARE: f64 = 2.5e-3;
const SHIFT_SD_S: f64 = 3e-3;
/// Blocks of a trial.
const BLOCKS: usize = 4;
/// Fewest rows of a trial.
const FEWEST_ROWS: usize = 100;
/// Order of the nuisances.
const ZERO: usize = 0;
const TIME_SHIFT: usize = 1;
/// Slopes of the measured output over the predicted one that a gain may explain; beyond, a unit is wrong.
const GAINS: std::ops::RangeInclusive<f64> = 0.4..=2.5;
/// Correlation from which on such a slope means anything.
const ALIKE: f64 = 0.8;
/// Digits of a ratio that is told.
const DIGITS: u8 = 3;

const PHASES: [&str; 3] = ["standing", "reversal", "moving"];

/// Bundles of transmissions as a [`Plant`].
pub struct Transmission {
    pub(super) rig: TransmissionRig,
    pub(super) stated: Model,
    pub(super) kinds: Vec<Is>,
    channels: Vec<Channel>,
    regimes: Vec<String>,
    trials: Vec<Trial>,
    motions: Vec<Motion>,
    effects: Vec<Effect>,
    nuisances: Vec<Nuisance>,
    remarks: Vec<String>,
    compared: String,
    pub(super) scale: Scale,
    /// Mean load of the trials; 0 without one.
    pub(super) mean_load: f64,
    /// Noise of a sample of a motion that is not recorded yet.
    noise: f64,
    segments: Vec<Vec<f64>>,
    complaint: Option<String>,
}

/// Why a bundle is no transmission that could be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransmissionError {
    #[error("this is no transmission: rig.toml has no plant = \"transmission\"")]
    NotATransmission,
    #[error("there are no trials, so there is nothing to compare\n  fix: add trials/000.csv")]
    NoTrials,
    #[error(
        "trial {trial:03} has only {rows} rows, too few to tell where it turns round\n  fix: record at \
         least a hundred rows, with several reversals"
    )]
    TooShort { trial: u32, rows: usize },
    #[error(
        "the input never moves in any trial, so that nothing is transmitted\n  fix: record it while it moves to and fro"
    )]
    Still,
    #[error(
        "no trial holds anything that can be compared: the input covers less than {:.0} % of the travel\n  fix: \
         record strokes over the whole travel",
        100.0 * MOST_SLACK
    )]
    NothingCompared,
}

impl Transmission {
    /// Prepares a bundle.
    pub fn new(bundle: &Bundle) -> Result<Self, TransmissionError> {
        let RigPlant::Transmission(rig) = &bundle.rig.plant else {
            return Err(TransmissionError::NotATransmission);
        };
        let (trials, remarks) = without_copies(&bundle.trials);
        let mut raw = Vec::new();
        for trial in trials {
            let TrialData::Transmission(data) = &trial.data else {
                return Err(TransmissionError::NotATransmission);
            };
            if trial.len() < FEWEST_ROWS {
                let (trial, rows) = (trial.number, trial.len());
                return Err(TransmissionError::TooShort { trial, rows });
            }
            raw.push(Rows::of(trial.number, &trial.t_s, data));
        }
        if raw.is_empty() {
            return Err(TransmissionError::NoTrials);
        }
        let inputs = || raw.iter().flat_map(|rows| rows.data.input.iter().copied());
        let range =
            [inputs().fold(f64::INFINITY, f64::min), inputs().fold(f64::NEG_INFINITY, f64::max)];
        if range[1] <= range[0] {
            return Err(TransmissionError::Still);
        }
        let scale = scale(&raw, rig, range[1] - range[0]);
        let (kinds, effects) = library(&scale, rig).into_iter().unzip();
        let grid_s = grid_s(&raw);
        let sensor = &bundle.rig.sensor;
        // No noise is none that was stated.
        let stated = [sensor.position_noise_sd_m, sensor.output_noise_sd]
            .map(|noise| noise.filter(|noise| *noise > 0.0));
        let output = columns::of_transmission(rig.input, rig.output)[1];
        let mut own = Self {
            rig: rig.clone(),
            stated: Model::stated(rig, range),
            kinds,
            channels: vec![Channel { name: output.into(), quantity: Quantity::Force }],
            regimes: regimes(),
            trials: Vec::new(),
            motions: Vec::new(),
            effects,
            nuisances: nuisances(&scale, &bundle.rig.priors, rig),
            remarks,
            compared: String::new(),
            mean_load: mean_load(&raw),
            noise: 0.0,
            segments: segments::inputs(range),
            scale,
            complaint: None,
        };
        let prepared: Vec<(Rows, Motion, Measured)> = raw
            .into_iter()
            .map(|rows| {
                let (motion, measured) = Motion::of(&rows, grid_s, range, stated);
                (rows, motion, measured)
            })
            .collect();
        let speeds = prepared.iter().flat_map(|(_, motion, _)| motion.speed.iter());
        let fastest = speeds.fold(0.0, |most, v| v.abs().max(most));
        for (rows, motion, measured) in prepared {
            own.add(rows, motion, &measured, fastest);
        }
        if own.trials.is_empty() {
            return Err(TransmissionError::NothingCompared);
        }
        own.compared = own.what_is_compared();
        own.complaint = own.complain();
        Ok(own)
    }

    fn add(&mut self, rows: Rows, motion: Motion, measured: &Measured, fastest: f64) {
        let Rows { number, clock, remarks, .. } = rows;
        self.remarks.extend(remarks);
        self.remarks.extend(clock.jumps.iter().map(|jump| {
            format!(
                "trial {number:03}: the clock jumps by {:.3} s after {:.3} s; what follows is compared again \
                 once the input has covered the largest slack",
                jump.step_s, jump.at_s
            )
        }));
        if motion.at.is_empty() {
            self.remarks.push(format!("trial {number:03}: nothing of it can be compared"));
            return;
        }
        let start_s = clock.t_s[0];
        let block_points = motion.input.len().div_ceil(BLOCKS).max(1);
        let of_input = self.stated.gain.abs() * measured.input_noise;
        let open = of_input.hypot(RESOLUTION * self.scale.range);
        self.noise = self.noise.max(measured.output_noise.hypot(open));
        let samples = motion.at.iter().map(|&i| {
            let (speed, share) = (motion.speed[i], motion.speed[i].abs() / fastest);
            let phase = match () {
                () if share < STANDING_SHARE => 0,
                () if motion.turning[i] => 1,
                () => 2,
            };
            let rate = usize::from(share > SLOW_SHARE) + usize::from(share > FAST_SHARE);
            let regime = match share < STANDING_SHARE {
                true => 0,
                false => 1 + 3 * usize::from(speed < 0.0) + rate,
            };
            Sample {
                t_s: start_s + i as f64 * motion.grid_s,
                channel: 0,
                value: measured.output[i],
                noise: measured.output_noise,
                model: open,
                phase,
                regime,
                arc_m: motion.input[i],
                speed_m_per_s: speed,
                block: i / block_points,
            }
        });
        let samples: Vec<Sample> = samples.collect();
        let first_s = samples[0].t_s - start_s;
        self.remarks.push(format!(
            "trial {number:03}: its first {first_s:.1} s are not scored: where it began in its slack is not known \
             until the input has covered {:.0} % of the travel",
            100.0 * MOST_SLACK
        ));
        let blocks = motion.input.len().div_ceil(block_points);
        let start_m = motion.input[0];
        self.trials.push(Trial { number, start_s, start_m, samples, blocks, forks: Vec::new() });
        self.motions.push(motion);
    }

    fn what_is_compared(&self) -> String {
        let [input, output, _] = columns::of_transmission(self.rig.input, self.rig.output);
        let hz = self.motions.first().map_or(0.0, |own| 1.0 / own.grid_s);
        format!(
            "the measured {output} with what the transmission of rig.toml makes of {input} ({hz:.0} points a \
             second, both smoothed over two of them)"
        )
    }

    /// A gain of the other sign or of another unit.
    fn complain(&self) -> Option<String> {
        let nominal = Point::off(&self.effects, self.nuisances.len());
        let (mut yy, mut ff, mut yf) = (0.0, 0.0, 0.0);
        for (trial, own) in self.trials.iter().enumerate() {
            let predicted = self.simulate(trial, &nominal)?;
            let mean = |values: &mut dyn Iterator<Item = f64>| {
                let (sum, n) = values.fold((0.0, 0.0), |(sum, n), x| (sum + x, n + 1.0));
                sum / f64::max(n, 1.0)
            };
            let y_mean = mean(&mut own.samples.iter().map(|sample| sample.value));
            let f_mean = mean(&mut predicted.iter().copied());
            for (sample, f) in own.samples.iter().zip(&predicted) {
                let (y, f) = (sample.value - y_mean, f - f_mean);
                (yy, ff, yf) = (yy + y * y, ff + f * f, yf + y * f);
            }
        }
        if yy * ff <= 0.0 {
            return Some(
                "the output does not move at all while the input does: nothing is transmitted, or its column \
                 is not the output"
                    .to_owned(),
            );
        }
        let (slope, alike) = (yf / ff, yf / (yy * ff).sqrt());
        let gain = "the gain of [transmission] is output for each unit of the input";
        match () {
            () if alike < -ALIKE => Some(format!(
                "the output runs against the input, and by the sign of the gain it should not: {gain}, negative \
                 where the two run against each other"
            )),
            () if alike > ALIKE && !GAINS.contains(&slope) => Some(format!(
                "the output moves {} times as far as the gain says, and otherwise alike: a slip of units, or another \
                 gain; {gain}, in metres and radians (a degree is 0.01745 rad)",
                significant(slope, DIGITS)
            )),
            () => None,
        }
    }

    pub(super) fn motions(&self) -> &[Motion] {
        &self.motions
    }

    pub(super) fn model(&self, point: &Point) -> Model {
        at_point(&self.stated, &self.kinds, point)
    }
}

/// The output of a model along an input, with its time constant, its zero and its drift.
pub(super) fn output(
    model: &Model,
    grid_s: f64,
    input: &[f64],
    load: &[f64],
    bend_rad: Option<&[f64]>,
) -> Vec<f64> {
    let bend = |i: usize| bend_rad.map(|own| own[i]);
    let Some(&first) = input.first() else { return Vec::new() };
    let mut state = model.start(first, bend(0));
    let at = |(i, u): (usize, &f64)| {
        model.step(&mut state, *u, load.get(i).copied().unwrap_or(0.0), bend(i))
    };
    let mut out: Vec<f64> = input.iter().enumerate().map(at).collect();
    if model.time_constant_s > 0.0 {
        follow(&mut out, 1, 1.0 - (-grid_s / model.time_constant_s).exp());
    }
    let middle_s = 0.5 * grid_s * input.len() as f64;
    for (i, y) in out.iter_mut().enumerate() {
        *y += model.offset + model.drift_per_s * (i as f64 * grid_s - middle_s);
    }
    out
}

impl Plant for Transmission {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn phases(&self) -> &[&'static str] {
        &PHASES
    }

    fn regimes(&self) -> &[String] {
        &self.regimes
    }

    fn trials(&self) -> &[Trial] {
        &self.trials
    }

    fn effects(&self) -> &[Effect] {
        &self.effects
    }

    fn nuisances(&self) -> &[Nuisance] {
        &self.nuisances
    }

    fn simulate(&self, trial: usize, point: &Point) -> Option<Vec<f64>> {
        let motion = &self.motions[trial];
        let model = self.model(point);
        let bend = motion.bend_rad.as_deref();
        let out = output(&model, motion.grid_s, &motion.input, &motion.load, bend);
        // The output is reported late: what is read now was there before.
        let shift_s = -(model.latency_s + point.nuisances[TIME_SHIFT]);
        let mut predicted = motion.read(&out, shift_s);
        predicted.iter_mut().for_each(|y| *y += point.nuisances[ZERO]);
        Some(predicted)
    }

    fn cheap(&self) -> bool {
        true
    }

    fn has_other_models(&self) -> bool {
        false
    }

    fn open(&self, _sample: &Sample) -> f64 {
        OPEN_SHARE * self.scale.range
    }

    fn far_off(&self) -> f64 {
        FAR_OFF
    }

    fn repeats(&self) -> &[Repeat] {
        &[]
    }

    fn segments(&self) -> &[Segment] {
        &segments::SEGMENTS
    }

    fn simulate_segment(&self, segment: usize, point: &Point) -> Option<Vec<f64>> {
        let input = &self.segments[segment];
        let model = self.model(point);
        let load = vec![self.mean_load; input.len()];
        let out = output(&model, segments::GRID_S, input, &load, None);
        let later = (model.latency_s / segments::GRID_S).round() as usize;
        let read = (later..out.len()).step_by(segments::STRIDE);
        Some(read.map(|i| out[i - later] / self.noise).collect())
    }

    fn complaint(&self) -> Option<&str> {
        self.complaint.as_deref()
    }

    fn hidden(&self, floor: f64, _measured: f64) -> Option<String> {
        if floor <= HIDING * self.scale.range {
            return None;
        }
        Some(format!(
            "no gap shows, but the floor of {} {} RMS is {:.1} % of the output's range, and slack of that size \
             would be lost in it; record more rows a second or a finer sensor, or state its noise in [sensor] \
             where it is less",
            significant(floor, DIGITS),
            self.units().force(),
            100.0 * floor / self.scale.range
        ))
    }

    fn units(&self) -> Units {
        match (self.rig.output, self.rig.input) {
            (Axis::Linear, Axis::Linear) => Units::MetresByMetres,
            (Axis::Rotary, Axis::Linear) => Units::RadiansByMetres,
            (Axis::Linear, Axis::Rotary) => Units::MetresByRadians,
            (Axis::Rotary, Axis::Rotary) => Units::RadiansByRadians,
        }
    }

    fn remarks(&self) -> &[String] {
        &self.remarks
    }

    fn compared(&self) -> &str {
        &self.compared
    }
}

fn regimes() -> Vec<String> {
    let mut names = vec!["standing".to_owned()];
    for direction in ["forward", "backward"] {
        names.extend(["slow", "middle", "fast"].map(|speed| format!("{direction}, {speed}")));
    }
    names
}

fn nuisances(scale: &Scale, stated: &RigPriors, rig: &TransmissionRig) -> Vec<Nuisance> {
    vec![
        Nuisance {
            name: "zero of the output",
            unit: rig.output.unit(),
            sd: stated.output_zero_sd.unwrap_or(ZERO_SHARE * scale.range),
            effect: Some("transmission.offset"),
        },
        Nuisance {
            name: "time shift",
            unit: "s",
            sd: stated.time_shift_sd_s.unwrap_or(SHIFT_SD_S),
            effect: Some("transmission.latency"),
        },
    ]
}

fn scale(raw: &[Rows], rig: &TransmissionRig, travel: f64) -> Scale {
    let loads = || raw.iter().flat_map(|rows| rows.data.load.iter().flatten());
    let power: f64 = loads().map(|load| load * load).sum();
    let load = (power / loads().count().max(1) as f64).sqrt();
    Scale {
        travel,
        range: rig.gain.abs() * travel,
        load: (load > 0.0).then_some(load),
        duration_s: raw.iter().map(Rows::duration_s).fold(0.0, f64::max),
    }
}

fn mean_load(raw: &[Rows]) -> f64 {
    let loads = || raw.iter().flat_map(|rows| rows.data.load.iter().flatten());
    loads().sum::<f64>() / loads().count().max(1) as f64
}
