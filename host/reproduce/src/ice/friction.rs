//! Table II, tendons: static and sliding friction and dead zone from loops of seven amplitudes.

use anyhow::anyhow;
use cathforce_identification::{
    Bends, Effort, Identified, LoopRecord, Mesh, Noise, OpenVessel, PullSetup, PulledTip, Pulls,
    RodValues, Spread, TendonValues, TipTendon, measured_loops,
};
use cathforce_mechanics::Description;

use super::catheter::{LENGTH_M, NOISE_M, RADIUS_M, SAMPLE_S, SECTION_READ, SENSOR_READ, catheter};
use super::trial::{pairs, search, worst_error};
use crate::meter::{Meter, Trouble};
use crate::part::Outcome;
use crate::plot::{Curve, Plot, Style};
use crate::row::Row;

/// Printed peaks of the drive \[counts\], evenly between the printed ends, and how far the drive goes in a
/// count, which is not printed \[m\]: 10 000 counts then bend the catheter by about 90°.
const COUNTS: [f64; 7] = [4e3, 5e3, 6e3, 7e3, 8e3, 9e3, 1e4];
const COUNT_M: f64 = 0.25e-6;
/// Tendons of a catheter of 12 F: distance from the centre line \[m\], stiffness of a steel wire of 0.2 mm
/// and 1.1 m, E A/L = 200 GPa · 0.031 mm²/1.1 m \[N/m\], and bend of the shaft behind the entry \[rad\]. None
/// of them is printed.
const OFFSET_M: f64 = 1.5e-3;
const TENDON_N_PER_M: f64 = 5.7e3;
const BEND_BEHIND_RAD: f64 = 0.5;
/// Friction of the trials: values and their standard deviations from one catheter to another. The printed
/// numbers have no unit that could be converted; these are those of steel in a polymer's lumen.
const NOMINAL: TendonValues =
    TendonValues { static_friction: 0.25, sliding_ratio: 0.6, slack_m: 0.2e-3 };
const VARIES: f64 = 0.1;
const CATHETERS: usize = 3;
/// Time of a way from one end to the other, and of a stay \[s\].
const WAY_S: f64 = 2.0;
const STAY_S: f64 = 0.3;

/// Links and tick \[s\] of the truth, of the fine simulation that the search follows, and of the coarse
/// one that it searches on. A tick is at most 10 ms and fits a whole number of times between two samples.
const TRUTH: (usize, f64) = (48, SAMPLE_S / 5.0);
const FINE: (usize, f64) = (60, SAMPLE_S / 6.0);
const COARSE: (usize, f64) = (24, SAMPLE_S / 4.0);
const EFFORT: Effort = Effort { global: 120, local: 60, seed: 31 };
/// Work of a coarse and of a fine simulation of all loops, in the unit of a [`Meter`], and about how many
/// of each a trial takes.
const WORK: [u64; 2] = [1000, 12_000];
const SIMULATIONS: [u64; 2] = [250, 7];

/// Why the printed numbers of the tendons' friction have no counterpart.
const WHY: &str = "eqs. (14) and (15) have no balance of units: a coefficient times a tension gives force per \
                   length at rest, a coefficient times tension, curvature and speed in motion, and table II \
                   prints no unit. The model here has Coulomb's coefficients at rest and in motion along \
                   the bend (capstan); the rows below find those";

pub fn work() -> u64 {
    CATHETERS as u64 * (SIMULATIONS[0] * WORK[0] + SIMULATIONS[1] * WORK[1])
}

/// One catheter: its true values, its loops, and what was found.
struct Trial {
    truth: TendonValues,
    records: Vec<LoopRecord>,
    found: Identified,
    again: Vec<LoopRecord>,
}

fn setup() -> PullSetup {
    PullSetup {
        length_m: LENGTH_M,
        amplitudes_m: COUNTS.map(|own| COUNT_M * own).to_vec(),
        way_s: WAY_S,
        stay_s: STAY_S,
        sample_s: SAMPLE_S,
    }
}

/// The catheter of table I with one tendon that bends it upwards.
fn description((links, tick_s): (usize, f64)) -> Description<f64> {
    let values = RodValues {
        density_kg_per_m3: 6169.0,
        youngs_pa: 30.20e9,
        air_drag_kg_per_m2: 0.0,
        damping_n_m2_s: 4.93e-6,
        // The device's model has no mass at the tip.
        tip_mass_kg: 0.0,
    };
    let tendon = TipTendon {
        offset_m: OFFSET_M,
        stiffness_n_per_m: TENDON_N_PER_M,
        bend_behind_rad: BEND_BEHIND_RAD,
        bends: Bends::Up,
    };
    catheter(RADIUS_M / 2.0).pulled(&values, &tendon, Mesh { edges: links, step_s: tick_s })
}

fn failed(error: impl std::fmt::Display) -> Trouble {
    Trouble::Failed(anyhow!("the model: {error}"))
}

pub fn run(meter: &Meter) -> Result<Outcome, Trouble> {
    let vessel = OpenVessel::new();
    let lumen = vessel.lumen().ok_or_else(|| failed("no open vessel"))?;
    let setup = setup();
    let rest = |mesh| {
        PulledTip::new(description(mesh), LENGTH_M, &lumen).map_err(|e| failed(format!("{e:?}")))
    };
    let (truth, fine, coarse) = (rest(TRUTH)?, rest(FINE)?, rest(COARSE)?);
    let experiment = Pulls { setup: &setup, fine: &fine, coarse: &coarse, lumen: &lumen };
    let trials: Result<Vec<Trial>, Trouble> =
        (0..CATHETERS as u64).map(|seed| trial(seed, &truth, &experiment, meter)).collect();
    Ok(outcome(&trials?))
}

