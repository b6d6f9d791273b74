//! Table II, pulsatile flow: amplitude and phase of the pulse, and the drag coefficient.

use anyhow::anyhow;
use cathforce_identification::{
    Chamber, Effort, FlowSetup, FlowValues, Identified, InFlow, Mesh, Noise, PulseRecord,
    RodValues, Spread, measured_pulse,
};
use cathforce_reference_solver::{Drive, Flow, Problem, Simulation};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::catheter::{LENGTH_M, NOISE_M, RADIUS_M, SAMPLE_S, SECTION_READ, SENSOR_READ, catheter};
use super::trial::{pairs, search, worst_error};
use crate::meter::{Meter, Trouble};
use crate::part::Outcome;
use crate::plot::{Curve, Plot, Style};
use crate::row::Row;

/// Table II: densities of catheter and fluid \[kg/m³\], and the flow.
const DENSITY_KG_PER_M3: f64 = 6991.0;
const FLUID_KG_PER_M3: f64 = 1060.0;
const PEAK_M_PER_S: f64 = 0.173;
const PULSE_RATIO: f64 = 0.95;
const DRAG: f64 = 22.0;
/// Printed 72 beats a minute \[Hz\].
const BEATS_HZ: f64 = 1.2;
/// Table I: modulus \[Pa\], viscous damping \[N·m²·s\] and tip mass \[kg\].
const YOUNGS_PA: f64 = 30.20e9;
const DAMPING_N_M2_S: f64 = 4.93e-6;
const TIP_MASS_KG: f64 = 3.50e-3;
/// Radius of the chamber, an adult's right atrium, and how far from its axis the catheter enters it, so
/// that the profile matters \[m\]. The diameter D of the profile is not printed.
const CHAMBER_M: f64 = 22.5e-3;
const OFF_AXIS_M: f64 = 8e-3;

const TRIALS: usize = 5;
/// Phases of the trials lie within this \[rad\], so that noise leads none of them across ±π.
const PHASES_RAD: f64 = 2.5;
/// Time after which the catheter only follows the beats, and of the record: four beats \[s\].
const LEAD_S: f64 = 2.5;
const RECORD_S: f64 = 4.0 / BEATS_HZ;
const TRUTH: Mesh = Mesh { edges: 24, step_s: 2.5e-3 };
const FINE: Mesh = Mesh { edges: 32, step_s: SAMPLE_S / 12.0 };
const COARSE: Mesh = Mesh { edges: 6, step_s: SAMPLE_S / 2.0 };
const EFFORT: Effort = Effort { global: 400, local: 60, seed: 21 };
/// Work of a coarse and of a fine simulation, in the unit of a [`Meter`], and about how many of each a
/// trial takes.
const WORK: [u64; 2] = [200, 6000];
const SIMULATIONS: [u64; 2] = [550, 7];

pub fn work() -> u64 {
    (TRIALS as u64 + 1) * (SIMULATIONS[0] * WORK[0] + SIMULATIONS[1] * WORK[1])
}

/// One record, what was true of it, and what was found.
struct Trial {
    truth: FlowValues,
    record: PulseRecord,
    found: Identified,
    again: PulseRecord,
}

fn setup() -> FlowSetup {
    let flow = Flow {
        density_kg_per_m3: FLUID_KG_PER_M3,
        coefficient: DRAG,
        // Eq. (16) prints the cross-section, which is taken per metre of length.
        width_m: std::f64::consts::PI * RADIUS_M * RADIUS_M,
        velocity_m_per_s: Vector3::y() * PEAK_M_PER_S,
        pulse_ratio: PULSE_RATIO,
        frequency_hz: BEATS_HZ,
        phase_rad: 0.0,
        lumen_radius_m: CHAMBER_M,
    };
    FlowSetup { length_m: LENGTH_M, flow, lead_s: LEAD_S, duration_s: RECORD_S, sample_s: SAMPLE_S }
}

fn problem(mesh: Mesh) -> Problem {
    let values = RodValues {
        density_kg_per_m3: DENSITY_KG_PER_M3,
        youngs_pa: YOUNGS_PA,
        air_drag_kg_per_m2: 0.0,
        damping_n_m2_s: DAMPING_N_M2_S,
        tip_mass_kg: TIP_MASS_KG,
    };
    // Beside the axis, so that the flow carries the catheter towards the wall, where it is slower.
    let chamber = Chamber {
        radius_m: CHAMBER_M,
        off_axis_m: OFF_AXIS_M,
        fluid_density_kg_per_m3: FLUID_KG_PER_M3,
    };
    catheter(RADIUS_M).in_chamber(&values, &chamber, mesh)
}

fn failed(error: impl std::fmt::Display) -> Trouble {
    Trouble::Failed(anyhow!("the reference solver: {error}"))
}

pub fn run(meter: &Meter) -> Result<Outcome, Trouble> {
    let setup = setup();
    let problems = [TRUTH, FINE, COARSE].map(problem);
    let at = Drive { insertion_m: LENGTH_M, rotation_rad: 0.0 };
    let rests: Result<Vec<Simulation<'_>>, Trouble> =
        problems.par_iter().map(|own| Simulation::settled(own, at).map_err(failed)).collect();
    let rests = rests?;
    let with = |k: usize| (&problems[k], &rests[k]);
    let experiment =
        InFlow { setup: &setup, fine: with(1), coarse: with(2), velocity_m_per_s: PEAK_M_PER_S };
    let trials: Result<Vec<Trial>, Trouble> = (0..TRIALS as u64)
        .into_par_iter()
        .map(|seed| trial(seed, with(0), &experiment, FlowValues::NAMES.len() - 1, meter))
        .collect();
    // The same with the velocity among what is searched for, to see whether it can be told.
    let all = trial(0, with(0), &experiment, FlowValues::NAMES.len(), meter)?;
    Ok(outcome(&trials?, &all))
}

