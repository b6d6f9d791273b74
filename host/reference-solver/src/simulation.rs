//! Time stepping: Newton's method for each step, with shorter steps where it does not converge.

use nalgebra::Vector3;
use thiserror::Error;

use crate::balance::{Balance, Derivative, HALF_BAND, Iterate, PER_NODE, Step, Table, balance};
use crate::band::Band;
use crate::beyond::{BRANCHES, towards};
use crate::contact::Touch;
use crate::drive::{Drive, Schedule};
use crate::joint::strain;
use crate::problem::{Integrator, Problem};
use crate::sample::{Sample, report};
use crate::state::{BendHistory, State, guide};

/// Work done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effort {
    /// Steps taken; parts of divided steps count.
    pub steps: usize,
    /// Iterations of Newton's method.
    pub iterations: usize,
    /// Steps that had to be divided.
    pub divided: usize,
}

/// Why a step has no solution.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum SolveError {
    #[error(
        "at insertion {insertion_m:.6} m no balance of forces was found even with steps of {step_s:.1e} s: \
         {residual_n:.1e} N are left"
    )]
    NoBalance { insertion_m: f64, step_s: f64, residual_n: f64 },
    #[error("the schedule begins {insertion_m} m inside; the instrument must be inside the vessel")]
    NothingInside { insertion_m: f64 },
}

/// Newton iterations before a step is divided.
const MOST_ITERATIONS: usize = 25;
/// First iterations, which are taken in full even if the residual grows, as it does at first because of
/// stretch.
const FREE_ITERATIONS: usize = 3;
/// Later corrections are shortened by `SHORTEN` at most `MOST_TRIES` times until the residual falls below
/// `DECREASE` times the last one. Where friction changes its direction, full corrections would cycle.
const MOST_TRIES: usize = 6;
const SHORTEN: f64 = 0.4;
const DECREASE: f64 = 0.9;
/// Largest number of successive halvings of a step.
const MOST_HALVINGS: u32 = 9;
/// Largest rotation of an edge in one iteration, approximately \[rad\].
const LARGEST_TURN: f64 = 0.3;

/// Steps whose lengths differ by less than this share are equally long; halved ones differ by a half.
const SAME_STEP: f64 = 1e-6;

/// Quasi-static settling: time and feed of a step, drag that decays over the steps at rest, and the speed
/// below which the instrument is at rest.
const SETTLE_STEP_S: f64 = 0.02;
const SETTLE_FEED_M: f64 = 2.5e-4;
const SETTLE_DRAG: f64 = 1000.0;
const SETTLE_STEPS: usize = 4000;
const RESTING_M: f64 = 1e-9;

/// A rod in its vessel, ready to be fed.
#[derive(Clone, Debug)]
pub struct Simulation<'a> {
    problem: &'a Problem,
    state: State,
    table: Table,
    matrix: Band,
    time_s: f64,
    sample: Sample,
    /// Work done so far.
    pub effort: Effort,
}

/// How one step treats time.
#[derive(Clone, Copy)]
enum Mode {
    Dynamic,
    /// Without inertia and friction.
    Settling {
        drag: f64,
    },
}

