//! Pescio et al. 2025, "A simulation environment for robot-assisted endovascular interventions".

use rayon::join;
use rayon::prelude::*;

#[cfg(feature = "wall")]
use crate::experiment::SAMPLE_S;
use crate::experiment::{Experiment, Trace, measured, too_few};
use crate::iliac::{
    ASSUMED, GPA_READ, Motion, REFERENCE_KG_PER_M3, REFERENCE_PA, Scores, TO_M, catheter,
    experiment, scores,
};
use crate::li;
use crate::meter::{Meter, Trouble};
use crate::part::{Outcome, Part};
use crate::row::Row;
#[cfg(feature = "wall")]
use crate::silicone;

pub const PARTS: &[Part] = &[
    Part { name: "insertion", work, run },
    #[cfg(feature = "wall")]
    Part { name: "tensile test", work: || 0, run: silicone::tensile_test },
    #[cfg(feature = "wall")]
    Part { name: "silicone wall", work: silicone::wall_work, run: silicone::wall },
    #[cfg(not(feature = "wall"))]
    crate::left_out::SILICONE,
];

/// A configuration of table 1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Configuration {
    name: &'static str,
    youngs_pa: f64,
    density_kg_per_m3: f64,
    nodes: usize,
}

const fn row(name: &'static str, mpa: f64, g_per_cm3: f64, nodes: usize) -> Configuration {
    Configuration { name, youngs_pa: 1e6 * mpa, density_kg_per_m3: 1e3 * g_per_cm3, nodes }
}

/// Table 1.
const TABLE_1: [Configuration; 9] = [
    row("M1", 200.0, 1.55, 50),
    row("M2", 300.0, 1.55, 50),
    row("M3", 600.0, 1.0, 50),
    row("M4", 600.0, 1.55, 10),
    row("M5", 600.0, 1.55, 25),
    row("M6", 600.0, 1.55, 50),
    row("M7", 600.0, 1.55, 70),
    row("M8", 600.0, 4.0, 50),
    row("M9", 800.0, 1.55, 50),
];

/// Printed speeds \[m/s\].
const SPEEDS_M_PER_S: [f64; 2] = [0.013, 0.023];
const SENSOR_SEED: u64 = 2;

/// The experiment of a configuration.
fn with(configuration: &Configuration, motion: Motion) -> Experiment {
    experiment(catheter(configuration.youngs_pa, configuration.density_kg_per_m3), motion)
}

/// The experiment itself, whose catheter is that of the reference configuration.
fn reference(motion: Motion) -> Experiment {
    experiment(catheter(REFERENCE_PA, REFERENCE_KG_PER_M3), motion)
}

fn work() -> u64 {
    let [slow, fast] = SPEEDS_M_PER_S.map(|speed| reference(Motion::even(speed)).work());
    slow[0] + fast[0] + slow[1] * (1 + TABLE_1.len() as u64) + fast[1]
}

fn run(meter: &Meter) -> Result<Outcome, Trouble> {
    let truth = |speed| {
        let truth = reference(Motion::rippled(speed)).truth(meter)?;
        let sensor = measured(&truth, li::COARSE, SENSOR_SEED);
        Ok::<_, Trouble>((truth, sensor))
    };
    let [slow_speed, fast_speed] = SPEEDS_M_PER_S;
    let (slow, fast) = join(|| truth(slow_speed), || truth(fast_speed));
    let ((slow, slow_sensor), (fast, fast_sensor)) = (slow?, fast?);
    let [slow_ours, fast_ours] =
        SPEEDS_M_PER_S.map(|speed| reference(Motion::even(speed)).on_device(meter));
    let (slow_ours, fast_ours) = (slow_ours?, fast_ours?);
    let at = |speed, truth: &Trace, sensor: &[_], ours: &Trace| {
        scores(truth, sensor, ours, Motion::even(speed))
    };
    let slow_scores = at(slow_speed, &slow, &slow_sensor, &slow_ours);
    let fast_scores = at(fast_speed, &fast, &fast_sensor, &fast_ours);
    let mut rows = insertion(&slow_scores, 13);
    rows.extend(insertion(&fast_scores, 23));
    rows.push(speeds(&slow_sensor, &fast_sensor));
    #[cfg(feature = "wall")]
    {
        let from = (Motion::even(slow_speed).scored_from_s() / SAMPLE_S) as usize;
        rows.push(silicone::yielded(peak_n(&slow_sensor[from.min(slow_sensor.len())..]))?);
    }
    let configurations: Result<Vec<_>, Trouble> = TABLE_1
        .par_iter()
        .map(|own| {
            let played = with(own, Motion::even(slow_speed)).with_nodes(own.nodes, meter);
            match played {
                Ok(ours) => Ok((own, Ok(at(slow_speed, &slow, &slow_sensor, &ours)))),
                Err(Trouble::Stopped) => Err(Trouble::Stopped),
                Err(Trouble::Failed(_)) => Ok((own, Err(too_few(own.nodes, TO_M)))),
            }
        })
        .collect();
    rows.extend(
        configurations?.iter().flat_map(|(own, scores)| configuration(own, scores.as_ref())),
    );
    Ok(Outcome { rows, plots: li::plots(&slow, &slow_sensor, &slow_ours) })
}

