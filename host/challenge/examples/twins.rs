//! Twins of the practice bundles: realities of this crate on their rigs, with their motions, rates
//! and noise. Another simulator made the bundles, so that a twin without any effect shows what two
//! realities of one rig differ by, and twins with effects are what a stranger's data are like.
//!
//!     cargo run --release -p cathforce-challenge --example twins -- BUNDLE OUT [EFFECT[+EFFECT][:SEVERITY]]…
//!
//! Each argument makes one case, `none` one without effects; `all` stands for every effect of the
//! library. A severity is from 0 to 1, 0.5 unless given.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use cathforce_challenge::{
    CONTACT_SPACING_M, Change, Instrument, LIBRARY, Noise, Rig, Trial, play_along, single,
};
use cathforce_reference::{Drive, Schedule, Station};
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Deserialize;

/// Noise of the practice bundles: force, drive force \[N\], tip, shape \[m\].
const NOISE_SD: [f64; 4] = [0.01, 0.02, 3e-4, 5e-4];
/// Rows between two of the tip.
const TIP_EVERY: usize = 8;
const SHAPE_POINTS: usize = 8;
const SEED: u64 = 1;

#[derive(Deserialize)]
struct RigFile {
    instrument: InstrumentTable,
    entry: EntryTable,
    vessel: VesselTable,
}

#[derive(Deserialize)]
struct InstrumentTable {
    outer_diameter_m: f64,
    inner_diameter_m: f64,
    density_kg_per_m3: f64,
    poissons_ratio: f64,
    sections: Vec<SectionTable>,
    tip_precurve: Vec<CurveTable>,
}

#[derive(Deserialize)]
struct SectionTable {
    length_m: f64,
    #[serde(rename = "youngs_modulus_Pa")]
    youngs_modulus_pa: f64,
}

#[derive(Deserialize)]
struct CurveTable {
    length_m: f64,
    curvature_per_m: f64,
}

#[derive(Deserialize)]
struct EntryTable {
    up: [f64; 3],
}

#[derive(Deserialize)]
struct VesselTable {
    friction_coefficient: f64,
    #[serde(rename = "wall_stiffness_N_per_m")]
    wall_stiffness_n_per_m: f64,
    wall_contact_spacing_m: f64,
}

#[derive(Deserialize)]
struct CentreRow {
    branch: String,
    x_m: f64,
    y_m: f64,
    z_m: f64,
    radius_m: f64,
}

#[derive(Deserialize)]
struct DriveRow {
    t_s: f64,
    insertion_m: f64,
    rotation_rad: f64,
}

fn rows<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<Vec<T>, csv::Error> {
    csv::Reader::from_path(path)?.into_deserialize().collect()
}

/// Where branches meet, edges are rounded over this share of the vessel's smallest radius: by the
/// distance of the corners of the practice bundles' meshes from the union of the branches.
const BLEND: f64 = 0.45;

/// The rig of a bundle; its vessel is the union of its branches.
fn rig(bundle: &Path) -> Result<Rig, Box<dyn Error>> {
    let file: RigFile = toml::from_str(&fs::read_to_string(bundle.join("rig.toml"))?)?;
    let mut names: Vec<String> = Vec::new();
    let mut branches: Vec<Vec<Station>> = Vec::new();
    for row in rows::<CentreRow>(&bundle.join("centreline.csv"))? {
        if names.last() != Some(&row.branch) {
            names.push(row.branch);
            branches.push(Vec::new());
        }
        let position_m = Vector3::new(row.x_m, row.y_m, row.z_m);
        let station = Station { position_m, radius_m: row.radius_m };
        branches.last_mut().ok_or("no branch")?.push(station);
    }
    let radii = branches.iter().flatten().map(|station| station.radius_m);
    let blend_m = BLEND * radii.fold(f64::INFINITY, f64::min);
    let i = &file.instrument;
    let piece = |s: &SectionTable| (s.length_m, s.youngs_modulus_pa);
    let (first, last) = (i.sections.first().ok_or("no section")?, i.sections.last());
    let sections = match last.filter(|_| i.sections.len() == 2) {
        Some(last) => [piece(first), piece(last)],
        None if i.sections.len() == 1 => [(0.5 * first.length_m, first.youngs_modulus_pa); 2],
        None => return Err("more than two sections".into()),
    };
    let spacing = CONTACT_SPACING_M / file.vessel.wall_contact_spacing_m;
    Ok(Rig {
        name: bundle.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        instrument: Instrument {
            name: "instrument",
            outer_diameter_m: i.outer_diameter_m,
            inner_diameter_m: i.inner_diameter_m,
            density_kg_per_m3: i.density_kg_per_m3,
            poissons_ratio: i.poissons_ratio,
            sections,
            precurve: i.tip_precurve.iter().map(|c| (c.length_m, c.curvature_per_m)).collect(),
            wall_stiffness_n_per_m: file.vessel.wall_stiffness_n_per_m * spacing,
        },
        branches,
        blend_m,
        up: Vector3::from(file.entry.up),
        friction_coefficient: file.vessel.friction_coefficient,
        start_m: 0.0,
    })
}

