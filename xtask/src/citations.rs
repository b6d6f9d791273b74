//! The code cites the equations of `docs/explanation/model.md`: both must agree.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

/// The page, and the path that a citation begins with.
const PAGE: &str = "docs/explanation/model.md";
/// Where the paths in the tables of the page start.
const CODE: &str = "shared/mechanics/src";
/// Folders of the checkout that hold no sources of its own.
const SKIPPED: [&str; 2] = ["target", ".git"];
/// Equations that no code needs to cite, because they only define a symbol.
const DEFINITIONS: &[usize] = &[];

/// Fails when the numbers of the page, the citations in `.rs` files or the names in the page's
/// tables do not agree; lists everything that is wrong.
pub fn check(root: &Path) -> anyhow::Result<()> {
    let page =
        std::fs::read_to_string(root.join(PAGE)).with_context(|| format!("{PAGE} is missing"))?;
    let mut citations = Vec::new();
    for path in sources(root)? {
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let name = path.strip_prefix(root).unwrap_or(&path).display().to_string();
        citations.extend(cited(&text).into_iter().map(|number| (name.clone(), number)));
    }
    let mut wrong = numbering(&page, &citations);
    wrong.extend(misnamed(&page, |path| std::fs::read_to_string(root.join(CODE).join(path)).ok()));
    if !wrong.is_empty() {
        bail!("{PAGE} and the code do not agree:\n  {}", wrong.join("\n  "));
    }
    Ok(())
}

/// Every `.rs` file of the checkout.
fn sources(root: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let (mut folders, mut files) = (vec![root.to_owned()], Vec::new());
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
        for entry in entries {
            let entry = entry?;
            let (path, kind) = (entry.path(), entry.file_type()?);
            let skipped = SKIPPED.iter().any(|name| entry.file_name() == *name);
            if kind.is_dir() && !skipped {
                folders.push(path);
            } else if kind.is_file() && path.extension().is_some_and(|ending| ending == "rs") {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Numbers of the equations in reading order: `(n)` at the end of an indented line.
fn equations(page: &str) -> Vec<usize> {
    let of_line = |line: &str| {
        let (_, number) =
            line.strip_prefix("    ")?.trim_end().strip_suffix(')')?.rsplit_once("  (")?;
        number.parse().ok()
    };
    page.lines().filter_map(of_line).collect()
}

/// Numbers that a source file cites behind the name of the page, as `(1)`, `(1), (2)` or
/// `(1)–(3)`; a list may go on in the next line of a comment.
fn cited(source: &str) -> Vec<usize> {
    let joined: Vec<&str> =
        source.lines().map(|line| line.trim().trim_start_matches(['/', '!']).trim()).collect();
    let joined = joined.join(" ");
    let mut numbers = Vec::new();
    for (at, _) in joined.match_indices(PAGE) {
        let mut rest = joined[at + PAGE.len()..].trim_start_matches(['`', ',', ' ']);
        let mut range_from = None;
        while let Some((number, after)) = number_in_brackets(rest) {
            numbers.extend(range_from.unwrap_or(number)..=number);
            rest = after.trim_start();
            range_from = rest.starts_with('–').then_some(number + 1);
            let Some(more) = ["–", ", and ", " and ", "and ", ","]
                .iter()
                .find_map(|separator| rest.strip_prefix(separator))
            else {
                break;
            };
            rest = more.trim_start();
        }
    }
    numbers
}

fn number_in_brackets(text: &str) -> Option<(usize, &str)> {
    let (number, after) = text.strip_prefix('(')?.split_once(')')?;
    Some((number.parse().ok()?, after))
}

/// What is wrong with the numbers of the page and the citations, each with its file.
fn numbering(page: &str, citations: &[(String, usize)]) -> Vec<String> {
    let numbers = equations(page);
    let count = numbers.len();
    let mut wrong = Vec::new();
    for (found, expected) in numbers.iter().zip(1..).filter(|(found, expected)| *found != expected)
    {
        wrong.push(format!("equation ({found}) should be ({expected}) in reading order"));
    }
    for (file, number) in citations.iter().filter(|(_, number)| !(1..=count).contains(number)) {
        wrong.push(format!("{file} cites ({number}), the page has (1) to ({count})"));
    }
    let cited: BTreeSet<usize> = citations.iter().map(|(_, number)| *number).collect();
    let excepted = |number: &usize| DEFINITIONS.contains(number) || cited.contains(number);
    for number in (1..=count).filter(|number| !excepted(number)) {
        wrong.push(format!("no code cites ({number})"));
    }
    wrong
}

/// Names in the tables of the page that their files do not have.
///
/// A cell names a file in backquotes and then what stands in it: `feed.rs` `State::feed`.
fn misnamed(page: &str, read: impl Fn(&str) -> Option<String>) -> Vec<String> {
    let mut wrong = Vec::new();
    for (number, line) in (1..).zip(page.lines()).filter(|(_, line)| line.starts_with('|')) {
        let mut file = None;
        for name in line.split('`').skip(1).step_by(2) {
            if name.ends_with(".rs") {
                let text = read(name);
                if text.is_none() {
                    wrong.push(format!("line {number}: there is no {CODE}/{name}"));
                }
                file = text.map(|text| (name, text));
            } else if let Some((path, text)) = &file
                && !name.split("::").all(|word| has_word(text, word))
            {
                wrong.push(format!("line {number}: {CODE}/{path} has no {name}"));
            }
        }
    }
    wrong
}

/// Whether the text has this name as a whole word.
fn has_word(text: &str, word: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        let (before, after) = (&text[..at], &text[at + word.len()..]);
        !before.ends_with(is_part) && !after.starts_with(is_part)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_numbers_at_the_end_of_indented_lines() {
        let page = "text (7)\n\n    a = f(3)        (1)\n    b\n    c = d  (2)\n| (4) |\n";
        assert_eq!(equations(page), [1, 2]);
    }

    #[test]
    fn lists_and_ranges_are_read_across_lines_of_a_comment() {
        // Put together, so that this file cites nothing.
        let source = format!(
            "/// A. {PAGE} (1), (4)–(6)\n/// and (9)\nf(2); // see (3)\n// `{PAGE}` (8), which f(7) has\n"
        );
        assert_eq!(cited(&source), [1, 4, 5, 6, 9, 8]);
    }

    #[test]
    fn a_number_that_is_wrong_unknown_or_not_cited_is_named() {
        let page = "    a  (1)\n    b  (3)\n    c  (2)\n    d  (4)\n";
        let at = |number| ("a.rs".to_owned(), number);
        let wrong = numbering(page, &[at(1), at(2), at(3), at(5)]);
        assert_eq!(
            wrong,
            [
                "equation (3) should be (2) in reading order",
                "equation (2) should be (3) in reading order",
                "a.rs cites (5), the page has (1) to (4)",
                "no code cites (4)",
            ]
        );
    }

    #[test]
    fn a_name_that_is_gone_is_named_with_its_line() {
        let page = "| s | `a.rs` `State::feed`, `gone`; `b.rs` |\n`c.rs` is no table\n";
        let read = |path: &str| (path == "a.rs").then(|| "impl State { fn feed(".to_owned());
        assert_eq!(
            misnamed(page, read),
            [
                format!("line 1: {CODE}/a.rs has no gone"),
                format!("line 1: there is no {CODE}/b.rs")
            ]
        );
    }
}
