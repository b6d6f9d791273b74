//! "Catheter modelling for medical simulator with CathBot integration", MSc thesis, Twente.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::errors::{ByAxis, by_axis};
use crate::experiment::{Trace, measured, sample_times};
use crate::instruments::INSTRUMENTS;
use crate::meter::{Meter, Trouble};
use crate::part::{Outcome, Part};
use crate::plot::{Curve, Plot, Style};
use crate::resin::{Moduli, Setup, experiment, with_instrument};
use crate::row::Row;
use crate::shape::at_equal_arc;

pub const PARTS: &[Part] = &[
    Part { name: "insertion", work, run },
    Part { name: "instruments", work: instruments_work, run: instruments },
    Part { name: "trainer", work: || 0, run: |_| Ok(Outcome::rows(trainer())) },
];

/// A trial of table 8 with the printed errors of table 9.
#[derive(Clone, Copy, Debug)]
struct Trial {
    moduli: Moduli,
    mean_n: [f64; 3],
    rms_n: [f64; 3],
    peak_n: Option<f64>,
}

const fn trial(tip: f64, shaft: f64, mean_n: [f64; 3], rms_n: [f64; 3]) -> Trial {
    let moduli = Moduli { tip_pa: 1e6 * tip, shaft_pa: 1e6 * shaft };
    Trial { moduli, mean_n, rms_n, peak_n: None }
}

/// Tables 8 and 9; the printed peaks of the simulation are in section 6.2.1.
const TRIALS: [Trial; 6] = [
    Trial {
        peak_n: Some(0.598),
        ..trial(50.0, 26.0, [0.053, 0.005, 0.008], [0.080, 0.009, 0.019])
    },
    Trial {
        peak_n: Some(0.497),
        ..trial(40.0, 26.0, [0.058, 0.004, 0.005], [0.089, 0.007, 0.011])
    },
    trial(37.5, 26.0, [0.061, 0.004, 0.005], [0.095, 0.007, 0.011]),
    trial(35.0, 26.0, [0.063, 0.004, 0.005], [0.099, 0.007, 0.010]),
    trial(30.0, 26.0, [0.069, 0.005, 0.004], [0.107, 0.008, 0.008]),
    trial(40.0, 15.0, [0.057, 0.005, 0.007], [0.089, 0.008, 0.014]),
];

/// Repeats of the experiment, and those whose shape was taken.
const REPEATS: u64 = 31;
const SHAPES: usize = 9;
/// Compared points: of the shaft, and of the tip.
const SHAFT_POINTS: usize = 7;
const TIP_POINTS: usize = 9;
/// The sensor's coarse axis looks along the insertion: table 7.
const COARSE: usize = 0;
/// Table 10 \[mm\].
const DEFORMATION_MM: [f64; SHAFT_POINTS + TIP_POINTS] = [
    0.957, 1.339, 1.094, 0.864, 0.743, 0.442, 0.667, 1.475, 1.449, 0.586, 0.614, 0.869, 0.506,
    0.342, 0.552, 0.584,
];

fn work() -> u64 {
    let [truth, ours] = experiment(TRIALS[0].moduli, &Setup::NOMINAL).work();
    REPEATS * truth + TRIALS.len() as u64 * ours
}

fn run(meter: &Meter) -> Result<Outcome, Trouble> {
    let truths: Result<Vec<_>, Trouble> = (0..REPEATS)
        .into_par_iter()
        .map(|repeat| experiment(TRIALS[0].moduli, &Setup::of_repeat(repeat)).truth(meter))
        .collect();
    let truths = truths?;
    let ours: Result<Vec<_>, Trouble> = TRIALS
        .par_iter()
        .map(|trial| experiment(trial.moduli, &Setup::NOMINAL).on_device(meter))
        .collect();
    Ok(outcome(&truths, &ours?))
}

