//! Writes files and folders whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file beside its place and moves it there after `write` has succeeded.
///
/// On an error an earlier file stays as it is.
pub fn write_whole<E: From<io::Error>>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
    // A file cannot be moved onto a pipe or a device.
    if path.exists() && !path.is_file() {
        let mut out = BufWriter::new(fs::OpenOptions::new().write(true).open(path)?);
        write(&mut out)?;
        return Ok(out.flush()?);
    }
    put_whole(path, |unfinished| {
        let mut out = BufWriter::new(File::create(unfinished)?);
        write(&mut out)?;
        Ok(out.flush()?)
    })
}

/// The same, but `make` creates the file at the path that it is given; there is no file there yet.
pub fn put_whole<E: From<io::Error>>(
    path: &Path,
    make: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    let unfinished = Unfinished(beside(path));
    make(&unfinished.0)?;
    Ok(fs::rename(&unfinished.0, path)?)
}

/// Makes a folder beside its place and moves it there after `fill` has succeeded. `path` must not exist
/// yet.
pub fn make_folder<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    if path.exists() {
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, "it is there already").into());
    }
    let unfinished = Unfinished(beside(path));
    fs::create_dir(&unfinished.0)?;
    fill(&unfinished.0)?;
    Ok(fs::rename(&unfinished.0, path)?)
}

fn beside(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    path.with_file_name(name)
}

/// A file or folder that is removed on drop unless it was moved.
struct Unfinished(PathBuf);

impl Drop for Unfinished {
    fn drop(&mut self) {
        if self.0.is_dir() {
            let _ = fs::remove_dir_all(&self.0);
        } else {
            let _ = fs::remove_file(&self.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fails_leaves_what_was_there_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        write_whole::<io::Error>(&path, |out| out.write_all(b"old")).unwrap();
        let failed = write_whole::<io::Error>(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("no more"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        let new = folder.path().join("new");
        let fill = |at: &Path| fs::write(at.join("a"), b"half");
        assert!(
            make_folder::<io::Error>(&new, |at| fill(at).and(Err(io::Error::other("no")))).is_err()
        );
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left over");
        make_folder::<io::Error>(&new, fill).unwrap();
        assert!(new.join("a").is_file());
        assert!(make_folder::<io::Error>(&new, fill).is_err(), "it is there already");
    }
}
