//! `docs/reference/hazards.md` and `docs/explanation/attacks.md`: each row names promises and tests, which
//! must be there.

use std::path::Path;

use anyhow::{Context, bail};

use crate::promises;

/// The pages, and the beginning of the identifiers of their rows.
const PAGES: [(&str, &str); 2] =
    [("docs/reference/hazards.md", "H"), ("docs/explanation/attacks.md", "A")];

/// Fails when a row names a promise or a test that does not exist, or no test at all.
pub fn check(root: &Path) -> anyhow::Result<()> {
    let known = promises::ids(root)?;
    let mut wrong = Vec::new();
    for (page, letter) in PAGES {
        let text = std::fs::read_to_string(root.join(page)).context(page)?;
        let exists = |path: &str, test: &str| {
            let source = std::fs::read_to_string(root.join(path));
            source.is_ok_and(|source| source.contains(&format!("fn {test}(")))
        };
        let found = problems(&text, letter, &known, exists);
        wrong.extend(found.into_iter().map(|problem| format!("{page}: {problem}")));
    }
    match wrong.is_empty() {
        true => Ok(()),
        false => bail!("{}", wrong.join("\n")),
    }
}

fn problems(
    text: &str,
    letter: &str,
    known: &[String],
    exists: impl Fn(&str, &str) -> bool,
) -> Vec<String> {
    let mut found = Vec::new();
    let mut expected = 1;
    for line in text.lines().filter(|line| line.starts_with(&format!("| {letter}"))) {
        let id = line.split('|').nth(1).unwrap_or_default().trim();
        if id != format!("{letter}{expected:02}") {
            found.push(format!("{id} stands where {letter}{expected:02} would"));
        }
        expected += 1;
        let words = line.split(|c: char| !c.is_alphanumeric());
        for promise in words.filter(|word| is_promise(word)) {
            if !known.iter().any(|known| known == promise) {
                found.push(format!("{id} names the promise {promise}, which there is not"));
            }
        }
        let tests: Vec<_> =
            line.split('`').skip(1).step_by(2).filter_map(|n| n.split_once("::")).collect();
        if tests.is_empty() {
            found.push(format!("{id} names no test"));
        }
        for (path, test) in tests.iter().filter(|(path, test)| !exists(path, test)) {
            found.push(format!("{id} names {path}::{test}, which does not exist"));
        }
    }
    if expected == 1 {
        found.push("it has no row".into());
    }
    found
}

fn is_promise(word: &str) -> bool {
    word.strip_prefix('P').is_some_and(|n| n.len() == 2 && n.bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_there_is_named_with_its_row() {
        let text = "| id | hazard |\n| --- | --- |\n| H01 | P01 | `a.rs::there` |\n| H02 | P99 | `a.rs::gone` |\n\
                    | H04 | P01 | nothing |\n";
        let found =
            problems(text, "H", &["P01".into()], |path, test| (path, test) == ("a.rs", "there"));
        let expected = [
            "H02 names the promise P99, which there is not",
            "H02 names a.rs::gone, which does not exist",
            "H04 stands where H03 would",
            "H04 names no test",
        ];
        assert_eq!(found, expected);
        assert_eq!(problems("", "H", &[], |_, _| true), ["it has no row"]);
    }
}
