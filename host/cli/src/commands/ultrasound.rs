//! `cathforce ultrasound`: the stiffness of tissue from masks of a vessel under a probe.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Instant;

use cathforce_ultrasound::{
    Description, Fit, ImageNoise, Interval, Known, Tissue, UltrasoundError, fit, mask_png, render,
    sections,
};
use serde_json::{Value, json};

use crate::args::{
    UltrasoundAction, UltrasoundArguments, UltrasoundFitArguments, UltrasoundRenderArguments,
};
use crate::failure::{Code, Failure};
use crate::output::{check_new_folder, shown, write_new_folder};
use crate::session::interrupt_flag;
use crate::ui::Ui;

/// The description in a folder of rendered masks.
const DESCRIPTION: &str = "description.toml";
/// Overlap below which images and block do not show the same thing; published was 0.72.
const LITTLE_OVERLAP: f64 = 0.7;

pub fn run(ui: &Ui, arguments: &UltrasoundArguments) -> Result<(), Failure> {
    match &arguments.action {
        UltrasoundAction::Fit(arguments) => fit_masks(ui, arguments),
        UltrasoundAction::Render(arguments) => render_masks(ui, arguments),
    }
}

fn fit_masks(ui: &Ui, arguments: &UltrasoundFitArguments) -> Result<(), Failure> {
    arguments.json_file.check()?;
    let path = &arguments.description;
    let description = Description::read(path).map_err(Failure::input)?;
    let study = description.study(folder(path)).map_err(Failure::input)?;
    ui.say(format_args!("fitting {} masks of {} poses", study.images.len(), study.poses.len()));
    let start = Instant::now();
    let found = fit(&study, interrupt_flag()?).map_err(|error| failed(path, error))?;
    let seconds = start.elapsed().as_secs_f64();
    warn(ui, &found);
    arguments.json_file.write(ui, &to_json(path, &found, seconds), text(&found, seconds))
}

/// The folder that the files of a description lie in.
fn folder(description: &Path) -> &Path {
    description.parent().unwrap_or(Path::new(""))
}

fn failed(path: &Path, error: UltrasoundError) -> Failure {
    match error {
        UltrasoundError::Interrupted => {
            Failure::new(Code::Failed, "interrupted: nothing is written")
        }
        // These name their file themselves.
        UltrasoundError::File { .. } | UltrasoundError::Gmsh(_) => Failure::input(error),
        error => Failure::input(format!("{}: {error}", path.display())),
    }
}

/// What the figures of a fit do not say.
fn warn(ui: &Ui, found: &Fit) {
    if !found.converged {
        ui.warn(format_args!("the search did not converge in {} epochs", found.epochs.len()));
    }
    if !found.solved {
        ui.warn("the tissue is softer than was solved at large strains; its modulus is a guess");
    }
    if found.mean_overlap < LITTLE_OVERLAP {
        ui.warn(format_args!(
            "masks and cross-sections overlap by {:.2} only\n  fix: check `origin_mm`, `pixel_mm`, the \
             vessel's diameter and depth, and the poses",
            found.mean_overlap
        ));
    }
}

fn is_known(found: &Fit) -> bool {
    found.poissons_ratio_known == Known::FromTheData
}

fn text(found: &Fit, seconds: f64) -> String {
    let [youngs, poisson] = [&found.youngs_modulus_kpa, &found.poissons_ratio];
    let interval = |own: &Interval, digits: usize| {
        let [low, high] = own.interval_95;
        format!("95 % interval {low:.digits$} to {high:.digits$}")
    };
    let mut text = format!("E   {:.1} kPa, {}\n", youngs.value, interval(youngs, 1));
    // Writing to a string does not fail.
    let _ = match is_known(found) {
        true => writeln!(text, "nu  {:.4}, {}", poisson.value, interval(poisson, 4)),
        false => writeln!(
            text,
            "nu: cannot be told from this data (best {:.4}, standard deviation {:.4})",
            poisson.value, poisson.sd
        ),
    };
    let _ = writeln!(text, "\nmask  pose  force N  overlap");
    for image in &found.images {
        let _ = writeln!(
            text,
            "{}  {}  {:.2}  {:.3}",
            image.name, image.pose, image.force_n, image.overlap
        );
    }
    for (k, [lateral, down]) in found.shifts_mm.iter().enumerate() {
        let _ = writeln!(
            text,
            "pose {}: the images lie {lateral:.2} mm aside and {down:.2} mm too deep",
            k + 1
        );
    }
    let _ = writeln!(text, "the outlines lie {:.3} mm too far out", found.outlines_out_mm);
    let _ = writeln!(
        text,
        "\nmean overlap {:.3}, {} epochs, {} evaluations, {seconds:.1} s",
        found.mean_overlap,
        found.epochs.len(),
        found.evaluations
    );
    text
}

fn to_json(path: &Path, found: &Fit, seconds: f64) -> Value {
    let known = if is_known(found) { "from the data" } else { "cannot be told from this data" };
    json!({
        "description": shown(path),
        "youngs_modulus_kpa": found.youngs_modulus_kpa,
        "poissons_ratio": found.poissons_ratio,
        "nu": known,
        "mean_overlap": found.mean_overlap,
        "images": found.images,
        "shifts_mm": found.shifts_mm,
        "outlines_out_mm": found.outlines_out_mm,
        "converged": found.converged,
        "epochs": found.epochs,
        "evaluations": found.evaluations,
        "profile": found.profile,
        "seconds": seconds,
    })
}

fn render_masks(ui: &Ui, arguments: &UltrasoundRenderArguments) -> Result<(), Failure> {
    let UltrasoundRenderArguments { description: path, out, noise, seed, .. } = arguments;
    let (youngs_modulus_kpa, poissons_ratio) =
        (arguments.youngs_modulus_kpa, arguments.poissons_ratio);
    check_new_folder(out)?;
    let description = Description::read(path).map_err(Failure::input)?;
    let inside = description.images.iter().all(|image| image.mask.components().count() == 1);
    if !inside || description.mesh.is_some() {
        let message = format!(
            "{}: masks or a mesh in other folders cannot be written into a new one\n  fix: name each \
             `mask` without a folder, and give a [block] in place of a `mesh`",
            path.display()
        );
        return Err(Failure::input(message));
    }
    let tissue = Tissue { youngs_modulus_kpa, poissons_ratio };
    let sections =
        sections(&description, folder(path), tissue).map_err(|error| failed(path, error))?;
    let noise = noise.then_some((ImageNoise::TYPICAL, *seed));
    let images = render(&description, &sections, noise);
    let mut files = vec![(DESCRIPTION.to_owned(), fs::read(path).map_err(Failure::input)?)];
    for image in &images {
        let file = mask_png(&image.mask).map_err(Failure::input)?;
        files.push((image.name.clone(), file));
    }
    write_new_folder(out, files.iter().map(|(name, bytes)| (name.as_str(), &bytes[..])))?;
    let json = json!({
        "folder": shown(out), "masks": images.len(), "tissue": tissue, "noise": noise.is_some(),
        "description": shown(out.join(DESCRIPTION)),
    });
    let text = format!(
        "{} masks in {}\nnext: cathforce ultrasound fit {}\n",
        images.len(),
        out.display(),
        out.join(DESCRIPTION).display()
    );
    ui.data(&json, text)
}
