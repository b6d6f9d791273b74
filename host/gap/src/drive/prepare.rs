//! From the rows of a bundle to a plant: derivatives, samples, cycles, repeats.

use cathforce_bundle::bundle::{
    Axis as Kind, Bundle, CommandKind, Plant as RigPlant, Rig, RigPriors, TrialData, columns,
};

use super::course::{Axis, Course, Known};
use super::effects::{Scale, library};
use super::error::DriveError;
use super::inertia;
use super::misread::Rows;
use super::motion::{Filters, Motion};
use super::noise::{self, Noise};
use super::plant::{Drive, Prepared, STRIDE};
use super::regimes::{Limits, Regime};
use super::segments;
use super::setpoint::Setpoint;
use super::slow::{is_too_seldom, without_inertia};
use crate::data::clock::{Clock, usual_step_s};
use crate::data::duplicate_trials::without_copies;
use crate::noise::floor;
use crate::plant::{Channel, Nuisance, Quantity, Repeat, Sample, Trial};
/// Samples of all trials together, about: of longer records every second or third is compared.
const MOST_SAMPLES: usize = 20_000;
/// Band of the narrowest filters \[Hz\].
const WIDEST_HZ: f64 = 29.6;
/// Blocks of a trial without a period.
const BLOCKS: usize = 4;
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
