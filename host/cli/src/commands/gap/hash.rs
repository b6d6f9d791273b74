//! Hashes of what an answer depends on: everything in a bundle, and the program.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::failure::{Code, Failure};

/// SHA-256 over name, length and bytes of every file that a bundle is read from, by name; of a
/// recording, over its own.
pub fn of_bundle(bundle: &Path) -> std::io::Result<String> {
    let mut files: Vec<PathBuf> =
        ["rig.toml", "vessel.stl", "centreline.csv"].iter().map(|name| bundle.join(name)).collect();
    if let Ok(trials) = std::fs::read_dir(bundle.join("trials")) {
        for entry in trials {
            files.push(entry?.path());
        }
    }
    files.push(bundle.to_path_buf());
    files.retain(|file| file.is_file());
    files.sort();
    let mut hash = Sha256::new();
    for file in files {
        let name = file.strip_prefix(bundle).unwrap_or(&file).to_string_lossy().into_owned();
        let bytes = std::fs::read(&file)?;
        hash.update(name.as_bytes());
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(&bytes);
    }
    Ok(format!("{:x}", hash.finalize()))
}

/// The same of several, in any order; of one it is its own.
pub fn of_all(paths: &[PathBuf]) -> std::io::Result<String> {
    let mut hashes = paths.iter().map(|path| of_bundle(path)).collect::<Result<Vec<_>, _>>()?;
    if hashes.len() == 1 {
        return Ok(hashes.remove(0));
    }
    hashes.sort();
    Ok(format!("{:x}", Sha256::digest(hashes.concat())))
}

/// SHA-256 of the program that answers.
pub fn own_sha256() -> Result<String, Failure> {
    let read = || std::fs::read(std::env::current_exe()?);
    let bytes = read()
        .map_err(|e| Failure::new(Code::Failed, format!("cannot read the program itself: {e}")))?;
    Ok(format!("{:x}", Sha256::digest(&bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_and_name_counts() {
        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        std::fs::create_dir(folder.path().join("trials")).unwrap();
        write("rig.toml", "a");
        write("trials/000.csv", "t_s");
        let first = of_bundle(folder.path()).unwrap();
        assert_eq!(first.len(), 64);
        write("notes.txt", "not read");
        assert_eq!(of_bundle(folder.path()).unwrap(), first);
        let path = folder.path().to_path_buf();
        assert_eq!(of_all(std::slice::from_ref(&path)).unwrap(), first);
        assert_ne!(of_all(&[path.clone(), path]).unwrap(), first);
        write("trials/000.csv", "t_m");
        assert_ne!(of_bundle(folder.path()).unwrap(), first);
    }
}
