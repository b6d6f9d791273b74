//! "3D deformation simulation for vascular tissue with 2D medical imaging".
//!
//! Printed are the material's values as found, the agents of the search, their bounds and thresholds,
//! the forces and the overlap. Sizes of the block and of the probe and the poses are not; they are
//! those of `cathforce_ultrasound::EXAMPLE`. The truth's masks come from a finer mesh, with image noise
//! and an error of registration.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use anyhow::Context;
use cathforce_ultrasound::{
    Description, EXAMPLE, Fit, ImageEntry, ImageNoise, Known, Section, Study, Tissue, fit_reusing,
    render, sections,
};

use crate::meter::{Meter, Trouble};
use crate::part::{Outcome, Part};
use crate::plot::{Curve, Plot, Style};
use crate::row::Row;

pub const PARTS: &[Part] = &[Part { name: "identification", work: || WORK, run }];

/// In milliseconds of the model, which takes some 40 µs on the computer for each: about 30 s.
const WORK: u64 = 700_000;

/// The truth: what the publication found.
const TRUTH: Tissue = Tissue { youngs_modulus_kpa: 592.54, poissons_ratio: 0.482 };
/// Printed standard deviations over six optimisations.
const PRINTED_SD: [f64; 2] = [20.13, 0.003];
/// Forces of the ramp at each pose: 2 to 10 N, a mask every quarter of a newton. The forces are printed,
/// their number is not.
const FORCES: usize = 33;
const RAMP_N: [f64; 2] = [2.0, 10.0];
/// Repeats with other noise; six optimisations are printed.
const REPEATS: u64 = 6;

const HOW: &str = "masks of a truth with the printed stiffness, from a finer mesh \
                   (neo-Hookean), with blur of 0.25 mm, speckle of a tenth of the \
                   contrast, and each pose misplaced by 0.3 mm (one standard deviation an axis); 33 \
                   masks at each of two poses, 2 to 10 N; not printed and assumed: block of 100 × 60 × 40 mm, \
                   vessel of 8 mm at 9 mm, probe of 38 × 5 mm";

fn run(meter: &Meter) -> Result<Outcome, Trouble> {
    let mut description: Description = toml::from_str(EXAMPLE).context("the example")?;
    description.images = ramp(description.poses.len());
    let here = Path::new("");
    let truth = sections(&description, here, TRUTH).context("the truth")?;
    meter.add(WORK / 4)?;
    let mut known = None;
    let mut fits = Vec::new();
    let start = Instant::now();
    let mut first_s = 0.0;
    for seed in 1..=REPEATS {
        let images = render(&description, &truth, Some((ImageNoise::TYPICAL, seed)));
        let mesh = description.mesh(here, description.elements).context("the mesh")?;
        let study = description.study_of(mesh, images);
        let (found, response) =
            fit_reusing(&study, known.take(), &AtomicBool::new(false)).context("the fit")?;
        if seed == 1 {
            first_s = start.elapsed().as_secs_f64();
        }
        known = Some(response);
        fits.push((study, found));
        meter.add(WORK / 8)?;
    }
    let found: Vec<&Fit> = fits.iter().map(|(_, found)| found).collect();
    Ok(Outcome { rows: rows(&found, first_s), plots: plots(&fits[0].0, &fits[0].1, &truth) })
}

/// Every force at every pose.
fn ramp(poses: usize) -> Vec<ImageEntry> {
    let force = |k: usize| RAMP_N[0] + (RAMP_N[1] - RAMP_N[0]) * k as f64 / (FORCES - 1) as f64;
    let all = (1..=poses).flat_map(|pose| (0..FORCES).map(move |k| (pose, force(k))));
    all.map(|(pose, force_n)| {
        let mask = format!("pose{pose}-{force_n:.2}n.png").into();
        ImageEntry { pose, force_n, mask }
    })
    .collect()
}

/// Mean and standard deviation.
fn spread(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let values: Vec<f64> = values.collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    [mean, (squares / (count - 1.0)).sqrt()]
}

