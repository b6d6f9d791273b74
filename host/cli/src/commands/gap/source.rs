//! What is diagnosed: a trial bundle, or the recordings of runs of one rig, each a trial.
//!
//! A recording holds the rig, one trial, and the image of the device that played it, whose lumen
//! is the vessel.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use cathforce_bundle::bundle::{
    CatheterTrial, GuidewireTrial, Plant as RigPlant, Trial, TrialData, VectorColumn,
};
use cathforce_bundle::{Bundle, ImageOptions};
use cathforce_config::image::{decode, decode_head, encode, encoded_len};
use cathforce_config::{ImageHead, Settings};
use cathforce_gap::catheter::Catheter;
use cathforce_gap::drive::Drive;
use cathforce_gap::plant::Plant;
use cathforce_gap::transmission::Transmission;
use cathforce_mechanics::{Description, parameters};
use cathforce_recording::{Measured, Recording};

use sha2::{Digest, Sha256};

use crate::failure::{Code, Failure};
use crate::settings::model::model_sha256;
use crate::ui::Ui;

/// A rig with trials.
pub struct Source {
    /// Of a recording without the vessel.
    pub bundle: Bundle,
    /// Where it comes from.
    pub paths: Vec<PathBuf>,
    /// Of a recording.
    image: Option<Vec<u8>>,
}

impl Source {
    /// A folder is a bundle, a file a recording.
    pub fn open(ui: &Ui, path: &Path) -> Result<Self, Failure> {
        if !path.is_file() {
            let bundle = crate::open::open_bundle(ui, path)?;
            return Ok(Self { bundle, paths: vec![path.to_path_buf()], image: None });
        }
        let recording = crate::open::open_recording(ui, path)?;
        let bundle = Bundle::without_vessel(path, &recording.rig_toml, vec![trial(&recording)])?;
        for warning in &bundle.warnings {
            ui.warn(warning);
        }
        let paths = vec![path.to_path_buf()];
        Ok(Self { bundle, paths, image: Some(recording.image) })
    }

    /// One bundle, or several recordings of one rig.
    pub fn open_all(ui: &Ui, paths: &[PathBuf]) -> Result<Self, Failure> {
        let (first, others) = match paths {
            [] => return Err(Failure::new(Code::Usage, "give a bundle or recordings")),
            [only] => return Self::open(ui, only),
            [first, others @ ..] => (first, others),
        };
        if let Some(folder) = paths.iter().find(|path| !path.is_file()) {
            let message = format!(
                "{} is no recording: several trials together are recordings (MCAP), or one bundle \
                 that holds them all\n  fix: give recordings only, or diagnose the bundle on its own",
                folder.display()
            );
            return Err(Failure::new(Code::Usage, message));
        }
        let read = |path: &PathBuf| crate::open::open_recording(ui, path);
        let head = read(first)?;
        let mut trials = vec![trial(&head)];
        for path in others {
            let recording = read(path)?;
            same_rig(ui, (first, &head), (path, &recording))?;
            trials.push(trial(&recording));
        }
        // A trial that was played twice is two.
        let numbers: BTreeSet<u32> = trials.iter().map(|trial| trial.number).collect();
        if numbers.len() < trials.len() {
            for (number, (path, trial)) in paths.iter().zip(&mut trials).enumerate() {
                trial.number = number as u32;
                ui.say(format_args!("trial {number:03}: {}", path.display()));
            }
        }
        trials.sort_by_key(|trial| trial.number);
        let bundle = Bundle::without_vessel(first, &head.rig_toml, trials)?;
        for warning in &bundle.warnings {
            ui.warn(warning);
        }
        Ok(Self { bundle, paths: paths.to_vec(), image: Some(head.image) })
    }

    /// Hash over everything that an answer depends on.
    pub fn hash(&self) -> Result<String, Failure> {
        let unread = |e| refuse(&self.bundle, &format_args!("cannot read it: {e}"));
        super::hash::of_all(&self.paths).map_err(unread)
    }

