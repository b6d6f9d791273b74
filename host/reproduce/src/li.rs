//! Li 2023, "Catheter modelling and force estimation in endovascular applications".

use rayon::join;

use crate::cantilever;
use crate::errors::Error;
use crate::experiment::{Experiment, Trace, measured, sample_times};
use crate::iliac::{
    ASSUMED, GPA_READ, Motion, REFERENCE_KG_PER_M3, REFERENCE_PA, Scores, catheter, experiment,
    scores,
};
use crate::meter::{Meter, Trouble};
use crate::part::{Outcome, Part};
use crate::plot::{Curve, Plot, Style};
use crate::row::Row;

pub const PARTS: &[Part] = &[
    Part { name: "insertion", work, run },
    Part { name: "cantilever under gravity", work: cantilever::work, run: cantilever::run },
    Part { name: "elastic phantom", work: || 0, run: |_| Ok(Outcome::rows(elastic())) },
];

const SPEED_M_PER_S: f64 = 0.013;
/// The sensor's coarse axis: it is upright under the box, so its z is the vertical.
pub const COARSE: usize = 1;
const SENSOR_SEED: u64 = 1;

/// The experiment, and the two ways in which the model is fed.
fn experiments() -> [Experiment; 2] {
    let with = |motion| experiment(catheter(REFERENCE_PA, REFERENCE_KG_PER_M3), motion);
    [with(Motion::rippled(SPEED_M_PER_S)), with(Motion::even(SPEED_M_PER_S))]
}

fn work() -> u64 {
    let [truth, ours] = experiments()[0].work();
    truth + 2 * ours
}

fn run(meter: &Meter) -> Result<Outcome, Trouble> {
    let [rippled, even] = experiments();
    let (truth, ours) = join(
        || rippled.truth(meter),
        || Ok::<_, Trouble>([even.on_device(meter)?, rippled.on_device(meter)?]),
    );
    let (truth, [even, encoder]) = (truth?, ours?);
    let sensor = measured(&truth, COARSE, SENSOR_SEED);
    let motion = Motion::even(SPEED_M_PER_S);
    let blind = scores(&truth, &sensor, &even, motion);
    let fed = scores(&truth, &sensor, &encoder, motion);
    let mut rows = printed(&blind);
    rows.extend(with_encoder(&fed));
    Ok(Outcome { rows, plots: plots(&truth, &sensor, &even) })
}

/// The figures that the thesis prints.
fn printed(s: &Scores) -> Vec<Row> {
    let how = format!(
        "device's model, fed at constant 13 mm/s, against the sensor's averaged force from 6.1 s on; \
         rigid wall; {GPA_READ}; {ASSUMED}"
    );
    let shape = "the same, one frame a second, in the camera's plane, points with 0.4 mm of noise";
    let [x, _, z] = s.force.axis;
    let force = |name: &str, e: Error, printed: [f64; 2]| {
        [
            Row::of(format!("force error {name}, mean"), "N", e.mean)
                .published(printed[0])
                .how(&how),
            Row::of(format!("force error {name}, relative"), "%", 100.0 * e.relative)
                .published(printed[1])
                .how(format!("{how}; mean error over mean force")),
        ]
    };
    let mut rows = Vec::new();
    rows.extend(force("x (across)", x, [0.0058, 24.29]));
    rows.extend(force("z (insertion)", z, [0.034, 19.35]));
    rows.extend(force("of the total", s.force.total, [0.0371, 30.45]));
    rows.push(Row::of("force error z (insertion), peak", "N", z.peak).published(0.35).how(&how));
    rows.push(Row::of("tip, mean distance", "mm", 1e3 * s.tip_m).published(3.1).how(shape));
    rows.push(
        Row::of("proximal part, mean Fréchet distance", "mm", 1e3 * s.frechet_m)
            .published(3.6)
            .how(format!("{shape}; behind the hook, 100 points at equal arc")),
    );
    let implied = format!("{how}; published is the printed error over its printed share");
    rows.push(Row::of("force x (across), mean", "N", x.magnitude).published(0.0239).how(&implied));
    rows.push(
        Row::of("force z (insertion), mean", "N", z.magnitude).published(0.176).how(&implied),
    );
    let moment = "M = Σ Lᵢ × Fᵢ about the entry over all contacts, against the truth without noise; \
                  the thesis records it and prints no error";
    rows.push(Row::of("moment error, mean", "mN·m", 1e3 * s.moment_n_m).how(moment));
    rows.push(Row::of("moment error, relative", "%", 100.0 * s.moment_relative).how(moment));
    rows.push(
        Row::of("ticks flagged as not resolved", "%", 100.0 * s.unresolved)
            .how("what the device itself says of the same play"),
    );
    rows
}

