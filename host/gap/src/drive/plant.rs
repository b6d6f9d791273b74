//! A drive on its own as a [`Plant`]: prepared trials, and their predictions by inverse dynamics.

use cathforce_bundle::bundle::{
    Axis as Kind, Bundle, CommandKind, DriveRig, Plant as RigPlant, Rig, RigPriors, TrialData,
    columns,
};

use super::course::{Axis, Course, Known};
use super::effects::{
    FORCE_BIAS, Scale, TIME_SHIFT, command, inertia_ratio, latency_s, library, swing,
};
use super::inertia;
use super::misread::Rows;
use super::motion::{Filters, Motion, evenly};
use super::noise::{self, Noise};
use super::segments;
use super::setpoint::Setpoint;
use crate::data::clock::{Clock, usual_step_s};
use crate::data::duplicate_trials::without_copies;
use crate::noise::floor;
use crate::plant::{
    Channel, Effect, Nuisance, Plant, Point, Quantity, Repeat, Sample, Segment, Swing, Trial, Units,
};
use crate::rounding::significant;

/// Grid points between two samples, about; of rows that are far apart, half as many as between them.
const STRIDE: usize = 5;
/// Samples of all trials together, about: of longer records every second or third is compared.
const MOST_SAMPLES: usize = 20_000;
/// Slower than this share of the largest speed is standing.
const STANDING_SHARE: f64 = 0.01;
/// Faster than this share of the largest speed is fast, slower than the other one is slow.
const FAST_SHARE: f64 = 2.0 / 3.0;
const SLOW_SHARE: f64 = 1.0 / 3.0;
/// An acceleration above this share of the largest one is hard.
const HARD_SHARE: f64 = 0.3;
/// Samples within this of a change of direction belong to the reversal \[s\].
const REVERSAL_S: f64 = 0.05;
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
/// Band of the narrowest filters \[Hz\].
const WIDEST_HZ: f64 = 29.6;
/// Blocks of a trial without a period.
const BLOCKS: usize = 4;

const PHASES: [&str; 5] = ["standing", "reversal", "speeding up", "slowing down", "steady"];

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
    compared: String,
    pub(super) filters: Filters,
    /// Grid points between two samples, about.
    pub(super) stride: usize,
    /// Of those between two points of a prediction.
    every: usize,
    segments: Vec<Course>,
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
    course: Course,
    /// Grid points of the samples.
    pub(super) at: Vec<usize>,
}

/// Why a bundle is no drive that could be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DriveError {
    #[error("this is no drive: rig.toml has no plant = \"drive\"")]
    NotADrive,
    #[error("there are no trials, so there is nothing to compare\n  fix: add trials/000.csv")]
    NoTrials,
    #[error(
        "trial {trial:03} has only {rows} rows, too few to differentiate a position twice\n  fix: \
         record at least a hundred rows"
    )]
    TooShort { trial: u32, rows: usize },
    #[error(
        "trial {trial:03} has a row every {step_s:.4} s, and moving the stated inertia takes {:.0} % of its \
         command: so seldom a row tells no acceleration\n  fix: t_s is in seconds; record at 50 Hz or \
         more, better at 100 Hz, or so slowly that inertia takes less than {:.0} %",
        100.0 * .share, 100.0 * SLOW_SHARE_OF_INERTIA
    )]
    TooSeldom { trial: u32, step_s: f64, share: f64 },
    #[error(
        "the drive never moves in any trial: no force of motion can be compared\n  fix: record \
         its position while it moves"
    )]
    Still,
    #[error(
        "{column} is 0 in every trial, and the drive moves: nothing drives it\n  fix: record what the \
         drive was given, in the unit of the column"
    )]
    NoCommand { column: &'static str },
    #[error(
        "no trial holds anything that can be compared: the drive rests or trembles in its encoder's \
         noise all the time\n  fix: record it while it moves"
    )]
    NothingCompared,
}

/// Digits of an inertia.
const DIGITS: u8 = 4;
/// Rows farther apart than this say nothing about accelerations \[s\]; a clock may go 2 % slow.
const LONGEST_STEP_S: f64 = 2.04e-2;
/// Fewest rows of a trial.
const FEWEST_ROWS: usize = 100;

