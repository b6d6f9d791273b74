//! Table I: density, modulus, air drag, damping and tip mass from releases of weights.

use anyhow::anyhow;
use cathforce_identification::{
    Effort, Identified, Measured, Mesh, Noise, Release, ReleaseSetup, Releases, RodValues, Spread,
    measured_releases,
};
use cathforce_reference_solver::{Problem, Simulation};
use rayon::prelude::*;

use super::catheter::{
    BENDING_DIAMETER_M, LENGTH_M, NOISE_M, POISSON, RADIUS_M, SAMPLE_S, SECTION_READ, SENSOR_READ,
    catheter,
};
use super::trial::{pairs, search, worst_error};
use crate::meter::{Meter, Trouble};
use crate::part::Outcome;
use crate::plot::{Curve, Plot, Style};
use crate::row::Row;

/// A line of table I.
struct Printed {
    figure: &'static str,
    unit: &'static str,
    /// Value in SI over the printed one.
    scale: f64,
    nominal: f64,
    lower: f64,
    upper: f64,
    sd: f64,
}

/// Table I in the order of [`RodValues`].
const TABLE_I: [Printed; 5] = [
    Printed {
        figure: "density",
        unit: "kg/m³",
        scale: 1.0,
        nominal: 6169.0,
        lower: 4208.0,
        upper: 7881.0,
        sd: 3223.0,
    },
    Printed {
        figure: "Young's modulus",
        unit: "GPa",
        scale: 1e9,
        nominal: 30.20,
        lower: 26.80,
        upper: 37.80,
        sd: 2.90,
    },
    Printed {
        figure: "air drag",
        unit: "kg/m²",
        scale: 1.0,
        nominal: 2.65e-6,
        lower: 3.15e-7,
        upper: 5.06e-6,
        sd: 1.42e-6,
    },
    // Printed in Ns/m; B of m = K u + B du/dt is in N·m²·s.
    Printed {
        figure: "viscous damping",
        unit: "N·m²·s",
        scale: 1.0,
        nominal: 4.93e-6,
        lower: 3.78e-6,
        upper: 6.00e-6,
        sd: 0.53e-6,
    },
    Printed {
        figure: "mass of the tip sensor",
        unit: "g",
        scale: 1e-3,
        nominal: 3.50,
        lower: 1.78,
        upper: 5.70,
        sd: 0.82,
    },
];

/// Catheters that were measured: section V.
const CATHETERS: usize = 5;
/// Printed weights \[kg\].
const WEIGHTS_KG: [f64; 3] = [5e-3, 10e-3, 20e-3];
/// Time of a record \[s\]: about seven swings, after which a tenth of the first is left.
const RECORD_S: f64 = 3.0;
/// The truth, the fine simulation that the search follows, and the coarse one that it searches on.
const TRUTH: Mesh = Mesh { edges: 24, step_s: 2.5e-3 };
const FINE: Mesh = Mesh { edges: 32, step_s: SAMPLE_S / 12.0 };
const COARSE: Mesh = Mesh { edges: 10, step_s: SAMPLE_S / 5.0 };
/// Searched range beyond the printed bounds, as a share of them on either side.
const BEYOND: f64 = 0.5;
const EFFORT: Effort = Effort { global: 120, local: 60, seed: 11 };
/// Work of a coarse and of a fine simulation of the three releases, in the unit of a [`Meter`], and about
/// how many of each a trial takes.
const WORK: [u64; 2] = [300, 9000];
const SIMULATIONS: [u64; 2] = [300, 7];

pub fn work() -> u64 {
    CATHETERS as u64 * (SIMULATIONS[0] * WORK[0] + SIMULATIONS[1] * WORK[1])
}

/// One catheter: its true values, its records, and what was found.
struct Trial {
    truth: RodValues,
    records: Vec<Release>,
    found: Identified,
    again: Vec<Release>,
}

fn setup() -> ReleaseSetup {
    ReleaseSetup {
        diameter_m: BENDING_DIAMETER_M,
        poisson: POISSON,
        length_m: LENGTH_M,
        weights_kg: WEIGHTS_KG.to_vec(),
        duration_s: RECORD_S,
        sample_s: SAMPLE_S,
    }
}

