//! One experiment played twice: by the reference solver, which is the truth, and by the device's
//! model.

use std::ops::ControlFlow;

use anyhow::anyhow;
use cathforce_mechanics::{Compiled, Drag, MAX_LINKS, MOST_LINKS, Real, State};
use cathforce_reference_solver::{Drive, Problem, Schedule, Simulation};
use cathforce_validation::{Case, Choices, Kind, Links, Record, play_watched};
use nalgebra::Vector3;

use crate::meter::{Meter, TICKS_A_STEP, Trouble};
use crate::noise::{Noise, averaged, sensed};

/// A solution over time.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Ascending \[s\].
    pub t_s: Vec<f64>,
    /// Force of the instrument on the vessel, summed over all contacts \[N\].
    pub force_n: Vec<Vector3<f64>>,
    /// Its moment about the entry, Σ Lᵢ × Fᵢ \[N·m\].
    pub moment_n_m: Vec<Vector3<f64>>,
    /// Centre lines, tip first \[m\], at the times asked for.
    pub frames: Vec<Vec<Vector3<f64>>>,
    /// Share of the samples that the model flagged as not resolved \[1\].
    pub unresolved: f64,
}

impl Trace {
    /// The force at a time, linearly between samples and constant beyond them \[N\].
    pub fn force_at(&self, t_s: f64) -> Vector3<f64> {
        between(&self.t_s, &self.force_n, t_s)
    }

    /// The moment at a time \[N·m\].
    pub fn moment_at(&self, t_s: f64) -> Vector3<f64> {
        between(&self.t_s, &self.moment_n_m, t_s)
    }
}

fn between(times: &[f64], values: &[Vector3<f64>], t_s: f64) -> Vector3<f64> {
    let after = times.partition_point(|t| *t < t_s).min(times.len().saturating_sub(1));
    let before = after.saturating_sub(1);
    let (Some(a), Some(b)) = (values.get(before), values.get(after)) else {
        return Vector3::zeros();
    };
    let share = (t_s - times[before]) / (times[after] - times[before]).max(f64::MIN_POSITIVE);
    a.lerp(b, share.clamp(0.0, 1.0))
}

/// What is played.
#[derive(Clone, Debug)]
pub struct Experiment {
    pub problem: Problem,
    pub schedule: Schedule,
    /// Times at which the shape is taken, ascending \[s\].
    pub frames_s: Vec<f64>,
    /// Drag of the model where it is not the device's \[N·s/m²\].
    pub drag_n_s_per_m2: Option<f64>,
}

impl Experiment {
    /// Work of the truth and of one play by the model, in the unit of a [`Meter`].
    pub fn work(&self) -> [u64; 2] {
        let end_s = self.schedule.end_s();
        let steps = (end_s / self.problem.numerics.step_s).round() as u64;
        [steps * TICKS_A_STEP, (1e3 * end_s).round() as u64]
    }

    /// The truth, by the reference solver.
    pub fn truth(&self, meter: &Meter) -> Result<Trace, Trouble> {
        let (problem, schedule) = (&self.problem, &self.schedule);
        let failed = |error| Trouble::Failed(anyhow!("the reference solver: {error}"));
        let mut simulation = Simulation::settled(problem, schedule.at(0.0)).map_err(failed)?;
        let dt_s = problem.numerics.step_s;
        let steps = (schedule.end_s() / dt_s).round() as usize;
        let mut trace = Trace::default();
        for k in 1..=steps {
            let t_s = k as f64 * dt_s;
            let sample = simulation.step(dt_s, schedule.at(t_s)).map_err(failed)?;
            trace.t_s.push(t_s);
            trace.force_n.push(sample.force_on_vessel_n);
            trace.moment_n_m.push(sample.moment_on_vessel_n_m);
            while trace.frames.len() < self.frames_s.len()
                && self.frames_s[trace.frames.len()] <= t_s + 1e-9
            {
                trace.frames.push(self.inside(simulation.centre_line_m()));
            }
            meter.add(TICKS_A_STEP)?;
        }
        Ok(trace)
    }