impl Drive {
    /// Prepares a bundle: derivatives, samples, cycles, repeats.
    pub fn new(bundle: &Bundle) -> Result<Self, DriveError> {
        let RigPlant::Drive(rig) = &bundle.rig.plant else { return Err(DriveError::NotADrive) };
        let (mut raw, mut longest_s) = (Vec::<Rows>::new(), 0.0_f64);
        let (trials, remarks) = without_copies(&bundle.trials);
        for trial in trials {
            let TrialData::Drive(data) = &trial.data else { return Err(DriveError::NotADrive) };
            if trial.len() < FEWEST_ROWS {
                return Err(DriveError::TooShort { trial: trial.number, rows: trial.len() });
            }
            longest_s = longest_s.max(usual_step_s(&trial.t_s));
            raw.push(Rows::of(trial.number, &trial.t_s, data, rig));
        }
        if raw.is_empty() {
            return Err(DriveError::NoTrials);
        }
        for rows in &mut raw {
            without_inertia(rows)?;
        }
        let filters = filters_of(&raw, &bundle.rig, longest_s);
        let motion = |rows: &Rows| {
            Motion::of(&filters.on_grid(&rows.clock.t_s, &rows.data.position), &filters)
        };
        let motions: Vec<Motion> = raw.iter().map(motion).collect();
        let scale = scale(&raw, &motions);
        if scale.speed_m_per_s <= 0.0 {
            return Err(DriveError::Still);
        }
        if scale.force_n <= 0.0 {
            let data = &raw[0].data;
            return Err(DriveError::NoCommand {
                column: columns::of_command(data.kind, data.axis),
            });
        }
        let axis = Axis {
            kind: rig.axis,
            inertia: rig.inertia,
            turnover_m_per_s: scale.turnover_m_per_s(),
        };
        let canned = segments::motions(&scale, &filters);
        let along = |motion: &Motion| Course::of(&axis, motion, &Known::bare(axis.inertia), 1);
        let every = filters.every(motions.iter().map(|motion| motion.position_m.len()).sum());
        let mut drive = Self {
            axis,
            every,
            rig: rig.clone(),
            channels: vec![Channel { name: channel(&raw).into(), quantity: Quantity::Force }],
            regimes: Regime::names(),
            trials: Vec::new(),
            motions: Vec::new(),
            setpoints: Vec::new(),
            effects: library(&scale, rig.axis),
            nuisances: nuisances(&scale, &bundle.rig.priors, rig.axis),
            repeats: Vec::new(),
            remarks,
            segments: canned.iter().map(along).collect(),
            noise_n: segments::NOISE_SHARE * scale.force_n,
            travel_m: scale.travel_m,
            // As of a catheter, no noise is none that was stated.
            stated_n: bundle.rig.sensor.drive_noise_sd_n.filter(|noise| *noise > 0.0),
            stated_m: bundle.rig.sensor.position_noise_sd_m.filter(|noise| *noise > 0.0),
            stride: stride(longest_s, filters.grid_s, &motions),
            estimated_n: Vec::new(),
            compared: compared(&filters, every),
            filters,
            complaint: None,
        };
        let limits = Limits::of(&scale, &motions);
        for (rows, motion) in raw.into_iter().zip(motions) {
            drive.add(rows, motion, &limits);
        }
        if drive.trials.is_empty() {
            return Err(DriveError::NothingCompared);
        }
        if !drive.estimated_n.is_empty() {
            let remark = floor::unstated(&drive.channels[0].name, &drive.estimated_n);
            drive.remarks.insert(0, remark);
        }
        drive.complaint = drive.complain();
        Ok(drive)
    }

