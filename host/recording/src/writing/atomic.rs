//! Writes files and folders whole or not at all.
//!
//! An output is made in a folder of its own beside its place, whose name nobody can foretell, then moved.
//! The folder holds a locked file as long as its command lives. So the next command finds what a killed
//! one has left and removes it, and a second writer of the same output is told from one.

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use tempfile::TempDir;

const LOCK: &str = "lock";
const UNFINISHED: &str = "unfinished";
/// A folder without a lock that is younger may be one that is being made.
const YOUNG: Duration = Duration::from_secs(60);

/// Writes a file beside its place and moves it there after `write` has succeeded.
///
/// On an error an earlier file stays as it is. A link stays a link, and its file is replaced.
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
        let mut out = BufWriter::new(File::create_new(unfinished)?);
        write(&mut out)?;
        Ok(out.flush()?)
    })
}

/// The same, but `make` creates the file at the path that it is given; there is no file there yet.
pub fn put_whole<E: From<io::Error>>(
    path: &Path,
    make: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    let path = &behind_link(path)?;
    let beside = Beside::new(path)?;
    make(&beside.unfinished())?;
    // After a loss of power there is the old file or the new one, and no empty one.
    File::open(beside.unfinished())?.sync_all()?;
    Ok(beside.put(path)?)
}

/// Makes a folder beside its place and moves it there after `fill` has succeeded. `path` must not exist
/// yet.
pub fn make_folder<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&Path) -> Result<(), E>,
) -> Result<(), E> {
    if path.symlink_metadata().is_ok() {
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, "it is there already").into());
    }
    let beside = Beside::new(path)?;
    fs::create_dir(beside.unfinished())?;
    fill(&beside.unfinished())?;
    Ok(beside.put(path)?)
}

/// The path of the file that a link leads to; a path that is no link is that already.
fn behind_link(path: &Path) -> io::Result<PathBuf> {
    /// Links that a system follows at most.
    const MOST: usize = 40;
    let mut path = path.to_path_buf();
    for _ in 0..MOST {
        if !path.symlink_metadata().is_ok_and(|found| found.is_symlink()) {
            return Ok(path);
        }
        let target = fs::read_link(&path)?;
        path = path.parent().unwrap_or(Path::new("")).join(target);
    }
    Err(io::Error::other("its links lead in a circle"))
}

/// A folder beside an output, which is removed on drop.
struct Beside {
    folder: TempDir,
    /// Locked until the output is in its place.
    _lock: File,
}

impl Beside {
    /// Refuses an output that another command is writing.
    fn new(path: &Path) -> io::Result<Self> {
        let name = path.file_name().ok_or_else(|| io::Error::other("it has no name"))?;
        let parent = parent(path);
        let prefix = prefix(name);
        let folder = tempfile::Builder::new().prefix(&prefix).tempdir_in(parent)?;
        let lock = File::create_new(folder.path().join(LOCK))?;
        lock.try_lock()?;
        let beside = Self { folder, _lock: lock };
        for other in fs::read_dir(parent)? {
            let other = other?.path();
            // By name: of a folder beside the working directory, one path is absolute and the other is not.
            let is_own = other.file_name() == beside.folder.path().file_name();
            let starts = |name: &OsStr| name.as_encoded_bytes().starts_with(prefix.as_bytes());
            if is_own || !other.file_name().is_some_and(starts) {
                continue;
            }
            if is_in_use(&other) {
                return Err(io::Error::new(
                    io::ErrorKind::ResourceBusy,
                    "another command is writing it now",
                ));
            }
        }
        Ok(beside)
    }

    fn unfinished(&self) -> PathBuf {
        self.folder.path().join(UNFINISHED)
    }

    fn put(&self, path: &Path) -> io::Result<()> {
        fs::rename(self.unfinished(), path)?;
        // A folder can be synchronised only on some systems, and the file is in its place already.
        #[cfg(unix)]
        let _ = File::open(parent(path)).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

fn parent(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// What the folders of one output begin with. The name itself may be as long as a name can be.
fn prefix(name: &OsStr) -> String {
    format!(".cathforce-{:08x}-", crc32fast::hash(name.as_encoded_bytes()))
}

/// Whether a command that lives has made this folder; one of a killed command is removed.
fn is_in_use(folder: &Path) -> bool {
    let lock = File::open(folder.join(LOCK));
    let is_left = match &lock {
        Ok(lock) => match lock.try_lock() {
            Ok(()) => true,
            Err(TryLockError::WouldBlock) => return true,
            // A file system without locks: what is there may be in use.
            Err(TryLockError::Error(_)) => false,
        },
        Err(_) => {
            let made = folder.metadata().and_then(|found| found.modified());
            made.is_ok_and(|made| {
                SystemTime::now().duration_since(made).is_ok_and(|age| age > YOUNG)
            })
        }
    };
    if is_left {
        // It may belong to somebody else, who is not bothered by it either.
        let _ = fs::remove_dir_all(folder);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

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
        assert_eq!(names(folder.path()), 1, "nothing is left over");
        make_folder::<io::Error>(&new, fill).unwrap();
        assert!(new.join("a").is_file());
        assert!(make_folder::<io::Error>(&new, fill).is_err(), "it is there already");
        assert_eq!(names(folder.path()), 2);
    }

    #[test]
    fn a_second_writer_is_refused_and_what_a_killed_one_left_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        write_whole::<io::Error>(&path, |out| {
            let second = write_whole::<io::Error>(&path, |out| out.write_all(b"second"));
            assert_eq!(second.unwrap_err().kind(), io::ErrorKind::ResourceBusy);
            // Another output of the same folder is free.
            write_whole::<io::Error>(&folder.path().join("other"), |out| out.write_all(b"other"))?;
            out.write_all(b"first")
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"first");
        // A killed command's lock is gone with it.
        let left = folder.path().join(format!("{}abcdef", prefix(OsStr::new("file"))));
        fs::create_dir(&left).unwrap();
        fs::write(left.join(LOCK), "").unwrap();
        fs::write(left.join(UNFINISHED), "half").unwrap();
        write_whole::<io::Error>(&path, |out| out.write_all(b"new")).unwrap();
        assert!(!left.exists());
        assert_eq!(names(folder.path()), 2);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_its_file_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["file", "link"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink("file", &link).unwrap();
        for content in ["first", "second"] {
            write_whole::<io::Error>(&link, |out| out.write_all(content.as_bytes())).unwrap();
            assert!(link.symlink_metadata().unwrap().is_symlink());
            assert_eq!(fs::read_to_string(&file).unwrap(), content);
        }
        std::os::unix::fs::symlink("circle", folder.path().join("circle")).unwrap();
        let circle = folder.path().join("circle");
        assert!(write_whole::<io::Error>(&circle, |out| out.write_all(b"x")).is_err());
    }
}
