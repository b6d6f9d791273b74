//! Turns the rows of a trial into samples: averages them, removes snaps, and finds their noise.

mod noise;
mod places;
mod snaps;

use cathforce_bundle::Trial as RigTrial;
use cathforce_bundle::bundle::{CatheterTrial, EncoderReading, RigSensor, VectorColumn};
use cathforce_mechanics::Drive;
use cathforce_recording::snap::Snap;
use cathforce_recording::{FEED_BEFORE_SCORE_M, SNAP_GUARD_S};

use self::noise::{Mean, Noise};
use super::column::{AVERAGE_S, Column, Source};
use super::motion::{Motion, phase, regime};
use super::sensors::{self, Limit};
use super::simulate::{Inputs, Trajectory};
use crate::data::clock::{Clock, Jump};
use crate::plant::{Channel, Sample};

/// Samples so long after it are left out \[s\].
const JUMP_GUARD_S: f64 = 0.5;
/// Of a trial in which nothing is fed, samples after so much rotation are compared \[rad\].
pub(super) const TURN_BEFORE_SCORE_RAD: f64 = 0.5;
/// Blocks of a trial.
pub const BLOCKS: usize = 4;
/// Fewest rows that tell the noise of a column.
const FEWEST_ROWS: usize = 12;
/// Share of a trial's samples from which on it is said that they are left out.
const FORKED_SAID: f64 = 0.01;
/// Samples to either side whose largest model deviation counts.
const NEIGHBOURS: usize = 2;
/// What a model leaves open of a force, as a share of that force and of its channel's RMS in the trial.
const OF_FORCE: f64 = 0.025;
const OF_CHANNEL: f64 = 0.016;
/// Most of it in a channel, over what a finer model and a nearer wall change there: rigs without an effect
/// leave 0.8 to 2.0 times that, whatever their forces.
const MOST_OF_FORCE: f64 = 1.5;
/// Times the stated noise from which on it is said that a sensor has more: a median over the rows of a trial
/// is off by a tenth.
const UNDERSTATED: f64 = 1.25;
/// Rows that make one sample: those of a stretch of time that have a value.
#[derive(Clone, Debug)]
struct Reading {
    source: Source,
    /// Never empty.
    rows: Vec<usize>,
    value: f64,
}

impl Reading {
    fn first(&self) -> usize {
        self.rows[0]
    }

    fn last(&self) -> usize {
        self.rows[self.rows.len() - 1]
    }
}

/// One trial, ready to be compared.
pub struct Prepared {
    pub inputs: Inputs,
    clock: Clock,
    columns: Vec<Column>,
    readings: Vec<Reading>,
    /// Of the measured force.
    snaps: Vec<Snap>,
    /// Quantities that were left out because they never change.
    dead: Vec<&'static str>,
    /// Columns whose noise nobody knows: it is not stated, and there are too few rows of them.
    too_few: Vec<Source>,
    limits: Vec<Limit>,
    /// Share of the readings that is left out because a fork decides it.
    forked_share: f64,
    motion: Motion,
}