    /// The device's model, in its precision, with as many links as it has time for.
    pub fn on_device(&self, meter: &Meter) -> Result<Trace, Trouble> {
        self.play::<f32, MAX_LINKS>(Links::Of(MAX_LINKS), meter)
    }

    /// The model with a number of nodes. More than the device has are computed in double precision.
    pub fn with_nodes(&self, nodes: usize, meter: &Meter) -> Result<Trace, Trouble> {
        let links = Links::Exactly(nodes);
        if nodes <= MAX_LINKS {
            self.play::<f32, MAX_LINKS>(links, meter)
        } else {
            self.play::<f64, MOST_LINKS>(links, meter)
        }
    }

    /// A centre line that ends at the guide's mouth: the two solvers place their last nodes differently.
    fn inside(&self, mut line: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
        let entry = &self.problem.entry;
        let is_behind = |p: &Vector3<f64>| (p - entry.position_m).dot(&entry.direction) <= 0.0;
        while line.last().is_some_and(is_behind) {
            line.pop();
        }
        line.push(entry.position_m);
        line
    }

    fn play<T: Compiled<LINKS>, const LINKS: usize>(
        &self,
        links: Links,
        meter: &Meter,
    ) -> Result<Trace, Trouble> {
        let case = Case {
            name: "the model",
            kind: Kind::Feed,
            problem: self.problem.clone(),
            schedule: self.schedule.clone(),
            scored_from_s: 0.0,
        };
        let mut choices = Choices { links, ..Choices::default() };
        if let Some(drag) = self.drag_n_s_per_m2 {
            choices.solver.drag = Drag::constant(drag);
        }
        let mut trace = Trace::default();
        let mut stopped = None;
        let watch = |record: &Record, state: &State<T, LINKS>| {
            while trace.frames.len() < self.frames_s.len()
                && self.frames_s[trace.frames.len()] <= record.t_s + 1e-9
            {
                trace.frames.push(self.inside(centre_line_m(state)));
            }
            match meter.add(1) {
                Ok(()) => ControlFlow::Continue(()),
                Err(trouble) => {
                    stopped = Some(trouble);
                    ControlFlow::Break(())
                }
            }
        };
        let records = play_watched::<T, LINKS>(&case, &choices, watch)?;
        if let Some(trouble) = stopped {
            return Err(trouble);
        }
        let flagged = records.iter().filter(|r| r.unresolved).count();
        trace.unresolved = flagged as f64 / records.len().max(1) as f64;
        for record in records {
            trace.t_s.push(record.t_s);
            trace.force_n.push(record.force_on_vessel_n);
            trace.moment_n_m.push(record.moment_on_vessel_n_m);
        }
        Ok(trace)
    }
}

/// Why the model refuses so few nodes over this insertion \[m\].
pub fn too_few(nodes: usize, insertion_m: f64) -> String {
    format!(
        "the device's links are at most 20 mm long, and {nodes} nodes over {:.0} mm need longer ones",
        1e3 * insertion_m
    )
}

/// Nodes of the model, tip first \[m\].
fn centre_line_m<T: Real, const LINKS: usize>(state: &State<T, LINKS>) -> Vec<Vector3<f64>> {
    let nodes = (0..state.nodes()).filter_map(|node| state.node_position_m(node));
    nodes.map(|p| Vector3::from(p.map(T::to_f64))).collect()
}

/// Sampling interval of the sensor \[s\].
pub const SAMPLE_S: f64 = 1e-3;
/// Half the width of the moving average of the sensor's data \[samples\]. No width is printed; a
/// quarter of a second takes noise of 0.01 N to below 1 mN.
const HALF_AVERAGE: usize = 125;

