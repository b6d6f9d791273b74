//! A challenge on disk: cases, sealed labels, answers.
//!
//! | file | when |
//! | --- | --- |
//! | `cases/NNN/` | made; the bundles to diagnose |
//! | `labels/NNN.json` | made; not to be opened before the reveal |
//! | `seals.json` | sealed; SHA-256 of every label file, which holds its salt |
//! | `answers/NNN.json` | run; only of sealed cases |
//! | `score.json` | scored; only of labels that match their seals |

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use cathforce_reference::SolveError;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use thiserror::Error;

use crate::change::Truth;
use crate::draw::{Case, Kind, cases};
use crate::score::Score;
use crate::stand::{Stand, Unchanged};

/// What is true of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Label {
    pub case: String,
    /// Of the challenge.
    #[serde(default)]
    pub seed: u64,
    pub kind: Kind,
    pub rig: String,
    pub effects: Vec<Truth>,
    pub severity: f64,
    /// RMS of what the effects change, with the noise, over the noise alone, in the channel that
    /// shows them best: 1 is invisible.
    pub gap_over_noise: f64,
    /// The same of every effect beside the others: of what it adds to them.
    #[serde(default)]
    pub added_over_noise: Vec<f64>,
    /// Both over the floor: the noise, and what a wall does that is nearer than anybody knows. Labels of seeds
    /// before 20000 have neither.
    #[serde(default)]
    pub gap_over_floor: Option<f64>,
    #[serde(default)]
    pub added_over_floor: Vec<f64>,
    /// Random, so that nobody finds the label by trying.
    pub salt: String,
}

/// Published before anything is diagnosed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seals {
    /// SHA-256 of the label file, by case.
    pub labels: BTreeMap<String, String>,
}

/// Why a challenge cannot go on.
#[derive(Debug, Error)]
pub enum ChallengeError {
    #[error("{}: {error}", path.display())]
    File { path: PathBuf, error: std::io::Error },
    #[error("{}: {error}", path.display())]
    Content { path: PathBuf, error: serde_json::Error },
    #[error(
        "{}: a challenge that is sealed, or of another seed or other rigs, is there already\n  \
         fix: name another folder",
        .0.display()
    )]
    AlreadyMade(PathBuf),
    #[error("{}: no challenge is there\n  fix: `cathforce gap challenge make` makes one", .0.display())]
    NoChallenge(PathBuf),
    #[error("{}: not sealed yet\n  fix: `cathforce gap challenge seal` first", .0.display())]
    NotSealed(PathBuf),
    #[error("{}: sealed already; a second seal would be worth nothing", .0.display())]
    AlreadySealed(PathBuf),
    #[error("case {0} is not answered yet\n  fix: `cathforce gap challenge run` first")]
    NotAnswered(String),
    #[error("the label of case {0} is not the one that was sealed")]
    Broken(String),
}

/// A challenge in a folder.
#[derive(Clone, Debug)]
pub struct Challenge {
    folder: PathBuf,
}