impl Prepared {
    /// `None` for a drive's trial.
    pub fn of(trial: &RigTrial, sensor: &RigSensor, tick_s: f64) -> Option<Self> {
        let clock = Clock::of(&trial.t_s);
        let trial = &RigTrial { t_s: clock.t_s.clone(), ..trial.clone() };
        let data = trial.catheter()?;
        let start = *trial.t_s.first()?;
        let ticks = (trial.duration_s() / tick_s).floor() as usize + 1;
        let times = || (0..ticks).map(|tick| start + tick as f64 * tick_s);
        let positions: Vec<_> = times().map(|t_s| trial.encoder_at(t_s)).collect::<Option<_>>()?;
        let guidewire = times().map(|t_s| {
            let EncoderReading { insertion_m, rotation_rad } = trial.guidewire_at(t_s)?;
            Some(Drive { insertion_m, rotation_rad })
        });
        let (mut columns, too_few) = columns(data, sensor);
        let dead = sensors::take_dead(&mut columns);
        let limits = columns.iter().flat_map(sensors::limits).collect();
        let mut shape_rows: Vec<usize> = columns
            .iter()
            .filter(|column| matches!(column.source, Source::Shape(..)))
            .flat_map(|column| column.rows.iter().map(|(row, _)| *row))
            .collect();
        shape_rows.sort_unstable();
        shape_rows.dedup();
        let tick_of = |row: usize| ((trial.t_s[row] - start) / tick_s).round() as usize;
        let inputs = Inputs {
            tick_s,
            insertion_m: positions.iter().map(|p| p.insertion_m).collect(),
            rotation_rad: positions.iter().map(|p| p.rotation_rad).collect(),
            guidewire: guidewire.collect(),
            tendons_m: times().map(|t_s| trial.tendons_at(t_s)).collect(),
            shape_ticks: shape_rows.iter().map(|&row| tick_of(row).min(ticks - 1)).collect(),
            shape_points: data.shape_m.len(),
        };
        Some(Self {
            motion: Motion::of(&inputs),
            inputs,
            clock,
            columns,
            readings: Vec::new(),
            snaps: Vec::new(),
            dead,
            too_few,
            limits,
            forked_share: 0.0,
        })
    }

    /// Whether a column is there.
    pub fn has(&self, source: Source) -> bool {
        self.columns.iter().any(|column| column.source == source)
    }

    /// Where a channel is measured, as a share of the arc length from the entry to the tip; all
    /// that is no point on the shape at the tip.
    pub fn along(&self, channel: &Channel) -> f64 {
        let sources = self.columns.iter().map(|column| column.source);
        let mut own = sources.filter(|source| source.channel() == *channel);
        match own.next() {
            // The first point is the tip, the last the entry.
            Some(Source::Shape(point, _)) => {
                1.0 - point as f64 / (self.inputs.shape_points.max(2) - 1) as f64
            }
            _ => 1.0,
        }
    }

    /// Time of the first row \[s\].
    pub fn start_s(&self) -> f64 {
        self.clock.t_s[0]
    }

    fn index(&self, t_s: f64) -> f64 {
        (t_s - self.clock.t_s[0]) / self.inputs.tick_s
    }

    /// Decides what is compared, from the measured snaps and those of the nominal model.
    pub fn choose_samples(&mut self, nominal: &Trajectory) {
        self.find_snaps();
        let of_nominal = self.snaps_of(&nominal.force_n, 0.0);
        let ready_s = self.ready_s();
        let near_snap = |t: f64| {
            let near = |s: &Snap| t > s.span_s[0] - SNAP_GUARD_S && t < s.span_s[1] + SNAP_GUARD_S;
            self.snaps.iter().chain(&of_nominal).any(near)
        };
        let kept = |t: f64| t >= ready_s && !near_snap(t) && !self.is_after_jump(t);
        let mut readings = Vec::new();
        for column in &self.columns {
            let averaged = matches!(column.source, Source::Force(_) | Source::DriveForce);
            let mut rest = column.rows.as_slice();
            while let Some(&(first, _)) = rest.first() {
                let until = self.clock.t_s[first] + if averaged { AVERAGE_S - 1e-6 } else { 0.0 };
                let count =
                    rest.iter().take_while(|(row, _)| self.clock.t_s[*row] <= until).count();
                let (own, others) = rest.split_at(count.max(1));
                rest = others;
                let limits = self.limits.iter().filter(|l| l.source == column.source);
                let at_limit = |value: f64| limits.clone().any(|limit| limit.value == value);
                if own.iter().all(|(row, value)| kept(self.clock.t_s[*row]) && !at_limit(*value)) {
                    let value = own.iter().map(|(_, v)| v).sum::<f64>() / own.len() as f64;
                    let rows = own.iter().map(|(row, _)| *row).collect();
                    readings.push(Reading { source: column.source, rows, value });
                }
            }
        }
        self.readings = readings;
    }

