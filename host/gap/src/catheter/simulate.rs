//! Plays one trial through the tick of the device, and computes the readings of its sensors.

use std::sync::{Arc, Mutex, OnceLock};

use cathforce_mechanics::{
    Description, Drive, Drives, Lumen, LumenHeader, MAX_TENDONS, Measurement, Model, State, settle,
    step,
};

use super::junctions::Junctions;
use crate::plant::Silhouette;

/// Quasi-static steps after which a start that never rests is taken as it is.
const SETTLE_STEPS: usize = 3000;
/// Trajectories that are kept, per trial: the nominal one, and the last ones, because a model is
/// often asked for again with other sensors, or to be differentiated.
const KEPT: usize = 16;

/// Drive positions of a trial, one a tick from its first row on.
#[derive(Clone, Debug)]
pub struct Inputs {
    pub tick_s: f64,
    pub insertion_m: Vec<f64>,
    pub rotation_rad: Vec<f64>,
    /// Of the guidewire's drive; without it a guidewire stays at the entry.
    pub guidewire: Option<Vec<Drive<f64>>>,
    /// Displacements of the tendons' drives \[m\]; without them every drive rests at zero.
    pub tendons_m: Vec<[f64; MAX_TENDONS]>,
    /// Ticks at which the shape is wanted.
    pub shape_ticks: Vec<usize>,
    /// Points on the shape, tip first and entry last; 0 for none.
    pub shape_points: usize,
}

/// What a tick gives.
#[derive(Clone, Debug, Default)]
pub struct Trajectory {
    pub force_n: Vec<[f64; 3]>,
    pub drive_force_n: Vec<f64>,
    pub tip_m: Vec<[f64; 3]>,
    /// At [`Inputs::shape_ticks`].
    pub shapes: Vec<Vec<[f64; 3]>>,
}

/// A model in a vessel.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    pub description: Description<f64>,
    /// Junctions of the vessel are nearer than stored by this \[m\].
    pub junctions_m: f64,
}

impl From<Description<f64>> for Setup {
    fn from(description: Description<f64>) -> Self {
        Self { description, junctions_m: 0.0 }
    }
}

/// The vessel and trajectories that were computed for it.
pub struct Simulator {
    header: LumenHeader,
    bytes: Vec<u8>,
    outer_radius_m: f64,
    /// Found when they are asked for.
    junctions: OnceLock<Junctions>,
    kept: Vec<Mutex<Vec<Kept>>>,
}

type Kept = (Setup, f64, Arc<Trajectory>);

impl Simulator {
    /// `outer_radius_m`: of what touches the vessel; `trials`: how many there are to keep trajectories
    /// of.
    pub fn new(header: LumenHeader, bytes: Vec<u8>, outer_radius_m: f64, trials: usize) -> Self {
        let kept = (0..trials).map(|_| Mutex::default()).collect();
        Self { header, bytes, outer_radius_m, junctions: OnceLock::new(), kept }
    }

    fn junctions(&self) -> &Junctions {
        let find = || Junctions::of(&self.header, &self.bytes, self.outer_radius_m);
        self.junctions.get_or_init(find)
    }

    /// Whether the vessel has walls that bend into it.
    pub fn has_junctions(&self) -> bool {
        !self.junctions().is_empty()
    }

    /// The vessel as a figure shows it.
    pub fn silhouette(&self, entry_m: [f64; 3]) -> Option<Silhouette> {
        Silhouette::of(&Lumen::new(self.header, &self.bytes).ok()?, entry_m)
    }

    /// Forgets what it found for a trial.
    pub fn forget(&self, trial: usize) {
        if let Some(kept) = self.kept.get(trial) {
            kept.lock().unwrap_or_else(|e| e.into_inner()).clear();
        }
    }