impl<'a> Simulation<'a> {
    /// Feeds quasi-statically and without friction from the guide's mouth to `start`, until the
    /// instrument rests.
    pub fn settled(problem: &'a Problem, start: Drive) -> Result<Self, SolveError> {
        if start.insertion_m.is_nan() || start.insertion_m <= 0.0 {
            return Err(SolveError::NothingInside { insertion_m: start.insertion_m });
        }
        let sample = Sample {
            t_s: 0.0,
            drive: start,
            force_on_vessel_n: Vector3::zeros(),
            moment_on_vessel_n_m: Vector3::zeros(),
            normal_force_n: 0.0,
            drive_force_n: 0.0,
            drive_torque_n_m: 0.0,
            tip_m: problem.entry.position_m,
            sliding: 0,
            sticking: 0,
        };
        let mut simulation = Self {
            problem,
            state: State::new(),
            table: Table::default(),
            matrix: Band::new(0, HALF_BAND),
            time_s: 0.0,
            sample,
            effort: Effort::default(),
        };
        simulation.state.drive.rotation_rad = start.rotation_rad;
        let mut rested = 0;
        for _ in 0..SETTLE_STEPS + (start.insertion_m / SETTLE_FEED_M) as usize {
            let missing = start.insertion_m - simulation.state.drive.insertion_m;
            let insertion_m = if missing > SETTLE_FEED_M {
                simulation.state.drive.insertion_m + SETTLE_FEED_M
            } else {
                rested += 1;
                start.insertion_m
            };
            let drag = SETTLE_DRAG / f64::from(1 + rested * rested);
            let before: Vec<_> = simulation.state.nodes.iter().map(|n| n.position).collect();
            let drive = Drive { insertion_m, rotation_rad: start.rotation_rad };
            simulation.advance(SETTLE_STEP_S, drive, Mode::Settling { drag })?;
            let moved =
                before.iter().zip(&simulation.state.nodes).map(|(a, b)| (b.position - a).norm());
            if rested > 20 && moved.fold(0.0, f64::max) < RESTING_M {
                break;
            }
        }
        for node in &mut simulation.state.nodes {
            node.velocity = Vector3::zeros();
            node.acceleration = Vector3::zeros();
            node.slip = Vector3::zeros();
            node.late_m_per_s = 0.0;
        }
        for bend in &mut simulation.state.bends {
            let relaxed = [bend.last; BRANCHES];
            *bend = BendHistory { before: bend.last, rate: [0.0; 2], relaxed, ..*bend };
        }
        simulation.state.last_step = 0.0;
        simulation.time_s = 0.0;
        simulation.sample.t_s = 0.0;
        Ok(simulation)
    }

