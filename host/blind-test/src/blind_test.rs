//! A blind test on disk: cases, sealed labels, answers.
//!
//! | file | when |
//! | --- | --- |
//! | `made.json` | begun and made; how many cases there are to be, on which rigs, and which are left out |
//! | `cases/NNN/` | made; the bundles to diagnose |
//! | `labels/NNN.json` | made; not to be opened before the reveal |
//! | `seals.json` | sealed; SHA-256 of every label file, which holds its salt, and of every case |
//! | `answers/NNN.json` | run; only of cases as they were sealed |
//! | `revealed.json` | revealed; no case is answered any more |
//! | `score.json` | scored; only of labels that match their seals |

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use thiserror::Error;

use crate::label::Label;
use crate::score::Score;

/// Published before anything is diagnosed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Seals {
    /// SHA-256 of the label file, by case.
    pub labels: BTreeMap<String, String>,
    /// SHA-256 over names and bytes of the case's files, by case. The first sets have none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub cases: BTreeMap<String, String>,
}

/// Why a blind test cannot go on.
#[derive(Debug, Error)]
pub enum BlindTestError {
    #[error("{}: {error}", path.display())]
    File { path: PathBuf, error: std::io::Error },
    #[error("{}: {error}", path.display())]
    Content { path: PathBuf, error: serde_json::Error },
    #[error(
        "{}: a blind test that is sealed, or of another seed, other rigs or another number of cases, is \
         there already\n  fix: name another folder",
        .0.display()
    )]
    AlreadyMade(PathBuf),
    #[error(
        "two rigs have the name `{0}`, and cases are told apart by it\n  fix: name their folders differently"
    )]
    OneName(String),
    #[error("{}: no blind test is there\n  fix: `cathforce gap blind-test make` makes one", .0.display())]
    NoBlindTest(PathBuf),
    #[error(
        "{}: its making was not finished\n  fix: `cathforce gap blind-test make` with the same options \
         goes on",
        .0.display()
    )]
    NotFinished(PathBuf),
    #[error("{}: not sealed yet\n  fix: `cathforce gap blind-test seal` first", .0.display())]
    NotSealed(PathBuf),
    #[error("{}: sealed already; a second seal would prove nothing", .0.display())]
    AlreadySealed(PathBuf),
    #[error(
        "{}: there are answers already, and a seal after them would prove nothing\n  fix: make a new \
         blind test in another folder",
        .0.display()
    )]
    AlreadyAnswered(PathBuf),
    #[error(
        "{}: its labels were opened (revealed.json); what is answered now is not blind\n  fix: `cathforce \
         gap diagnose` on a case, or a new blind test",
        .0.display()
    )]
    AlreadyRevealed(PathBuf),
    #[error("case {0} is not answered yet\n  fix: `cathforce gap blind-test run` first")]
    NotAnswered(String),
    #[error("the label of case {0} is not the one that was sealed")]
    Broken(String),
    #[error("{}: not the case that was sealed: a file was changed, added or removed", .0.display())]
    Changed(PathBuf),
}

/// The plan of a blind test and how far it is made. Together with the seed it determines the cases; it
/// tells no label.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Made {
    pub cases: usize,
    pub rigs: Vec<String>,
    /// Cases for which the solver finds no balance.
    pub left_out: Vec<usize>,
    /// Whether all other cases are there.
    pub is_whole: bool,
}

/// A blind test in a folder.
#[derive(Clone, Debug)]
pub struct BlindTest {
    pub(crate) folder: PathBuf,
}

