//! Files that commands write, and what they never write over.
//!
//! A recording cannot be made again: whatever the command, it is replaced only by another
//! recording, and only where `--overwrite` says so. Exports are not replaced unasked either, since
//! somebody may have gone on from them. Pages, summaries and images are, they are made again at
//! any time.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use cathforce_record::{is_recording, write_whole};

use crate::failure::{Code, Failure};

/// Says now, rather than after a run, that a recording cannot be written. One that is there is
/// refused, or with `overwrite` left as it is until the new one begins.
pub fn check_recording(path: &Path, overwrite: bool) -> Result<(), Failure> {
    match path.symlink_metadata() {
        Ok(_) if !overwrite => Err(is_there(path, ANOTHER_NAME_OR_OVERWRITE)),
        _ => check_writable(path),
    }
}

/// The same of an export; a pipe or a device may be written to.
pub fn check_export(path: &Path, overwrite: bool) -> Result<(), Failure> {
    if path.is_file() && !overwrite {
        return Err(is_there(path, ANOTHER_NAME_OR_OVERWRITE));
    }
    check_no_recording(path)
}

/// Takes a recording that is to be replaced out of the way of the one that begins now.
pub fn make_room(path: &Path) -> Result<(), Failure> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Failure::write(path, e)),
        _ => Ok(()),
    }
}

/// What other tools measured is never written over: there is no way around it.
pub fn check_new(path: &Path) -> Result<(), Failure> {
    match path.symlink_metadata() {
        Ok(_) => Err(is_there(path, "give another name, or move it away")),
        Err(_) => Ok(()),
    }
}

/// Says now that a file which can be made again cannot be written.
pub fn check_again(path: &Path) -> Result<(), Failure> {
    check_no_recording(path)?;
    check_writable(path)
}

/// Writes a file that can be made again, whole or not at all.
pub fn write_again(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    check_no_recording(path)?;
    write_whole(path, |out| out.write_all(bytes.as_ref())).map_err(|e| Failure::write(path, e))
}

/// A recording is replaced by nothing that is none.
pub fn check_no_recording(path: &Path) -> Result<(), Failure> {
    // A pipe would wait for somebody who writes.
    if path.is_file() && is_recording(path) {
        let message = format!(
            "{} is a recording and stays as it is\n  fix: give another name",
            path.display()
        );
        return Err(Failure::new(Code::Usage, message));
    }
    Ok(())
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
