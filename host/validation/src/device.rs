//! Plays a case on the device's model, with a stored wall made from the analytic one.

use std::ops::ControlFlow;

use anyhow::{Context, anyhow};
use cathforce_bundle::SolverDefaults;
use cathforce_bundle::geometry::{Wall, WallPoint};
use cathforce_bundle::lumen::{BuiltLumen, LumenOptions, build_lumen};
use cathforce_mechanics::{
    self as mechanics, BRICK_CELLS, Compiled, Description, FREE, LumenHeader, MAX_LINKS, Model,
    Real, State,
};
use cathforce_reference_solver::{Lumen, Problem};
use nalgebra::Vector3;

use crate::{Case, Record};

/// Choices of the model that a case does not state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choices {
    pub solver: SolverDefaults,
    /// Grid of the stored wall \[m\].
    pub cell_m: f64,
    pub links: Links,
}

/// Number of links over the largest insertion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Links {
    /// As many as a device has time for whose model has this number at most.
    Of(usize),
    Exactly(usize),
}

impl Default for Choices {
    /// The device's choices.
    fn default() -> Self {
        Self {
            solver: SolverDefaults::default(),
            cell_m: cathforce_bundle::CELL_M,
            links: Links::Of(MAX_LINKS),
        }
    }
}

/// The reference's wall, for sampling.
struct AnalyticWall<'a>(&'a Lumen);

impl Wall for AnalyticWall<'_> {
    fn sample(&self, p: &Vector3<f64>) -> WallPoint {
        let here = self.0.sample(p);
        let normal = here.gradient.try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
        WallPoint { distance_m: here.distance_m, normal, beyond_m: here.beyond_m }
    }

    fn bounds_m(&self) -> (Vector3<f64>, Vector3<f64>) {
        self.0.bounds_m()
    }
}

/// The device's description of a problem.
fn description<T: Real>(
    problem: &Problem,
    link_length_m: f64,
    defaults: &SolverDefaults,
) -> Description<T> {
    let lit = T::lit;
    let vector = |v: &Vector3<f64>| [lit(v.x), lit(v.y), lit(v.z)];
    let sections = problem.rod.sections.iter().map(|s| mechanics::Section {
        length_m: lit(s.length_m),
        bending_stiffness_n_m2: lit(s.bending_n_m2),
        torsional_stiffness_n_m2: lit(s.torsion_n_m2),
        axial_stiffness_n: lit(s.axial_n),
        mass_kg_per_m: lit(s.mass_kg_per_m),
    });
    let precurve = problem.rod.curves.iter().map(|c| mechanics::PrecurvePiece {
        length_m: lit(c.length_m),
        curvature_per_m: lit(c.up_per_m),
        lateral_curvature_per_m: lit(c.side_per_m),
        torsion_per_m: T::zero(),
    });
    Description {
        instrument: mechanics::Instrument {
            outer_radius_m: lit(problem.rod.radius_m),
            sections: sections.collect(),
            precurve: precurve.collect(),
        },
        guidewire: None,
        tendon: mechanics::Tendon::none(),
        tendons: [].into_iter().collect(),
        entry: mechanics::Entry {
            position_m: vector(&problem.entry.position_m),
            direction: vector(&problem.entry.direction),
            up: vector(&problem.entry.up),
        },
        wall: mechanics::Wall {
            line_stiffness_n_per_m2: lit(problem.wall.line_stiffness_n_per_m2),
            end_stiffness_n_per_m: lit(problem.wall.end_stiffness_n_per_m),
            tangential_ratio: lit(problem.wall.tangential_ratio),
            friction_coefficient: lit(problem.wall.friction_coefficient),
            onset_m: lit(defaults.onset_m),
            damping_s: lit(defaults.wall_damping_s),
        },
        effects: mechanics::Effects::off(),
        gravity_m_per_s2: vector(&problem.gravity_m_per_s2),
        solver: mechanics::Solver {
            link_length_m: lit(link_length_m),
            fine_tip_m: lit(defaults.fine_tip_m(link_length_m)),
            tick_s: lit(defaults.tick_s),
            substeps: defaults.substeps_for(problem.wall.line_stiffness_n_per_m2),
            solves: defaults.solves,
            predictor_gain: lit(defaults.predictor_gain),
            bending_damping_s: lit(defaults.bending_damping_s + problem.beyond.bending_viscosity_s),
            drag: defaults.drag(),
        },
    }
}

fn stored(problem: &Problem, cell_m: f64) -> anyhow::Result<BuiltLumen> {
    if problem.lumen.tubes().is_empty() {
        return Ok(free_space());
    }
    let options = LumenOptions::for_instrument(problem.rod.radius_m, cell_m);
    build_lumen(&AnalyticWall(&problem.lumen), options).context("the vessel has too many bricks")
}