impl Challenge {
    /// A folder, whatever is in it.
    pub fn at(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf() }
    }

    /// Makes `count` cases of a seed on these rigs, or those of them that are not there yet.
    /// `salt_seed` must not be known to whoever diagnoses. `made` is told after every case.
    ///
    /// Gives the cases that are left out because the solver finds no balance, and why.
    pub fn make(
        &self,
        seed: u64,
        count: usize,
        salt_seed: u64,
        stands: &[Stand],
        made: &(dyn Fn() + Sync),
    ) -> Result<Vec<(usize, SolveError)>, ChallengeError> {
        if self.folder.join("seals.json").exists() || self.is_of_another(seed, stands)? {
            return Err(ChallengeError::AlreadyMade(self.folder.clone()));
        }
        let mut rng = ChaCha8Rng::seed_from_u64(salt_seed);
        let drawn: Vec<(Case, u128)> =
            cases(seed, count, stands).into_iter().map(|case| (case, rng.random())).collect();
        create(&self.folder.join("labels"))?;
        create(&self.folder.join("cases"))?;
        let unchanged: BTreeMap<&str, Result<Unchanged, SolveError>> =
            stands.iter().map(|stand| (&*stand.rig.name, stand.unchanged())).collect();
        let make = |(case, salt): &(Case, u128)| -> Result<_, ChallengeError> {
            let played = match &unchanged[&*case.stand.rig.name] {
                _ if self.label_path(&name(case.number)).exists() => Ok(()),
                Ok(unchanged) => self.make_case(seed, case, *salt, unchanged)?,
                Err(error) => Err(*error),
            };
            made();
            Ok(played.err().map(|error| (case.number, error)))
        };
        let left_out: Vec<_> = drawn.par_iter().map(make).collect::<Result<_, _>>()?;
        Ok(left_out.into_iter().flatten().collect())
    }

    /// Whether there are cases of another seed, or of other rigs.
    fn is_of_another(&self, seed: u64, stands: &[Stand]) -> Result<bool, ChallengeError> {
        if !self.folder.join("labels").exists() {
            return Ok(self.folder.join("cases").exists());
        }
        let first =
            self.cases()?.into_iter().map(|case| self.label_path(&case)).find(|p| p.exists());
        let label: Option<Label> = first.map(|path| read_json(&path)).transpose()?;
        let is_known = |rig: &str| stands.iter().any(|stand| stand.rig.name == rig);
        Ok(label.is_some_and(|label| label.seed != seed || !is_known(&label.rig)))
    }

    /// Plays and writes one case, or says why it cannot be played.
    fn make_case(
        &self,
        seed: u64,
        case: &Case,
        salt: u128,
        unchanged: &Unchanged,
    ) -> Result<Result<(), SolveError>, ChallengeError> {
        let name = name(case.number);
        let stand = &case.stand;
        let play_all = || {
            let real = stand.play(&case.changes)?;
            let without = |k: usize| {
                let others: Vec<_> = [&case.changes[..k], &case.changes[k + 1..]].concat();
                if others.is_empty() { Ok(unchanged.nominal.clone()) } else { stand.play(&others) }
            };
            let without = (0..case.changes.len()).map(without);
            Ok((real, without.collect::<Result<Vec<_>, SolveError>>()?))
        };
        let (real, without) = match play_all() {
            Ok(played) => played,
            Err(error) => return Ok(Err(error)),
        };
        let over_noise = |without: &Vec<_>| stand.gap_over_noise(&real, without);
        let over_floor = |without: &Vec<_>| stand.gap_over_floor(&real, without, unchanged);
        let label = Label {
            case: name.clone(),
            seed,
            kind: case.kind,
            rig: stand.rig.name.clone(),
            effects: case.changes.iter().map(|c| c.truth(stand.rig.friction_coefficient)).collect(),
            severity: case.severity,
            gap_over_noise: over_noise(&unchanged.nominal),
            added_over_noise: without.iter().map(over_noise).collect(),
            gap_over_floor: Some(over_floor(&unchanged.nominal)),
            added_over_floor: without.iter().map(over_floor).collect(),
            salt: format!("{salt:032x}"),
        };
        let folder = self.folder.join("cases").join(&name);
        stand
            .write(&folder, &format!("case-{name}"), &real, case.noise_seed)
            .map_err(|error| ChallengeError::File { path: folder, error })?;
        // The label comes last: what has one is whole.
        write_json(&self.label_path(&name), &label)?;
        Ok(Ok(()))
    }

    fn label_path(&self, case: &str) -> PathBuf {
        self.folder.join(format!("labels/{case}.json"))
    }

    /// Names of all cases, in order.
    pub fn cases(&self) -> Result<Vec<String>, ChallengeError> {
        let path = self.folder.join("cases");
        let entries = fs::read_dir(&path).map_err(file(&path))?;
        let mut names = Vec::new();
        for entry in entries {
            let entry = entry.map_err(file(&path))?;
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
        names.sort();
        Ok(names)
    }

    /// Folder of one case's bundle.
    pub fn bundle(&self, case: &str) -> PathBuf {
        self.folder.join("cases").join(case)
    }

    /// Hashes every label and writes `seals.json`.
    pub fn seal(&self) -> Result<Seals, ChallengeError> {
        let path = self.folder.join("seals.json");
        if path.exists() {
            return Err(ChallengeError::AlreadySealed(self.folder.clone()));
        }
        if !self.folder.join("labels").is_dir() {
            return Err(ChallengeError::NoChallenge(self.folder.clone()));
        }
        let cases = self.cases()?;
        let hashes = cases.into_iter().map(|case| Ok((case.clone(), self.hash(&case)?)));
        let seals = Seals { labels: hashes.collect::<Result<_, ChallengeError>>()? };
        write_json(&path, &seals)?;
        Ok(seals)
    }

    fn hash(&self, case: &str) -> Result<String, ChallengeError> {
        let path = self.label_path(case);
        let bytes = fs::read(&path).map_err(file(&path))?;
        Ok(format!("{:x}", Sha256::digest(&bytes)))
    }

    /// What was sealed.
    pub fn seals(&self) -> Result<Seals, ChallengeError> {
        let path = self.folder.join("seals.json");
        if !path.exists() {
            return Err(ChallengeError::NotSealed(self.folder.clone()));
        }
        read_json(&path)
    }

    /// The answer to a case, if it was given.
    pub fn answer(&self, case: &str) -> Result<Option<Value>, ChallengeError> {
        let path = self.answer_path(case);
        if path.exists() { read_json(&path).map(Some) } else { Ok(None) }
    }

    /// Keeps the answer to a case.
    pub fn keep_answer(&self, case: &str, answer: &Value) -> Result<(), ChallengeError> {
        create(&self.folder.join("answers"))?;
        write_json(&self.answer_path(case), answer)
    }

    fn answer_path(&self, case: &str) -> PathBuf {
        self.folder.join(format!("answers/{case}.json"))
    }

    /// Keeps the score.
    pub fn keep_score(&self, score: &Score) -> Result<(), ChallengeError> {
        write_json(&self.folder.join("score.json"), score)
    }

    /// Opens the labels, which must be those that were sealed, once every case is answered.
    pub fn reveal(&self) -> Result<Vec<(Label, Value)>, ChallengeError> {
        let seals = self.seals()?;
        let open = |(case, seal): (&String, &String)| {
            let Some(answer) = self.answer(case)? else {
                return Err(ChallengeError::NotAnswered(case.clone()));
            };
            if self.hash(case)? != *seal {
                return Err(ChallengeError::Broken(case.clone()));
            }
            Ok((read_json(&self.label_path(case))?, answer))
        };
        seals.labels.iter().map(open).collect()
    }
}

fn file(path: &Path) -> impl Fn(std::io::Error) -> ChallengeError {
    let path = path.to_path_buf();
    move |error| ChallengeError::File { path: path.clone(), error }
}

fn name(case: usize) -> String {
    format!("{case:03}")
}

fn create(folder: &Path) -> Result<(), ChallengeError> {
    fs::create_dir_all(folder).map_err(file(folder))
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<(), ChallengeError> {
    let content = |error| ChallengeError::Content { path: path.to_path_buf(), error };
    let text = serde_json::to_string_pretty(value).map_err(content)?;
    // Whoever is interrupted leaves a whole file or none.
    let beside = path.with_extension("json.part");
    fs::write(&beside, text + "\n").map_err(file(&beside))?;
    fs::rename(&beside, path).map_err(file(path))
}

fn read_json<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<T, ChallengeError> {
    let content = |error| ChallengeError::Content { path: path.to_path_buf(), error };
    let text = fs::read_to_string(path).map_err(file(path))?;
    serde_json::from_str(&text).map_err(content)
}
