//! `docs/promises.md` names the test behind each promise; the tests must be there.

use std::path::Path;

use anyhow::{Context, bail};

/// Fails when a test named in the table does not exist.
pub fn check(root: &Path) -> anyhow::Result<()> {
    let path = root.join("docs/promises.md");
    let text =
        std::fs::read_to_string(&path).with_context(|| format!("{} is missing", path.display()))?;
    let missing = missing(&text, |path, test| {
        let source = std::fs::read_to_string(root.join(path));
        source.is_ok_and(|source| test.is_none_or(|test| source.contains(&format!("fn {test}("))))
    });
    if !missing.is_empty() {
        bail!("docs/promises.md names tests that do not exist:\n  {}", missing.join("\n  "));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_that_is_gone_is_named_with_its_line() {
        let text = "| id | test |\n| P01 | `a.rs::there` |\n| P02 | `a.rs::gone`, `b.rs` |\n";
        let found = missing(text, |path, test| path == "a.rs" && test == Some("there"));
        assert_eq!(found, ["line 3: a.rs::gone", "line 3: b.rs"]);
    }
}