    fn add(&mut self, rows: Rows, motion: Motion, limits: &Limits) {
        let Rows { number, ref clock, ref data, driven, remarks } = rows;
        let t_s = &clock.t_s[..];
        let quasi_static = is_too_seldom(t_s);
        self.remarks.extend(remarks);
        let row_n = self.stated_n.unwrap_or_else(|| {
            let found_n = Noise::of(t_s, &driven.command).most;
            self.estimated_n.push(found_n);
            found_n
        });
        let noise_n = noise::command_n(t_s, row_n, &self.filters);
        let row_m = Noise::of(t_s, &data.position).or_stated(self.stated_m);
        let of_steps = noise::of_steps(&data.position, row_m, &motion, &self.filters);
        let open =
            of_steps.unwrap_or_else(|| noise::acceleration_m_per_s2(t_s, row_m, &self.filters));
        let open_n = driven.inertia * open;
        let measured = self.filters.measured(&self.filters.on_grid(t_s, &driven.command));
        let points = measured.len();
        let setpoint = Setpoint::of(t_s, data, &self.filters);
        let period = setpoint.as_ref().and_then(Setpoint::period);
        let stride = period.map_or(self.stride, |period| divisor(period, self.stride));
        let block_points = period.unwrap_or(points.div_ceil(BLOCKS)).max(1);
        let blocks = points.div_ceil(block_points);
        let reach = self.filters.reach();
        let jumps = self.jumps(number, clock);
        let near_jump = |i: usize| {
            jumps.iter().any(|&[from, to]| from.saturating_sub(reach) <= i && i <= to + reach)
        };
        let rests = motion.rests(self.travel_m, row_m, reach);
        let resting = rests.iter().filter(|rests| **rests).count() as f64 / points.max(1) as f64;
        if resting > 0.0 {
            self.remarks.push(format!(
                "trial {number:03}: the drive rests for {:.0} % of the time; there static friction \
                 holds any force up to its limit, so these samples are not scored",
                100.0 * resting
            ));
        }
        let mut left_out = rests;
        if quasi_static {
            // Where friction turned over between two rows, nobody knows.
            let around_s = usual_step_s(t_s) + 2.0 * self.filters.spread_s();
            let turns = motion.turns((around_s / motion.dt_s) as usize);
            left_out.iter_mut().zip(turns).for_each(|(out, turns)| *out |= turns);
            self.remarks.push(format!(
                "trial {number:03}: rows so seldom do not tell when friction turned over; {around_s:.2} s before \
                 and after each reversal are not compared"
            ));
        }
        let at: Vec<usize> = (reach..points.saturating_sub(reach))
            .step_by(stride)
            .filter(|&i| !near_jump(i) && !left_out[i])
            .collect();
        let samples = at.iter().map(|&i| {
            let (velocity, acceleration) =
                (motion.velocity_m_per_s[i], motion.acceleration_m_per_s2[i]);
            Sample {
                t_s: t_s[0] + i as f64 * self.filters.grid_s,
                channel: 0,
                value: measured[i],
                noise: noise_n,
                model: open_n,
                phase: limits.phase(&motion, i),
                regime: limits.regime(velocity, acceleration),
                arc_m: motion.position_m[i],
                speed_m_per_s: velocity,
                block: i / block_points,
            }
        });
        let samples: Vec<Sample> = samples.collect();
        if samples.is_empty() {
            self.remarks.push(format!("trial {number:03}: nothing of it can be compared"));
            return;
        }
        let (start_s, start_m) = (t_s[0], motion.position_m[0]);
        self.trials.push(Trial { number, start_s, start_m, samples, blocks, forks: Vec::new() });
        // Smoothed as the position is, from which a load may follow.
        let load =
            driven.load.map(|load| self.filters.as_position(&self.filters.on_grid(t_s, &load)));
        let load = load.unwrap_or_default();
        let known = Known { inertia: driven.inertia, load, induced: driven.induced };
        let course = Course::of(&self.axis, &motion, &known, self.every);
        self.motions.push(Prepared { motion, known, course, at });
        let own = self.trials.len() - 1;
        // After a jump of the clock, nobody knows what was repeated when.
        let setpoint = setpoint.filter(|_| jumps.is_empty());
        if let Some(period) = period.filter(|_| setpoint.is_some()) {
            self.add_repeats([own, own], period, period);
        }
        for other in 0..own {
            let is_same = |earlier: &Setpoint| setpoint.as_ref().is_some_and(|s| s.is_run(earlier));
            if self.setpoints[other].as_ref().is_some_and(is_same) {
                self.add_repeats([other, own], 0, block_points);
            }
        }
        self.setpoints.push(setpoint);
    }

    /// Axes or units that are not the model's, by the inertia that the data show.
    fn complain(&self) -> Option<String> {
        let rows = self.trials.iter().zip(&self.motions).flat_map(|(trial, prepared)| {
            let Prepared { motion, known, at, .. } = prepared;
            let of = |series: &[f64]| self.filters.predicted(series, at, 0.0);
            let inertial = of(&motion.acceleration_m_per_s2);
            let load = if known.load.is_empty() { vec![0.0; at.len()] } else { of(&known.load) };
            let samples = trial.samples.iter().zip(inertial).zip(load);
            let row = |((s, a), load): ((&Sample, f64), f64)| {
                let speed = s.speed_m_per_s;
                (s.value - load - known.induced * speed, known.inertia * a, speed)
            };
            samples.map(row).collect::<Vec<_>>()
        });
        inertia::complaint(rows, self.axis.inertia, self.axis.kind)
    }

