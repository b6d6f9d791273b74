//! The commands that README and docs print.

use std::path::Path;

/// A command as a page prints it, without its comment.
#[derive(Clone, Debug, PartialEq)]
pub struct Documented {
    /// `docs/config.md:18`.
    pub place: String,
    /// In a block of its own, not in a sentence: meant to be typed.
    pub in_block: bool,
    /// Something was left out: `…`.
    pub abridged: bool,
    /// From the program's name on; optional parts without their brackets.
    pub words: Vec<String>,
}

/// Every command of the pages that begins with these words, page by page.
pub fn documented(program: &[&str]) -> Vec<Documented> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let root = root.into_iter().find(|folder| folder.join("docs").is_dir()).expect("the pages");
    let docs = std::fs::read_dir(root.join("docs")).expect("docs");
    let mut pages = docs.map(|entry| entry.expect("an entry").path()).collect::<Vec<_>>();
    pages.retain(|page| page.extension().is_some_and(|ending| ending == "md"));
    pages.push(root.join("README.md"));
    pages.sort();
    let found = pages.iter().flat_map(|page| {
        let text = std::fs::read_to_string(page).expect("a page");
        let name = page.strip_prefix(root).expect("below it").display().to_string();
        commands(&name, &text)
    });
    let is_of = |command: &Documented| {
        program.iter().zip(&command.words).filter(|(wanted, word)| wanted == word).count()
            == program.len()
    };
    found.filter(is_of).collect()
}

/// What stands in blocks, a line each, and in backticks.
fn commands(page: &str, text: &str) -> Vec<Documented> {
    let mut found = Vec::new();
    let (mut sentence, mut fenced) = (String::new(), false);
    let mut lines = (1..).zip(text.lines());
    while let Some((number, line)) = lines.next() {
        if line.starts_with("```") {
            fenced = !fenced;
        } else if fenced || line.starts_with("    ") {
            let mut whole = line.to_owned();
            while let Some(begun) = whole.strip_suffix('\\') {
                whole = begun.to_owned() + lines.next().map_or("", |(_, rest)| rest);
            }
            let command = whole.split(" # ").next().unwrap_or_default();
            found.extend(Documented::read(format!("{page}:{number}"), true, command));
        } else {
            sentence += line;
            sentence.push(' ');
        }
    }
    let quoted = sentence.split('`').skip(1).step_by(2);
    found.extend(quoted.filter_map(|text| Documented::read(page.to_owned(), false, text)));
    found
}

impl Documented {
    fn read(place: String, in_block: bool, text: &str) -> Option<Self> {
        let plain = text.replace(['[', ']'], "");
        let mut words = Vec::<String>::new();
        for word in plain.split_whitespace() {
            // What an option is given may be left to the reader; else something was left out.
            let is_value = words.last().is_some_and(|before| before.starts_with("--"));
            if word != "…" || is_value {
                words.push(word.trim_end_matches("...").to_owned());
            }
        }
        // Variables of the environment come before the program.
        let from = words.iter().position(|word| !word.contains('='))?;
        let abridged = plain.split_whitespace().any(|word| word == "…");
        Some(Self { place, in_block, abridged, words: words.split_off(from) })
    }
}