    /// The same state for another problem on the same mesh. A wall that has moved between the two moves
    /// the touching points with it in the next step.
    pub fn released<'b>(self, problem: &'b Problem) -> Simulation<'b> {
        let moved = problem.lumen.offset_m() - self.problem.lumen.offset_m();
        let Self { mut state, matrix, time_s, sample, effort, .. } = self;
        // Friction depends on the relative displacement of instrument and wall.
        state.nodes.iter_mut().for_each(|node| node.slip -= moved);
        let table = Table::default();
        Simulation { problem, state, table, matrix, time_s, sample, effort }
    }

    /// Advances by `dt_s` to the drive's new position.
    pub fn step(&mut self, dt_s: f64, drive: Drive) -> Result<&Sample, SolveError> {
        self.advance(dt_s, drive, Mode::Dynamic)?;
        Ok(&self.sample)
    }

    /// Points of the centre line, the tip first \[m\].
    pub fn centre_line_m(&self) -> Vec<Vector3<f64>> {
        self.state.nodes.iter().map(|node| node.position).collect()
    }

    /// The result of the last step.
    pub fn sample(&self) -> &Sample {
        &self.sample
    }

    fn advance(&mut self, dt: f64, drive: Drive, mode: Mode) -> Result<(), SolveError> {
        let start = self.state.drive;
        // Progress and size of the next part, in units of the smallest part.
        let whole: u32 = 1 << MOST_HALVINGS;
        let (mut done, mut size) = (0, whole);
        let mut is_divided = false;
        while done < whole {
            let share = f64::from(done + size) / f64::from(whole);
            let blend = |from: f64, to: f64| from + (to - from) * share;
            let target = Drive {
                insertion_m: blend(start.insertion_m, drive.insertion_m),
                rotation_rad: blend(start.rotation_rad, drive.rotation_rad),
            };
            let part = dt * f64::from(size) / f64::from(whole);
            match self.attempt(part, target, mode) {
                Ok(()) => {
                    done += size;
                    // Longer parts are used again as soon as they fit.
                    if size < whole && done.is_multiple_of(2 * size) {
                        size *= 2;
                    }
                }
                Err(residual_n) if size == 1 => {
                    let insertion_m = target.insertion_m;
                    return Err(SolveError::NoBalance { insertion_m, step_s: part, residual_n });
                }
                Err(_) => {
                    is_divided = true;
                    size /= 2;
                }
            }
        }
        self.effort.divided += usize::from(is_divided);
        Ok(())
    }

    /// Attempts one step. The state changes only if it converges; else the residual is returned.
    fn attempt(&mut self, dt: f64, drive: Drive, mode: Mode) -> Result<(), f64> {
        let problem = self.problem;
        let mut start = self.state.clone();
        let known = start.nodes.len();
        start.feed(problem, drive, dt);
        self.table.reach(problem, start.nodes.len());
        let fed = drive.insertion_m - self.state.drive.insertion_m;
        let mut step = Step::new(problem, &start, &self.table);
        step.feed_speed = fed / dt;
        step.derivative = match (problem.numerics.integrator, mode) {
            (Integrator::Bdf2, Mode::Dynamic) if start.last_step > 0.0 => {
                Derivative::bdf2(dt, start.last_step)
            }
            (Integrator::BdfAlpha { alpha }, Mode::Dynamic)
                if (start.last_step - dt).abs() < SAME_STEP * dt =>
            {
                Derivative::bdf_alpha(dt, alpha)
            }
            _ => Derivative::euler(dt),
        };
        if let Mode::Settling { drag } = mode {
            step.inertia = 0.0;
            step.friction = 0.0;
            step.drag = drag;
        } else {
            step.relaxing_bends = problem.beyond.relaxing_bends;
            let viscous_s = problem.beyond.bending_viscosity_s;
            match problem.numerics.integrator {
                Integrator::BdfAlpha { .. } => step.viscous_s = viscous_s,
                Integrator::Euler | Integrator::Bdf2 => step.viscosity = viscous_s / dt,
            }
        }
        // While a run begins, time stands still.
        step.end_s = if matches!(mode, Mode::Dynamic) { self.time_s + dt } else { 0.0 };
        let mut iterate = guess(&step, known, fed, dt);
        let (solution, iterations) = self.iterate(&step, &mut iterate)?;
        self.effort.steps += 1;
        self.effort.iterations += iterations;
        self.time_s += dt;
        self.sample = report(&step, &iterate, &solution, self.time_s);
        let velocities: Vec<_> = (0..start.nodes.len())
            .map(|k| {
                let node = &start.nodes[k];
                let now = &iterate.positions[k];
                step.derivative.of(now, &node.position, &node.earlier.0, &node.velocity)
            })
            .collect();
        let derivative = step.derivative;
        let bends = bends(problem, drive, &iterate);
        for (history, now) in start.bends.iter_mut().zip(bends) {
            let BendHistory { last, before, rate, mut relaxed } = *history;
            for (bend, spring) in relaxed.iter_mut().zip(problem.beyond.relaxing_bends) {
                let share = towards(dt, spring.time_s);
                *bend = std::array::from_fn(|i| bend[i] + (now[i] - bend[i]) * share);
            }
            let of = |i: usize| derivative.of_number(now[i], last[i], before[i], rate[i]);
            *history = BendHistory { last: now, before: last, rate: [of(0), of(1)], relaxed };
        }
        for (k, node) in start.nodes.iter_mut().enumerate() {
            node.acceleration =
                derivative.of(&velocities[k], &node.velocity, &node.earlier.1, &node.acceleration);
            node.earlier = (node.position, node.velocity);
            node.position = iterate.positions[k];
            node.velocity = velocities[k];
            node.slip = solution.reactions[k].slip;
            let reaction = &solution.reactions[k];
            let branches = node.relaxed.iter_mut().zip(problem.beyond.relaxing);
            branches.for_each(|(relaxed, spring)| {
                *relaxed += (reaction.indentation - *relaxed) * towards(dt, spring.time_s)
            });
            let is_open = reaction.touch == Touch::Open;
            let speed = if is_open { velocities[k].norm() } else { reaction.slid_m / dt };
            let share = towards(dt, problem.beyond.memory.time_s);
            node.late_m_per_s += (speed - node.late_m_per_s) * share;
        }
        start.edges = iterate.edges;
        start.last_step = if matches!(mode, Mode::Dynamic) { dt } else { 0.0 };
        self.state = start;
        Ok(())
    }

    /// Newton's method from `iterate` to balance.
    fn iterate(&mut self, step: &Step, iterate: &mut Iterate) -> Result<(Balance, usize), f64> {
        let numerics = &self.problem.numerics;
        // Force by which the stiffest edge answers to rounding of the positions.
        let stiffest =
            step.edges[..step.edges.len() - 1].iter().fold(0.0, |s: f64, e| s.max(e.axial));
        let rounding_n = 30.0 * f64::EPSILON * stiffest * step.start.drive.insertion_m;
        let tolerance_n = numerics.tolerance_n.max(rounding_n);
        let mut found = balance(step, iterate, &mut self.matrix);
        for iteration in 1..=MOST_ITERATIONS {
            let residual = out_of_balance(&found.residual, numerics.spacing_m);
            let held = found.reactions.iter().any(|reaction| reaction.held);
            for (slid, reaction) in iterate.slid.iter_mut().zip(&found.reactions) {
                *slid = reaction.sliding;
            }
            if residual < tolerance_n && !held {
                return Ok((found, iteration));
            }
            if !residual.is_finite() || !self.matrix.solve(&mut found.residual) {
                return Err(residual);
            }
            let correction = std::mem::take(&mut found.residual);
            let mut scale = cautious(&correction, numerics.spacing_m);
            let from = iterate.clone();
            let tries = if iteration > FREE_ITERATIONS && !held { MOST_TRIES } else { 1 };
            for last_try in (0..tries).rev() {
                iterate.clone_from(&from);
                iterate.move_by(step, &correction, scale);
                found = balance(step, iterate, &mut self.matrix);
                if last_try == 0
                    || found.reactions.iter().any(|reaction| reaction.held)
                    || out_of_balance(&found.residual, numerics.spacing_m) < DECREASE * residual
                {
                    break;
                }
                scale *= SHORTEN;
            }
        }
        Err(out_of_balance(&found.residual, numerics.spacing_m))
    }
}