fn trial(
    seed: u64,
    rest: &PulledTip,
    experiment: &Pulls<'_>,
    meter: &Meter,
) -> Result<Trial, Trouble> {
    let mut noise = Noise::of_seed(seed);
    let varied = NOMINAL
        .to_array()
        .map(|own| own * noise.within(1.0, VARIES, 1.0 - 2.0 * VARIES, 1.0 + 2.0 * VARIES));
    let truth = TendonValues::of_array(varied);
    let loops = |values: &TendonValues, rest: &PulledTip| {
        let records = experiment.setup.loops(values, rest, experiment.lumen);
        records.map_err(|error| failed(format!("{error:?}")))
    };
    let mut records = loops(&truth, rest)?;
    for own in &mut records {
        own.tip_m = noise.on(&own.tip_m, NOISE_M);
    }
    let measured = measured_loops(&records, NOISE_M, seed)
        .map_err(|(k, error)| failed(format!("loop {k}: {error}")))?;
    let low = TendonValues { static_friction: 0.02, sliding_ratio: 0.1, slack_m: 0.0 };
    let high = TendonValues { static_friction: 0.6, sliding_ratio: 1.0, slack_m: 0.6e-3 };
    let parameters = TendonValues::parameters(low, high);
    let found = search(
        &parameters,
        experiment,
        &measured,
        Effort { seed: EFFORT.seed + seed, ..EFFORT },
        meter,
        WORK,
    )?;
    let values = TendonValues::of_array(std::array::from_fn(|k| found.values[k]));
    let again = loops(&values, experiment.fine)?;
    Ok(Trial { truth, records, found, again })
}

fn outcome(trials: &[Trial]) -> Outcome {
    let how = format!(
        "{CATHETERS} catheters, friction and dead zone varied by 10 % about 0.25 at rest, 0.6 of that in motion, and 0.2 mm; loops of \
         seven amplitudes, 4000 to 10000 counts of 0.25 µm (not printed), by the device's model with {} links \
         and {:.1} ms; {SENSOR_READ}; bounds, dead zones and thickness of each; multi-start with {} links, \
         local searches that follow {} links and {:.1} ms by defect correction; no opposite tendon; {SECTION_READ}",
        TRUTH.0,
        1e3 * TRUTH.1,
        COARSE.0,
        FINE.0,
        1e3 * FINE.1,
    );
    let printed = [
        ("β_static of table II", "as printed", 493_892.0),
        ("β_sliding of table II", "as printed", 266.0),
        ("ε, smoothing parameter of table II", "as printed", 4.75e-6),
        ("n_offset of table II", "N", 0.0027),
    ];
    let mut rows: Vec<Row> = printed
        .into_iter()
        .map(|(figure, unit, value)| Row::without(figure, unit, WHY).published(value))
        .collect();
    let lines = [
        ("static friction", "1", 1.0),
        ("sliding over static friction", "1", 1.0),
        ("dead zone", "mm", 1e3),
    ];
    for (k, (figure, unit, scale)) in lines.into_iter().enumerate() {
        let told = || trials.iter().filter(|own| own.found.told[k]);
        let values: Vec<f64> = told().map(|own| own.found.values[k]).collect();
        let truths: Vec<f64> = told().map(|own| own.truth.to_array()[k]).collect();
        let Some(spread) = Spread::of(&values) else {
            rows.push(Row::without(figure, unit, "the loops do not tell it").how(how.as_str()));
            continue;
        };
        let mean =
            Row::of(format!("tendon, {figure} (mean of trials)"), unit, scale * spread.nominal);
        rows.push(mean.how(how.as_str()));
        let error = 100.0 * worst_error(&values, &truths);
        let figure = format!("tendon, {figure}, largest error of a trial");
        rows.push(Row::of(figure, "%", error).how(how.as_str()));
    }
    let all: Vec<Identified> = trials.iter().map(|own| own.found.clone()).collect();
    let count = all.iter().flat_map(|own| &own.inseparable).count();
    rows.push(
        Row::of(
            "tendon, pairs that the loops do not tell apart, over all trials",
            "1",
            count as f64,
        )
        .how(format!("correlation of errors above 0.95 in any trial: {}; {how}", pairs(&all))),
    );
    let plot = trials.first().map(plot);
    Outcome { rows, plots: plot.into_iter().collect() }
}

fn plot(trial: &Trial) -> Plot {
    let points = |own: &LoopRecord| {
        let each = own.tendon_m.iter().zip(&own.tip_m);
        each.map(|(drive, tip)| [1e-3 * drive / COUNT_M, 1e3 * tip]).collect()
    };
    let curves = |name: &str, style, all: &[LoopRecord]| -> Vec<Curve> {
        all.iter()
            .step_by(3)
            .map(|own| Curve { name: name.into(), style, points: points(own) })
            .collect()
    };
    let mut own = curves("measured", Style::Truth, &trial.records);
    own.extend(curves("with the found parameters", Style::Ours, &trial.again));
    Plot {
        title: "Tip over the tendon's drive, three of seven amplitudes".into(),
        axes: ["drive, thousands of counts", "height of the tip, mm"],
        equal: false,
        curves: own,
    }
}