    /// Whether the clock jumped so shortly before that nothing is compared.
    fn is_after_jump(&self, t_s: f64) -> bool {
        self.clock.spans_s().any(|[from, to]| t_s > from && t_s < to + JUMP_GUARD_S)
    }

    /// From when on what was before the trial is forgotten \[s\]: the drive has fed the instrument by
    /// [`FEED_BEFORE_SCORE_M`], or, where it never does, turned it by [`TURN_BEFORE_SCORE_RAD`].
    fn ready_s(&self) -> f64 {
        let moved = |column: &[f64], way: f64| {
            column.iter().position(|position| (position - column[0]).abs() >= way)
        };
        let Inputs { insertion_m, rotation_rad, tick_s, .. } = &self.inputs;
        let fed = moved(insertion_m, FEED_BEFORE_SCORE_M);
        let ready = fed.or_else(|| moved(rotation_rad, TURN_BEFORE_SCORE_RAD));
        ready.map_or(f64::INFINITY, |tick| self.start_s() + tick as f64 * tick_s)
    }

    /// Leaves out the readings that a fork decides.
    pub fn leave_out(&mut self, decided: &[bool]) {
        let all = self.readings.len().max(1);
        let mut own = decided.iter();
        self.readings.retain(|_| !own.next().is_some_and(|decided| *decided));
        self.forked_share = 1.0 - self.readings.len() as f64 / all as f64;
    }

    fn column(&self, source: Source) -> Option<&Column> {
        self.columns.iter().find(|column| column.source == source)
    }

    /// Predictions of the samples from a trajectory whose sensor read `force_n`, read later by
    /// `shift_s`.
    pub fn read(&self, of: &Trajectory, force_n: &[[f64; 3]], shift_s: f64) -> Vec<f64> {
        let at = |column: &dyn Fn(usize) -> f64, row: usize| {
            let index = self.index(self.clock.t_s[row] + shift_s).max(0.0);
            let low = (index.floor() as usize).min(force_n.len() - 1);
            let high = (low + 1).min(force_n.len() - 1);
            let share = (index - low as f64).clamp(0.0, 1.0);
            column(low) + share * (column(high) - column(low))
        };
        let mean = |rows: &[usize], column: &dyn Fn(usize) -> f64| {
            rows.iter().map(|row| at(column, *row)).sum::<f64>() / rows.len() as f64
        };
        let predict = |reading: &Reading| match reading.source {
            Source::Force(axis) => mean(&reading.rows, &|tick| force_n[tick][axis]),
            Source::DriveForce => mean(&reading.rows, &|tick| of.drive_force_n[tick]),
            Source::Tip(axis) => mean(&reading.rows, &|tick| of.tip_m[tick][axis]),
            Source::Shape(point, axis) => {
                // Shapes are slow: their shift in time is below their noise.
                let tick = self.index(self.clock.t_s[reading.first()]).round() as usize;
                let found = self.inputs.shape_ticks.binary_search(&tick.min(force_n.len() - 1));
                let shape = found.ok().and_then(|k| of.shapes.get(k));
                shape.and_then(|shape| shape.get(point)).map_or(f64::NAN, |p| p[axis])
            }
        };
        self.readings.iter().map(predict).collect()
    }