fn trial(
    seed: u64,
    (problem, rest): (&Problem, &Simulation<'_>),
    experiment: &InFlow<'_>,
    searched: usize,
    meter: &Meter,
) -> Result<Trial, Trouble> {
    let mut noise = Noise::of_seed(seed);
    let truth = FlowValues {
        pulse_ratio: PULSE_RATIO,
        phase_rad: noise.within(0.0, PHASES_RAD, -PHASES_RAD, PHASES_RAD),
        coefficient: DRAG,
        velocity_m_per_s: PEAK_M_PER_S,
    };
    let mut record = experiment.setup.record(&truth, problem, rest).map_err(failed)?;
    record.position_m = noise.on(&record.position_m, NOISE_M);
    let measured = measured_pulse(&record, NOISE_M, seed).map_err(failed)?;
    let pi = std::f64::consts::PI;
    let low = FlowValues {
        pulse_ratio: 0.0,
        phase_rad: -pi,
        coefficient: 1.0,
        velocity_m_per_s: 0.5 * PEAK_M_PER_S,
    };
    // Z < 1 is printed.
    let high = FlowValues {
        pulse_ratio: 1.0,
        phase_rad: pi,
        coefficient: 100.0,
        velocity_m_per_s: 2.0 * PEAK_M_PER_S,
    };
    let mut parameters = FlowValues::parameters(low, high);
    parameters.truncate(searched);
    let found = search(
        &parameters,
        experiment,
        &measured,
        Effort { seed: EFFORT.seed + seed, ..EFFORT },
        meter,
        WORK,
    )?;
    let mut values = truth.to_array();
    values.iter_mut().zip(&found.values).for_each(|(own, found)| *own = *found);
    let (problem, rest) = experiment.fine;
    let again =
        experiment.setup.record(&FlowValues::of_array(values), problem, rest).map_err(failed)?;
    Ok(Trial { truth, record, found, again })
}

fn outcome(trials: &[Trial], all: &Trial) -> Outcome {
    let how = format!(
        "{TRIALS} records of four beats at 72 a minute, solved by the reference solver with {} edges and {} ms \
         and another phase each; {SENSOR_READ}; mean shift, peak, trough and the amplitude at the beat's \
         frequency; multi-start with {} edges, local searches that follow {} edges by defect correction; flow across the catheter, chamber \
         of 45 mm, entry 8 mm beside its axis (none of them is printed); the area of eq. (16) is the printed \
         cross-section per metre; M_f as printed; {SECTION_READ}",
        TRUTH.edges,
        1e3 * TRUTH.step_s,
        COARSE.edges,
        FINE.edges,
    );
    let of = |k: usize| trials.iter().map(|own| own.found.values[k]).collect::<Vec<f64>>();
    let mut rows = Vec::new();
    let lines =
        [(0, "Z_f, amplitude of the pulse", PULSE_RATIO), (2, "C_f, drag coefficient", DRAG)];
    for (k, figure, printed) in lines {
        let values = of(k);
        if let Some(spread) = Spread::of(&values) {
            let mean = format!("{figure} (mean of trials)");
            rows.push(Row::of(mean, "1", spread.nominal).published(printed).how(how.as_str()));
            let sd = format!("{figure}, standard deviation over trials");
            rows.push(Row::of(sd, "1", spread.sd).how(how.as_str()));
            let error = 100.0 * worst_error(&values, &vec![printed; values.len()]);
            let figure = format!("{figure}, largest error of a trial");
            rows.push(Row::of(figure, "%", error).how(how.as_str()));
        }
    }
    let phases = of(1);
    let off = phases.iter().zip(trials).map(|(found, own)| (found - own.truth.phase_rad).abs());
    let off = off.fold(0.0, f64::max).to_degrees();
    rows.push(
        Row::of("Φ_f, phase of the pulse, largest error of a trial", "°", off)
            .how(format!("no number is printed; {how}")),
    );
    let [sd, found] = [&all.found.sd, &all.found.values].map(|own| own.get(3).copied());
    let why = format!(
        "the drag goes by C_f M_f², and the displacement tells hardly more than this product: searched for \
         together, M_f comes out as {:.0} ± {:.0} mm/s and C_f as {:.1} ± {:.1}; pairs whose errors go together: \
         {}. The publication has M_f from finite elements of the flow",
        1e3 * found.unwrap_or(f64::NAN),
        1e3 * sd.unwrap_or(f64::NAN),
        all.found.values[2],
        all.found.sd[2],
        pairs(std::slice::from_ref(&all.found)),
    );
    rows.push(
        Row::without("M_f, peak of the velocity's profile", "mm/s", why)
            .published(1e3 * PEAK_M_PER_S),
    );
    let plot = trials.first().map(plot);
    Outcome { rows, plots: plot.into_iter().collect() }
}

fn plot(trial: &Trial) -> Plot {
    let points = |own: &PulseRecord| {
        let each = own.position_m.iter().enumerate();
        each.map(|(k, x)| [own.from_s + k as f64 * own.step_s, 1e3 * (x - own.rest_m)]).collect()
    };
    let curve = |name: &str, style, own| Curve { name: name.into(), style, points: points(own) };
    Plot {
        title: "Tip in the pulsatile flow".into(),
        axes: ["time, s", "displacement along the flow, mm"],
        equal: false,
        curves: vec![
            curve("measured", Style::Truth, &trial.record),
            curve("with the found parameters", Style::Ours, &trial.again),
        ],
    }
}
