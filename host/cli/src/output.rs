//! Files that commands write, and what they never write over.
//!
//! What somebody measured cannot be made again, and no command knows it by its name. So a file that
//! is there gives way only to its own kind: unasked where it can be made again at any time, as a
//! page, a summary or an image, else with `--overwrite`, as a recording or an export. What other
//! tools measured and what is imported of it gives way to nothing.

mod kind;

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use cathforce_recording::{is_recording, write_whole};

use crate::failure::{Code, Failure};
pub use kind::{Kind, NODES, TICKS};

/// Says now, rather than after a run, that a recording cannot be written. One that is there is
/// refused, or with `overwrite` left as it is until the new one begins.
pub fn check_recording(path: &Path, overwrite: bool) -> Result<(), Failure> {
    match path.symlink_metadata() {
        Ok(_) if !overwrite => return Err(is_there(path, ANOTHER_NAME_OR_OVERWRITE)),
        Ok(_) => check_kind(path, Kind::Recording)?,
        Err(_) => {}
    }
    check_writable(path)
}

/// The same of an export; a pipe or a device may be written to.
pub fn check_export(path: &Path, kind: Kind<'_>, overwrite: bool) -> Result<(), Failure> {
    if path.is_file() && !overwrite {
        return Err(is_there(path, ANOTHER_NAME_OR_OVERWRITE));
    }
    check_again(path, kind)
}

/// Takes a recording that is to be replaced out of the way of the one that begins now.
pub fn make_room(path: &Path) -> Result<(), Failure> {
    if path.symlink_metadata().is_err() {
        return Ok(());
    }
    check_kind(path, Kind::Recording)?;
    fs::remove_file(path).map_err(|e| Failure::write(path, e))
}

/// What other tools measured is never written over: there is no way around it.
pub fn check_new(path: &Path) -> Result<(), Failure> {
    match path.symlink_metadata() {
        Ok(_) => Err(is_there(path, "give another name, or move it away")),
        Err(_) => Ok(()),
    }
}

/// A folder that is made: it is new, and there is one to make it in.
pub fn check_new_folder(path: &Path) -> Result<(), Failure> {
    check_new(path)?;
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    match parent.unwrap_or(Path::new(".")).metadata() {
        Ok(parent) if parent.is_dir() => Ok(()),
        Ok(_) => Err(Failure::write(path, "it is to be in a file, not in a folder")),
        Err(e) => Err(Failure::write(path, e)),
    }
}

/// Says now that a file which can be made again cannot be written.
pub fn check_again(path: &Path, kind: Kind<'_>) -> Result<(), Failure> {
    check_kind(path, kind)?;
    // A pipe would wait for somebody who reads.
    match path.exists() && !path.is_file() && !path.is_dir() {
        true => Ok(()),
        false => check_writable(path),
    }
}

/// Writes a file that can be made again, whole or not at all.
pub fn write_again(path: &Path, kind: Kind<'_>, bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    check_kind(path, kind)?;
    write_whole(path, |out| out.write_all(bytes.as_ref())).map_err(|e| Failure::write(path, e))
}

/// A file is replaced by its own kind alone.
pub fn check_kind(path: &Path, kind: Kind<'_>) -> Result<(), Failure> {
    let stays = |what: String| {
        let message =
            format!("{} is {what} and stays as it is\n  fix: give another name", path.display());
        Err(Failure::new(Code::Usage, message))
    };
    // A pipe would wait for somebody who writes.
    match path.is_file() {
        true if kind.is_in(path) => Ok(()),
        true if is_recording(path) => stays("a recording".into()),
        true => stays(format!("not {}", kind.name())),
        false if kind == Kind::Recording => stays("not a file".into()),
        false => Ok(()),
    }
}

/// Files that are written in one go are several: the last one would be all that is left.
pub fn check_apart<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Result<(), Failure> {
    let mut seen: Vec<PathBuf> = Vec::new();
    for path in paths {
        let place = place(path);
        if seen.contains(&place) {
            let message = format!("{} is named twice\n  fix: a file each", path.display());
            return Err(Failure::new(Code::Usage, message));
        }
        seen.push(place);
    }
    Ok(())
}

/// Where a path leads, however it is written.
fn place(path: &Path) -> PathBuf {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let folder = || parent.unwrap_or(Path::new(".")).canonicalize();
    let new = || Some(folder().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(new).unwrap_or_else(|| path.to_path_buf())
}

const ANOTHER_NAME_OR_OVERWRITE: &str = "give another name, or --overwrite";

fn is_there(path: &Path, fix: &str) -> Failure {
    let message = format!("{} is there already and stays as it is\n  fix: {fix}", path.display());
    Failure::new(Code::Usage, message)
}

/// Leaves what is there.
fn check_writable(path: &Path) -> Result<(), Failure> {
    let is_new = !path.exists();
    let open = fs::OpenOptions::new().append(true).create(true).open(path);
    open.map_err(|e| Failure::write(path, e))?;
    if is_new {
        fs::remove_file(path).map_err(|e| Failure::write(path, e))?;
    }
    Ok(())
}