    /// Pairs samples of a trial with those `lag` grid points later of another, or of the same, in
    /// pieces of at most `most` points without a gap.
    fn add_repeats(&mut self, [first, second]: [usize; 2], lag: usize, most: usize) {
        let [a, b] = [first, second].map(|trial| &self.motions[trial].at);
        let mut piece: Option<Repeat> = None;
        for (k, i) in a.iter().enumerate() {
            let Ok(later) = b.binary_search(&(i + lag)) else { continue };
            match &mut piece {
                Some(own)
                    if (own.first.1 + own.len, own.second.1 + own.len) == (k, later)
                        && a[own.first.1] / most == i / most =>
                {
                    own.len += 1;
                }
                _ => {
                    let new = Repeat { first: (first, k), second: (second, later), len: 1 };
                    self.repeats.extend(piece.replace(new));
                }
            }
        }
        self.repeats.extend(piece);
    }

    /// Grid points from which on and to which the clock jumps; a remark for each.
    fn jumps(&mut self, number: u32, clock: &Clock) -> Vec<[usize; 2]> {
        self.remarks.extend(clock.jumps.iter().map(|jump| {
            format!(
                "trial {number:03}: the clock jumps by {:.3} s after {:.3} s; what lies around the \
                 jump is not compared",
                jump.step_s, jump.at_s
            )
        }));
        let grid = |t: f64| ((t - clock.t_s[0]) / self.filters.grid_s) as usize;
        clock.spans_s().map(|span| span.map(grid)).collect()
    }
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

/// Force bias and a shift in time.
fn nuisances(scale: &Scale, stated: &RigPriors, kind: Kind) -> Vec<Nuisance> {
    vec![
        Nuisance {
            name: "force bias",
            unit: if kind == Kind::Linear { "N" } else { "N·m" },
            sd: stated.force_bias_sd_n.unwrap_or(2.5e-3 * scale.force_n),
            effect: Some("sensor.bias"),
        },
        Nuisance {
            name: "time shift",
            unit: "s",
            sd: stated.time_shift_sd_s.unwrap_or(3e-3),
            effect: Some("drive.latency"),
        },
    ]
}

/// Share of the command that inertia may take in rows that are too seldom for accelerations: little more than
/// what a floor hides friction from.
const SLOW_SHARE_OF_INERTIA: f64 = 0.03;

/// Whether rows say nothing about accelerations.
fn is_too_seldom(t_s: &[f64]) -> bool {
    usual_step_s(t_s) > LONGEST_STEP_S
}

/// Leaves the inertia out of a trial whose rows are too seldom for it, where it takes next to nothing.
fn without_inertia(rows: &mut Rows) -> Result<(), DriveError> {
    if !is_too_seldom(&rows.clock.t_s) {
        return Ok(());
    }
    let step_s = usual_step_s(&rows.clock.t_s);
    // A motion that is faster than the rows shows as larger accelerations than it has.
    let position = evenly(&rows.clock.t_s, &rows.data.position, step_s);
    let bends = position.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]) / step_s.powi(2));
    let bends: Vec<f64> = bends.collect();
    let rms = |values: &[f64]| {
        (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
    };
    let inertial = rows.driven.inertia * rms(&bends);
    let share = inertial / rms(&rows.driven.command).max(f64::MIN_POSITIVE);
    if share > SLOW_SHARE_OF_INERTIA {
        return Err(DriveError::TooSeldom { trial: rows.number, step_s, share });
    }
    rows.driven.inertia = 0.0;
    rows.remarks.push(format!(
        "trial {:03}: a row every {step_s:.3} s tells no acceleration, and inertia takes {:.1} % of the \
         command: the trial is taken quasi-statically, without inertia",
        rows.number,
        100.0 * share
    ));
    Ok(())
}

/// The column that is compared, or what stands for it.
fn channel(raw: &[Rows]) -> &'static str {
    columns::of_command(CommandKind::Force, raw[0].data.axis)
}

/// The filters that the noise of the position asks for.
fn filters_of(raw: &[Rows], rig: &Rig, step_s: f64) -> Filters {
    let stated = rig.sensor.position_noise_sd_m.filter(|noise| *noise > 0.0);
    let rows = raw.iter().map(|rows| {
        let t_s = &rows.clock.t_s[..];
        let noise = Noise::of(t_s, &rows.data.position).or_stated(stated);
        (t_s, &rows.driven.command[..], rows.driven.inertia * noise)
    });
    noise::filters(&rows.collect::<Vec<_>>(), step_s)
}

