//! The licence texts of everything that is linked into what is distributed.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Context;

use super::sources::Package;

/// Beginnings of the names of files with a licence or with what it asks to keep.
const NAMES: [&str; 5] = ["licen", "copying", "copyright", "notice", "unlicense"];

/// The texts of the packages of others, one after the other. Equal texts are printed once.
pub fn texts(packages: &[Package]) -> anyhow::Result<String> {
    let mut all = String::from(
        "Packages of others that are a part of cathforce or of its firmware, and their licences.\n\
         cathforce itself is licensed under MIT or Apache-2.0: see LICENSE-MIT and LICENSE-APACHE.\n",
    );
    // A text, and who is licensed by it.
    let mut texts: Vec<(String, Vec<String>)> = Vec::new();
    for package in packages.iter().filter(|package| package.is_linked && !package.is_own()) {
        let Package { name, version, licence, .. } = package;
        let _ = writeln!(all, "\n{name} {version}: {licence}");
        let found = files(&package.folder)?;
        if found.is_empty() {
            all += "  its package holds no text of its licence\n";
        }
        for (file, text) in found {
            let number = match texts.iter().position(|(known, _)| *known == text) {
                Some(at) => at,
                None => {
                    texts.push((text, Vec::new()));
                    texts.len() - 1
                }
            };
            texts[number].1.push(format!("{name} {version}"));
            let _ = writeln!(all, "  {file}: text {}", number + 1);
        }
    }
    for (number, (text, users)) in texts.iter().enumerate() {
        let rule = "-".repeat(80);
        let _ = writeln!(
            all,
            "\n{rule}\nText {}, of {}\n{rule}\n\n{text}",
            number + 1,
            users.join(", ")
        );
    }
    Ok(all)
}

fn files(folder: &Path) -> anyhow::Result<Vec<(String, String)>> {
    let mut found = Vec::new();
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let lower = name.to_lowercase();
        if path.is_file() && NAMES.iter().any(|begin| lower.starts_with(begin)) {
            let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
            found.push((name, String::from_utf8_lossy(&bytes).trim_end().to_owned()));
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dist::boards;

    #[test]
    fn the_firmwares_packages_and_their_texts_are_there() {
        let packages = boards::packages().unwrap();
        let texts = texts(&packages).unwrap();
        for word in ["heapless ", "Permission is hereby granted", "Apache License"] {
            assert!(texts.contains(word), "{word}");
        }
        // What is only used at build time is not delivered.
        assert!(!texts.contains("\nserde_derive "));
    }
}
