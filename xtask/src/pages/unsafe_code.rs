//! Every use of `unsafe` in what is shipped, with the proof beside it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context;

/// Folders of the sources that are shipped. Tests have files and folders of their own.
const FOLDERS: [&str; 3] = ["shared", "firmware", "host"];
/// Lines above a use in which its proof begins at the latest.
const REACH: usize = 8;
/// What the attributes promise, which the linker holds them to.
const ATTRIBUTES: [(&str, &str); 3] = [
    ("unsafe(no_mangle)", "The linker refuses a second symbol of this name."),
    ("unsafe(link_section", "The linker script of the board places this section."),
    ("unsafe(naked)", "The body is assembler alone."),
];

/// A use of `unsafe`.
#[derive(Debug, PartialEq, Eq)]
pub struct Use {
    pub file: String,
    pub line: usize,
    pub code: String,
    /// `None`: there is no proof beside it.
    pub proof: Option<String>,
}

/// All uses, by file.
pub fn all(root: &Path) -> anyhow::Result<Vec<Use>> {
    let mut found = Vec::new();
    for path in sources(root)? {
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let name = path.strip_prefix(root)?.display().to_string();
        found.extend(in_file(&name, &text));
    }
    Ok(found)
}

/// Every `.rs` file below a `src` folder.
fn sources(root: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut folders: Vec<_> = FOLDERS.iter().map(|folder| root.join(folder)).collect();
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs")
                && path.components().any(|part| part.as_os_str() == "src")
            {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

fn in_file(name: &str, text: &str) -> Vec<Use> {
    let lines: Vec<_> = text.lines().map(str::trim).collect();
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let code = line.split(" // ").next().unwrap_or(line);
        if !is_use(code) {
            continue;
        }
        let attribute = ATTRIBUTES.iter().find(|(begin, _)| code.contains(begin));
        let proof = match attribute {
            Some((_, proof)) => Some((*proof).to_owned()),
            // It is who calls it who needs a proof, or it is a type.
            None if is_declaration(code) => {
                Some("A declaration; who calls it has the proof.".to_owned())
            }
            None => beside(&lines, at).or_else(|| of_all_below(&lines, below(text, at))),
        };
        found.push(Use { file: name.into(), line: at + 1, code: code.to_owned(), proof });
    }
    found
}

fn is_use(code: &str) -> bool {
    let is_comment = code.starts_with("//");
    // A word with a hyphen, as in a content policy, is no keyword.
    let mut words = code.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-'));
    !is_comment && words.any(|word| word == "unsafe") && !code.contains("\"unsafe")
}

fn is_declaration(code: &str) -> bool {
    ["unsafe fn", "unsafe extern"].iter().any(|begin| code.contains(begin))
}

/// The comment `SAFETY:` or the section `# Safety` above a use, with what stands between them.
fn beside(lines: &[&str], at: usize) -> Option<String> {
    let first = at.saturating_sub(REACH);
    let begins = (first..=at).rev().find(|&line| lines[line].contains("SAFETY: "))?;
    // Another use in between has taken it, unless both are of one statement.
    let ends = lines[begins..at].iter().any(|line| *line == "}" || line.is_empty());
    if ends && begins != at {
        return None;
    }
    Some(comment(&lines[begins..], "SAFETY: "))
}

/// Where the code of a line is compiled: a macro's at the end of the file, where all of its uses have been.
fn below(text: &str, at: usize) -> usize {
    let lines: Vec<_> = text.lines().collect();
    let top = (0..=at)
        .rev()
        .find(|&line| !lines[line].starts_with([' ', '}']) && !lines[line].is_empty());
    match top.is_some_and(|top| lines[top].starts_with("macro_rules!")) {
        true => lines.len(),
        false => at,
    }
}

/// The comment `SAFETY of all below:`, which holds to the end of the file.
fn of_all_below(lines: &[&str], at: usize) -> Option<String> {
    let begins = (0..at).rev().find(|&line| lines[line].contains("SAFETY of all below: "))?;
    Some(comment(&lines[begins..], "SAFETY of all below: "))
}

/// A comment from its mark on.
fn comment(lines: &[&str], mark: &str) -> String {
    let first = lines[0].split_once(mark).map_or("", |(_, rest)| rest);
    let rest = lines[1..].iter().map_while(|line| line.strip_prefix("// "));
    let text: Vec<_> = std::iter::once(first).chain(rest).collect();
    let text = text.join(" ");
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The page's text: equal uses of a file stand in one row.
pub fn text(uses: &[Use]) -> String {
    let mut text = format!(
        "The compiler does not check what stands in `unsafe`. This page lists each use in the sources of \
         firmware, shared crates and host, {} in all, with the proof that stands beside it. A test fails \
         when one has none. [Decision 3](../decisions/0003-unsafe-stands-alone.md) says why the shared \
         crates have theirs in one place.\n",
        uses.len()
    );
    let mut at = 0;
    while let Some(first) = uses.get(at) {
        let file = &first.file;
        let of_file: Vec<_> = uses[at..].iter().take_while(|one| one.file == *file).collect();
        at += of_file.len();
        let _ = writeln!(text, "\n## `{file}`\n\n| uses | code | proof |\n| --- | --- | --- |");
        let mut seen: Vec<(&str, &str, usize)> = Vec::new();
        for one in of_file {
            let proof = one.proof.as_deref().unwrap_or_default();
            match seen.iter_mut().find(|(code, other, _)| *code == one.code && *other == proof) {
                Some((.., count)) => *count += 1,
                None => seen.push((&one.code, proof, 1)),
            }
        }
        for (code, proof, count) in seen {
            let code = code.replace('|', "\\|");
            let _ = writeln!(text, "| {count} | `{code}` | {} |", proof.replace('|', "\\|"));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_proof_is_found_beside_its_use_and_no_further() {
        let text = "fn a() {\n    // SAFETY: it is so,\n    // and stays so.\n    unsafe { b() }\n}\n\
                    fn c() {\n    unsafe { d() }\n}\n#[unsafe(no_mangle)]\nunsafe fn e() {}\n\
                    // an unsafe comment\nlet text = \"unsafe\";\nlet policy = \"'unsafe-inline'\";\n";
        let found = in_file("x.rs", text);
        let proofs: Vec<_> = found.iter().map(|one| one.proof.as_deref()).collect();
        assert_eq!(found.len(), 4, "{found:#?}");
        assert_eq!(proofs[0], Some("It is so, and stays so."));
        assert_eq!(proofs[1], None);
        assert!(proofs[2].is_some_and(|proof| proof.contains("linker")), "{proofs:?}");
        assert!(proofs[3].is_some_and(|proof| proof.contains("calls it")), "{proofs:?}");
    }

    #[test]
    fn one_proof_may_hold_for_the_rest_of_a_file() {
        let text =
            "unsafe { a() }\n// SAFETY of all below: no memory.\nfn b() {\n  unsafe { c() }\n}\n";
        let found = in_file("x.rs", text);
        assert_eq!(found[0].proof, None);
        assert_eq!(found[1].proof.as_deref(), Some("No memory."));
        // A macro is compiled where it is used.
        let text =
            "macro_rules! m {\n  () => { unsafe { a() } }\n}\n// SAFETY of all below: none.\n";
        assert_eq!(in_file("x.rs", text)[0].proof.as_deref(), Some("None."));
    }
}
