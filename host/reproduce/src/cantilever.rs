//! The catheter of Li 2023, held at its end under gravity, with the variations of its table 3.1.

use anyhow::anyhow;
use cathforce_reference_solver::{
    Beyond, Entry, Lumen, Numerics, Problem, Rod, Schedule, TipLoad, WallLaw,
};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::elastica::hanging;
use crate::experiment::{Experiment, too_few};
use crate::iliac::{GPA_READ, catheter};
use crate::meter::{Meter, Trouble};
use crate::part::Outcome;
use crate::plot::{Curve, Plot, Style};
use crate::row::Row;

/// A column of table 3.1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Variation {
    name: &'static str,
    nodes: usize,
    youngs_pa: f64,
    density_kg_per_m3: f64,
}

const fn column(name: &'static str, nodes: usize, mpa: f64, g_per_cm3: f64) -> Variation {
    Variation { name, nodes, youngs_pa: 1e6 * mpa, density_kg_per_m3: 1e3 * g_per_cm3 }
}

/// Table 3.1, the ground truth first.
const VARIATIONS: [Variation; 9] = [
    column("ground truth", 50, 600.0, 1.55),
    column("M1", 10, 600.0, 1.55),
    column("M2", 25, 600.0, 1.55),
    column("M3", 70, 600.0, 1.55),
    column("M4", 50, 300.0, 1.55),
    column("M5", 50, 200.0, 1.55),
    column("M6", 50, 600.0, 4.0),
    column("M7", 50, 800.0, 1.55),
    column("M8", 50, 600.0, 1.0),
];

/// The whole catheter hangs \[m\].
const LENGTH_M: f64 = 0.825;
/// The model swings for this time \[s\], with this drag \[N·s/m²\]. The device's drag of 0.155 is for
/// short lengths in a vessel; 825 mm in air would creep downwards with it for a minute. With this one
/// the slowest swing of the variations, ω² ≈ 17 s⁻², decays within 0.4 to 1.1 s.
const REST_S: f64 = 10.0;
const DRAG_N_S_PER_M2: f64 = 0.01;
/// Motion of the tip in the last second that counts as rest \[m\].
const RESTING_M: f64 = 0.5e-3;
const GRAVITY_M_PER_S2: f64 = 9.81;

pub fn work() -> u64 {
    VARIATIONS.len() as u64 * (1e3 * REST_S) as u64
}

pub fn run(meter: &Meter) -> Result<Outcome, Trouble> {
    let both: Result<Vec<_>, Trouble> =
        VARIATIONS.par_iter().map(|variation| solve(variation, LENGTH_M, meter)).collect();
    Ok(outcome(&both?))
}

/// A variation's fine shape and the model's, or why the model has none.
struct Solved {
    variation: Variation,
    fine: Vec<Vector3<f64>>,
    ours: Result<Vec<Vector3<f64>>, String>,
}

fn solve(variation: &Variation, length_m: f64, meter: &Meter) -> Result<Solved, Trouble> {
    let rod = catheter(variation.youngs_pa, variation.density_kg_per_m3);
    let fine = hanging(&rod, length_m, GRAVITY_M_PER_S2)
        .ok_or_else(|| anyhow!("the elastica of {} has no balance", variation.name))?;
    let fine = fine.into_iter().map(|[z, y]| Vector3::new(0.0, y, z)).collect();
    let problem = problem(rod);
    let experiment = Experiment {
        problem,
        schedule: Schedule::starting_at(length_m, 0.0).then(REST_S, 0.0, 0.0, 0.0),
        frames_s: vec![REST_S - 1.0, REST_S],
        drag_n_s_per_m2: Some(DRAG_N_S_PER_M2),
    };
    let ours = match experiment.with_nodes(variation.nodes, meter) {
        Ok(trace) => at_rest(&trace.frames),
        Err(Trouble::Stopped) => return Err(Trouble::Stopped),
        Err(Trouble::Failed(_)) => Err(too_few(variation.nodes, length_m)),
    };
    Ok(Solved { variation: *variation, fine, ours })
}

/// The last shape, unless the tip still moves.
fn at_rest(frames: &[Vec<Vector3<f64>>]) -> Result<Vec<Vector3<f64>>, String> {
    let [before, last] = frames else { return Err("the model has no shape".into()) };
    let moved_m = (last[0] - before[0]).norm();
    if moved_m <= RESTING_M {
        return Ok(last.clone());
    }
    Err(format!(
        "the model does not come to rest within {REST_S} s: its tip moves by {:.1} mm in the last one",
        1e3 * moved_m
    ))
}