/// Bends of all joints of an iterate, towards up and side.
fn bends(problem: &Problem, drive: Drive, iterate: &Iterate) -> Vec<[f64; 2]> {
    let mouth = guide(&problem.entry, drive.rotation_rad);
    let joint = |j: usize| {
        let bend = strain(iterate.edges.get(j).unwrap_or(&mouth), &iterate.edges[j - 1], &[0.0; 2]);
        [bend.up, bend.side]
    };
    (1..=iterate.edges.len()).map(joint).collect()
}

/// Largest residual force; torques are divided by the spacing.
fn out_of_balance(residual: &[f64], spacing: f64) -> f64 {
    let parts = residual.as_chunks::<PER_NODE>().0;
    let size = |part: &[f64; PER_NODE]| {
        part[..3].iter().fold(part[3].abs() / spacing, |worst, x| worst.max(x.abs()))
    };
    parts.iter().map(size).fold(0.0, |worst, x| if x > worst || x.is_nan() { x } else { worst })
}

/// The share of a correction that turns no edge by more than [`LARGEST_TURN`].
fn cautious(correction: &[f64], spacing: f64) -> f64 {
    let parts = correction.as_chunks::<PER_NODE>().0;
    let mut largest: f64 = 0.0;
    for (k, part) in parts.iter().enumerate() {
        let next = parts.get(k + 1).copied().unwrap_or_default();
        let apart = (0..3).map(|i| (part[i] - next[i]).powi(2)).sum::<f64>().sqrt() / spacing;
        largest = largest.max(apart).max(part[3].abs());
    }
    if largest > LARGEST_TURN { LARGEST_TURN / largest } else { 1.0 }
}

/// First guess of a step: nodes keep their velocity, and entering nodes lie on the axis.
fn guess(step: &Step, known: usize, fed: f64, dt: f64) -> Iterate {
    let start = step.start;
    let entry = &step.problem.entry;
    let h = step.problem.numerics.spacing_m;
    let ahead = if step.inertia > 0.0 { dt } else { 0.0 };
    let positions: Vec<_> = start
        .nodes
        .iter()
        .enumerate()
        .map(|(k, node)| {
            if k >= known || start.nodes.len() == 1 {
                entry.position_m + entry.direction * (start.drive.insertion_m - h * k as f64)
            } else if ahead > 0.0 {
                node.position + node.velocity * ahead
            } else {
                node.position + start.edges[k].tangent * fed
            }
        })
        .collect();
    let count = positions.len();
    let mut iterate = Iterate {
        positions,
        edges: start.edges.clone(),
        twists: vec![0.0; count],
        slid: vec![Vector3::zeros(); count],
    };
    iterate.move_by(step, &vec![0.0; PER_NODE * count], 0.0);
    iterate
}

/// Settles and plays a schedule; returns one sample for each step.
pub fn run(problem: &Problem, schedule: &Schedule) -> Result<(Vec<Sample>, Effort), SolveError> {
    let mut simulation = Simulation::settled(problem, schedule.at(0.0))?;
    let dt_s = problem.numerics.step_s;
    let steps = (schedule.end_s() / dt_s).round() as usize;
    let mut samples = Vec::with_capacity(steps);
    for k in 1..=steps {
        let drive = schedule.at(k as f64 * dt_s);
        samples.push(simulation.step(dt_s, drive)?.clone());
    }
    Ok((samples, simulation.effort))
}