/// Errors of the insertion at one speed. Numbers are printed for 13 mm/s only.
fn insertion(s: &Scores, mm_per_s: u32) -> Vec<Row> {
    let how = format!(
        "device's model, fed at constant {mm_per_s} mm/s, against the sensor's averaged force behind \
         the direction-limiting guide (6.1 s at 13 mm/s); {GPA_READ}; {ASSUMED}"
    );
    let shape = "the same, one frame a second, points with 0.4 mm of noise";
    let [x, _, y] = s.force.axis;
    let mut figures = Vec::new();
    for (name, e, printed) in [
        ("x", x, [0.0058, 24.29]),
        ("y", y, [0.034, 19.35]),
        ("of the total", s.force.total, [0.0371, 30.45]),
    ] {
        figures.push((format!("force error {name}"), "N", e.mean, printed[0], how.as_str()));
        let relative = 100.0 * e.relative;
        figures.push((
            format!("force error {name}, relative"),
            "%",
            relative,
            printed[1],
            how.as_str(),
        ));
    }
    figures.push(("tip, mean distance".into(), "mm", 1e3 * s.tip_m, 3.1, shape));
    let frechet = "proximal part, mean Fréchet distance".to_owned();
    figures.push((frechet, "mm", 1e3 * s.frechet_m, 3.6, shape));
    let rows = figures.into_iter().map(|(name, unit, ours, printed, how)| {
        let row = Row::of(format!("{mm_per_s} mm/s: {name}"), unit, ours).how(how);
        if mm_per_s == 13 { row.published(printed) } else { row }
    });
    rows.collect()
}

/// Largest magnitude \[N\].
fn peak_n(force_n: &[nalgebra::Vector3<f64>]) -> f64 {
    force_n.iter().map(|f| f.norm()).fold(0.0, f64::max)
}

/// How little the speed matters to the force.
fn speeds(slow: &[nalgebra::Vector3<f64>], fast: &[nalgebra::Vector3<f64>]) -> Row {
    Row::of("peak force at 23 mm/s over that at 13 mm/s", "1", peak_n(fast) / peak_n(slow)).how(
        "the truth's averaged sensor, whole insertion; printed is that the speed has minimal influence",
    )
}

/// What a configuration of table 1 makes of the experiment.
fn configuration(own: &Configuration, scores: Result<&Scores, &String>) -> [Row; 2] {
    let Configuration { name, youngs_pa, density_kg_per_m3, nodes } = *own;
    let what = format!(
        "{name} ({:.0} MPa, {:.2} g/cm³, {nodes} nodes)",
        1e-6 * youngs_pa,
        1e-3 * density_kg_per_m3
    );
    let names =
        [format!("{what}: force error of the total"), format!("{what}: tip, mean distance")];
    let how = "the model with this configuration against the experiment with M6's catheter at 13 mm/s, \
               nodes over the inserted length; printed is a look at shape and stability only, which \
               chose M6";
    let [force, tip] = names;
    match scores {
        Ok(s) => [
            Row::of(force, "N", s.force.total.mean).how(how),
            Row::of(tip, "mm", 1e3 * s.tip_m).how(how),
        ],
        Err(why) => [
            Row::without(force, "N", why.as_str()).how(how),
            Row::without(tip, "mm", why.as_str()).how(how),
        ],
    }
}