fn problem(rod: Rod) -> Problem {
    Problem {
        rod,
        entry: Entry { position_m: Vector3::zeros(), direction: Vector3::z(), up: Vector3::y() },
        lumen: Lumen::open(),
        wall: WallLaw {
            line_stiffness_n_per_m2: 8e5,
            end_stiffness_n_per_m: 2e3,
            tangential_ratio: 3.0,
            friction_coefficient: 0.0,
        },
        beyond: Beyond::default(),
        gravity_m_per_s2: Vector3::y() * -GRAVITY_M_PER_S2,
        drag_n_s_per_m2: 0.02,
        tip_load: TipLoad::default(),
        // The model has its own.
        numerics: Numerics::default(),
    }
}

fn outcome(all: &[Solved]) -> Outcome {
    let tip = |line: &[Vector3<f64>]| line.first().copied().unwrap_or_else(Vector3::zeros);
    let truth = tip(&all[0].fine);
    let mut rows = Vec::new();
    for own in all {
        let Variation { name, nodes, youngs_pa, density_kg_per_m3 } = own.variation;
        let what = format!(
            "{name}: {:.0} MPa, {:.2} g/cm³, {nodes} nodes",
            1e-6 * youngs_pa,
            1e-3 * density_kg_per_m3
        );
        let names = [
            format!("gravity, {what}: tip below the clamp"),
            format!("gravity, {what}: tip from that of the ground truth"),
            format!("gravity, {what}: tip against the elastica"),
        ];
        match &own.ours {
            Err(why) => rows.extend(names.map(|name| Row::without(name, "mm", why.as_str()))),
            Ok(line) => {
                let ours = tip(line);
                let numbers = [-ours.y, (ours - truth).norm(), (ours - tip(&own.fine)).norm()];
                let how = "device's model at rest; the elastica is solved on 2000 segments; \
                           figures 3.10 to 3.12 print no number";
                rows.extend(
                    names
                        .into_iter()
                        .zip(numbers)
                        .map(|(name, m)| Row::of(name, "mm", 1e3 * m).how(how)),
                );
            }
        }
    }
    if let Some(row) = rows.first_mut() {
        row.how = format!("{}; {GPA_READ}", row.how);
    }
    Outcome {
        rows,
        plots: vec![plot(all, "Young's modulus", &[0, 4, 5, 7]), plot(all, "density", &[0, 6, 8])],
    }
}

/// Shapes of some variations.
fn plot(all: &[Solved], what: &str, which: &[usize]) -> Plot {
    let flat = |line: &[Vector3<f64>]| line.iter().map(|p| [1e3 * p.z, 1e3 * p.y]).collect();
    let curves = which.iter().filter_map(|&k| all.get(k)).flat_map(|own| {
        let fine = Curve {
            name: format!("{}, elastica", own.variation.name),
            style: Style::Truth,
            points: flat(&own.fine),
        };
        let ours = own.ours.as_ref().ok().map(|line| Curve {
            name: format!("{}, device's model", own.variation.name),
            style: if own.variation.name == VARIATIONS[0].name {
                Style::Ours
            } else {
                Style::Other
            },
            points: flat(line),
        });
        [Some(fine), ours].into_iter().flatten()
    });
    Plot {
        title: format!("Under gravity, by {what}"),
        axes: ["along the clamp, mm", "height, mm"],
        equal: true,
        curves: curves.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 60 mm: short enough that beam theory of small deflections holds for the straight part.
    #[test]
    fn the_model_hangs_as_the_elastica_does() {
        let meter = Meter::new(work(), &|_, _| (), &|| false);
        let solved = solve(&VARIATIONS[0], 0.06, &meter).unwrap();
        let (fine, ours) = (solved.fine[0], solved.ours.unwrap()[0]);
        // The hook takes 25 mm of it and ends a diameter beside the shaft.
        assert!((fine.y - 0.016).abs() < 1e-3 && (ours - fine).norm() < 0.3e-3, "{fine} {ours}");
    }

    #[test]
    fn too_few_nodes_are_refused_with_a_reason() {
        let meter = Meter::new(work(), &|_, _| (), &|| false);
        let few = Variation { nodes: 3, ..VARIATIONS[0] };
        let solved = solve(&few, 0.06, &meter).unwrap();
        assert!(solved.ours.is_err_and(|why| why.contains("3 nodes")));
    }
}