fn problem(mesh: Mesh) -> Problem {
    let nominal = TABLE_I.each_ref().map(|own| own.scale * own.nominal);
    catheter(RADIUS_M).in_air(&RodValues::of_array(nominal), mesh)
}

fn failed(error: impl std::fmt::Display) -> Trouble {
    Trouble::Failed(anyhow!("the reference solver: {error}"))
}

pub fn run(meter: &Meter) -> Result<Outcome, Trouble> {
    let setup = setup();
    let problems = [TRUTH, FINE, COARSE].map(problem);
    let rests: Result<Vec<Simulation<'_>>, Trouble> =
        problems.par_iter().map(|own| setup.rest(own).map_err(failed)).collect();
    let rests = rests?;
    let with = |k: usize| (&problems[k], &rests[k]);
    let experiment = Releases { setup: &setup, fine: with(1), coarse: with(2) };
    let trials: Result<Vec<Trial>, Trouble> = (0..CATHETERS as u64)
        .into_par_iter()
        .map(|seed| trial(seed, &setup, with(0), &experiment, meter))
        .collect();
    Ok(outcome(&trials?))
}

/// The catheter of a seed: every value normally distributed about the nominal one, within the bounds.
fn drawn(seed: u64) -> (RodValues, Noise) {
    let mut noise = Noise::of_seed(seed);
    let values = TABLE_I
        .each_ref()
        .map(|own| own.scale * noise.within(own.nominal, own.sd, own.lower, own.upper));
    (RodValues::of_array(values), noise)
}

fn bounds() -> [RodValues; 2] {
    let low = TABLE_I.each_ref().map(|own| own.scale * own.lower * (1.0 - BEYOND));
    let high = TABLE_I.each_ref().map(|own| own.scale * own.upper * (1.0 + BEYOND));
    [low, high].map(RodValues::of_array)
}