fn outcome(truths: &[Trace], ours: &[Trace]) -> Outcome {
    let sensors: Vec<_> =
        truths.iter().enumerate().map(|(k, truth)| measured(truth, COARSE, k as u64)).collect();
    let mean = mean(&sensors);
    let times: Vec<f64> = truths.first().map(|t| sample_times(t).collect()).unwrap_or_default();
    let times = &times[..mean.len()];
    let estimated: Vec<Vec<_>> =
        ours.iter().map(|own| times.iter().map(|t| own.force_at(*t)).collect()).collect();
    let mut rows = peaks(&sensors, &mean, times);
    for (k, (trial, estimated)) in TRIALS.iter().zip(&estimated).enumerate() {
        rows.extend(errors(k, trial, estimated, &by_axis(&mean, estimated)));
    }
    rows.extend(deformation(truths, &ours[0]));
    rows.push(
        Row::of("trial 0: ticks flagged as not resolved", "%", 100.0 * ours[0].unresolved)
            .how("what the device itself says of the same play"),
    );
    let plots = [force_plot(times, &sensors, &mean, &estimated), shape_plot(truths, &ours[0])];
    Outcome { rows, plots: plots.into_iter().collect() }
}

/// Mean over the repeats, sample by sample, as long as the shortest.
fn mean(sensors: &[Vec<Vector3<f64>>]) -> Vec<Vector3<f64>> {
    let count = sensors.iter().map(Vec::len).min().unwrap_or(0);
    let at = |k: usize| sensors.iter().map(|own| own[k]).sum::<Vector3<f64>>();
    (0..count).map(|k| at(k) / sensors.len() as f64).collect()
}

/// Largest magnitude along an axis, and its place.
fn peak(force: &[Vector3<f64>], axis: usize) -> (usize, f64) {
    let size = |(k, f): (usize, &Vector3<f64>)| (k, f[axis].abs());
    force.iter().enumerate().map(size).fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a })
}

/// Peaks of the mean over the repeats, and how far the repeats spread.
fn peaks(sensors: &[Vec<Vector3<f64>>], mean: &[Vector3<f64>], times: &[f64]) -> Vec<Row> {
    let how = "31 seeded repeats of the truth (entry ±0.2 mm, roll ±5°, speed ±2 %, friction ±0.03, one \
               standard deviation), sensor at 1 kHz, mean of all; friction 0.3, exits at 35° \
               and a tip in their plane are not printed and assumed; a \
               bore of 6 mm does not squeeze a catheter of 1.65 mm, as the printed text says";
    let (at, along) = peak(mean, 0);
    let own: Vec<f64> = sensors.iter().map(|s| peak(s, 0).1).collect();
    let middle = own.iter().sum::<f64>() / own.len() as f64;
    let spread = own.iter().map(|p| (p - middle).powi(2)).sum::<f64>() / (own.len() - 1) as f64;
    vec![
        Row::of("31 repeats: mean, peak along the insertion", "N", along).published(0.473).how(how),
        Row::of("31 repeats: time of that peak", "s", times[at]).published(4.4).how(how),
        Row::of("31 repeats: mean, peak across (y)", "N", peak(mean, 1).1)
            .published(0.0233)
            .how(how),
        Row::of("31 repeats: mean, peak across (z)", "N", peak(mean, 2).1)
            .published(0.0209)
            .how(how),
        Row::of(
            "31 repeats: standard deviation of the peak along the insertion",
            "N",
            spread.sqrt(),
        )
        .how(how),
    ]
}

/// Rows of one trial.
fn errors(index: usize, own: &Trial, estimated: &[Vector3<f64>], errors: &ByAxis) -> Vec<Row> {
    let Moduli { tip_pa, shaft_pa } = own.moduli;
    let what = format!("trial {index} ({}/{} MPa)", 1e-6 * tip_pa, 1e-6 * shaft_pa);
    let how = "device's model with these moduli (tip/shaft; one table prints GPa) against the mean of 31 \
               repeats of the truth with 50/26 MPa";
    let mut rows = Vec::new();
    for (axis, name) in ["X", "Y", "Z"].into_iter().enumerate() {
        let e = errors.axis[axis];
        rows.push(
            Row::of(format!("{what}: mean error {name}"), "N", e.mean)
                .published(own.mean_n[axis])
                .how(how),
        );
        rows.push(
            Row::of(format!("{what}: RMSE {name}"), "N", e.rms).published(own.rms_n[axis]).how(format!(
                "{how}; the printed formula takes the root of a mean norm, this is the root of a mean square"
            )),
        );
    }
    if let Some(printed) = own.peak_n {
        let along = peak(estimated, 0).1;
        rows.push(
            Row::of(format!("{what}: simulated peak"), "N", along).published(printed).how(how),
        );
    }
    if index == 0 {
        let row = Row::of(format!("{what}: peak error X"), "N", errors.axis[0].peak);
        rows.push(row.published(0.23).how(format!("{how}; printed as 0.23 and as nearly 0.25")));
    }
    rows
}

