//! Files and folders of what is distributed.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;

/// Every file below a folder, in the order of their paths.
pub fn list(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let (mut folders, mut found) = (vec![folder.to_owned()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            match path.is_dir() {
                true => folders.push(path),
                false => found.push(path),
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Copies a file, or a folder with everything in it.
pub fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    let said = || format!("{} cannot be copied to {}", from.display(), to.display());
    if !from.is_dir() {
        fs::create_dir_all(to.parent().unwrap_or(to)).with_context(said)?;
        fs::copy(from, to).with_context(said)?;
        return Ok(());
    }
    fs::create_dir_all(to).with_context(said)?;
    for entry in fs::read_dir(from).with_context(said)? {
        let entry = entry?;
        copy(&entry.path(), &to.join(entry.file_name()))?;
    }
    Ok(())
}

/// Files that hold these bytes.
pub fn that_hold(folder: &Path, bytes: &[u8]) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for path in list(folder)? {
        let text = fs::read(&path).with_context(|| path.display().to_string())?;
        if text.windows(bytes.len()).any(|part| part == bytes) {
            found.push(path);
        }
    }
    Ok(found)
}

/// Files that only one of two folders has, or that differ, each with what is the matter.
pub fn differences(one: &Path, other: &Path) -> anyhow::Result<Vec<String>> {
    let names = |folder: &Path| -> anyhow::Result<Vec<PathBuf>> {
        list(folder)?.iter().map(|path| Ok(path.strip_prefix(folder)?.to_owned())).collect()
    };
    let (first, second) = (names(one)?, names(other)?);
    let mut found = Vec::new();
    for name in &first {
        if !second.contains(name) {
            found.push(format!("{}: only in {}", name.display(), one.display()));
        } else if fs::read(one.join(name))? != fs::read(other.join(name))? {
            found.push(format!("{}: differs", name.display()));
        }
    }
    let only = second.iter().filter(|name| !first.contains(name));
    found.extend(only.map(|name| format!("{}: only in {}", name.display(), other.display())));
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_is_equal_and_each_change_is_named() {
        let folder = std::env::temp_dir().join(format!("cathforce-files-{}", std::process::id()));
        let (one, other) = (folder.join("one"), folder.join("other"));
        fs::create_dir_all(one.join("sub")).unwrap();
        fs::write(one.join("sub/a"), "of /home/me").unwrap();
        fs::write(one.join("b"), "b").unwrap();
        copy(&one, &other).unwrap();
        assert!(differences(&one, &other).unwrap().is_empty());
        fs::write(other.join("b"), "c").unwrap();
        fs::write(other.join("c"), "c").unwrap();
        fs::remove_file(other.join("sub/a")).unwrap();
        let said = differences(&one, &other).unwrap().join("\n");
        for word in ["b: differs", "c: only in", "sub/a: only in"] {
            assert!(said.contains(word), "{word} in {said}");
        }
        assert_eq!(that_hold(&one, b"/home").unwrap(), [one.join("sub/a")]);
        fs::remove_dir_all(folder).unwrap();
    }
}
