//! Files that commands write, and the rule for files that exist already.
//!
//! A measurement cannot be made again, and its name does not tell that it is one. An existing file is
//! therefore replaced only by a file of its own kind. A page, a summary or an image can be made again
//! at any time, so it is replaced without a question; a recording or an export is replaced with
//! `--overwrite` only. The files of other tools and imported trials are never replaced.

mod json_file;
mod kind;
mod settings_file;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use cathforce_recording::{is_being_recorded, is_recording, make_folder, write_whole};

use crate::failure::{Code, Failure};
pub use json_file::JsonFile;
pub use kind::{Kind, NODES, TICKS, is_own_page};
pub use settings_file::{TOP as SETTINGS_KEYS, is_settings};

/// Checks before a run that a recording can be written. An existing file is refused, unless
/// `overwrite` is set; then it stays until the new recording begins.
pub fn check_recording(path: &Path, overwrite: bool) -> Result<(), Failure> {
    match path.symlink_metadata() {
        Ok(_) if !overwrite => return Err(is_there(path, ANOTHER_NAME_OR_OVERWRITE)),
        Ok(_) => {
            check_kind(path, Kind::Recording)?;
            check_not_recorded(path)?;
        }
        Err(_) => {}
    }
    check_writable(path)
}

/// Checks before the work that an export can be written. Pipes and devices are allowed.
pub fn check_export(path: &Path, kind: Kind<'_>, overwrite: bool) -> Result<(), Failure> {
    if path.is_file() && !overwrite {
        return Err(is_there(path, ANOTHER_NAME_OR_OVERWRITE));
    }
    check_again(path, kind)
}

/// Deletes a recording to make room for the one that begins now.
pub fn make_room(path: &Path) -> Result<(), Failure> {
    if path.symlink_metadata().is_err() {
        return Ok(());
    }
    check_kind(path, Kind::Recording)?;
    check_not_recorded(path)?;
    fs::remove_file(path).map_err(|e| Failure::write(path, e))
}

/// Refuses a recording that another command is writing.
fn check_not_recorded(path: &Path) -> Result<(), Failure> {
    if !is_being_recorded(path) {
        return Ok(());
    }
    let message = format!(
        "another command is recording into {} now\n  fix: wait for its end, or give another name",
        path.display()
    );
    Err(Failure::new(Code::Usage, message))
}

/// Refuses an existing file of any kind.
pub fn check_new(path: &Path) -> Result<(), Failure> {
    match path.symlink_metadata() {
        Ok(_) => Err(is_there(path, "give another name, or move it away")),
        Err(_) => Ok(()),
    }
}

/// Checks that a folder can be made: it must not exist, and its parent must.
pub fn check_new_folder(path: &Path) -> Result<(), Failure> {
    check_new(path)?;
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    match parent.unwrap_or(Path::new(".")).metadata() {
        Ok(parent) if parent.is_dir() => Ok(()),
        Ok(_) => Err(Failure::write(path, "its parent is a file, not a folder")),
        Err(e) => Err(Failure::write(path, e)),
    }
}

/// Writes files into a new folder whole or not at all: beside its place, then renamed.
pub fn write_new_folder<'a>(
    path: &Path,
    files: impl IntoIterator<Item = (&'a str, &'a [u8])>,
) -> Result<(), Failure> {
    make_folder(path, |folder| {
        files.into_iter().try_for_each(|(name, bytes)| fs::write(folder.join(name), bytes))
    })
    .map_err(|error: std::io::Error| Failure::write(path, error))
}

/// Checks before the work that a file which can be made again can be written.
pub fn check_again(path: &Path, kind: Kind<'_>) -> Result<(), Failure> {
    check_kind(path, kind)?;
    // Opening a pipe would wait for a reader.
    match path.exists() && !path.is_file() && !path.is_dir() {
        true => Ok(()),
        false => check_writable(path),
    }
}

/// Writes a file that can be made again. It is written whole or not at all.
pub fn write_again(path: &Path, kind: Kind<'_>, bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    check_kind(path, kind)?;
    write_whole(path, |out| out.write_all(bytes.as_ref())).map_err(|e| Failure::write(path, e))
}

/// Refuses to replace a file of another kind.
pub fn check_kind(path: &Path, kind: Kind<'_>) -> Result<(), Failure> {
    let stays = |what: String| {
        let message =
            format!("{} is {what} and stays as it is\n  fix: give another name", path.display());
        Err(Failure::new(Code::Usage, message))
    };
    // Opening a pipe would wait for a writer.
    match path.is_file() {
        true if kind.is_in(path) => Ok(()),
        true if is_recording(path) => stays("a recording".into()),
        true => stays(format!("not {}", kind.name())),
        false if kind == Kind::Recording => stays("not a file".into()),
        false => Ok(()),
    }
}

/// Refuses two outputs with the same path: only the last one would remain.
pub fn check_apart<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Result<(), Failure> {
    let mut seen: Vec<PathBuf> = Vec::new();
    for path in paths {
        let place = place(path);
        if seen.contains(&place) {
            let message = format!(
                "{} is named twice\n  fix: give each output a file of its own",
                path.display()
            );
            return Err(Failure::new(Code::Usage, message));
        }
        seen.push(place);
    }
    Ok(())
}

/// The file that a path leads to, however the path is written.
fn place(path: &Path) -> PathBuf {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let folder = || parent.unwrap_or(Path::new(".")).canonicalize();
    let new = || Some(folder().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(new).unwrap_or_else(|| path.to_path_buf())
}

/// A path in JSON. One that is no UTF-8, which JSON cannot hold, has the replacement character.
pub fn shown(path: impl AsRef<Path>) -> String {
    path.as_ref().display().to_string()
}

const ANOTHER_NAME_OR_OVERWRITE: &str = "give another name, or replace it with --overwrite";

fn is_there(path: &Path, fix: &str) -> Failure {
    let message = format!("{} exists already and stays as it is\n  fix: {fix}", path.display());
    Failure::new(Code::Usage, message)
}

/// Opens the file for writing and leaves its contents as they are.
fn check_writable(path: &Path) -> Result<(), Failure> {
    let is_new = !path.exists();
    let open = fs::OpenOptions::new().append(true).create(true).open(path);
    open.map_err(|e| Failure::write(path, e))?;
    if is_new {
        fs::remove_file(path).map_err(|e| Failure::write(path, e))?;
    }
    Ok(())
}