/// What the force sensor under the phantom gives, sampled at 1 kHz from the first sample time on
/// and averaged, as the publications did it \[N\].
pub fn measured(trace: &Trace, coarse: usize, seed: u64) -> Vec<Vector3<f64>> {
    let mut noise = Noise::of_seed(seed);
    let read: Vec<_> =
        sample_times(trace).map(|t_s| sensed(trace.force_at(t_s), coarse, &mut noise)).collect();
    averaged(&read, HALF_AVERAGE)
}

/// Times of the sensor's samples \[s\].
pub fn sample_times(trace: &Trace) -> impl Iterator<Item = f64> + use<> {
    let end_s = trace.t_s.last().copied().unwrap_or(0.0);
    (1..=(end_s / SAMPLE_S).round() as usize).map(|k| k as f64 * SAMPLE_S)
}

/// A feed at `speed_m_per_s` after `rest_s` of rest, with a ripple of amplitude `ripple_m_per_s`.
///
/// The publications print how far the speed strays, not how fast. Here it strays at 0.7 and 1.9 Hz,
/// in the range of one turn of a drive wheel, by half of the amplitude each.
pub fn feed(
    from_m: f64,
    to_m: f64,
    rest_s: f64,
    speed_m_per_s: f64,
    ripple_m_per_s: f64,
    phases: [f64; 2],
) -> Schedule {
    const KNOT_S: f64 = 5e-3;
    const RAMP_S: f64 = 0.1;
    let waves = [0.7, 1.9].map(|hertz| std::f64::consts::TAU * hertz);
    // The integral of the speed over the time of the feed; the ramp is that of the speed.
    let fed = |t: f64| {
        let even = if t < RAMP_S { 0.5 * t * t / RAMP_S } else { t - 0.5 * RAMP_S };
        let strayed =
            waves.iter().zip(phases).map(|(w, phase)| (phase.cos() - (w * t + phase).cos()) / w);
        speed_m_per_s * even + 0.5 * ripple_m_per_s * strayed.sum::<f64>()
    };
    let end_s = (to_m - from_m) / speed_m_per_s + 0.5 * RAMP_S;
    let count = ((rest_s + end_s) / KNOT_S).round() as usize;
    let knot = |k: usize| {
        let t_s = k as f64 * KNOT_S;
        let insertion_m = from_m + fed((t_s - rest_s).max(0.0));
        (t_s, Drive { insertion_m, rotation_rad: 0.0 })
    };
    let knots = (0..=count).map(knot).collect();
    Schedule::samples(knots).unwrap_or_else(|| Schedule::starting_at(from_m, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feed_arrives_and_its_speed_strays_by_its_ripple() {
        let even = feed(5e-3, 0.165, 0.3, 0.013, 0.0, [0.0; 2]);
        assert!((even.at(even.end_s()).insertion_m - 0.165).abs() < 0.1e-3);
        assert_eq!(even.at(0.25).insertion_m, 5e-3);
        let rippled = feed(5e-3, 0.165, 0.3, 0.013, 0.002, [0.4, 2.0]);
        let speeds = (100..2000).map(|k| {
            let t = 5e-3 * f64::from(k);
            (rippled.at(t + 5e-3).insertion_m - rippled.at(t).insertion_m) / 5e-3
        });
        let (low, high) = speeds.fold((1.0_f64, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
        assert!(
            (0.0110..0.0112).contains(&low) && (0.0148..0.0150).contains(&high),
            "{low} {high}"
        );
    }

    #[test]
    fn a_trace_is_linear_between_samples() {
        let trace = Trace {
            t_s: vec![0.1, 0.2],
            force_n: vec![Vector3::x(), Vector3::x() * 3.0],
            ..Trace::default()
        };
        for (t_s, x) in [(0.0, 1.0), (0.15, 2.0), (0.2, 3.0), (0.9, 3.0)] {
            assert!((trace.force_at(t_s).x - x).abs() < 1e-12, "{t_s}");
        }
    }
}