/// What the encoder adds, which the thesis did not feed to its simulation.
fn with_encoder(s: &Scores) -> [Row; 3] {
    let how = "the same, but fed by the encoder with its ripple of ±2 mm/s, as the device is";
    [
        Row::of("force error of the total with the encoder, mean", "N", s.force.total.mean)
            .how(how),
        Row::of("tip with the encoder, mean distance", "mm", 1e3 * s.tip_m).how(how),
        Row::of("proximal part with the encoder, mean Fréchet distance", "mm", 1e3 * s.frechet_m)
            .how(how),
    ]
}

/// Force over time along the two axes that the publications look at.
pub fn plots(truth: &Trace, sensor: &[nalgebra::Vector3<f64>], ours: &Trace) -> Vec<Plot> {
    let times: Vec<f64> = sample_times(truth).collect();
    let axes = [(0, "Force across the aorta"), (2, "Force along the insertion")];
    let forces = axes.map(|(axis, title)| {
        let every = || times.iter().enumerate().step_by(10);
        let measured = every().filter_map(|(k, t)| Some([*t, sensor.get(k)?[axis]])).collect();
        let estimated = every().map(|(_, t)| [*t, ours.force_at(*t)[axis]]).collect();
        Plot {
            title: title.into(),
            axes: ["time, s", "force, N"],
            equal: false,
            curves: vec![
                Curve { name: "sensor on the truth".into(), style: Style::Truth, points: measured },
                Curve { name: "device's model".into(), style: Style::Ours, points: estimated },
            ],
        }
    });
    let flat =
        |line: &Vec<nalgebra::Vector3<f64>>| line.iter().map(|p| [1e3 * p.z, 1e3 * p.x]).collect();
    let shapes = truth.frames.iter().zip(&ours.frames).skip(3).step_by(4).flat_map(|(a, b)| {
        [
            Curve { name: "truth".into(), style: Style::Truth, points: flat(a) },
            Curve { name: "device's model".into(), style: Style::Ours, points: flat(b) },
        ]
    });
    let shapes = Plot {
        title: "Shapes every 4 s".into(),
        axes: ["along the aorta, mm", "across it, mm"],
        equal: true,
        curves: shapes.collect(),
    };
    forces.into_iter().chain([shapes]).collect()
}

/// What needs the elastic phantom.
fn elastic() -> Vec<Row> {
    vec![Row::without(
        "insertion with the elastic phantom (2.7 MPa, Poisson's ratio 0.4, fixed at five openings)",
        "N",
        "the phantom's finite elements are not part of this version; its thickness is not printed either",
    )]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first 12 mm: the hook leaves the guide.
    #[test]
    fn a_short_insertion_is_scored_and_its_forces_add_up() {
        let motion = Motion { to_m: 0.017, ..Motion::even(0.03) };
        let short = experiment(catheter(REFERENCE_PA, REFERENCE_KG_PER_M3), motion);
        let meter = Meter::new(short.work().iter().sum(), &|_, _| (), &|| false);
        let (truth, ours) = (short.truth(&meter).unwrap(), short.on_device(&meter).unwrap());
        assert_eq!(truth.t_s.len() as u64 * crate::meter::TICKS_A_STEP, short.work()[0]);
        assert_eq!(ours.t_s.len() as u64, short.work()[1]);
        let end_s = short.schedule.end_s();
        let (a, b) = (truth.force_at(end_s), ours.force_at(end_s));
        assert!((a - b).norm() < 0.3 * a.norm().max(5e-3), "{a} {b}");
    }
}