fn motions(bundle: &Path) -> Result<Vec<Schedule>, Box<dyn Error>> {
    let mut files: Vec<PathBuf> = fs::read_dir(bundle.join("trials"))?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()?;
    files.sort();
    let motion = |path: &PathBuf| -> Result<Schedule, Box<dyn Error>> {
        let drive = |row: DriveRow| {
            let drive = Drive { insertion_m: row.insertion_m, rotation_rad: row.rotation_rad };
            (row.t_s, drive)
        };
        let samples = rows(path)?.into_iter().map(drive).collect();
        Schedule::samples(samples).ok_or_else(|| format!("{}: time", path.display()).into())
    };
    files.iter().map(motion).collect()
}

/// Points of a centre line that are as far from each other along it.
fn evenly(line: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut arc = vec![0.0];
    for pair in line.windows(2) {
        arc.push(arc[arc.len() - 1] + (pair[1] - pair[0]).norm());
    }
    let length = arc[arc.len() - 1];
    let point = |k: usize| {
        let at = length * k as f64 / (SHAPE_POINTS - 1) as f64;
        let after = arc.partition_point(|a| *a < at).clamp(1, line.len() - 1);
        let share = (at - arc[after - 1]) / (arc[after] - arc[after - 1]);
        line[after - 1].lerp(&line[after], share)
    };
    (0..SHAPE_POINTS).map(point).collect()
}

fn table(trial: &Trial, noise: &mut Noise) -> String {
    let mut text = String::from("t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N,drive_fx_N");
    let points = (0..SHAPE_POINTS).map(|k| format!("p{k:02}"));
    for point in std::iter::once("tip".to_owned()).chain(points) {
        text += &format!(",{point}_x_m,{point}_y_m,{point}_z_m");
    }
    text.push('\n');
    // Writing to a string does not fail.
    for (k, row) in trial.iter().enumerate() {
        let f = row.force_n + noise.vector(NOISE_SD[0]);
        let drive_n = row.drive_force_n + noise.normal() * NOISE_SD[1];
        let Drive { insertion_m, rotation_rad } = row.encoder;
        let _ = write!(text, "{:.4},{insertion_m:.6},{rotation_rad:.4}", row.t_s);
        let _ = write!(text, ",{:.5},{:.5},{:.5},{drive_n:.5}", f.x, f.y, f.z);
        let mut point = |at: Option<Vector3<f64>>| match at {
            Some(p) => text += &format!(",{:.6},{:.6},{:.6}", p.x, p.y, p.z),
            None => text += ",,,",
        };
        point((k % TIP_EVERY == 0).then(|| row.tip_m + noise.vector(NOISE_SD[2])));
        if row.shape_m.is_empty() {
            (0..SHAPE_POINTS).for_each(|_| point(None));
        } else {
            evenly(&row.shape_m).iter().for_each(|p| point(Some(p + noise.vector(NOISE_SD[3]))));
        }
        text.push('\n');
    }
    text
}

/// Root mean squares of what changed: force, drive force \[N\], tip \[m\].
fn changed(real: &[Trial], nominal: &[Trial]) -> [f64; 3] {
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    for (a, b) in real.iter().zip(nominal).flat_map(|(a, b)| a.iter().zip(b)) {
        sums[0] += (a.force_n - b.force_n).norm_squared();
        sums[1] += (a.drive_force_n - b.drive_force_n).powi(2);
        sums[2] += (a.tip_m - b.tip_m).norm_squared();
        count += 1.0;
    }
    sums.map(|sum| (sum / f64::max(count, 1.0)).sqrt())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [bundle, out, cases @ ..] = &arguments[..] else {
        return Err("give a bundle, a folder to write to, and cases".into());
    };
    let (bundle, out) = (Path::new(bundle), Path::new(out));
    let (rig, motions) = (rig(bundle)?, motions(bundle)?);
    let play = |changes: &[Change]| -> Result<Vec<Trial>, _> {
        motions.par_iter().map(|motion| play_along(&rig, changes, motion)).collect()
    };
    let nominal = play(&[])?;
    let all = LIBRARY.map(str::to_owned);
    let cases = cases.iter().flat_map(|case| match case.as_str() {
        "all" => all.to_vec(),
        _ => vec![case.clone()],
    });
    for (number, case) in cases.enumerate() {
        let (ids, severity) = case.split_once(':').unwrap_or((&case, "0.5"));
        let severity: f64 = severity.parse()?;
        let mut rng = ChaCha8Rng::seed_from_u64(SEED + number as u64);
        let effects = ids.split('+').filter(|id| *id != "none");
        let changes = effects.map(|id| single(id, severity, &mut rng).ok_or(id.to_owned()));
        let changes: Vec<Change> =
            changes.collect::<Result<_, _>>().map_err(|id| format!("there is no effect {id}"))?;
        let Ok(real) = play(&changes) else {
            println!("{ids}: the solver finds no balance; left out");
            continue;
        };
        let folder = out.join(ids.replace('+', "-and-"));
        fs::create_dir_all(folder.join("trials"))?;
        for file in ["rig.toml", "centreline.csv", "vessel.stl"] {
            fs::copy(bundle.join(file), folder.join(file))?;
        }
        for (k, trial) in real.iter().enumerate() {
            let mut noise = Noise::of_seed(rng.random());
            fs::write(folder.join(format!("trials/{k:03}.csv")), table(trial, &mut noise))?;
        }
        let [force_n, drive_n, tip_m] = changed(&real, &nominal);
        println!(
            "{}: changes force {:.1} mN, drive force {:.1} mN, tip {:.2} mm; {changes:?}",
            folder.display(),
            1e3 * force_n,
            1e3 * drive_n,
            1e3 * tip_m
        );
    }
    Ok(())
}