fn rows(found: &[&Fit], first_s: f64) -> Vec<Row> {
    let youngs = || found.iter().map(|own| own.tissue.youngs_modulus_kpa);
    let poisson = || found.iter().map(|own| own.tissue.poissons_ratio);
    let [youngs_kpa, youngs_sd_kpa] = spread(youngs());
    let [ratio, ratio_sd] = spread(poisson());
    let largest =
        |off: &dyn Fn(f64) -> f64, own: Vec<f64>| own.into_iter().map(off).fold(0.0, f64::max);
    let youngs_off =
        largest(&|own| 100.0 * (own / TRUTH.youngs_modulus_kpa - 1.0).abs(), youngs().collect());
    let ratio_off = largest(&|own| (own - TRUTH.poissons_ratio).abs(), poisson().collect());
    let [overlap, _] = spread(found.iter().map(|own| own.mean_overlap));
    let least = found.iter().flat_map(|own| &own.images).map(|image| image.overlap);
    let least = least.fold(1.0, f64::min);
    let most_epochs = found.iter().map(|own| own.epochs.len()).max().unwrap_or(0) as f64;
    let told = found.iter().filter(|own| own.poissons_ratio_known == Known::FromTheData).count();
    let repeats = "mean over 6 repeats with other noise";
    let spread_of = "standard deviation over 6 repeats with other noise; printed is that over six \
                     optimisations";
    let time = "response of the block, search, simplex, intervals and profile of the first repeat over \
                its epochs; printed is the simulation of 8 agents on other hardware";
    vec![
        Row::of("Young's modulus found", "kPa", youngs_kpa)
            .published(TRUTH.youngs_modulus_kpa)
            .how(format!("{repeats}; {HOW}")),
        Row::of("Young's modulus found, spread", "kPa", youngs_sd_kpa)
            .published(PRINTED_SD[0])
            .how(spread_of),
        Row::of("Young's modulus, largest error", "%", youngs_off)
            .how("against the truth, worst of 6 repeats"),
        Row::of("Poisson's ratio found", "1", ratio).published(TRUTH.poissons_ratio).how(repeats),
        Row::of("Poisson's ratio found, spread", "1", ratio_sd)
            .published(PRINTED_SD[1])
            .how(spread_of),
        Row::of("Poisson's ratio, largest error", "1", ratio_off)
            .how("against the truth, worst of 6 repeats"),
        Row::of("repeats of 6 whose data tell Poisson's ratio", "1", told as f64).how(
            "standard deviation below half of what the bounds 0.47 to 0.49 leave by themselves",
        ),
        Row::of("overlap of masks, mean", "1", overlap).published(0.72).how(repeats),
        Row::of("overlap of masks, least", "1", least).how("of 396 masks"),
        Row::of("epochs to convergence, at most", "1", most_epochs)
            .published(10.0)
            .how("8 agents, 2 of them exploring, to 5 kPa and 0.005; worst of 6 repeats"),
        Row::of("time of an epoch", "min", first_s / 60.0 / (found[0].epochs.len().max(1) as f64))
            .published(40.0)
            .how(time),
        Row::of("time of a fit", "s", first_s).how("the first repeat, from masks to intervals"),
    ]
}

/// The agents' mean over the epochs, as the publication's Figure 3, and the outlines at 10 N.
fn plots(study: &Study, found: &Fit, truth: &[Section]) -> Vec<Plot> {
    let epochs = || (1..).zip(&found.epochs).map(|(k, own)| (f64::from(k), own));
    let count = found.epochs.len() as f64;
    let of = |title: &str, axis: &'static str, truth: f64, points: Vec<[f64; 2]>| Plot {
        title: title.to_owned(),
        axes: ["epoch", axis],
        equal: false,
        curves: vec![
            Curve {
                name: "truth".into(),
                style: Style::Truth,
                points: vec![[1.0, truth], [count, truth]],
            },
            Curve { name: "mean of the agents".into(), style: Style::Ours, points },
        ],
    };
    let youngs = epochs().map(|(k, own)| [k, own.youngs_modulus_kpa]).collect();
    let poisson = epochs().map(|(k, own)| [k, own.poissons_ratio]).collect();
    vec![
        of("Young's modulus over the epochs", "E, kPa", TRUTH.youngs_modulus_kpa, youngs),
        of("Poisson's ratio over the epochs", "ν", TRUTH.poissons_ratio, poisson),
        outlines(study, truth),
    ]
}

/// The truth at the least and at the largest force of the first pose; depth is drawn downwards.
fn outlines(study: &Study, truth: &[Section]) -> Plot {
    let curve = |(style, k): (Style, usize)| Curve {
        name: format!("{} N", study.images[k].force_n),
        style,
        points: truth[k].outline_mm().iter().map(|p| [p.x, -p.y]).collect(),
    };
    let last = study.images.iter().rposition(|image| image.pose == 0).unwrap_or(0);
    Plot {
        title: "Vessel under the probe, first pose".into(),
        axes: ["lateral, mm", "height below the probe, mm"],
        equal: true,
        curves: [(Style::Other, 0), (Style::Truth, last)].map(curve).into(),
    }
}
