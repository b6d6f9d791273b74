//! Nodes and edges inside the vessel, and their feed by the drive.

use nalgebra::Vector3;

use crate::beyond::BRANCHES;
use crate::drive::Drive;
use crate::joint::Edge;
use crate::problem::{Entry, Problem};

/// One node; node 0 is the tip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub position: Vector3<f64>,
    pub velocity: Vector3<f64>,
    pub acceleration: Vector3<f64>,
    /// Position and velocity one step earlier.
    pub earlier: (Vector3<f64>, Vector3<f64>),
    /// Elastic tangential displacement of its contact with the wall \[m\].
    pub slip: Vector3<f64>,
    /// Indentations to which the relaxing branches of the wall have relaxed \[m\].
    pub relaxed: [f64; BRANCHES],
    /// Speed at which it slides, as its friction follows it \[m/s\].
    pub late_m_per_s: f64,
}

/// Bend of a joint at the end of the last step and of the one before, towards up and side, and its rate at
/// the end of the last one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BendHistory {
    pub last: [f64; 2],
    pub before: [f64; 2],
    pub rate: [f64; 2],
    /// Bends to which the relaxing springs have relaxed.
    pub relaxed: [[f64; 2]; BRANCHES],
}

/// Edge k runs from node k + 1, or the guide's mouth, to node k.
#[derive(Clone, Debug)]
pub(crate) struct State {
    pub nodes: Vec<Node>,
    pub edges: Vec<Edge>,
    /// Of the joint at the proximal end of each edge.
    pub bends: Vec<BendHistory>,
    pub drive: Drive,
    /// Length of the last step; 0 if the next step does not use the history \[s\].
    pub last_step: f64,
}

/// Shortest base edge, as a share of the spacing.
const SHORTEST: f64 = 0.02;

impl State {
    /// Nothing inside the vessel.
    pub fn new() -> Self {
        let drive = Drive::default();
        Self { nodes: Vec::new(), edges: Vec::new(), bends: Vec::new(), drive, last_step: 0.0 }
    }

    /// Unstretched length of the edge at the guide \[m\].
    pub fn base_length(&self, spacing: f64) -> f64 {
        self.drive.insertion_m - spacing * (self.nodes.len().saturating_sub(1)) as f64
    }

    /// Moves the drive; nodes enter and leave through the guide.
    pub fn feed(&mut self, problem: &Problem, target: Drive, dt: f64) {
        let spacing = problem.numerics.spacing_m;
        let entry = &problem.entry;
        let (before, at) = (self.drive.insertion_m, target.insertion_m);
        let velocity = entry.direction * if dt > 0.0 { (at - before) / dt } else { 0.0 };
        self.drive = target;
        while self.base_length(spacing) > (1.0 + SHORTEST) * spacing || self.nodes.is_empty() {
            let passed = spacing * self.nodes.len() as f64;
            // The node's earlier place in the guide lies on the axis behind the mouth.
            let inside = |insertion: f64| entry.position_m + entry.direction * (insertion - passed);
            let earlier = inside(before) - velocity * self.last_step;
            self.nodes.push(Node {
                position: inside(before),
                velocity,
                acceleration: Vector3::zeros(),
                earlier: (earlier, velocity),
                slip: Vector3::zeros(),
                relaxed: [0.0; BRANCHES],
                late_m_per_s: velocity.norm(),
            });
            self.edges.push(guide(entry, target.rotation_rad));
            self.bends.push(BendHistory::default());
        }
        while self.nodes.len() > 1 && self.base_length(spacing) < SHORTEST * spacing {
            self.nodes.pop();
            self.edges.pop();
            self.bends.pop();
        }
    }
}

/// The edge inside the guide.
pub(crate) fn guide(entry: &Entry, rotation: f64) -> Edge {
    let (sin, cos) = rotation.sin_cos();
    let side = entry.direction.cross(&entry.up);
    Edge { length: 1.0, tangent: entry.direction, first: entry.up * cos + side * sin }
}