    pub fn plant(&self) -> Result<Box<dyn Plant>, Failure> {
        let bundle = &self.bundle;
        match &bundle.rig.plant {
            RigPlant::Drive(_) => Ok(Box::new(Drive::new(bundle).map_err(|e| refuse(bundle, &e))?)),
            RigPlant::Transmission(_) => Ok(Box::new(self.transmission()?)),
            RigPlant::Catheter(_) => Ok(Box::new(self.catheter()?)),
        }
    }

    /// The model of a transmission.
    pub fn transmission(&self) -> Result<Transmission, Failure> {
        Transmission::new(&self.bundle).map_err(|e| refuse(&self.bundle, &e))
    }

    /// The model of a rig with a catheter; of a recording in the lumen that its device had.
    pub fn catheter(&self) -> Result<Catheter, Failure> {
        let bundle = &self.bundle;
        let Some(image) = &self.image else { return catheter(bundle) };
        let (head, lumen) = split(image).map_err(|e| refuse(bundle, &e))?;
        let found = Catheter::in_lumen(bundle, head.lumen, lumen.to_vec());
        found.map_err(|e| refuse(bundle, &e))
    }

    /// A device image with these options. `described`: the rig with them; of a recording, its
    /// parameters are put into the image that was recorded.
    pub fn image(
        &self,
        ui: &Ui,
        options: &ImageOptions,
        described: &Description<f32>,
    ) -> Result<Vec<u8>, Failure> {
        let Some(image) = &self.image else {
            return Ok(crate::image::image_with(ui, &self.bundle, options)?.0);
        };
        let failed = |e: &dyn std::fmt::Display| refuse(&self.bundle, e);
        let (mut head, lumen) = split(image).map_err(|e| failed(&e))?;
        for info in parameters() {
            if let Some(value) = described.parameter(info.key) {
                head.description.set_parameter(info.key, value).map_err(|e| failed(&e))?;
            }
        }
        // A device may have been told of another tip than rig.toml states.
        let same = model_sha256(&head.description) == model_sha256(described);
        if options.band.is_some() && !same {
            ui.warn(format_args!(
                "{}: what was recorded is another model than rig.toml states, so the device is told \
                 of no band\n  fix: `cathforce gap apply` with the bundle",
                self.bundle.path.display()
            ));
        }
        head.band = options.band.filter(|_| same);
        // What is not set anew stays as it was recorded.
        if options.settings != Settings::default() {
            head.settings = options.settings;
        }
        let mut bytes = vec![0; encoded_len(&head, lumen).map_err(|e| failed(&e))?];
        encode(&head, lumen, &mut bytes).map_err(|e| failed(&e))?;
        Ok(bytes)
    }
}

/// The model of a catheter's bundle.
pub fn catheter(bundle: &Bundle) -> Result<Catheter, Failure> {
    Catheter::new(bundle).map_err(|e| refuse(bundle, &e))
}

fn refuse(bundle: &Bundle, error: &dyn std::fmt::Display) -> Failure {
    Failure::input(format!("{}: {error}", bundle.path.display()))
}

/// Refuses a recording of another rig; says where only the device was set otherwise.
fn same_rig(
    ui: &Ui,
    (first, own): (&Path, &Recording),
    (path, other): (&Path, &Recording),
) -> Result<(), Failure> {
    let hash = |bytes: &[u8]| format!("{:.16}", format!("{:x}", Sha256::digest(bytes)));
    let differ = |what: &str, a: &[u8], b: &[u8]| {
        Failure::input(format!(
            "{} and {} differ in their {what} (SHA-256 {}… and {}…): they are trials of two rigs\n  \
             fix: diagnose them apart",
            first.display(),
            path.display(),
            hash(a),
            hash(b)
        ))
    };
    if own.rig_toml != other.rig_toml {
        return Err(differ("rig.toml", own.rig_toml.as_bytes(), other.rig_toml.as_bytes()));
    }
    let parts = |path: &Path, recording: &Recording| {
        let (head, lumen) = split(&recording.image)
            .map_err(|e| Failure::input(format!("{}: {e}", path.display())))?;
        Ok::<_, Failure>((head, lumen.to_vec()))
    };
    let ((a, a_lumen), (b, b_lumen)) = (parts(first, own)?, parts(path, other)?);
    if (a.lumen, &a_lumen) != (b.lumen, &b_lumen) {
        return Err(differ("lumen", &a_lumen, &b_lumen));
    }
    let keys = parameters()
        .filter(|info| a.description.parameter(info.key) != b.description.parameter(info.key));
    let keys: Vec<&str> = keys.map(|info| info.key).collect();
    if !keys.is_empty() {
        ui.warn(format_args!(
            "{} and {}: the device was configured differently ({}); what was measured is compared \
             with what rig.toml states, so this changes nothing",
            first.display(),
            path.display(),
            keys.join(", ")
        ));
    }
    Ok(())
}

