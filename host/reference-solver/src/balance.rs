//! Residual forces at an iterate, and their derivative.

use nalgebra::Vector3;

use crate::band::Band;
use crate::beyond::{BRANCHES, Relaxing};
use crate::contact::{Point, Reaction, Touch};
use crate::joint::{Bend, Edge, arc_curvature, bend, strain};
use crate::problem::Problem;
use crate::rod::Stretch;
use crate::state::{State, guide};

/// Unknowns of a node: position, and twist of the edge towards the guide.
pub(crate) const PER_NODE: usize = 4;
/// Diagonals on either side: a joint couples three nodes and two twists.
pub(crate) const HALF_BAND: usize = 10;

/// Derivative by time as c₀ x + c₁ x_n + c₂ x_{n−1} + d₁ ẋ_n.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Derivative {
    pub now: f64,
    pub last: f64,
    pub before: f64,
    pub rate: f64,
}

impl Derivative {
    /// Implicit Euler, first order.
    pub fn euler(dt: f64) -> Self {
        Self { now: 1.0 / dt, last: -1.0 / dt, before: 0.0, rate: 0.0 }
    }

    /// Second-order backward differentiation for steps of varying length.
    pub fn bdf2(dt: f64, last_dt: f64) -> Self {
        let w = dt / last_dt;
        Self {
            now: (1.0 + 2.0 * w) / (1.0 + w) / dt,
            last: -(1.0 + w) / dt,
            before: w * w / (1.0 + w) / dt,
            rate: 0.0,
        }
    }

    /// Between the trapezoidal rule and the former, for steps of the same length.
    pub fn bdf_alpha(dt: f64, alpha: f64) -> Self {
        let share = 1.0 / (1.0 + alpha);
        Self {
            now: (1.5 + alpha) * share / dt,
            last: -2.0 / dt,
            before: (0.5 + alpha) * share / dt,
            rate: alpha * share,
        }
    }

    /// The derivative of a vector from its values now, one step and two steps before.
    pub fn of(
        &self,
        now: &Vector3<f64>,
        last: &Vector3<f64>,
        before: &Vector3<f64>,
        rate: &Vector3<f64>,
    ) -> Vector3<f64> {
        now * self.now + last * self.last + before * self.before + rate * self.rate
    }

    /// The same of a number.
    pub fn of_number(&self, now: f64, last: f64, before: f64, rate: f64) -> f64 {
        now * self.now + last * self.last + before * self.before + rate * self.rate
    }
}

/// Everything that is constant while a step is solved.
pub(crate) struct Step<'a> {
    pub problem: &'a Problem,
    /// The state at the beginning, with the nodes that have entered since.
    pub start: &'a State,
    pub derivative: Derivative,
    /// 1 with inertia, 0 quasi-static.
    pub inertia: f64,
    pub drag: f64,
    pub friction: f64,
    /// Feed along the rod \[m/s\].
    pub feed_speed: f64,
    /// Viscous time of bending over the length of the step, for a rate of first order \[1\].
    pub viscosity: f64,
    /// Viscous time of bending, for a rate like every other \[s\].
    pub viscous_s: f64,
    /// Springs of bending that relax.
    pub relaxing_bends: [Relaxing; BRANCHES],
    /// Time at the end of the step \[s\].
    pub end_s: f64,
    /// Joint j lies at node j; the last one is the guide's. The first is not used.
    pub joints: Vec<Stretch>,
    /// Integrals over edge k.
    pub edges: Vec<Stretch>,
    /// Unstretched length and mass that node k stands for.
    pub shares: Vec<(f64, f64)>,
}