/// The compared points of a shape, the proximal ones first.
fn points(line: &[Vector3<f64>]) -> Option<Vec<Vector3<f64>>> {
    let tip_m = crate::resin::tip_m();
    let mut shaft = at_equal_arc(line, tip_m, SHAFT_POINTS + 1)?;
    // The first of them begins the tip; the last one lies in the guide.
    shaft.remove(0);
    shaft.reverse();
    let length_m: f64 = line.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let count = TIP_POINTS as f64 - 1.0;
    let tip = (0..TIP_POINTS).filter_map(|k| {
        crate::shape::at_arc(line, (tip_m * (1.0 - k as f64 / count)).min(length_m))
    });
    Some(shaft.into_iter().chain(tip).collect())
}

/// Mean error of the 16 points over 9 repeats, in the camera's plane.
fn deformation(truths: &[Trace], ours: &Trace) -> Vec<Row> {
    let how = "last shape of the device's model against that of 9 repeats of the truth, 7 points of the \
               shaft and 9 of the tip at equal arc, seen from above; no camera noise is printed";
    let last = |trace: &Trace| trace.frames.last().and_then(|line| points(line));
    let shapes: Vec<_> = truths.iter().take(SHAPES).filter_map(last).collect();
    let Some(own) = last(ours).filter(|_| !shapes.is_empty()) else {
        return vec![
            Row::without("deformation, mean", "mm", "no shape reached its end").published(0.818),
        ];
    };
    let flat = |v: Vector3<f64>| v.x.hypot(v.z);
    let (own, shapes) = (&own, &shapes);
    let of = |k: usize| shapes.iter().map(move |s| 1e3 * flat(s[k] - own[k]));
    let count = shapes.len() as f64;
    let means: Vec<f64> = (0..own.len()).map(|k| of(k).sum::<f64>() / count).collect();
    let rms = (0..own.len()).map(|k| (of(k).map(|e| e * e).sum::<f64>() / count).sqrt());
    let rms = rms.sum::<f64>() / own.len() as f64;
    let mut rows: Vec<_> = means
        .iter()
        .zip(DEFORMATION_MM)
        .enumerate()
        .map(|(k, (mean, printed))| {
            Row::of(format!("deformation, node {k}"), "mm", *mean).published(printed).how(how)
        })
        .collect();
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    rows.push(Row::of("deformation, mean of 16 nodes", "mm", mean).published(0.818).how(how));
    rows.push(Row::of("deformation, RMSE of 16 nodes", "mm", rms).published(0.884).how(how));
    rows
}

fn force_plot(
    times: &[f64],
    sensors: &[Vec<Vector3<f64>>],
    mean: &[Vector3<f64>],
    estimated: &[Vec<Vector3<f64>>],
) -> Plot {
    let along = |force: &[Vector3<f64>]| {
        times.iter().zip(force).step_by(10).map(|(t, f)| [*t, f.x]).collect::<Vec<_>>()
    };
    let curve = |name: &str, style, force: &[Vector3<f64>]| Curve {
        name: name.into(),
        style,
        points: along(force),
    };
    let mut curves = vec![curve("mean of 31 repeats", Style::Truth, mean)];
    if let Some(one) = sensors.first() {
        curves.push(curve("one repeat", Style::Other, one));
    }
    if let Some(own) = estimated.first() {
        curves.push(curve("device's model, 50/26 MPa", Style::Ours, own));
    }
    Plot {
        title: "Force along the insertion".into(),
        axes: ["time, s", "force, N"],
        equal: false,
        curves,
    }
}