    /// The samples. `deviation`: what the model leaves open at each, beside what goes by the force;
    /// `bend_m`: length of the tip that is bent.
    pub fn samples(&self, channels: &[Channel], deviation: &[f64], bend_m: f64) -> Vec<Sample> {
        let force = self.contact();
        let around = |i: usize| {
            let own = |j: &usize| self.readings[*j].source == self.readings[i].source;
            let around = i.saturating_sub(NEIGHBOURS)..(i + NEIGHBOURS + 1).min(deviation.len());
            around.filter(own).map(|j| deviation[j]).fold(0.0, f64::max)
        };
        let deviation: Vec<f64> = (0..self.readings.len()).map(around).collect();
        let of_force = self.of_force(&deviation);
        let noises: Vec<(Source, Noise<'_>)> =
            self.columns.iter().map(|own| (own.source, self.noise(own))).collect();
        let duration = self.clock.t_s[self.clock.t_s.len() - 1] - self.clock.t_s[0];
        let sample = |(i, reading): (usize, &Reading)| {
            let t_s = 0.5 * (self.clock.t_s[reading.first()] + self.clock.t_s[reading.last()]);
            let tick = (self.index(t_s).round() as usize).min(self.inputs.insertion_m.len() - 1);
            let name = reading.source.channel().name;
            let noise = noises.iter().find(|(source, _)| *source == reading.source);
            let share = (t_s - self.clock.t_s[0]) / duration.max(f64::MIN_POSITIVE);
            Sample {
                t_s,
                channel: channels.iter().position(|c| c.name == name).unwrap_or_default(),
                value: reading.value,
                noise: noise.map_or(0.0, |(_, own)| own.of_sample(reading.rows.len())),
                model: deviation[i].hypot(of_force[i]),
                phase: phase(&self.motion, tick, &force, self.inputs.insertion_m[tick] < bend_m),
                regime: regime(&self.motion, tick),
                arc_m: self.inputs.insertion_m[tick],
                speed_m_per_s: self.motion.feed_m_per_s[tick],
                block: ((share * BLOCKS as f64) as usize).min(BLOCKS - 1),
            }
        };
        self.readings.iter().enumerate().map(sample).collect()
    }

    /// What any model leaves open of each force that was measured, beside what a finer one and a nearer
    /// wall change at each (`deviation`): little of a channel in which those change next to nothing.
    fn of_force(&self, deviation: &[f64]) -> Vec<f64> {
        let mean_square = |of: Source, what: &dyn Fn(usize) -> f64| {
            let own = (0..self.readings.len()).filter(|i| self.readings[*i].source == of);
            let squares: Vec<f64> = own.map(|i| what(i).powi(2)).collect();
            squares.iter().sum::<f64>() / squares.len().max(1) as f64
        };
        let forces = [Source::Force(0), Source::Force(1), Source::Force(2), Source::DriveForce];
        let open = forces.map(|of| {
            let squared = mean_square(of, &|i| self.readings[i].value);
            let usual = squared * (OF_FORCE.powi(2) + OF_CHANNEL.powi(2));
            let most = MOST_OF_FORCE.powi(2) * mean_square(of, &|i| deviation[i]);
            let share = (most / usual.max(f64::MIN_POSITIVE)).sqrt().min(1.0);
            (of, squared.sqrt(), share)
        });
        let open = |reading: &Reading| {
            let own = open.iter().find(|(of, ..)| *of == reading.source);
            own.map_or(0.0, |(_, rms, share)| {
                share * (OF_FORCE * reading.value).hypot(OF_CHANNEL * rms)
            })
        };
        self.readings.iter().map(open).collect()
    }

    /// First tick with a measured force clearly above its noise, if any.
    fn contact(&self) -> Option<usize> {
        const ABOVE_NOISE: f64 = 6.0;
        let columns = [0, 1, 2].map(|axis| self.column(Source::Force(axis)));
        let first = columns.into_iter().flatten().filter_map(|column| {
            let start = column.rows.first()?.1;
            let above = |(_, f): &&(usize, f64)| (f - start).abs() > ABOVE_NOISE * column.noise;
            column.rows.iter().find(above).map(|(row, _)| *row)
        });
        first.min().map(|row| self.index(self.clock.t_s[row]).round() as usize)
    }

    /// What never changes from beginning to end, and is left out.
    pub fn dead(&self) -> &[&'static str] {
        &self.dead
    }

    /// What must be known about this trial.
    pub fn remarks(&self, number: u32) -> Vec<String> {
        let mut remarks = Vec::new();
        for Jump { at_s, step_s, .. } in &self.clock.jumps {
            remarks.push(format!(
                "trial {number:03}: the clock jumps by {step_s:.3} s after {at_s:.3} s; the \
                 motion of the drive in between is not known, so the {JUMP_GUARD_S} s after the jump \
                 are not scored"
            ));
        }
        for what in &self.dead {
            remarks.push(format!(
                "trial {number:03}: {what} has the same value in every row: its sensor was off or \
                 not connected, so the channel is left out"
            ));
        }
        if let Some(first) = self.too_few.first() {
            let more = match self.too_few.len() {
                1 => String::new(),
                count => format!(" and {} columns more", count - 1),
            };
            remarks.push(format!(
                "trial {number:03}: {}{more}: rig.toml does not state the noise, and fewer than \
                 {FEWEST_ROWS} rows are too few to estimate it, so the columns are left out",
                first.channel().name
            ));
        }
        for Limit { source, value, share } in &self.limits {
            remarks.push(format!(
                "trial {number:03}: {} stays at {value} in {:.0} % of its rows: the sensor was at \
                 its limit, so these rows are not scored",
                source.channel().name,
                100.0 * share
            ));
        }
        if self.forked_share >= FORKED_SAID {
            remarks.push(format!(
                "trial {number:03}: {:.0} % of the samples are not scored; there the tip may go either \
                 side of the dividing wall within the uncertainty of the setup",
                100.0 * self.forked_share
            ));
        }
        if self.readings.is_empty() {
            remarks.push(format!(
                "trial {number:03}: nothing can be compared; the drive neither feeds {} mm nor turns \
                 by {TURN_BEFORE_SCORE_RAD} rad, or nothing was measured",
                1e3 * FEED_BEFORE_SCORE_M
            ));
        }
        remarks
    }

    /// The noise of a column's samples.
    fn noise<'a>(&self, column: &'a Column) -> Noise<'a> {
        let own = self.readings.iter().filter(|reading| reading.source == column.source);
        let means: Vec<Mean> = match column.source {
            // The few shapes of a trial do not tell their noise.
            Source::Shape(..) => Vec::new(),
            _ => own.map(|own| self.mean(own)).collect(),
        };
        Noise::of(column, &means)
    }

    fn mean(&self, reading: &Reading) -> Mean {
        let ends = [reading.first(), reading.last()].map(|row| self.clock.t_s[row]);
        Mean { t_s: 0.5 * (ends[0] + ends[1]), value: reading.value, rows: reading.rows.len() }
    }

    /// The noise of one row of a column, where it was estimated from its rows.
    pub fn estimated_noise(&self, source: Source) -> Option<f64> {
        let own = |column: &&Column| column.source == source && column.estimated;
        self.columns.iter().find(own).map(|column| self.noise(column).of_row())
    }

    /// The stated noise of one row of a column and the one that it has, where that is so much larger that the
    /// stated one is not believed.
    pub fn understated_noise(&self, source: Source) -> Option<[f64; 2]> {
        let own = |column: &&Column| column.source == source && !column.estimated;
        let column = self.columns.iter().find(own)?;
        let found = self.noise(column).of_row();
        (found > UNDERSTATED * column.noise).then_some([column.noise, found])
    }
}