impl<'a> Step<'a> {
    /// The tables of a state whose drive has moved.
    pub fn new(problem: &'a Problem, start: &'a State, table: &Table) -> Self {
        let h = problem.numerics.spacing_m;
        let count = start.nodes.len();
        let base = start.base_length(h);
        let rod = &problem.rod;
        // Arc length from the tip to joint j, and to the middle of edge k.
        let joint = |j: usize| if j < count { h * j as f64 } else { h * (count - 1) as f64 + base };
        let middle = |k: usize| 0.5 * (joint(k) + joint(k + 1));
        let cell = |j: usize| {
            let (low, high) = (if j == 0 { 0.0 } else { middle(j - 1) }, middle(j));
            (high - low, rod.stretch(low, high))
        };
        let near_guide = count.saturating_sub(1);
        let joints = (0..=count).map(|j| {
            if j == count {
                rod.stretch(middle(count - 1), joint(count))
            } else if j < near_guide {
                table.cells[j].1
            } else {
                cell(j).1
            }
        });
        let edges = (0..count).map(|k| {
            if k < near_guide { table.edges[k] } else { rod.stretch(joint(k), joint(k + 1)) }
        });
        let shares = (0..count).map(|k| {
            let (length, stretch) = if k < near_guide { table.cells[k] } else { cell(k) };
            (length, stretch.mass)
        });
        Self {
            problem,
            start,
            derivative: Derivative::euler(1.0),
            inertia: 1.0,
            drag: problem.drag_n_s_per_m2,
            friction: problem.wall.friction_coefficient,
            feed_speed: 0.0,
            viscosity: 0.0,
            viscous_s: 0.0,
            relaxing_bends: Default::default(),
            end_s: 0.0,
            joints: joints.collect(),
            edges: edges.collect(),
            shares: shares.collect(),
        }
    }
}

/// Cells and edges of the rod away from the guide, which do not change with the feed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    /// Unstretched length and properties of the cell around joint j.
    cells: Vec<(f64, Stretch)>,
    edges: Vec<Stretch>,
}

impl Table {
    /// Extends the table to at least `count` nodes.
    pub fn reach(&mut self, problem: &Problem, count: usize) {
        let h = problem.numerics.spacing_m;
        for j in self.cells.len()..count {
            let at = h * j as f64;
            let low = if j == 0 { 0.0 } else { at - 0.5 * h };
            self.cells.push((at + 0.5 * h - low, problem.rod.stretch(low, at + 0.5 * h)));
            self.edges.push(problem.rod.stretch(at, at + h));
        }
    }
}

/// Positions, edges and accumulated twists of an iterate.
#[derive(Clone, Debug)]
pub(crate) struct Iterate {
    pub positions: Vec<Vector3<f64>>,
    pub edges: Vec<Edge>,
    /// Turn of each edge about itself since the step began \[rad\].
    pub twists: Vec<f64>,
    /// Direction in which each node slid in the last iteration, or zero.
    pub slid: Vec<Vector3<f64>>,
}

impl Iterate {
    fn vector(&self, step: &Step, k: usize) -> Vector3<f64> {
        let proximal = self.positions.get(k + 1).copied().unwrap_or(step.problem.entry.position_m);
        self.positions[k] - proximal
    }

    /// Moves by `scale` times a correction.
    pub fn move_by(&mut self, step: &Step, correction: &[f64], scale: f64) {
        let parts = correction.as_chunks::<PER_NODE>().0;
        for (position, part) in self.positions.iter_mut().zip(parts) {
            *position += Vector3::new(part[0], part[1], part[2]) * scale;
        }
        for (k, part) in parts.iter().enumerate() {
            let vector = self.vector(step, k);
            self.edges[k] = self.edges[k].carried_to(&vector, part[3] * scale);
            self.twists[k] += part[3] * scale;
        }
    }

    /// Rotation of the cross-section of edge k since the step began.
    fn turn(&self, step: &Step, k: usize) -> Vector3<f64> {
        let (before, now) = (&step.start.edges[k].tangent, &self.edges[k].tangent);
        before.cross(now) + now * self.twists[k]
    }
}

/// The balance of an iterate.
pub(crate) struct Balance {
    /// Residual force and torque, node by node.
    pub residual: Vec<f64>,
    /// Reaction of the wall on the instrument, node by node.
    pub reactions: Vec<Reaction>,
    /// Tension of the base edge \[N\].
    pub base_tension: f64,
    /// Squared bending moments \[(N·m)²\] and torques \[N·m\] of the guide's joint and the next.
    pub mouth: [(f64, f64); 2],
}