fn trial(
    seed: u64,
    setup: &ReleaseSetup,
    (problem, rest): (&Problem, &Simulation<'_>),
    experiment: &Releases<'_>,
    meter: &Meter,
) -> Result<Trial, Trouble> {
    let (truth, mut noise) = drawn(seed);
    let mut records = setup.releases(&truth, problem, rest).map_err(failed)?;
    for own in &mut records {
        own.position_m = noise.on(&own.position_m, NOISE_M);
    }
    let measured: Measured = measured_releases(&records, NOISE_M, seed)
        .map_err(|(weight, error)| failed(format!("release {weight}: {error}")))?;
    let [low, high] = bounds();
    let parameters = RodValues::parameters(low, high);
    let effort = Effort { seed: EFFORT.seed + seed, ..EFFORT };
    let found = search(&parameters, experiment, &measured, effort, meter, WORK)?;
    let values: [f64; 5] = std::array::from_fn(|k| found.values[k]);
    let (problem, rest) = experiment.fine;
    let again = setup.releases(&RodValues::of_array(values), problem, rest).map_err(failed)?;
    Ok(Trial { truth, records, found, again })
}

fn outcome(trials: &[Trial]) -> Outcome {
    let how = format!(
        "{CATHETERS} catheters, each value drawn from the printed nominal value and standard deviation \
         within the printed bounds; weights of 5, 10 and 20 g released by the reference solver with {} edges \
         and {} ms; {SENSOR_READ}; six features of each; multi-start with {} edges and {} ms within half \
         beyond the printed bounds, then local searches that follow {} edges and {:.1} ms by defect correction; {SECTION_READ}",
        TRUTH.edges,
        1e3 * TRUTH.step_s,
        COARSE.edges,
        1e3 * COARSE.step_s,
        FINE.edges,
        1e3 * FINE.step_s,
    );
    let mut rows = Vec::new();
    for (k, printed) in TABLE_I.iter().enumerate() {
        rows.extend(lines(k, printed, trials, &how));
    }
    let poisson = "a release bends the catheter in one plane; nothing twists, and no feature depends on \
                   Poisson's ratio. The printed standard deviation of 0 says the same";
    rows.push(Row::without("Poisson's ratio", "1", poisson).published(POISSON));
    let all: Vec<Identified> = trials.iter().map(|own| own.found.clone()).collect();
    let count = all.iter().flat_map(|own| &own.inseparable).count();
    let named = format!("correlation of errors above 0.95 in any trial: {}; {how}", pairs(&all));
    rows.push(
        Row::of("pairs that the features do not tell apart, over all trials", "1", count as f64)
            .how(named),
    );
    let plot = trials.first().map(plot);
    Outcome { rows, plots: plot.into_iter().collect() }
}

/// The lines of one parameter: nominal value, bounds and standard deviation over the trials, and the
/// largest error.
fn lines(k: usize, printed: &Printed, trials: &[Trial], how: &str) -> Vec<Row> {
    let Printed { figure, unit, scale, .. } = *printed;
    let told: Vec<&Trial> = trials.iter().filter(|own| own.found.told[k]).collect();
    let values: Vec<f64> = told.iter().map(|own| own.found.values[k] / scale).collect();
    let truths: Vec<f64> = told.iter().map(|own| own.truth.to_array()[k] / scale).collect();
    let names = [
        (format!("{figure}, nominal (mean of trials)"), printed.nominal),
        (format!("{figure}, lower bound (least of trials)"), printed.lower),
        (format!("{figure}, upper bound (largest of trials)"), printed.upper),
        (format!("{figure}, standard deviation over trials"), printed.sd),
    ];
    let Some(spread) = Spread::of(&values) else {
        let sd = trials.iter().map(|own| own.found.sd[k] / scale).fold(f64::INFINITY, f64::min);
        let why = format!(
            "the features do not tell it: from bound to bound of the search it moves all of them by less than \
             their noise. A value could be told from nothing above {:.1e} {unit}, {:.0} times the printed one",
            cathforce_calibration::NINETY * sd,
            cathforce_calibration::NINETY * sd / printed.nominal,
        );
        let rows = names.into_iter();
        return rows
            .map(|(name, value)| Row::without(name, unit, why.clone()).published(value).how(how))
            .collect();
    };
    let Spread { nominal, lower, upper, sd } = spread;
    let most = Spread::largest_sd(printed.lower, printed.upper, CATHETERS);
    let mut rows: Vec<Row> = names
        .into_iter()
        .zip([nominal, lower, upper, sd])
        .map(|((name, value), ours)| {
            let how = match value == printed.sd && value > most {
                true => format!(
                    "{CATHETERS} values between the printed bounds have a standard deviation of {most:.0} at \
                     most, so the printed one is of something else; {how}"
                ),
                false => how.to_owned(),
            };
            Row::of(name, unit, ours).published(value).how(how)
        })
        .collect();
    let interval = told.iter().map(|own| own.found.sd[k] / scale).sum::<f64>() / told.len() as f64;
    let how = format!(
        "of the found value to the catheter's own; by the noise alone the standard deviation of a trial is \
         {:.1} % in the mean; {how}",
        100.0 * interval / nominal
    );
    let error = 100.0 * worst_error(&values, &truths);
    rows.push(Row::of(format!("{figure}, largest error of a trial"), "%", error).how(how));
    rows
}

fn plot(trial: &Trial) -> Plot {
    let points = |own: &Release| {
        let each = own.position_m.iter().enumerate();
        each.map(|(k, x)| [k as f64 * own.step_s, 1e3 * x]).collect()
    };
    let names = WEIGHTS_KG.map(|own| format!("{} g", 1e3 * own));
    let measured = trial.records.iter().zip(&names).map(|(own, name)| Curve {
        name: format!("{name}, measured"),
        style: Style::Truth,
        points: points(own),
    });
    let again = trial.again.iter().zip(&names).map(|(own, name)| Curve {
        name: format!("{name}, with the found parameters"),
        style: Style::Ours,
        points: points(own),
    });
    Plot {
        title: "Tip after the release of a weight, first catheter".into(),
        axes: ["time, s", "height of the tip, mm"],
        equal: false,
        curves: measured.chain(again).collect(),
    }
}