fn shape_plot(truths: &[Trace], ours: &Trace) -> Plot {
    let flat = |line: &Vec<Vector3<f64>>| line.iter().map(|p| [1e3 * p.x, 1e3 * p.z]).collect();
    let curve = |name: &str, style, trace: &Trace| {
        let line = trace.frames.last()?;
        Some(Curve { name: name.into(), style, points: flat(line) })
    };
    let mut curves: Vec<_> =
        truths.iter().take(SHAPES).filter_map(|t| curve("9 repeats", Style::Truth, t)).collect();
    curves.extend(curve("device's model", Style::Ours, ours));
    Plot {
        title: "Last shape from above".into(),
        axes: ["along the phantom, mm", "across it, mm"],
        equal: true,
        curves,
    }
}

fn instruments_work() -> u64 {
    INSTRUMENTS.len() as u64 * experiment(TRIALS[0].moduli, &Setup::NOMINAL).work()[1]
}

/// Every instrument in the same phantom, and its tip drawn.
fn instruments(meter: &Meter) -> Result<Outcome, Trouble> {
    let mut out = Outcome::default();
    for own in INSTRUMENTS {
        let played = with_instrument(own, TRIALS[0].moduli, &Setup::NOMINAL).on_device(meter)?;
        let how = format!(
            "device's model with 50/26 MPa in the same phantom; {} mm, {} F, outside {} mm, inside {}; {}; \
             {}; no number is printed",
            1e3 * own.shaft_m,
            own.french,
            1e3 * own.outer_m,
            own.inner_m.map_or("not printed, solid".into(), |m| format!("{} mm", 1e3 * m)),
            own.doc,
            own.source
        );
        let along = peak(&played.force_n, 0).1;
        out.rows.push(
            Row::of(format!("{}: peak along the insertion", own.number), "N", along).how(how),
        );
        if let Some(tip) = own.tip() {
            let points = crate::shape::drawn(tip, 0.02).into_iter().map(|p| p.map(|x| 1e3 * x));
            let tip = Curve { name: own.doc.into(), style: Style::Ours, points: points.collect() };
            out.plots.push(Plot {
                title: format!("Tip of {}", own.number),
                axes: ["along the shaft, mm", "aside, mm"],
                equal: true,
                curves: vec![tip],
            });
        }
    }
    Ok(out)
}

/// What the thesis tells of the trainer itself.
fn trainer() -> Vec<Row> {
    vec![
        Row::without(
            "delay from the master's frame to the force frame",
            "ms",
            "users' scores are printed and no delay; `cathforce latency` measures it on a bus, stage by stage",
        ),
        Row::without(
            "forces of other publications that it quotes (Cosserat rod 0.0089 N, networks 0.0217 and \
             0.0178 N, sections 0.0162 N)",
            "N",
            "they are of other catheters, loads and sensors, which the thesis does not describe",
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_deformations_have_the_printed_mean() {
        let mean = DEFORMATION_MM.iter().sum::<f64>() / DEFORMATION_MM.len() as f64;
        assert!((mean - 0.818).abs() < 0.001, "{mean}");
    }

    #[test]
    fn equal_shapes_deviate_by_nothing_and_shifted_ones_by_their_shift() {
        let line = |z: f64| {
            (0..90).map(|k| Vector3::new(0.09 - 1e-3 * f64::from(k), 0.0, z)).collect::<Vec<_>>()
        };
        let trace = |z| Trace { frames: vec![line(z)], ..Trace::default() };
        let rows = deformation(&[trace(1e-3), trace(-2e-3)], &trace(0.0));
        assert_eq!(rows.len(), 18);
        assert!(rows[..17].iter().all(|row| (row.ours.unwrap() - 1.5).abs() < 1e-9));
        assert!((rows[17].ours.unwrap() - 2.5f64.sqrt()).abs() < 1e-9);
    }

    /// The first 12 mm of one repeat.
    #[test]
    fn a_short_insertion_agrees_with_the_truth() {
        let setup = Setup { to_m: 0.017, ..Setup::NOMINAL };
        let short = experiment(TRIALS[0].moduli, &setup);
        let meter = Meter::new(1, &|_, _| (), &|| false);
        let (truth, ours) = (short.truth(&meter).unwrap(), short.on_device(&meter).unwrap());
        let end_s = short.schedule.end_s();
        let (a, b) = (truth.force_at(end_s), ours.force_at(end_s));
        assert!((a - b).norm() < 0.3 * a.norm().max(5e-3), "{a} {b}");
    }
}