/// Fills `matrix` with the derivative of internal minus external forces.
pub(crate) fn balance(step: &Step, iterate: &Iterate, matrix: &mut Band) -> Balance {
    let problem = step.problem;
    let count = iterate.positions.len();
    let size = PER_NODE * count;
    matrix.reset(size);
    let mut out = Balance {
        residual: vec![0.0; size],
        reactions: Vec::with_capacity(count),
        base_tension: 0.0,
        mouth: [(0.0, 0.0); 2],
    };
    for k in 0..count {
        add_stretch(step, iterate, k, matrix, &mut out);
        add_node(step, iterate, k, matrix, &mut out);
        add_contact(step, iterate, k, matrix, &mut out);
    }
    let mouth = guide(&problem.entry, step.start.drive.rotation_rad);
    for j in 1..=count {
        let joint = &step.joints[j];
        let (bending, unloaded) = with_relaxing(step, j);
        let e = iterate.edges.get(j).unwrap_or(&mouth);
        // EI ((κ − κ₀) + v (κ − κ_n)) = EI (1 + v) (κ − (κ₀ + v κ_n)/(1 + v)), v = viscosity/dt.
        let v = step.viscosity;
        let (stiffness, unloaded) = if step.viscous_s > 0.0 {
            // The same with κ̇ = c₀ κ + what is known.
            let (d, known) = (&step.derivative, &step.start.bends[j - 1]);
            let scale = 1.0 + step.viscous_s * d.now;
            let rest = |i: usize| {
                let rate = d.of_number(0.0, known.last[i], known.before[i], known.rate[i]);
                (unloaded[i] - step.viscous_s * rate) / scale
            };
            (bending * scale, [rest(0), rest(1)])
        } else if v == 0.0 {
            (bending, unloaded)
        } else {
            let before = &step.start.edges;
            let bend = strain(before.get(j).unwrap_or(&mouth), &before[j - 1], &[0.0; 2]);
            let between = |own: f64, last: f64| (own + v * last) / (1.0 + v);
            let [up, side] = unloaded;
            (bending * (1.0 + v), [between(up, bend.up), between(side, bend.side)])
        };
        let bent = bend(e, &iterate.edges[j - 1], &unloaded, stiffness, joint.torsion);
        add_joint(j, size, &bent, matrix, &mut out.residual);
        if j + 1 >= count {
            let moment = stiffness * bent.strain.up.hypot(bent.strain.side);
            out.mouth[count - j] = (moment * moment, joint.torsion * bent.strain.twist);
        }
    }
    let load = &problem.tip_load;
    let edge = &iterate.edges[0];
    push(&mut out.residual, 0, &load.force_n);
    let couple = Couple::on(edge, &load.moment_n_m);
    push(&mut out.residual, 0, &couple.force);
    if count > 1 {
        push(&mut out.residual, 1, &-couple.force);
    }
    out.residual[3] += couple.torque;
    out
}

/// Stiffness of joint j with its relaxing springs, and the bend at which all of them together rest:
/// EI ((κ − κ₀) + Σ r (κ − κ_r)) = EI (1 + Σ r) (κ − (κ₀ + Σ r κ_r)/(1 + Σ r)).
///
/// A viscosity beside them is taken over the stiffness of all springs.
fn with_relaxing(step: &Step, j: usize) -> (f64, [f64; 2]) {
    let joint = &step.joints[j];
    let own = joint.unloaded.map(arc_curvature);
    let ratio = step.relaxing_bends.iter().map(|spring| spring.ratio).sum::<f64>();
    if ratio == 0.0 {
        return (joint.bending, own);
    }
    let relaxed = &step.start.bends[j - 1].relaxed;
    let springs = || step.relaxing_bends.iter().zip(relaxed);
    let held = |i: usize| springs().map(|(spring, bend)| spring.ratio * bend[i]).sum::<f64>();
    let rest = |i: usize| (own[i] + held(i)) / (1.0 + ratio);
    (joint.bending * (1.0 + ratio), [rest(0), rest(1)])
}

fn push(residual: &mut [f64], node: usize, force: &Vector3<f64>) {
    for i in 0..3 {
        residual[PER_NODE * node + i] += force[i];
    }
}

/// A moment on an edge: a pair of forces across it, and a torque about it.
struct Couple {
    force: Vector3<f64>,
    torque: f64,
}

impl Couple {
    fn on(edge: &Edge, moment: &Vector3<f64>) -> Self {
        Self { force: moment.cross(&edge.tangent) / edge.length, torque: moment.dot(&edge.tangent) }
    }
}

