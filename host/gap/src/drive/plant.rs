//! A drive on its own as a [`Plant`]: prepared trials, and their predictions by inverse dynamics.

use cathforce_bundle::bundle::{Axis as Kind, DriveRig};

use super::course::{Axis, Course, Known};
use super::effects::{FORCE_BIAS, TIME_SHIFT, command, inertia_ratio, latency_s, swing};
use super::motion::{Filters, Motion};
use super::regimes::PHASES;
use super::segments;
use super::setpoint::Setpoint;
use crate::plant::{
    Channel, Effect, Nuisance, Plant, Point, Repeat, Sample, Segment, Swing, Trial, Units,
};
use crate::rounding::significant;

/// Grid points between two samples, about; of rows that are far apart, half as many as between them.
pub(super) const STRIDE: usize = 5;
/// Share of the command force that friction models leave of a real axis: the measured axis of EMPS (Janot,
/// Gautier and Brunot 2019) is left 2.3 N of 42 N RMS by Coulomb and viscous friction with an offset; the amplitude of
/// the discrepancy goes up to four times this.
const OPEN_SHARE: f64 = 0.0165;
/// Of that, the least that an axis may leave: 0.2 % of its command, which is what a motor's constant, a weighed mass
/// and a good force sensor are known to. With a half of it, 0.8 %, an axis with 0.2 N of friction beside an inertial
/// force of 13 N had a gap that dry friction closed to the floor, and no answer.
const LEAST_AMPLITUDE: f64 = 0.125;
/// Share of the measured force from which on a floor hides effects that matter: friction of 1 % of
/// it would be no gap.
const HIDING: f64 = 0.02;
/// Standard deviations beyond which a residual is what friction leaves where it turns over. The floor
/// of a drive is far below what any model leaves: with 3, coarse encoders were a latency; with 30,
/// friction that falls as motion sets in was 6 % too slow.
const FAR_OFF: f64 = 10.0;
/// Digits of an inertia.
const DIGITS: u8 = 4;

/// Drive bundles as a [`Plant`].
pub struct Drive {
    pub(super) rig: DriveRig,
    pub(super) axis: Axis,
    pub(super) channels: Vec<Channel>,
    pub(super) regimes: Vec<String>,
    pub(super) trials: Vec<Trial>,
    pub(super) motions: Vec<Prepared>,
    /// By trial; `None` where it has none, or the clock jumps.
    pub(super) setpoints: Vec<Option<Setpoint>>,
    pub(super) effects: Vec<Effect>,
    pub(super) nuisances: Vec<Nuisance>,
    pub(super) repeats: Vec<Repeat>,
    pub(super) remarks: Vec<String>,
    pub(super) compared: String,
    pub(super) filters: Filters,
    /// Grid points between two samples, about.
    pub(super) stride: usize,
    /// Of those between two points of a prediction.
    pub(super) every: usize,
    pub(super) segments: Vec<Course>,
    /// Of a sample of a segment \[N\].
    pub(super) noise_n: f64,
    pub(super) travel_m: f64,
    /// What rig.toml states of a row of the command \[N\], and of the position \[m\].
    pub(super) stated_n: Option<f64>,
    pub(super) stated_m: Option<f64>,
    /// What its rows say where it states nothing, trial by trial \[N\].
    pub(super) estimated_n: Vec<f64>,
    /// Why axes or units cannot be those of the model, if so.
    pub(super) complaint: Option<String>,
}

/// What a trial's predictions need.
pub(super) struct Prepared {
    pub(super) motion: Motion,
    pub(super) known: Known,
    pub(super) course: Course,
    /// Grid points of the samples.
    pub(super) at: Vec<usize>,
}

impl Plant for Drive {
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
        let Prepared { course, at, .. } = &self.motions[trial];
        let force_n = command(course, point);
        let [bias_n, shift_s] = [FORCE_BIAS, TIME_SHIFT].map(|k| point.nuisances[k]);
        let shift_s = latency_s(point) + shift_s;
        let mut predicted = self.filters.predicted_of(&force_n, course.every, at, shift_s);
        predicted.iter_mut().for_each(|f| *f += bias_n);
        Some(predicted)
    }

    fn cheap(&self) -> bool {
        true
    }

    fn has_other_models(&self) -> bool {
        false
    }

    fn open(&self, sample: &Sample) -> f64 {
        // What the encoder leaves open is noise.
        OPEN_SHARE * sample.value.abs()
    }

    fn least_amplitude(&self) -> f64 {
        LEAST_AMPLITUDE
    }

    fn far_off(&self) -> f64 {
        FAR_OFF
    }

    fn swing(&self, effect: usize) -> Option<Swing> {
        swing(effect, self.travel_m)
    }

    fn repeats(&self) -> &[Repeat] {
        &self.repeats
    }

    fn segments(&self) -> &[Segment] {
        &segments::SEGMENTS
    }

    fn simulate_segment(&self, segment: usize, point: &Point) -> Option<Vec<f64>> {
        let force_n = command(&self.segments[segment], point);
        let reach = self.filters.reach();
        let at: Vec<usize> = (reach..force_n.len().saturating_sub(reach)).step_by(STRIDE).collect();
        let predicted = self.filters.predicted(&force_n, &at, latency_s(point));
        Some(predicted.into_iter().map(|f| f / self.noise_n).collect())
    }

    fn misstated(&self, effect: usize, values: &[f64]) -> Option<String> {
        let stated = self.axis.inertia;
        let (what, unit) = match self.axis.kind {
            Kind::Linear => ("mass", "kg"),
            Kind::Rotary => ("inertia", "kg·m²"),
        };
        let id = self.effects[effect].id;
        let as_mass = inertia_ratio(effect, values)?;
        Some(format!(
            "{id} does to the inertia what a moving {what} of {} {unit} would do, where rig.toml states \
             {} {unit}: weigh what moves before {id} is believed",
            significant(as_mass * stated, DIGITS),
            significant(stated, DIGITS)
        ))
    }

    fn complaint(&self) -> Option<&str> {
        self.complaint.as_deref()
    }

    fn hidden(&self, floor_n: f64, measured_n: f64) -> Option<String> {
        if floor_n <= HIDING * measured_n {
            return None;
        }
        let samples = || self.trials.iter().flat_map(|trial| &trial.samples);
        let open = samples().map(|sample| sample.model.powi(2)).sum::<f64>();
        let fix = match () {
            () if open > 0.5 * samples().count() as f64 * floor_n.powi(2) => {
                "most of it is what the position leaves open in the acceleration: record it with a \
                 finer encoder or more rows a second, or state the position's noise in [sensor] where it \
                 is less"
            }
            () if self.repeats.is_empty() => {
                "most of it is the command's noise: record more rows a second, or state \
                 that noise in [sensor] where it is less"
            }
            () => "runs of one set-point differ by as much: record again what disturbed them",
        };
        Some(format!(
            "no gap shows, but the floor of {} {} RMS is {:.0} % of the measured force, \
             and friction of that size would be lost in it; {fix}",
            significant(floor_n, DIGITS),
            self.units().force(),
            100.0 * floor_n / measured_n
        ))
    }

    fn units(&self) -> Units {
        match self.axis.kind {
            Kind::Linear => Units::Linear,
            Kind::Rotary => Units::Rotary,
        }
    }

    fn remarks(&self) -> &[String] {
        &self.remarks
    }

    fn compared(&self) -> &str {
        &self.compared
    }
}