    /// The trajectory of a trial; the sensor's effects play no part in it. `None` when the
    /// description is refused or a number is not finite.
    pub fn run(
        &self,
        trial: usize,
        setup: &Setup,
        insertion_offset_m: f64,
        inputs: &Inputs,
    ) -> Option<Arc<Trajectory>> {
        let same = |kept: &&Kept| kept.0 == *setup && kept.1 == insertion_offset_m;
        // A poisoned lock only means that another trial panicked: nothing kept is half done.
        let lock = || self.kept.get(trial).map(|k| k.lock().unwrap_or_else(|e| e.into_inner()));
        if let Some((.., found)) = lock().as_deref().and_then(|kept| kept.iter().find(same)) {
            return Some(Arc::clone(found));
        }
        let fresh = Arc::new(self.simulate(setup, insertion_offset_m, inputs)?);
        if let Some(mut kept) = lock() {
            // The first one is the nominal model's and stays.
            if kept.len() >= KEPT {
                kept.remove(1);
            }
            kept.push((setup.clone(), insertion_offset_m, Arc::clone(&fresh)));
        }
        Some(fresh)
    }

    /// [`Simulator::run`] without looking for, or keeping, what was found before.
    pub fn simulate(
        &self,
        Setup { description, junctions_m }: &Setup,
        insertion_offset_m: f64,
        inputs: &Inputs,
    ) -> Option<Trajectory> {
        let moved =
            (*junctions_m != 0.0).then(|| self.junctions().nearer(&self.bytes, *junctions_m));
        let lumen = Lumen::new(self.header, moved.as_deref().unwrap_or(&self.bytes)).ok()?;
        let entry_m = description.entry.position_m;
        let model = Model::<f64>::new(description.clone()).ok()?;
        let drives = |tick: usize| Drives {
            catheter: Drive {
                insertion_m: (inputs.insertion_m[tick] + insertion_offset_m).max(0.0),
                rotation_rad: inputs.rotation_rad[tick],
            },
            guidewire: inputs.guidewire.as_ref().map_or(Drive::default(), |wire| wire[tick]),
            tendons_m: inputs.tendons_m.get(tick).copied().unwrap_or_default(),
        };
        let mut state = Box::new(State::<f64>::new());
        for _ in 0..SETTLE_STEPS {
            if settle(&model, &lumen, &mut state, drives(0)) {
                break;
            }
        }
        let mut found = Trajectory::default();
        let mut shapes = inputs.shape_ticks.iter().peekable();
        for tick in 0..inputs.insertion_m.len() {
            let outputs = step(&model, &lumen, &mut state, drives(tick));
            if !outputs.force_on_vessel_n.iter().all(|f| f.is_finite()) {
                return None;
            }
            found.force_n.push(outputs.force_on_vessel_n);
            found.drive_force_n.push(outputs.drive_force_n);
            found.tip_m.push(state.node_position_m(0).unwrap_or(entry_m));
            if shapes.next_if(|&&wanted| wanted == tick).is_some() {
                found.shapes.push(shape(&state, entry_m, inputs.shape_points));
            }
        }
        Some(found)
    }
}

/// Readings of the force sensor, one a tick.
pub fn readings(description: &Description<f64>, inputs: &Inputs, of: &Trajectory) -> Vec<[f64; 3]> {
    let mut sensor = Measurement::<f64>::new();
    let sensor_effects = &description.effects.sensor;
    of.force_n.iter().map(|&force| sensor.read(sensor_effects, inputs.tick_s, force)).collect()
}

/// Points equally spaced along the chain of nodes, tip first, entry last.
fn shape(state: &State<f64>, entry_m: [f64; 3], points: usize) -> Vec<[f64; 3]> {
    let mut nodes: Vec<[f64; 3]> =
        (0..state.nodes()).filter_map(|node| state.node_position_m(node)).collect();
    nodes.push(entry_m);
    let distance =
        |pair: &[[f64; 3]]| (0..3).map(|k| (pair[1][k] - pair[0][k]).powi(2)).sum::<f64>().sqrt();
    let mut arc = vec![0.0];
    for pair in nodes.windows(2) {
        arc.push(arc[arc.len() - 1] + distance(pair));
    }
    let whole = arc[arc.len() - 1];
    let at = |k: usize| {
        let wanted = whole * k as f64 / (points.max(2) - 1) as f64;
        let after = arc.partition_point(|&s| s < wanted).clamp(1, arc.len().max(2) - 1);
        let (Some(p), Some(q)) = (nodes.get(after - 1), nodes.get(after)) else { return entry_m };
        let span = arc[after] - arc[after - 1];
        let share = if span > 0.0 { (wanted - arc[after - 1]) / span } else { 0.0 };
        [0, 1, 2].map(|i| p[i] + share * (q[i] - p[i]))
    };
    (0..points).map(at).collect()
}
