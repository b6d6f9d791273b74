//! `cargo xtask figures`: the figures that README and docs quote, measured and written.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde_json::Value;

use crate::consent::Consent;
use crate::shell::{command, output, root, target_folder};
use crate::{build, demo, setup};

/// Where the project's developers have more practice bundles; a user's clone has none.
const PRACTICE: &str = "../shared/data/practice";
/// Shifts of the vessel that tell how firm a trial's figures are; a mesh and a registration are
/// not known better.
const SHIFTS: [&str; 6] =
    ["x_m=1e-4", "x_m=-1e-4", "y_m=1e-4", "y_m=-1e-4", "z_m=1e-4", "z_m=-1e-4"];
const BEGIN: &str = "<!-- cargo xtask figures: demo -->\n";
const END: &str = "<!-- end -->";

/// Measures the demo and every practice trial without an effect, and writes what they gave.
pub fn write(consent: Consent) -> anyhow::Result<()> {
    let elf = setup::emulator_and_firmware(consent, &[])?.elf;
    let program = build::host()?;
    let out = target_folder().join("demo");
    std::fs::create_dir_all(&out)?;
    let summary = demo::play(&program, &elf, &out)?;
    insert(&root().join("README.md"), BEGIN, &demo_table(&read(&summary)?)?)?;
    let figures = root().join("docs/reference/figures.md");
    std::fs::write(&figures, practice_page(&program)?)?;
    println!("written: README.md, {}", figures.display());
    Ok(())
}

fn read(path: &Path) -> anyhow::Result<Value> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    Ok(serde_json::from_str(&text)?)
}

fn number(summary: &Value, key: &str) -> anyhow::Result<f64> {
    summary[key].as_f64().with_context(|| format!("the summary has no `{key}`"))
}

fn demo_table(summary: &Value) -> anyhow::Result<String> {
    let of = |key: &str| number(summary, key);
    let (error, peak) = (of("force_rms_error_N")?, of("measured_force_peak_N")?);
    let mut text = String::from("| | |\n| --- | --- |\n");
    let mut row = |name: &str, value: String| writeln!(text, "| {name} | {value} |");
    row("ticks, of which missed", format!("{}, {}", of("ticks")?, of("missed_ticks")?))?;
    row(
        "worst tick",
        format!(
            "{} instructions, {:.0} % of 480 MHz at one cycle each",
            of("worst_instructions_per_tick")?,
            100.0 * of("budget_share_480mhz")?
        ),
    )?;
    row("peak contact force at a node", format!("{:.0} mN", 1e3 * of("peak_contact_force_N")?))?;
    row(
        "force error against the bundle's sensor",
        format!(
            "{:.1} mN RMS, {:.1} % of its peak; the sensor's noise alone makes {:.1} mN",
            1e3 * error,
            100.0 * error / peak,
            1e3 * of("force_noise_rms_N")?
        ),
    )?;
    row("device against host replay", format!("{} bits differ", of("differing_bits")?))?;
    Ok(text)
}

fn practice_page(program: &Path) -> anyhow::Result<String> {
    let mut text = String::from(
        "# Figures\n\nWritten by `cargo xtask figures`; each line is one `cathforce simulate BUNDLE --trial N`.\n\n\
         The bundles are simulated by an independent simulator that is not part of this project, \
         not measured. Nominal parameters, nothing fitted, vessel from the STL, 64 links, one solve a tick. \
         Errors are RMS outside snaps of the measured force and after the first 3 mm; they include \
         the sensor's noise: 17.3 mN in the force's norm, 20 mN in the drive force, 0.52 mm in the tip. \
         The last column is the worst of six runs with the vessel shifted by 0.1 mm along x, y \
         and z, both ways (`--set effects.wall.registration.x_m=1e-4`): where it is far above \
         the other, the instrument stands before a branching that a tenth of a millimetre \
         decides.\n\n\
         | bundle | trial | force error | of peak | drive force error | tip error | unresolved ticks | of peak, vessel shifted |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for bundle in bundles()? {
        let name = bundle.file_name().unwrap_or_default().to_string_lossy().into_owned();
        for trial in 0..trials(&bundle)? {
            let summary = simulate(program, &bundle, trial, None)?;
            let mut shifted: f64 = 0.0;
            for shift in SHIFTS {
                let summary = simulate(program, &bundle, trial, Some(shift))?;
                shifted = shifted.max(share_of_peak(&summary)?);
            }
            let of = |key: &str| number(&summary, key);
            writeln!(
                text,
                "| {name} | {trial} | {:.1} mN | {:.1} % | {:.1} mN | {:.2} mm | {} of {} | {:.1} % |",
                1e3 * of("force_rms_error_N")?,
                100.0 * share_of_peak(&summary)?,
                1e3 * of("drive_fx_rms_error_N")?,
                1e3 * of("tip_rms_error_m")?,
                of("unresolved_ticks")?,
                of("ticks")?,
                100.0 * shifted
            )?;
        }
    }
    Ok(text)
}

/// The summary of one trial, with the vessel where it is or shifted.
fn simulate(
    program: &Path,
    bundle: &Path,
    trial: usize,
    shift: Option<&str>,
) -> anyhow::Result<Value> {
    let mut simulate = command(program);
    simulate.args(["simulate", "--json", "--quiet", "--trial", &trial.to_string()]);
    simulate.args(shift.map(|shift| format!("--set=effects.wall.registration.{shift}")));
    let json = output(simulate.arg(bundle)).with_context(|| {
        format!("`cathforce simulate {} --trial {trial}` failed", bundle.display())
    })?;
    Ok(serde_json::from_str(&json)?)
}

/// RMS of the force error over the measured peak \[1\].
fn share_of_peak(summary: &Value) -> anyhow::Result<f64> {
    Ok(number(summary, "force_rms_error_N")? / number(summary, "measured_force_peak_N")?)
}

/// The example, and the other practice bundles without an effect where they are.
fn bundles() -> anyhow::Result<Vec<PathBuf>> {
    let mut bundles = vec![root().join(demo::EXAMPLE)];
    if let Ok(entries) = root().join(PRACTICE).read_dir() {
        for entry in entries {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name.ends_with("-none")
                && path.join("rig.toml").is_file()
                && !demo::EXAMPLE.ends_with(&name)
            {
                bundles.push(path);
            }
        }
    }
    bundles.sort();
    Ok(bundles)
}

fn trials(bundle: &Path) -> anyhow::Result<usize> {
    let folder = bundle.join("trials");
    Ok(folder.read_dir().with_context(|| folder.display().to_string())?.count())
}

/// Replaces what stands between the line `begin` and the next end mark.
pub fn insert(page: &Path, begin: &str, table: &str) -> anyhow::Result<()> {
    let text = std::fs::read_to_string(page).with_context(|| page.display().to_string())?;
    let Some((before, rest)) = text.split_once(begin) else {
        bail!("{}: the line `{}` is missing", page.display(), begin.trim());
    };
    let Some((_, after)) = rest.split_once(END) else {
        bail!("{}: the line `{END}` is missing", page.display());
    };
    std::fs::write(page, format!("{before}{begin}{table}{END}{after}"))?;
    Ok(())
}