/// Head and lumen of an image; the lumen stands at its end.
fn split(image: &[u8]) -> Result<(ImageHead, &[u8]), cathforce_config::ImageError> {
    decode(image)?;
    let head = decode_head(image)?;
    let lumen = &image[image.len() - head.lumen.byte_len()..];
    Ok((head, lumen))
}

/// What was played and measured.
fn trial(recording: &Recording) -> Trial {
    let rows = &recording.trial.rows;
    let force = rows.iter().map(|row| row.force_n);
    let drive = rows.iter().map(|row| row.drive_force_n);
    let tip = rows.iter().map(|row| row.tip_m);
    let data = CatheterTrial {
        insertion_m: rows.iter().map(|row| row.insertion_m).collect(),
        rotation_rad: rows.iter().map(|row| row.rotation_rad).collect(),
        force_n: rows.iter().any(|row| row.force_n.is_some()).then(|| force.collect()),
        drive_force_n: rows.iter().any(|row| row.drive_force_n.is_some()).then(|| drive.collect()),
        tip_m: rows.iter().any(|row| row.tip_m.is_some()).then(|| tip.collect()),
        shape_m: shape(recording),
        guidewire: guidewire(rows),
        tendons_m: tendons(rows),
    };
    Trial {
        number: recording.info.trial.parse().unwrap_or_default(),
        t_s: rows.iter().map(|row| row.t_s).collect(),
        data: TrialData::Catheter(data),
    }
}

/// A column for each point, with gaps where a row has another number of them or none.
fn shape(recording: &Recording) -> Vec<VectorColumn> {
    let shapes_m = &recording.trial.shapes_m;
    let points = shapes_m.iter().map(Vec::len).max().unwrap_or(0);
    // Of a row that has fewer, nobody knows which.
    let whole = |i: usize| shapes_m.get(i).filter(|row| row.len() == points);
    let of = |k: usize| move |i: usize| whole(i)?.get(k).copied();
    (0..points).map(|k| (0..recording.trial.rows.len()).map(of(k)).collect()).collect()
}

/// The columns of the guidewire's drive, if the trial had one.
fn guidewire(rows: &[Measured]) -> Option<GuidewireTrial> {
    let wire = rows.iter().map(|row| row.guidewire).collect::<Option<Vec<_>>>()?;
    let force = wire.iter().map(|wire| wire.drive_force_n);
    (!wire.is_empty()).then(|| GuidewireTrial {
        insertion_m: wire.iter().map(|wire| wire.insertion_m).collect(),
        rotation_rad: wire.iter().map(|wire| wire.rotation_rad).collect(),
        drive_force_n: wire
            .iter()
            .any(|wire| wire.drive_force_n.is_some())
            .then(|| force.collect()),
    })
}

/// A column for each tendon that every row has.
fn tendons(rows: &[Measured]) -> Vec<Vec<f64>> {
    let column = |k: usize| rows.iter().map(|row| row.tendons_m.get(k).copied()?).collect();
    (0..).map_while(column).filter(|column: &Vec<f64>| !column.is_empty()).collect()
}