fn scale(raw: &[Rows], motions: &[Motion]) -> Scale {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let commands = || raw.iter().flat_map(|rows| rows.driven.command.iter());
    let power: f64 = commands().map(|f| f * f).sum();
    let positions = || motions.iter().flat_map(|m| m.position_m.iter().copied());
    let low = positions().fold(f64::INFINITY, f64::min);
    Scale {
        force_n: (power / commands().count() as f64).sqrt(),
        speed_m_per_s: largest(
            &mut motions.iter().flat_map(|m| m.velocity_m_per_s.iter().map(|v| v.abs())),
        ),
        travel_m: positions().fold(f64::NEG_INFINITY, f64::max) - low,
        duration_s: largest(&mut raw.iter().map(|rows| duration_s(&rows.clock.t_s))),
    }
}

/// What is compared, and how far it was smoothed.
fn compared(filters: &Filters, every: usize) -> String {
    let hz = filters.bandwidth_hz();
    let why = match hz {
        hz if hz > 0.9 * WIDEST_HZ => "the widest band that is used",
        _ => "as the noise of the position and the rate of the rows ask for",
    };
    let thinned = match every {
        1 => String::new(),
        _ => format!(
            "; of so long a record it is predicted every {:.0} ms, as that band allows",
            1e3 * filters.grid_s * every as f64
        ),
    };
    format!(
        "the measured command force with the one that moves the known mass along the measured position (inverse \
         dynamics, both smoothed to {hz:.0} Hz, {why}{thinned})"
    )
}

fn duration_s(t_s: &[f64]) -> f64 {
    t_s.last().zip(t_s.first()).map_or(0.0, |(last, first)| last - first)
}

/// Grid points between two samples, about, of rows so far apart.
fn stride(step_s: f64, grid_s: f64, motions: &[Motion]) -> usize {
    let points: usize = motions.iter().map(|motion| motion.position_m.len()).sum();
    let half_step = (0.5 * step_s / grid_s) as usize;
    STRIDE.max(half_step).max(points.div_ceil(STRIDE * MOST_SAMPLES) * STRIDE)
}

/// The number of grid points nearest to a stride that divides a period.
fn divisor(period: usize, stride: usize) -> usize {
    let strides = stride.div_ceil(2)..=stride + stride / 2 + 1;
    strides.min_by_key(|&n| (!period.is_multiple_of(n), n.abs_diff(stride))).unwrap_or(stride)
}

/// Where regimes and phases of a bundle begin.
struct Limits {
    speed_m_per_s: f64,
    acceleration_m_per_s2: f64,
}

/// Standing, or direction × speed × acceleration.
struct Regime;

impl Regime {
    fn names() -> Vec<String> {
        let mut names = vec!["standing".to_owned()];
        for direction in ["forward", "backward"] {
            for speed in ["slow", "middle", "fast"] {
                for load in ["", ", hard"] {
                    names.push(format!("{direction}, {speed}{load}"));
                }
            }
        }
        names
    }
}

impl Limits {
    fn of(scale: &Scale, motions: &[Motion]) -> Self {
        let all = motions.iter().flat_map(|m| m.acceleration_m_per_s2.iter().map(|a| a.abs()));
        let acceleration_m_per_s2 = all.fold(0.0, f64::max);
        Self { speed_m_per_s: scale.speed_m_per_s, acceleration_m_per_s2 }
    }

    fn regime(&self, velocity: f64, acceleration: f64) -> usize {
        let share = velocity.abs() / self.speed_m_per_s;
        if share < STANDING_SHARE {
            return 0;
        }
        let speed = usize::from(share > SLOW_SHARE) + usize::from(share > FAST_SHARE);
        let hard = acceleration.abs() > HARD_SHARE * self.acceleration_m_per_s2;
        1 + usize::from(velocity < 0.0) * 6 + speed * 2 + usize::from(hard)
    }

    fn phase(&self, motion: &Motion, i: usize) -> usize {
        let velocity = &motion.velocity_m_per_s;
        let reach = (REVERSAL_S / motion.dt_s) as usize;
        let around = &velocity[i.saturating_sub(reach)..(i + reach).min(velocity.len())];
        let standing = STANDING_SHARE * self.speed_m_per_s;
        let turns = around.iter().any(|v| *v > standing) && around.iter().any(|v| *v < -standing);
        let power = velocity[i] * motion.acceleration_m_per_s2[i];
        let steady = motion.acceleration_m_per_s2[i].abs() < 0.05 * self.acceleration_m_per_s2;
        match () {
            () if turns => 1,
            () if velocity[i].abs() < standing => 0,
            () if steady => 4,
            () if power > 0.0 => 2,
            () => 3,
        }
    }
}
