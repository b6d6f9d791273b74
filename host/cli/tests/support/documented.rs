//! The commands that the pages print.

use std::path::{Path, PathBuf};

/// A command as a page prints it, without its comment.
#[derive(Clone, Debug, PartialEq)]
pub struct Documented {
    /// `docs/reference/settings.md:18`.
    pub place: String,
    /// In a block, not in a sentence: it is meant to be typed.
    pub in_block: bool,
    /// Something was left out, as `…`.
    pub abridged: bool,
    /// The words from the program's name on, without the brackets of optional parts.
    pub words: Vec<String>,
}

/// The workspace.
pub fn root() -> &'static Path {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    root.into_iter().find(|folder| folder.join("docs").is_dir()).expect("the pages")
}

/// Every page that a reader is given: the book, the pages beside README, one for each example.
pub fn pages() -> Vec<PathBuf> {
    let mut pages = ["README.md", "CONTRIBUTING.md", "SECURITY.md", "firmware/README.md"]
        .map(|page| root().join(page))
        .to_vec();
    for folder in ["docs", "examples"] {
        pages_below(&root().join(folder), &mut pages);
    }
    pages.sort();
    pages
}

fn pages_below(folder: &Path, pages: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of pages") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            pages_below(&path, pages);
        } else if path.extension().is_some_and(|ending| ending == "md") {
            pages.push(path);
        }
    }
}

/// Every command of the pages that begins with these words, page by page; but for the page of
/// usages, which is generated from the arguments.
pub fn documented(program: &[&str]) -> Vec<Documented> {
    let typed = pages().into_iter().filter(|page| !page.ends_with("reference/command-line.md"));
    let found = typed.flat_map(|page| {
        let text = std::fs::read_to_string(&page).expect("a page");
        let name = page.strip_prefix(root()).expect("below it").display().to_string();
        commands(&name, &text)
    });
    let is_of = |command: &Documented| {
        program.iter().zip(&command.words).filter(|(wanted, word)| wanted == word).count()
            == program.len()
    };
    found.filter(is_of).collect()
}

/// The commands in blocks, a line each, and in backticks.
///
/// In a block of a console, commands come after `$ ` and everything else is output.
fn commands(page: &str, text: &str) -> Vec<Documented> {
    let mut found = Vec::new();
    let (mut sentence, mut fenced, mut console) = (String::new(), false, false);
    let mut lines = (1..).zip(text.lines());
    while let Some((number, line)) = lines.next() {
        if line.starts_with("```") {
            fenced = !fenced;
            console = fenced && line == "```console";
        } else if fenced || line.starts_with("    ") {
            let typed = line.strip_prefix("$ ");
            if console && typed.is_none() {
                continue;
            }
            let mut whole = typed.unwrap_or(line).to_owned();
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
        for word in shell_words(&plain) {
            // `…` after an option is a value that is left to the reader.
            let is_value = words.last().is_some_and(|before| before.starts_with("--"));
            if word != "…" || is_value {
                words.push(word.trim_end_matches("...").to_owned());
            }
        }
        // Variables of the environment stand before the program.
        let from = words.iter().position(|word| !word.contains('='))?;
        let abridged = plain.split_whitespace().any(|word| word == "…");
        Some(Self { place, in_block, abridged, words: words.split_off(from) })
    }
}

/// Words as a shell splits them: white space within double quotes is part of a word, and `""` is an
/// empty one.
fn shell_words(text: &str) -> Vec<String> {
    let (mut words, mut word, mut quoted) = (Vec::new(), None::<String>, false);
    for letter in text.chars() {
        match letter {
            '"' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            letter if letter.is_whitespace() && !quoted => words.extend(word.take()),
            letter => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    words
}
