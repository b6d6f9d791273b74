//! `cargo xtask book`: builds the book in `docs/`; and what the suite checks of the pages without
//! mdBook: links, anchors, the table of contents, and the paths of files that pages name.

use crate::consent::Consent;
use crate::shell::{cargo, command, output, run, target_folder};

/// mdBook's version: another one may lay pages out differently.
const VERSION: &str = "0.5.4";

/// Builds the book, installing mdBook first where it is missing, and says where it is.
pub fn build(consent: Consent) -> anyhow::Result<()> {
    let book = target_folder().join("book");
    run(command(mdbook(consent)?).args(["build", "docs", "--dest-dir"]).arg(&book))?;
    println!("\nOpen {}", book.join("index.html").display());
    Ok(())
}

/// mdBook of [`VERSION`]: the one that is installed, or one built into the target folder.
fn mdbook(consent: Consent) -> anyhow::Result<std::path::PathBuf> {
    let tools = target_folder().join("tools");
    let own = tools.join("bin").join(format!("mdbook{}", std::env::consts::EXE_SUFFIX));
    for program in ["mdbook".into(), own.clone()] {
        let version = output(command(&program).arg("--version")).unwrap_or_default();
        if version.trim().trim_start_matches("mdbook v") == VERSION {
            return Ok(program);
        }
    }
    let folder = tools.display().to_string();
    // Without the web server that reloads pages, it takes a third of the time to build.
    let words = ["install", "mdbook", "--locked", "--version", VERSION];
    let words = [&words[..], &["--no-default-features", "--features", "search", "--root", &folder]];
    let words = words.concat();
    consent.to(&format!("cargo {}   (some minutes)", words.join(" ")))?;
    run(&mut cargo(&words))?;
    Ok(own)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::{Component, Path, PathBuf};

    use crate::documented;
    use crate::shell::root;

    /// Folders of the workspace: what begins with one of them in backquotes is a path.
    const FOLDERS: [&str; 7] =
        ["shared/", "host/", "firmware/", "hil-tests/", "xtask/", "examples/", "docs/"];

    fn name(page: &Path) -> String {
        page.strip_prefix(root()).unwrap_or(page).display().to_string()
    }

    fn pages() -> Vec<PathBuf> {
        let mut pages = documented::pages();
        pages.push(root().join("CHANGELOG.md"));
        pages
    }

    #[test]
    fn every_link_and_anchor_leads_somewhere() {
        let mut broken = Vec::new();
        for page in pages() {
            let text = fs::read_to_string(&page).unwrap();
            for (number, target) in links(&text) {
                if let Err(why) = follow(&page, &target) {
                    broken.push(format!("{}:{number}: {target}: {why}", name(&page)));
                }
            }
        }
        assert!(broken.is_empty(), "{}", broken.join("\n"));
    }

    /// Pages of the book link to nothing outside of it: a reader of the book has nothing else.
    fn follow(page: &Path, target: &str) -> Result<(), String> {
        if ["http://", "https://", "mailto:"].iter().any(|begin| target.starts_with(begin)) {
            return Ok(());
        }
        let (path, anchor) = match target.split_once('#') {
            Some((path, anchor)) => (path, Some(anchor)),
            None => (target, None),
        };
        let file = match path {
            "" => page.to_owned(),
            path => flat(&page.parent().unwrap_or(page).join(path)),
        };
        if !file.exists() {
            return Err("no such file".into());
        }
        let docs = root().join("docs");
        if page.starts_with(&docs) && !file.starts_with(&docs) {
            return Err("outside of the book; name its path in backquotes".into());
        }
        let Some(anchor) = anchor else { return Ok(()) };
        let text = fs::read_to_string(&file).map_err(|error| error.to_string())?;
        match anchors(&text).contains(anchor) {
            true => Ok(()),
            false => Err(format!("{} has no such heading", name(&file))),
        }
    }

    #[test]
    fn the_table_of_contents_has_every_page_once() {
        let docs = root().join("docs");
        let summary = docs.join("SUMMARY.md");
        let listed = links(&fs::read_to_string(&summary).unwrap());
        let listed: Vec<PathBuf> = listed.iter().map(|(_, path)| docs.join(path)).collect();
        let set: BTreeSet<&PathBuf> = listed.iter().collect();
        assert_eq!(set.len(), listed.len(), "a page is listed twice");
        for page in &listed {
            assert!(page.is_file(), "docs/SUMMARY.md lists {}, which is missing", name(page));
        }
        let pages = documented::pages();
        let missing: Vec<String> = pages
            .iter()
            .filter(|page| page.starts_with(&docs) && **page != summary && !set.contains(page))
            .map(|page| name(page))
            .collect();
        assert!(missing.is_empty(), "docs/SUMMARY.md lacks {}", missing.join(", "));
    }

    #[test]
    fn the_files_that_pages_name_exist() {
        let mut missing = Vec::new();
        for page in documented::pages() {
            for (number, line) in prose(&fs::read_to_string(&page).unwrap()) {
                for word in line.split('`').skip(1).step_by(2) {
                    let path = word.split("::").next().unwrap_or(word);
                    let is_path = FOLDERS.iter().any(|folder| path.starts_with(folder));
                    // Names that are left to the reader, and commands.
                    let is_open = path.contains(['…', '*', '<', ' ']) || path.contains("NAME");
                    if is_path && !is_open && !root().join(path).exists() {
                        missing.push(format!("{}:{number}: {path}", name(&page)));
                    }
                }
            }
        }
        assert!(missing.is_empty(), "no such file:\n{}", missing.join("\n"));
    }

    /// Lines outside of blocks, with their numbers.
    fn prose(text: &str) -> Vec<(usize, &str)> {
        let mut fenced = false;
        let mut lines: Vec<(usize, &str)> = (1..).zip(text.lines()).collect();
        lines.retain(|(_, line)| {
            let is_fence = line.trim_start().starts_with("```");
            fenced ^= is_fence;
            !is_fence && !fenced && !line.starts_with("    ")
        });
        lines
    }

    /// Targets of links and pictures, with their lines.
    fn links(text: &str) -> Vec<(usize, String)> {
        let mut found = Vec::new();
        for (number, line) in prose(text) {
            let outside: String = line.split('`').step_by(2).collect::<Vec<_>>().join("``");
            let mut rest = &outside[..];
            while let Some((_, after)) = rest.split_once("](") {
                let (target, after) = after.split_once(')').unwrap_or((after, ""));
                found.push((number, target.to_owned()));
                rest = after;
            }
        }
        found
    }

    /// Anchors of a page's headings, as GitHub and mdBook make them.
    fn anchors(text: &str) -> BTreeSet<String> {
        let headings = prose(text).into_iter().filter_map(|(_, line)| {
            let heading = line.trim_start_matches('#');
            (heading.len() < line.len() && heading.starts_with(' ')).then(|| heading.trim())
        });
        let anchor = |heading: &str| {
            let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>().to_lowercase()
        };
        headings.map(anchor).collect()
    }

    /// Without `..`, whether or not folders on the way exist.
    fn flat(path: &Path) -> PathBuf {
        let mut flat = PathBuf::new();
        for part in path.components() {
            match part {
                Component::ParentDir => drop(flat.pop()),
                Component::CurDir => {}
                part => flat.push(part),
            }
        }
        flat
    }

    #[test]
    fn links_headings_and_code_are_told_apart() {
        let text =
            "# A `b` (c) – d\n[x](y.md#z) `[not](this)` ![p](q.png)\n```\n[nor](this)\n```\n";
        assert_eq!(links(text), [(2, "y.md#z".to_owned()), (2, "q.png".to_owned())]);
        assert!(anchors(text).contains("a-b-c--d"), "{:?}", anchors(text));
        assert_eq!(flat(Path::new("/a/b/../c/./d")), Path::new("/a/c/d"));
    }
}