fn add_stretch(step: &Step, iterate: &Iterate, k: usize, matrix: &mut Band, out: &mut Balance) {
    let count = iterate.positions.len();
    let edge = &iterate.edges[k];
    let h = step.problem.numerics.spacing_m;
    let rest = if k + 1 == count { step.start.base_length(h) } else { h };
    let stiffness = step.edges[k].axial;
    let tension = stiffness * (edge.length - rest);
    let t = &edge.tangent;
    push(&mut out.residual, k, &(t * -tension));
    if k + 1 < count {
        push(&mut out.residual, k + 1, &(t * tension));
    } else {
        out.base_tension = tension;
    }
    let across = tension / edge.length;
    for i in 0..3 {
        for j in 0..3 {
            let value = (stiffness - across) * t[i] * t[j] + if i == j { across } else { 0.0 };
            let (row, column) = (PER_NODE * k + i, PER_NODE * k + j);
            matrix.add(row, column, value);
            if k + 1 < count {
                matrix.add(row, column + PER_NODE, -value);
                matrix.add(row + PER_NODE, column, -value);
                matrix.add(row + PER_NODE, column + PER_NODE, value);
            }
        }
    }
}

/// Weight, inertia and drag.
fn add_node(step: &Step, iterate: &Iterate, k: usize, matrix: &mut Band, out: &mut Balance) {
    let node = &step.start.nodes[k];
    let (length, mass) = step.shares[k];
    let d = &step.derivative;
    let velocity = d.of(&iterate.positions[k], &node.position, &node.earlier.0, &node.velocity);
    let acceleration = d.of(&velocity, &node.velocity, &node.earlier.1, &node.acceleration);
    let beyond = &step.problem.beyond;
    let mass = if k == 0 { mass + beyond.tip_mass_kg } else { mass };
    let inertia = step.inertia * mass;
    let drag = step.drag * length;
    let fed = iterate.edges[k].tangent * step.feed_speed;
    let stream = iterate.edges[k].tangent * (step.problem.beyond.stream_n_per_m * length);
    let force = step.problem.gravity_m_per_s2 * mass + stream
        - acceleration * inertia
        - (velocity - fed) * drag;
    push(&mut out.residual, k, &force);
    add_square_drag(step, k, &(velocity - fed), matrix, out);
    let stiffness = inertia * d.now * d.now + drag * d.now;
    for i in 0..3 {
        matrix.add(PER_NODE * k + i, PER_NODE * k + i, stiffness);
    }
}

/// Drag by the square of the speed, of still air and of the flow.
fn add_square_drag(
    step: &Step,
    k: usize,
    velocity: &Vector3<f64>,
    matrix: &mut Band,
    out: &mut Balance,
) {
    let beyond = &step.problem.beyond;
    let flow_drag = beyond.flow.drag_kg_per_m2();
    // The profile is that at the beginning of the step.
    let stream = || {
        let wall = step.problem.lumen.sample(&step.start.nodes[k].position);
        beyond.flow.at(wall.distance_m, step.end_s)
    };
    let air = (beyond.air_drag_kg_per_m2, Vector3::zeros());
    let flow = (flow_drag, if flow_drag > 0.0 { stream() } else { Vector3::zeros() });
    for (drag, stream) in [air, flow] {
        let against = velocity - stream;
        let (drag, speed) = (drag * step.shares[k].0, against.norm());
        if drag <= 0.0 || speed <= 0.0 {
            continue;
        }
        push(&mut out.residual, k, &(against * (-drag * speed)));
        let scale = drag * step.derivative.now;
        for i in 0..3 {
            for j in 0..3 {
                let own = if i == j { speed } else { 0.0 };
                let value = scale * (own + against[i] * against[j] / speed);
                matrix.add(PER_NODE * k + i, PER_NODE * k + j, value);
            }
        }
    }
}

