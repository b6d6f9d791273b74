//! Reads a recording.

use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use cathforce_bus::master::Master;
use cathforce_config::image;

use super::contents::{Contents, Wrong};
use crate::container::{Container, Cut, Damage};
use crate::format::dropout::Dropout;
use crate::format::frame::BusFrame;
use crate::format::info::{RunInfo, RunResult};
use crate::format::trial::Trial;
use crate::import::is_trial;

/// Whether a file begins like a recording, complete or not; `false` if it cannot be read.
pub fn is_recording(path: &Path) -> bool {
    let mut head = [0; mcap::MAGIC.len()];
    let read = fs::File::open(path).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && head == mcap::MAGIC
}

/// The content of a recording, without anything derived.
#[derive(Clone, Debug)]
pub struct Recording {
    pub info: RunInfo,
    /// The device image that was in use.
    pub image: Vec<u8>,
    pub rig_toml: String,
    /// The bus description.
    pub dbc: String,
    /// Files of the vessel by their names in a trial bundle.
    pub vessel: Vec<(String, Vec<u8>)>,
    /// Every frame, in the order in which it crossed the bus.
    pub frames: Vec<BusFrame>,
    /// When each frame reached the host's computer, on the same clock \[ns\]; without a stamp of the
    /// carrier, the time of the frame.
    pub arrived_ns: Vec<u64>,
    /// When the recorder got each frame, on the same clock \[ns\].
    pub logged_ns: Vec<u64>,
    /// Missing frames, in the order in which they were noticed.
    pub dropouts: Vec<Dropout>,
    /// The trial that was played, with its measurements.
    pub trial: Trial,
    /// Time on the bus at which the trial's time is zero \[ns\].
    pub trial_start_ns: Option<u64>,
    /// What the device reported at the end, if the run ended normally.
    pub result: Option<RunResult>,
    /// Where the file breaks off, if it was not finished.
    pub cut: Option<Cut>,
    /// Parts of the file that do not match their checksums and are left out.
    pub damage: Vec<Damage>,
}

/// Why a file is no usable recording.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    #[error("cannot read {}: {source}; give a recording made by `cathforce run`", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error(
        "{}: byte 0: not an MCAP file, it begins with {found}; {fix}",
        path.display()
    )]
    NotMcap { path: PathBuf, found: String, fix: &'static str },
    #[error(
        "{}: byte {byte}: {cause}; the file is damaged, copy it again or record anew",
        path.display()
    )]
    Damaged { path: PathBuf, byte: usize, cause: String },
    #[error(
        "{}: an MCAP file, but {missing}; give a recording made by `cathforce run`",
        path.display()
    )]
    NotOurs { path: PathBuf, missing: String },
    #[error(
        "{}: breaks off at byte {byte}, before the {missing}: nothing of the run is in it; copy it \
         again or record anew",
        path.display()
    )]
    CutTooEarly { path: PathBuf, byte: usize, missing: String },
}

impl Recording {
    /// Layout of the drives' positions in the frames to the device.
    pub fn master(&self) -> Master {
        // An unreadable image is refused where it is needed; here it means the default layout.
        image::master(&self.image).unwrap_or_default()
    }

    /// Whether the recording is complete, in words.
    pub fn completeness(&self) -> String {
        match self.cut {
            Some(cut) => format!("no: it breaks off at byte {}", cut.byte),
            None if !self.damage.is_empty() => {
                let parts =
                    self.damage.iter().map(|Damage { byte, what }| format!("byte {byte}: {what}"));
                format!("no: {}", parts.collect::<Vec<_>>().join("; "))
            }
            None if self.result.is_none() => "no: the run broke off".into(),
            None => "yes".into(),
        }
    }

    /// Reads the file whole.
    ///
    /// A file that breaks off because its recorder was killed is read up to there, see
    /// [`Recording::cut`]. Chunks and attachments that do not match their checksums are left out, see
    /// [`Recording::damage`]. A file whose information about the run is damaged is refused.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        // A device may have no end.
        let is_special = path.metadata().is_ok_and(|found| !found.is_file());
        let bytes = match is_special {
            true => Err(io::Error::other("it is no file, but a folder, a pipe or a device")),
            false => fs::read(path),
        };
        let bytes = bytes.map_err(|source| ReadError::Io { path: path.into(), source })?;
        Self::of_bytes(path, &bytes)
    }

    /// The same of a file that is in memory; `path` names it in errors.
    pub fn of_bytes(path: &Path, bytes: &[u8]) -> Result<Self, ReadError> {
        if !bytes.starts_with(mcap::MAGIC) {
            let found =
                bytes.iter().take(8).map(|b| format!("{b:02x}")).collect::<Vec<_>>().join(" ");
            let found = if found.is_empty() { "nothing".to_owned() } else { found };
            return Err(ReadError::NotMcap { path: path.into(), found, fix: instead_of(bytes) });
        }
        let damaged =
            |byte: usize, cause: String| ReadError::Damaged { path: path.into(), byte, cause };
        let container = Container::read(bytes).map_err(|(byte, cause)| damaged(byte, cause))?;
        let contents = Contents::read(&container);
        let contents = contents.map_err(|Wrong { byte, cause }| damaged(byte, cause))?;
        let Container { cut, .. } = container;
        let missing = |what: &str| {
            let first = contents.damage.first();
            match (cut, first) {
                (_, Some(Damage { byte, what: damage })) => {
                    damaged(*byte, format!("{damage}, and there is no {what} without it"))
                }
                (Some(Cut { byte }), None) => {
                    ReadError::CutTooEarly { path: path.into(), byte, missing: what.into() }
                }
                (None, None) => {
                    ReadError::NotOurs { path: path.into(), missing: format!("it has no {what}") }
                }
            }
        };
        let info = contents.info.clone().ok_or_else(|| missing("`cathforce` metadata"))?;
        let image = contents.image.clone().ok_or_else(|| missing("attached device image"))?;
        let rig_toml = contents.rig_toml.clone().ok_or_else(|| missing("attached rig.toml"))?;
        Ok(Self {
            image,
            rig_toml,
            dbc: contents.dbc,
            vessel: contents.vessel,
            frames: contents.frames,
            arrived_ns: contents.arrived_ns,
            logged_ns: contents.logged_ns,
            dropouts: contents.dropouts,
            trial: Trial { rows: contents.rows, shapes_m: contents.shapes_m, noise: info.noise },
            trial_start_ns: contents.trial_start_ns,
            result: contents.result,
            cut,
            damage: contents.damage,
            info,
        })
    }
}

/// Advice for a file that is no recording.
fn instead_of(bytes: &[u8]) -> &'static str {
    let text = std::str::from_utf8(bytes).unwrap_or_default();
    let heading = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    if is_trial(text) {
        "this is a trial: give the folder of its bundle, which holds rig.toml, or a recording made by \
         `cathforce run`"
    } else if text.contains("trial-bundle/") {
        "this is the rig.toml of a bundle: give its folder, or a recording made by `cathforce run`"
    } else if heading.contains([',', ';', '\t']) {
        "this is a table: `cathforce import csv` makes a trial of it, for the folder trials of a \
         bundle; or give a recording made by `cathforce run`"
    } else {
        "give a recording made by `cathforce run`"
    }
}
