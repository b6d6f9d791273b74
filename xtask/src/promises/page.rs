//! `docs/promises.md` names the test behind each promise; the tests must be there.

use std::path::Path;

use anyhow::{Context, bail};

const PAGE: &str = "docs/promises.md";

/// Fails when a test named in the table does not exist.
pub fn check(root: &Path) -> anyhow::Result<()> {
    let path = root.join(PAGE);
    let text =
        std::fs::read_to_string(&path).with_context(|| format!("{} is missing", path.display()))?;
    let missing = missing(&text, |path, test| {
        let source = std::fs::read_to_string(root.join(path));
        source.is_ok_and(|source| test.is_none_or(|test| source.contains(&format!("fn {test}("))))
    });
    if !missing.is_empty() {
        bail!("{PAGE} names tests that do not exist:\n  {}", missing.join("\n  "));
    }
    Ok(())
}

/// Tests are named as `path/to/file.rs` or `path/to/file.rs::function`, in backquotes.
fn missing(text: &str, exists: impl Fn(&str, Option<&str>) -> bool) -> Vec<String> {
    let mut missing = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let named = line.split('`').skip(1).step_by(2).filter(|word| word.contains(".rs"));
        for name in named {
            let (path, test) = match name.split_once("::") {
                Some((path, test)) => (path, Some(test.rsplit("::").next().unwrap_or(test))),
                None => (name, None),
            };
            if !exists(path, test) {
                missing.push(format!("line {}: {name}", number + 1));
            }
        }
    }
    missing
}

/// A row of the table, with the tests of its section.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Promise {
    pub id: String,
    pub promise: String,
    pub mechanism: String,
    /// As the page states it.
    pub figure: String,
    /// `path/to/file.rs::function`
    pub tests: Vec<String>,
}

/// The identifiers of the promises.
#[cfg(test)]
pub fn ids(root: &Path) -> anyhow::Result<Vec<String>> {
    Ok(promises(root)?.into_iter().map(|promise| promise.id).collect())
}

/// The promises of the page.
pub fn promises(root: &Path) -> anyhow::Result<Vec<Promise>> {
    let path = root.join(PAGE);
    let text =
        std::fs::read_to_string(&path).with_context(|| format!("{} is missing", path.display()))?;
    let promises = read(&text);
    if promises.is_empty() {
        bail!("{PAGE} has no table whose rows begin with `| P01 |`");
    }
    Ok(promises)
}

fn read(text: &str) -> Vec<Promise> {
    let rows = text.lines().filter_map(|line| {
        let cells: Vec<_> = line.split('|').map(str::trim).collect();
        match cells[..] {
            ["", id, promise, mechanism, figure, _, _, ""] if is_id(id) => Some(Promise {
                id: id.into(),
                promise: promise.into(),
                mechanism: mechanism.into(),
                figure: figure.into(),
                tests: tests(text, id),
            }),
            _ => None,
        }
    });
    rows.collect()
}

fn is_id(word: &str) -> bool {
    word.strip_prefix('P').is_some_and(|n| n.len() == 2 && n.bytes().all(|b| b.is_ascii_digit()))
}

/// The tests that the section of a promise lists.
fn tests(text: &str, id: &str) -> Vec<String> {
    let heading = format!("### {id}");
    let section = text.lines().skip_while(|line| line.trim() != heading).skip(1);
    let section = section.take_while(|line| !line.starts_with('#'));
    let names = section.filter_map(|line| line.strip_prefix("- `")?.strip_suffix('`'));
    names.filter(|name| name.contains("::")).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_that_is_gone_is_named_with_its_line() {
        let text = "| id | test |\n| P01 | `a.rs::there` |\n| P02 | `a.rs::gone`, `b.rs` |\n";
        let found = missing(text, |path, test| path == "a.rs" && test == Some("there"));
        assert_eq!(found, ["line 3: a.rs::gone", "line 3: b.rs"]);
    }

    #[test]
    fn rows_have_the_tests_of_their_sections() {
        let text = "| id | promise | mechanism | figure | tests | left open |\n| --- | --- | --- | --- | --- | --- |\n\
                    | P01 | it stops | a timer | 25 ms | [1](#p01) |  |\n\
                    | P02 | it holds | a limiter | 1 N | none yet | all |\n\n\
                    ## Tests\n\n### P01\n\n- `a/b.rs::p01_it_stops`\n\nSee `c.rs`.\n\n### P03\n\n- `d.rs::e`\n";
        let found = read(text);
        assert_eq!(found.len(), 2);
        assert_eq!(
            (found[0].figure.as_str(), &found[0].tests[..]),
            ("25 ms", &["a/b.rs::p01_it_stops".to_owned()][..])
        );
        assert_eq!(found[1].tests, [""; 0]);
    }
}