/// The wall's force on the surface at node k, and the moment of its arm on the edges around.
fn add_contact(step: &Step, iterate: &Iterate, k: usize, matrix: &mut Band, out: &mut Balance) {
    let problem = step.problem;
    let count = iterate.positions.len();
    let wall = problem.lumen.sample(&iterate.positions[k]);
    if wall.distance_m >= problem.rod.radius_m {
        out.reactions.push(Reaction::none());
        return;
    }
    let law = &problem.wall;
    let end = if k == 0 { law.end_stiffness_n_per_m } else { 0.0 };
    let normal = law.line_stiffness_n_per_m2 * step.shares[k].0 + end;
    let point = Point {
        normal,
        tangential: if step.friction > 0.0 { normal * law.tangential_ratio } else { 0.0 },
        friction: step.friction * problem.beyond.memory.factor(step.start.nodes[k].late_m_per_s),
        radius: problem.rod.radius_m,
        stiffening_per_m: problem.beyond.stiffening_per_m,
        light: (
            problem.beyond.light_friction,
            problem.beyond.light_load_n_per_m * step.shares[k].0,
        ),
        light_power: problem.beyond.light_power,
        relaxing: std::array::from_fn(|i| {
            (problem.beyond.relaxing[i].ratio * normal, step.start.nodes[k].relaxed[i])
        }),
    };
    // The cross-section at a node turns with the mean of its edges.
    let around: &[(usize, f64)] = if k == 0 { &[(0, 1.0)] } else { &[(k - 1, 0.5), (k, 0.5)] };
    let turn = around.iter().map(|&(edge, share)| iterate.turn(step, edge) * share).sum();
    let node = &step.start.nodes[k];
    let displacement = iterate.positions[k] - node.position;
    let reaction = point.reaction(&wall, &displacement, &turn, &node.slip, &iterate.slid[k]);
    push(&mut out.residual, k, &reaction.force);
    let moment = reaction.arm.cross(&reaction.force);

    // Columns of the surface's motion: d(surface) = dx + Σ share (t × de/|e| + t dθ) × arm.
    let mut columns: [(usize, Vector3<f64>); 3 * PER_NODE] =
        [(usize::MAX, Vector3::zeros()); 3 * PER_NODE];
    let first = PER_NODE * k.saturating_sub(1);
    let size = PER_NODE * count;
    // No column lies beyond the position of the next node towards the guide.
    let end = size.min(PER_NODE * (k + 1) + 3);
    for (i, column) in columns.iter_mut().enumerate() {
        if first + i < end {
            column.0 = first + i;
        }
    }
    for i in 0..3 {
        columns[PER_NODE * k + i - first].1 += Vector3::ith(i, 1.0);
    }
    for &(edge, share) in around {
        let t = &iterate.edges[edge].tangent;
        let length = iterate.edges[edge].length;
        let couple = Couple::on(&iterate.edges[edge], &(moment * share));
        push(&mut out.residual, edge, &couple.force);
        out.residual[PER_NODE * edge + 3] += couple.torque;
        if edge + 1 < count {
            push(&mut out.residual, edge + 1, &-couple.force);
        }
        for i in 0..3 {
            let swing = t.cross(&Vector3::ith(i, share / length)).cross(&reaction.arm);
            columns[PER_NODE * edge + i - first].1 += swing;
            columns[PER_NODE * (edge + 1) + i - first].1 -= swing;
        }
        columns[PER_NODE * edge + 3 - first].1 += t.cross(&reaction.arm) * share;
    }
    if reaction.touch != Touch::Open {
        for (row, work) in columns.iter().filter(|(row, _)| *row < size) {
            for (column, motion) in columns.iter().filter(|(column, _)| *column < size) {
                let mut value = work.dot(&(reaction.by_surface * motion));
                if *column / PER_NODE == k && *column % PER_NODE < 3 {
                    value += work.dot(&reaction.by_position.column(*column % PER_NODE));
                }
                matrix.add(*row, *column, value);
            }
        }
    }
    out.reactions.push(reaction);
}

/// Scatters a joint's derivatives from (f, θ_f, e, θ_e) to the nodes j − 1, j, j + 1.
fn add_joint(j: usize, size: usize, bent: &Bend, matrix: &mut Band, residual: &mut [f64]) {
    // f = x_{j−1} − x_j, e = x_j − x_{j+1}.
    let first = PER_NODE * (j - 1);
    let targets = |p: usize| -> [(usize, f64); 2] {
        match p {
            0..3 => [(first + p, 1.0), (first + PER_NODE + p, -1.0)],
            3 => [(first + 3, 1.0), (usize::MAX, 0.0)],
            4..7 => [(first + p, 1.0), (first + PER_NODE + p, -1.0)],
            _ => [(first + PER_NODE + 3, 1.0), (usize::MAX, 0.0)],
        }
    };
    for p in 0..8 {
        for (row, sign) in targets(p).into_iter().filter(|(row, _)| *row < size) {
            residual[row] -= sign * bent.gradient[p];
            for q in 0..8 {
                for (column, other) in targets(q).into_iter().filter(|(column, _)| *column < size) {
                    matrix.add(row, column, sign * other * bent.hessian[(p, q)]);
                }
            }
        }
    }
}