impl BlindTest {
    /// A folder, whatever is in it.
    pub fn at(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf() }
    }

    pub(crate) fn label_path(&self, case: &str) -> PathBuf {
        self.folder.join(format!("labels/{case}.json"))
    }

    /// Names of all cases, in order.
    pub fn cases(&self) -> Result<Vec<String>, BlindTestError> {
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

    /// Hashes every label and every case, and writes `seals.json`.
    pub fn seal(&self) -> Result<Seals, BlindTestError> {
        let path = self.folder.join("seals.json");
        if path.exists() {
            return Err(BlindTestError::AlreadySealed(self.folder.clone()));
        }
        if !self.folder.join("labels").is_dir() {
            return Err(BlindTestError::NoBlindTest(self.folder.clone()));
        }
        if !self.made()?.is_some_and(|made| made.is_whole) {
            return Err(BlindTestError::NotFinished(self.folder.clone()));
        }
        if self.folder.join("answers").exists() {
            return Err(BlindTestError::AlreadyAnswered(self.folder.clone()));
        }
        let names = self.cases()?;
        let hashes = names.iter().map(|case| Ok((case.clone(), self.hash(case)?)));
        let labels = hashes.collect::<Result<_, BlindTestError>>()?;
        let hashes =
            names.iter().map(|case| Ok((case.clone(), hash_of_folder(&self.bundle(case))?)));
        let seals = Seals { labels, cases: hashes.collect::<Result<_, BlindTestError>>()? };
        write_json(&path, &seals)?;
        Ok(seals)
    }

    /// What was said when the blind test was made; `None` of one that no program of today made.
    pub(crate) fn made(&self) -> Result<Option<Made>, BlindTestError> {
        let path = self.folder.join("made.json");
        if path.exists() { read_json(&path).map(Some) } else { Ok(None) }
    }

    /// SHA-256 of `seals.json`, the one figure that has to be published before a case is answered.
    pub fn seals_sha256(&self) -> Result<String, BlindTestError> {
        let path = self.folder.join("seals.json");
        let bytes = fs::read(&path).map_err(file(&path))?;
        Ok(format!("{:x}", Sha256::digest(&bytes)))
    }

    fn hash(&self, case: &str) -> Result<String, BlindTestError> {
        let path = self.label_path(case);
        let bytes = fs::read(&path).map_err(file(&path))?;
        Ok(format!("{:x}", Sha256::digest(&bytes)))
    }

    /// What was sealed.
    pub fn seals(&self) -> Result<Seals, BlindTestError> {
        let path = self.folder.join("seals.json");
        if !path.exists() {
            return Err(BlindTestError::NotSealed(self.folder.clone()));
        }
        read_json(&path)
    }

    /// Refuses a case that is not the one that was sealed, and any whose label was opened.
    pub fn check_case(&self, seals: &Seals, case: &str) -> Result<(), BlindTestError> {
        if self.folder.join("revealed.json").exists() {
            return Err(BlindTestError::AlreadyRevealed(self.folder.clone()));
        }
        self.check_bytes(seals, case)
    }

    fn check_bytes(&self, seals: &Seals, case: &str) -> Result<(), BlindTestError> {
        let bundle = self.bundle(case);
        match seals.cases.get(case) {
            Some(seal) if hash_of_folder(&bundle)? != *seal => Err(BlindTestError::Changed(bundle)),
            _ => Ok(()),
        }
    }

    /// The answer to a case, if it was given.
    pub fn answer(&self, case: &str) -> Result<Option<Value>, BlindTestError> {
        let path = self.answer_path(case);
        if path.exists() { read_json(&path).map(Some) } else { Ok(None) }
    }

    /// Keeps the answer to a case.
    pub fn keep_answer(&self, case: &str, answer: &Value) -> Result<(), BlindTestError> {
        create(&self.folder.join("answers"))?;
        write_json(&self.answer_path(case), answer)
    }

    fn answer_path(&self, case: &str) -> PathBuf {
        self.folder.join(format!("answers/{case}.json"))
    }

    /// Keeps the score.
    pub fn keep_score(&self, score: &Score) -> Result<(), BlindTestError> {
        write_json(&self.folder.join("score.json"), score)
    }

    /// Opens the labels, which must be those that were sealed, once every case is answered; from then
    /// on none is answered any more.
    pub fn reveal(&self) -> Result<Vec<(Label, Value)>, BlindTestError> {
        let seals = self.seals()?;
        let open = |(case, seal): (&String, &String)| {
            let Some(answer) = self.answer(case)? else {
                return Err(BlindTestError::NotAnswered(case.clone()));
            };
            if self.hash(case)? != *seal {
                return Err(BlindTestError::Broken(case.clone()));
            }
            self.check_bytes(&seals, case)?;
            Ok((read_json(&self.label_path(case))?, answer))
        };
        let revealed = seals.labels.iter().map(open).collect::<Result<_, BlindTestError>>()?;
        let mark = serde_json::json!({ "seals_sha256": self.seals_sha256()? });
        write_json(&self.folder.join("revealed.json"), &mark)?;
        Ok(revealed)
    }
}

/// SHA-256 over name, length and bytes of every file in a folder and in those below it, by name.
fn hash_of_folder(folder: &Path) -> Result<String, BlindTestError> {
    let (mut open, mut files) = (vec![folder.to_path_buf()], Vec::new());
    while let Some(path) = open.pop() {
        for entry in fs::read_dir(&path).map_err(file(&path))? {
            let entry = entry.map_err(file(&path))?.path();
            if entry.is_dir() { open.push(entry) } else { files.push(entry) }
        }
    }
    files.sort();
    let mut hash = Sha256::new();
    for path in files {
        let bytes = fs::read(&path).map_err(file(&path))?;
        let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy();
        hash.update(name.as_bytes());
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(&bytes);
    }
    Ok(format!("{:x}", hash.finalize()))
}

fn file(path: &Path) -> impl Fn(std::io::Error) -> BlindTestError {
    let path = path.to_path_buf();
    move |error| BlindTestError::File { path: path.clone(), error }
}

pub(crate) fn create(folder: &Path) -> Result<(), BlindTestError> {
    fs::create_dir_all(folder).map_err(file(folder))
}

pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), BlindTestError> {
    let content = |error| BlindTestError::Content { path: path.to_path_buf(), error };
    let text = serde_json::to_string_pretty(value).map_err(content)?;
    // Whoever is interrupted leaves a whole file or none.
    let beside = path.with_extension("json.part");
    fs::write(&beside, text + "\n").map_err(file(&beside))?;
    fs::rename(&beside, path).map_err(file(path))
}

pub(crate) fn read_json<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<T, BlindTestError> {
    let content = |error| BlindTestError::Content { path: path.to_path_buf(), error };
    let text = fs::read_to_string(path).map_err(file(path))?;
    serde_json::from_str(&text).map_err(content)
}