/// Channels that any trial has, forces first.
pub fn channels<'a>(trials: impl Iterator<Item = &'a Prepared>) -> Vec<Channel> {
    let mut sources: Vec<Source> =
        trials.flat_map(|own| own.columns.iter().map(|column| column.source)).collect();
    sources.sort_unstable();
    sources.dedup();
    sources.into_iter().map(Source::channel).collect()
}

/// What was measured, and the columns whose noise nobody knows.
fn columns(data: &CatheterTrial, sensor: &RigSensor) -> (Vec<Column>, Vec<Source>) {
    let (mut columns, mut too_few) = (Vec::new(), Vec::new());
    let shape_noise_m = sensors::shape_noise_m(&data.shape_m);
    let mut add = |source, rows: Vec<(usize, f64)>, stated: Option<f64>| {
        if !rows.is_empty() {
            let stated = stated.filter(|noise| *noise > 0.0);
            let found = shape_noise_m.filter(|_| matches!(source, Source::Shape(..)));
            if stated.or(found).is_none() && rows.len() < FEWEST_ROWS {
                too_few.push(source);
                return;
            }
            let noise = stated.or(found).unwrap_or_else(|| cathforce_recording::white_noise(&rows));
            columns.push(Column { source, rows, noise, estimated: stated.is_none() });
        }
    };
    let axis = |column: &VectorColumn, axis: usize| -> Vec<(usize, f64)> {
        let rows = column.iter().enumerate();
        rows.filter_map(|(row, value)| Some((row, (*value)?[axis]))).collect()
    };
    for k in 0..3 {
        if let Some(force) = &data.force_n {
            add(Source::Force(k), axis(force, k), sensor.force_noise_sd_n);
        }
        if let Some(tip) = &data.tip_m {
            add(Source::Tip(k), axis(tip, k), sensor.tip_noise_sd_m);
        }
        // The last point is the entry, where the instrument is clamped.
        let points = data.shape_m.len().saturating_sub(1);
        for (point, column) in data.shape_m.iter().enumerate().take(points) {
            add(Source::Shape(point, k), axis(column, k), sensor.shape_noise_sd_m);
        }
    }
    if let Some(drive) = &data.drive_force_n {
        let rows = drive.iter().enumerate().filter_map(|(row, f)| Some((row, (*f)?))).collect();
        add(Source::DriveForce, rows, sensor.drive_noise_sd_n);
    }
    columns.sort_by_key(|column| column.source);
    (columns, too_few)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_bundle::Bundle;

    use super::*;
    use crate::catheter::plant::Catheter;
    use crate::plant::Plant;

    fn example() -> Bundle {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        Bundle::open(&example).unwrap()
    }

    #[test]
    fn points_on_the_shape_lie_between_entry_and_tip() {
        let bundle = example();
        let own = Prepared::of(&bundle.trials[0], &bundle.rig.sensor, 4e-3).unwrap();
        let along = |source: Source| own.along(&source.channel());
        // Eight points, of which the last one is the entry.
        assert_eq!(along(Source::Shape(0, 2)), 1.0);
        assert!((along(Source::Shape(4, 0)) - 3.0 / 7.0).abs() < 1e-12);
        assert!((along(Source::Shape(6, 1)) - 1.0 / 7.0).abs() < 1e-12);
        assert_eq!([along(Source::Tip(0)), along(Source::Force(1))], [1.0; 2]);
    }

    #[test]
    fn a_model_leaves_open_a_share_of_a_force_where_a_finer_one_changes_much() {
        let catheter = Catheter::new(&example()).unwrap();
        let own = &catheter.prepared[0];
        let with = |deviation: f64| {
            own.samples(catheter.channels(), &vec![deviation; own.readings.len()], 0.0)
        };
        let is_force = |s: &&Sample| catheter.channels()[s.channel].quantity.is_force();
        let open = |samples: &[Sample], share: f64| {
            let mut forces = samples.iter().filter(is_force);
            assert!(forces.clone().count() > 1000);
            forces.all(|s| s.model >= 0.999 * share * OF_FORCE * s.value.abs())
        };
        assert!(open(&with(1.0), 1.0));
        // By tenths of a millinewton, among forces of tens of millinewtons.
        let known = with(1e-4);
        assert!(!open(&known, 0.5));
        let most = 1e-4 * 1f64.hypot(MOST_OF_FORCE) * 1e3;
        let mean_square = |samples: &[Sample]| {
            let forces: Vec<f64> =
                samples.iter().filter(is_force).map(|s| s.model.powi(2)).collect();
            forces.iter().sum::<f64>() / forces.len() as f64
        };
        let left = 1e3 * mean_square(&known).sqrt();
        assert!((left / most - 1.0).abs() < 1e-6, "{left} {most}");
    }
}
