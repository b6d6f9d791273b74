//! Replaces a settings file whole or not at all. A link stays a link, permissions stay, and a
//! read-only file is not replaced.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::failure::{Code, Failure};
use crate::output::{Kind, check_kind};

/// A complete file, which will replace the one beside it.
pub struct Staged {
    file: NamedTempFile,
    /// The file to replace; for a link, the file that it leads to.
    path: PathBuf,
}

impl Staged {
    /// Writes a text into a file beside the one that it will replace.
    pub fn new(path: &Path, text: &str) -> Result<Self, Failure> {
        let failed = |e: &dyn std::fmt::Display| Failure::write(path, e);
        let (place, permissions) = replaceable(path)?;
        let folder = place.parent().filter(|f| !f.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let mut file = new_file(folder).map_err(|e| failed(&e))?;
        file.write_all(text.as_bytes()).map_err(|e| failed(&e))?;
        if let Some(permissions) = permissions {
            file.as_file().set_permissions(permissions).map_err(|e| failed(&e))?;
        }
        file.as_file().sync_all().map_err(|e| failed(&e))?;
        Ok(Self { file, path: place })
    }

    /// The path of the new file before it replaces the old one.
    pub fn written(&self) -> &Path {
        self.file.path()
    }

    /// Replaces the old file in one step.
    pub fn commit(self) -> Result<(), Failure> {
        let Self { file, path } = self;
        file.persist(&path).map_err(|e| Failure::write(&path, e.error))?;
        Ok(())
    }
}

/// The file that a path leads to, and its permissions if it exists. Refuses a file that may not be
/// replaced.
///
/// A rename checks the permissions of the folder only, and would turn a link into a file.
pub fn replaceable(path: &Path) -> Result<(PathBuf, Option<fs::Permissions>), Failure> {
    check_kind(path, Kind::Settings)?;
    let shown = path.display();
    let refused = |why: &str, fix: &str| {
        Failure::new(Code::Failed, format!("{shown} {why} and stays as it is\n  fix: {fix}"))
    };
    if path.symlink_metadata().is_err() {
        return Ok((path.to_path_buf(), None));
    }
    let place = fs::canonicalize(path).map_err(|e| {
        let why = format!("is a link that cannot be followed ({e})");
        refused(&why, "make the file that it leads to, or take the link away")
    })?;
    let permissions = fs::metadata(&place).map_err(|e| Failure::write(path, e))?.permissions();
    // Root may open any file for writing, so the permission is checked as well.
    let may_write = fs::OpenOptions::new().append(true).open(&place);
    match may_write {
        _ if permissions.readonly() => {
            Err(refused("is read-only", "allow writing (`chmod u+w`), or give another name"))
        }
        Err(e) => Err(Failure::write(path, e)),
        Ok(_) => Ok((place, Some(permissions))),
    }
}

/// A temporary file with the permissions of an ordinary new file.
#[cfg(unix)]
fn new_file(folder: &Path) -> std::io::Result<NamedTempFile> {
    use std::os::unix::fs::PermissionsExt as _;
    // The umask still applies.
    let permissions = fs::Permissions::from_mode(0o666);
    tempfile::Builder::new().permissions(permissions).tempfile_in(folder)
}

#[cfg(not(unix))]
fn new_file(folder: &Path) -> std::io::Result<NamedTempFile> {
    NamedTempFile::new_in(folder)
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::{PermissionsExt as _, symlink};

    use super::*;

    const OLD: &str = "rig = \"old\"\n";

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    fn write(path: &Path, text: &str) -> Result<(), Failure> {
        Staged::new(path, text)?.commit()
    }

    #[test]
    fn a_file_keeps_its_permissions_and_a_new_one_has_those_of_any_file() {
        let folder = tempfile::tempdir().unwrap();
        let [old, new, any] = ["old", "new", "any"].map(|name| folder.path().join(name));
        fs::write(&any, "").unwrap();
        fs::write(&old, OLD).unwrap();
        fs::set_permissions(&old, fs::Permissions::from_mode(0o664)).unwrap();
        write(&old, "text").unwrap();
        write(&new, "text").unwrap();
        assert_eq!((mode(&old), mode(&new)), (0o664, mode(&any)));
        assert_eq!(fs::read_to_string(&old).unwrap(), "text");
    }

    #[test]
    fn a_read_only_file_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        fs::write(&path, OLD).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap();
        let refused = write(&path, "text").unwrap_err();
        let said = refused.message;
        assert!(said.contains("is read-only") && said.contains("fix: "), "{said}");
        assert_eq!(fs::read_to_string(&path).unwrap(), OLD);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left");
    }

    #[test]
    fn what_is_no_file_of_settings_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rig.toml");
        for text in ["format = \"trial-bundle/1\"\nname = \"a\"\n", "t_s,insertion_m\n0,0\n"] {
            fs::write(&path, text).unwrap();
            let said = write(&path, "text").unwrap_err().message;
            assert!(said.contains("is not a settings file") && said.contains("fix: "), "{said}");
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
    }

    #[test]
    fn a_link_is_written_through() {
        let folder = tempfile::tempdir().unwrap();
        let elsewhere = tempfile::tempdir().unwrap();
        let [file, link] = [elsewhere.path().join("s.toml"), folder.path().join("s.toml")];
        symlink(&file, &link).unwrap();
        let refused = write(&link, "text").unwrap_err();
        assert!(refused.message.contains("cannot be followed"), "{}", refused.message);
        fs::write(&file, OLD).unwrap();
        write(&link, "text").unwrap();
        assert!(link.symlink_metadata().unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "text");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