/// A cube of 2 m without a wall.
fn free_space() -> BuiltLumen {
    const CELL_M: f64 = 1e-2;
    let bricks = (2.0 / (CELL_M * BRICK_CELLS as f64)).ceil() as u16;
    let header = LumenHeader {
        origin_m: [-1.0; 3],
        cell_m: CELL_M as f32,
        distance_unit_m: 1e-6,
        bricks: [bricks; 3],
        stored: 0,
    };
    BuiltLumen {
        header,
        bytes: FREE.to_le_bytes().repeat(usize::from(bricks).pow(3)),
        fine: [0; 2],
    }
}

/// Plays a case and returns one record a tick.
///
/// The device uses `f32` and [`MAX_LINKS`]; for more links take [`mechanics::MOST_LINKS`]. Fails if the model
/// or its lumen refuses the case.
pub fn play<T: Compiled<LINKS>, const LINKS: usize>(
    case: &Case,
    choices: &Choices,
) -> anyhow::Result<Vec<Record>> {
    play_watched::<T, LINKS>(case, choices, |_, _| ControlFlow::Continue(()))
}

/// The same, and shows the state after every tick to `watch`, which may end the play.
pub fn play_watched<T: Compiled<LINKS>, const LINKS: usize>(
    case: &Case,
    choices: &Choices,
    mut watch: impl FnMut(&Record, &State<T, LINKS>) -> ControlFlow<()>,
) -> anyhow::Result<Vec<Record>> {
    let defaults = &choices.solver;
    let schedule = &case.schedule;
    let ticks = (schedule.end_s() / defaults.tick_s).round() as usize;
    let at = |tick: usize| schedule.at(tick as f64 * defaults.tick_s);
    let largest_insertion_m = (0..=ticks).map(|k| at(k).insertion_m).fold(0.0, f64::max);
    let (links, tip_links) = links_of(case, choices);
    let played = SolverDefaults { tip_links, ..*defaults };
    let link_length_m = played.link_length_m(largest_insertion_m, links);
    let description = description::<T>(&case.problem, link_length_m, &played);
    let model: Model<T, LINKS> =
        Model::new(description).map_err(|error| anyhow!("{}: {error:?}", case.name))?;
    let built = stored(&case.problem, choices.cell_m)?;
    let lumen = mechanics::Lumen::new(built.header, &built.bytes)
        .map_err(|error| anyhow!("{}: {error:?}", case.name))?;
    let drive = |tick: usize| {
        let d = at(tick);
        mechanics::Drive {
            insertion_m: T::lit(d.insertion_m),
            rotation_rad: T::lit(d.rotation_rad),
        }
    };
    let mut state = Box::new(State::new());
    while !mechanics::settle(&model, &lumen, &mut state, drive(0)) {}
    let mut records = Vec::with_capacity(ticks);
    for tick in 1..=ticks {
        let outputs = mechanics::step(&model, &lumen, &mut state, drive(tick));
        let tip = state.node_position_m(0).unwrap_or([T::zero(); 3]);
        let record = Record {
            t_s: tick as f64 * defaults.tick_s,
            insertion_m: at(tick).insertion_m,
            rotation_rad: at(tick).rotation_rad,
            drive_force_n: outputs.drive_force_n.to_f64(),
            drive_torque_n_m: outputs.drive_torque_n_m.to_f64(),
            force_on_vessel_n: outputs.force_on_vessel_n.map(T::to_f64).into(),
            moment_on_vessel_n_m: outputs.moment_on_vessel_n_m.map(T::to_f64).into(),
            tip_m: tip.map(T::to_f64).into(),
            unresolved: outputs.unresolved,
        };
        records.push(record);
        if watch(&record, &state).is_break() {
            break;
        }
    }
    Ok(records)
}

/// Number of links of the chain, and how many of them are the short ones at the tip, whose share
/// stays the same.
fn links_of(case: &Case, choices: &Choices) -> (usize, usize) {
    let tip_links = choices.solver.tip_links;
    match choices.links {
        Links::Exactly(links) => (links, tip_links * links / MAX_LINKS),
        Links::Of(most) => {
            let links = choices.solver.links_at(case.problem.wall.line_stiffness_n_per_m2);
            (links * most / MAX_LINKS, tip_links * most / MAX_LINKS)
        }
    }
}

/// Plays a case with the device's precision and choices.
pub fn play_on_device(case: &Case) -> anyhow::Result<Vec<Record>> {
    play::<f32, MAX_LINKS>(case, &Choices::default())
}
