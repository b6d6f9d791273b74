//! Files and folders of one crate that import each other in a circle.
//!
//! Imports are read from the source text: `use` declarations, and paths that begin with `crate::`,
//! `super::`, `self::` or a child module. A name that is only re-exported counts as an import of
//! the file that defines it, so a `lib.rs` or `mod.rs` that declares and re-exports is in no
//! circle. Code under `#[cfg(test)]` is skipped. Methods and macros are not followed.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

/// Module path inside a crate; empty for `lib.rs` and `main.rs`.
type ModulePath = Vec<String>;

/// Circles of the crate whose sources are in `src`: the paths of each, relative to `src`.
pub fn circles(src: &Path) -> io::Result<Vec<Vec<String>>> {
    let mut files = Vec::new();
    for path in rust_files(src)? {
        let relative = path.strip_prefix(src).unwrap_or(&path).to_path_buf();
        files.push((relative, std::fs::read_to_string(&path)?));
    }
    Ok(circles_of(&files))
}

fn rust_files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let (mut folders, mut found) = (vec![folder.to_path_buf()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Circles among files, then among folders.
fn circles_of(files: &[(PathBuf, String)]) -> Vec<Vec<String>> {
    let modules = Modules::read(files);
    let names: Vec<String> = files.iter().map(|(path, _)| unix(path)).collect();
    let edges = modules.imports();
    let mut found: Vec<Vec<String>> = strongly_connected(files.len(), &edges)
        .into_iter()
        .map(|circle| circle.into_iter().map(|file| names[file].clone()).collect())
        .collect();
    found.extend(folder_circles(&names, &edges));
    found.iter_mut().for_each(|circle| circle.sort());
    found.sort();
    found
}

fn unix(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

/// Circles among the folders that lie side by side in one folder.
fn folder_circles(names: &[String], edges: &BTreeSet<(usize, usize)>) -> Vec<Vec<String>> {
    let folders: BTreeSet<String> = names
        .iter()
        .flat_map(|name| name.match_indices('/').map(|(at, _)| name[..at].to_string()))
        .collect();
    let folders: Vec<String> = folders.into_iter().collect();
    let mut imports = BTreeSet::new();
    for &(from, to) in edges {
        let (from, to) = (parts(&names[from]), parts(&names[to]));
        let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
        // Both go on into a folder below the last one that they share.
        let side = |of: &[String]| (of.len() > shared).then(|| of[..=shared].join("/"));
        if let (Some(from), Some(to)) = (side(&from), side(&to)) {
            let index = |of: &String| folders.iter().position(|folder| folder == of);
            if let (Some(from), Some(to)) = (index(&from), index(&to)) {
                imports.insert((from, to));
            }
        }
    }
    strongly_connected(folders.len(), &imports)
        .into_iter()
        .map(|circle| circle.into_iter().map(|folder| format!("{}/", folders[folder])).collect())
        .collect()
}

/// Folders that a file belongs to: `a/b.rs` beside `a/b/` belongs to it.
fn parts(name: &str) -> Vec<String> {
    let mut parts: Vec<String> =
        name.trim_end_matches(".rs").split('/').map(str::to_string).collect();
    if parts.last().is_some_and(|last| last == "mod") {
        parts.pop();
    }
    parts
}

/// Sets of more than one node that reach each other.
fn strongly_connected(nodes: usize, edges: &BTreeSet<(usize, usize)>) -> Vec<Vec<usize>> {
    let reached: Vec<BTreeSet<usize>> = (0..nodes)
        .map(|start| {
            let (mut open, mut seen) = (vec![start], BTreeSet::new());
            while let Some(node) = open.pop() {
                for &(_, next) in edges.range((node, 0)..(node + 1, 0)) {
                    if seen.insert(next) {
                        open.push(next);
                    }
                }
            }
            seen
        })
        .collect();
    let mut found: BTreeSet<Vec<usize>> = BTreeSet::new();
    for node in 0..nodes {
        let circle: Vec<usize> = (0..nodes)
            .filter(|&other| {
                other == node || (reached[node].contains(&other) && reached[other].contains(&node))
            })
            .collect();
        if circle.len() > 1 {
            found.insert(circle);
        }
    }
    found.into_iter().collect()
}

/// One source file.
struct Module {
    path: ModulePath,
    /// Every path that it names, absolute inside the crate; re-exports are not among them.
    imports: Vec<ModulePath>,
    /// Names that it imports or re-exports; `None` for those of other crates.
    aliases: BTreeMap<String, Option<ModulePath>>,
    /// Modules whose every name it makes known.
    globs: Vec<ModulePath>,
    /// Names of items that it defines.
    items: BTreeSet<String>,
    /// Every identifier in it; macros may define items of any name.
    words: BTreeSet<String>,
}

/// The files of a crate by their module paths.
struct Modules {
    modules: Vec<Module>,
    by_path: BTreeMap<ModulePath, usize>,
}

impl Modules {
    fn read(files: &[(PathBuf, String)]) -> Self {
        let texts: Vec<(ModulePath, Vec<Token>)> =
            files.iter().map(|(path, text)| (module_path(path), tokens(text))).collect();
        let mut tests = BTreeSet::new();
        for (path, tokens) in &texts {
            for name in test_modules(tokens) {
                tests.insert(child(path, &name));
            }
        }
        let is_test =
            |path: &ModulePath| tests.iter().any(|test: &ModulePath| path.starts_with(test));
        let children: BTreeSet<ModulePath> = texts.iter().map(|(path, _)| path.clone()).collect();
        let modules: Vec<Module> = texts
            .into_iter()
            .map(|(path, tokens)| {
                let tokens = if is_test(&path) { Vec::new() } else { without_tests(tokens) };
                Module::read(path, &tokens, &children)
            })
            .collect();
        let mut by_path = BTreeMap::new();
        for (index, module) in modules.iter().enumerate() {
            by_path.entry(module.path.clone()).or_insert(index);
        }
        Self { modules, by_path }
    }

    /// Pairs of files: the first imports the second.
    fn imports(&self) -> BTreeSet<(usize, usize)> {
        let mut edges = BTreeSet::new();
        for (from, module) in self.modules.iter().enumerate() {
            for path in &module.imports {
                if let Some(to) = self.definition(path, 0)
                    && to != from
                {
                    edges.insert((from, to));
                }
            }
        }
        edges
    }

    /// The file that defines what a path names.
    fn definition(&self, path: &[String], depth: usize) -> Option<usize> {
        /// Re-exports of re-exports; a name that leads back to itself ends here.
        const DEEPEST: usize = 16;
        let (len, index) = (0..=path.len())
            .rev()
            .find_map(|len| self.by_path.get(&path[..len]).map(|index| (len, *index)))?;
        let Some(name) = path.get(len) else {
            return Some(index);
        };
        let module = &self.modules[index];
        if module.items.contains(name) || depth > DEEPEST {
            return Some(index);
        }
        if let Some(alias) = module.aliases.get(name) {
            let mut target = alias.clone()?;
            target.extend_from_slice(&path[len + 1..]);
            return self.definition(&target, depth + 1);
        }
        for glob in &module.globs {
            let mut target = glob.clone();
            target.extend_from_slice(&path[len..]);
            if let Some(found) = self.definition(&target, depth + 1)
                && self.modules[found].words.contains(name)
            {
                return Some(found);
            }
        }
        Some(index)
    }
}

impl Module {
    fn read(path: ModulePath, tokens: &[Token], files: &BTreeSet<ModulePath>) -> Self {
        let mut module = Self {
            path,
            imports: Vec::new(),
            aliases: BTreeMap::new(),
            globs: Vec::new(),
            items: items(tokens),
            words: tokens.iter().filter(|token| is_name(token)).cloned().collect(),
        };
        // The path of an inline module, with the depth of braces at which it ends.
        let mut inline: Vec<(String, usize)> = Vec::new();
        let (mut depth, mut at) = (0_usize, 0);
        while at < tokens.len() {
            let here = |path: &ModulePath, inline: &[(String, usize)]| {
                let mut here = path.clone();
                here.extend(inline.iter().map(|(name, _)| name.clone()));
                here
            };
            match tokens[at].as_str() {
                "{" => depth += 1,
                "}" => {
                    depth = depth.saturating_sub(1);
                    inline.retain(|(_, ends)| *ends <= depth);
                }
                "mod" if tokens.get(at + 2).is_some_and(|token| token == "{") => {
                    depth += 1;
                    inline.push((tokens[at + 1].clone(), depth));
                    at += 2;
                }
                "use" => {
                    let is_public = is_public(tokens, at);
                    let end = tokens[at..].iter().position(|t| t == ";").map_or(at, |n| at + n);
                    let base = here(&module.path, &inline);
                    for (path, name) in used(&tokens[at + 1..end]) {
                        module.take_use(&base, files, path, name, is_public);
                    }
                    at = end;
                }
                first if starts_path(tokens, at) => {
                    let base = here(&module.path, &inline);
                    let is_child = files.contains(&child(&base, first));
                    if is_child || matches!(first, "crate" | "super" | "self") {
                        let (path, end) = path_at(tokens, at);
                        if let Some(path) = absolute(&base, files, &path) {
                            module.imports.push(path);
                        }
                        at = end;
                    }
                }
                _ => {}
            }
            at += 1;
        }
        module
    }

    /// Takes in one name of a `use` declaration.
    fn take_use(
        &mut self,
        base: &ModulePath,
        files: &BTreeSet<ModulePath>,
        path: Vec<String>,
        name: String,
        is_public: bool,
    ) {
        let path = absolute(base, files, &path);
        if name != "*" {
            self.aliases.insert(name, path.clone());
        } else if let Some(path) = &path {
            self.globs.push(path.clone());
        }
        if let Some(path) = path
            && !(is_public && path.starts_with(&self.path))
        {
            self.imports.push(path);
        }
    }
}

/// The module that a file is.
fn module_path(file: &Path) -> ModulePath {
    let mut path = parts(&unix(file));
    if path.len() == 1 && (path[0] == "lib" || path[0] == "main") {
        path.clear();
    }
    path
}

fn child(path: &ModulePath, name: &str) -> ModulePath {
    let mut path = path.clone();
    path.push(name.to_string());
    path
}

/// A path as written, from the root of the crate; `None` if it leads into another crate.
fn absolute(
    base: &ModulePath,
    files: &BTreeSet<ModulePath>,
    path: &[String],
) -> Option<ModulePath> {
    let (first, mut rest) = path.split_first()?;
    let mut found = match first.as_str() {
        "crate" => Vec::new(),
        "self" => base.clone(),
        "super" => base[..base.len().checked_sub(1)?].to_vec(),
        name if files.contains(&child(base, name)) => child(base, name),
        _ => return None,
    };
    while let Some(("super", more)) = rest.split_first().map(|(next, more)| (next.as_str(), more)) {
        found.pop()?;
        rest = more;
    }
    found.extend_from_slice(rest);
    Some(found)
}

/// Every path of a `use` declaration with the name that it gets; `*` for all names of a module.
fn used(tokens: &[Token]) -> Vec<(Vec<String>, String)> {
    let mut found = Vec::new();
    let mut prefix: Vec<String> = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        match tokens[at].as_str() {
            "::" => at += 1,
            "{" => {
                let (mut depth, mut from) = (0, at + 1);
                for (index, token) in tokens.iter().enumerate().skip(at) {
                    match token.as_str() {
                        "{" => depth += 1,
                        "}" => depth -= 1,
                        _ => {}
                    }
                    let ends = depth == 0;
                    if ends || (depth == 1 && token == ",") {
                        for (path, name) in used(&tokens[from..index]) {
                            let mut whole = prefix.clone();
                            // `a::{self}` is `a`.
                            let is_self = path.len() == 1 && path[0] == "self";
                            if !is_self || whole.is_empty() {
                                whole.extend(path);
                            }
                            let name = match (name.as_str(), whole.last()) {
                                ("self", Some(last)) => last.clone(),
                                _ => name,
                            };
                            found.push((whole, name));
                        }
                        from = index + 1;
                    }
                    if ends {
                        return found;
                    }
                }
                return found;
            }
            "*" => {
                found.push((prefix, "*".to_string()));
                return found;
            }
            "as" => {
                let name = tokens.get(at + 1).cloned().unwrap_or_default();
                found.push((prefix, name));
                return found;
            }
            name => {
                prefix.push(name.to_string());
                at += 1;
            }
        }
    }
    if let Some(last) = prefix.last().cloned() {
        found.push((prefix, last));
    }
    found
}

/// A path begins here, and is not the middle of one.
fn starts_path(tokens: &[Token], at: usize) -> bool {
    is_name(&tokens[at])
        && tokens.get(at + 1).is_some_and(|token| token == "::")
        && (at == 0 || (tokens[at - 1] != "::" && tokens[at - 1] != "."))
}

/// The path that begins here, and its last token.
fn path_at(tokens: &[Token], mut at: usize) -> (Vec<String>, usize) {
    let mut path = vec![tokens[at].clone()];
    while tokens.get(at + 1).is_some_and(|token| token == "::")
        && tokens.get(at + 2).is_some_and(|token| is_name(token))
    {
        path.push(tokens[at + 2].clone());
        at += 2;
    }
    (path, at)
}

/// `pub` or `pub(…)` stands before the token.
fn is_public(tokens: &[Token], at: usize) -> bool {
    let before = tokens[..at].iter().rev().take_while(|token| !matches!(token.as_str(), ";" | "}"));
    before.take(6).any(|token| token == "pub")
}

/// Names that are defined in a file, at whatever depth.
fn items(tokens: &[Token]) -> BTreeSet<String> {
    const KEYWORDS: [&str; 9] =
        ["fn", "struct", "enum", "trait", "type", "const", "static", "union", "macro_rules"];
    let mut found = BTreeSet::new();
    for (at, token) in tokens.iter().enumerate() {
        if !KEYWORDS.contains(&token.as_str()) {
            continue;
        }
        let name = tokens[at + 1..].iter().find(|token| !matches!(token.as_str(), "!" | "mut"));
        found.extend(name.filter(|name| is_name(name)).cloned());
    }
    found
}

/// An identifier, a keyword, or a mark such as `{` and `::`.
type Token = String;

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Tokens of a source text, without comments, strings and characters.
fn tokens(text: &str) -> Vec<Token> {
    let text: Vec<char> = text.chars().collect();
    let at_is =
        |at: usize, what: &str| what.chars().zip(at..).all(|(c, i)| text.get(i) == Some(&c));
    let (mut tokens, mut at) = (Vec::new(), 0);
    while let Some(&c) = text.get(at) {
        if at_is(at, "//") {
            while text.get(at).is_some_and(|&c| c != '\n') {
                at += 1;
            }
        } else if at_is(at, "/*") {
            let mut depth = 0;
            loop {
                if at_is(at, "/*") {
                    (depth, at) = (depth + 1, at + 2);
                } else if at_is(at, "*/") {
                    (depth, at) = (depth - 1, at + 2);
                } else {
                    at += 1;
                }
                if depth == 0 || at >= text.len() {
                    break;
                }
            }
        } else if let Some(end) = raw_string_end(&text, at) {
            at = end;
        } else if c == '"' {
            at += 1;
            while text.get(at).is_some_and(|&c| c != '"') {
                at += if text[at] == '\\' { 2 } else { 1 };
            }
            at += 1;
        } else if c == '\'' && (at_is(at + 1, "\\") || text.get(at + 2) == Some(&'\'')) {
            // A character; a lifetime has no second quote.
            at += if at_is(at + 1, "\\") { 3 } else { 2 };
            while text.get(at).is_some_and(|&c| c != '\'') {
                at += 1;
            }
            at += 1;
        } else if c.is_alphanumeric() || c == '_' {
            let from = at;
            while text.get(at).is_some_and(|&c| c.is_alphanumeric() || c == '_') {
                at += 1;
            }
            tokens.push(text[from..at].iter().collect());
        } else if at_is(at, "::") {
            tokens.push("::".to_string());
            at += 2;
        } else {
            if !c.is_whitespace() {
                tokens.push(c.to_string());
            }
            at += 1;
        }
    }
    tokens
}

/// The end of a raw string that begins here.
fn raw_string_end(text: &[char], at: usize) -> Option<usize> {
    let prefix = usize::from(text.get(at) == Some(&'b'));
    if text.get(at + prefix) != Some(&'r') || (at > 0 && text[at - 1].is_alphanumeric()) {
        return None;
    }
    let from = at + prefix + 1;
    let hashes = text[from..].iter().take_while(|&&c| c == '#').count();
    if text.get(from + hashes) != Some(&'"') {
        return None;
    }
    let ends = |end: usize| {
        text[end] == '"'
            && text[end + 1..].iter().take(hashes).filter(|&&c| c == '#').count() == hashes
    };
    (from + hashes + 1..text.len()).find(|&end| ends(end)).map(|end| end + 1 + hashes)
}

/// From the `#` of an attribute that holds only in tests to the token after it.
fn test_attribute_end(tokens: &[Token], at: usize) -> Option<usize> {
    if tokens.get(at)? != "#" || tokens.get(at + 1)? != "[" {
        return None;
    }
    let end = at + tokens[at..].iter().position(|token| token == "]")?;
    let attribute = &tokens[at + 2..end];
    let has = |name: &str| attribute.iter().any(|token| token == name);
    let is_test = attribute.first()? == "cfg" && has("test") && !has("not") && !has("any");
    is_test.then_some(end + 1)
}

/// Modules in files of their own that are declared for tests only.
fn test_modules(tokens: &[Token]) -> Vec<String> {
    let mut found = Vec::new();
    for at in 0..tokens.len() {
        let Some(after) = test_attribute_end(tokens, at) else { continue };
        let mut rest = tokens[after..].iter().skip_while(|token| *token != "mod");
        if let (Some(_), Some(name), Some(";")) =
            (rest.next(), rest.next(), rest.next().map(String::as_str))
            && tokens[after..].iter().take_while(|token| *token != "mod").count() < 8
        {
            found.push(name.clone());
        }
    }
    found
}

/// Tokens without the items that exist in tests only.
fn without_tests(tokens: Vec<Token>) -> Vec<Token> {
    let (mut kept, mut at) = (Vec::new(), 0);
    while at < tokens.len() {
        let Some(mut end) = test_attribute_end(&tokens, at) else {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        };
        // To the end of the item: its semicolon, or the brace that closes its body.
        let mut depth = 0_usize;
        while let Some(token) = tokens.get(end) {
            match token.as_str() {
                "{" | "(" | "[" => depth += 1,
                "}" | ")" | "]" => depth = depth.saturating_sub(1),
                _ => {}
            }
            end += 1;
            if depth == 0 && matches!(token.as_str(), ";" | "}") {
                break;
            }
        }
        at = end;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> Vec<Vec<String>> {
        let files: Vec<_> =
            files.iter().map(|(path, text)| (PathBuf::from(path), text.to_string())).collect();
        circles_of(&files)
    }

    #[test]
    fn two_files_that_import_each_other_are_a_circle() {
        let lib = ("lib.rs", "mod a; mod b; mod c;");
        let a = ("a.rs", "use crate::b::B; pub struct A;");
        let b = ("b.rs", "pub struct B; fn f(_: super::a::A) {}");
        let c = ("c.rs", "use crate::{a::A, b};");
        assert_eq!(found(&[lib, a, b, c]), [["a.rs", "b.rs"]]);
        let b = ("b.rs", "pub struct B;");
        assert!(found(&[lib, a, b, c]).is_empty());
    }

    #[test]
    fn a_name_leads_to_the_file_that_defines_it() {
        let lib = ("lib.rs", "mod a; mod b; pub use other::Real; pub use a::*;");
        let a = ("a.rs", "use crate::b::B; use other::Real; pub struct A(Real);");
        let b = ("b.rs", "use crate::Real; pub struct B(Real);");
        assert!(found(&[lib, a, b]).is_empty(), "a name of another crate");
        let lib = ("lib.rs", "mod a; mod b; pub use a::*; pub use b::{self, B as Renamed};");
        let a = ("a.rs", "use crate::Renamed; pub struct A;");
        let b = ("b.rs", "use crate::A; pub struct B;");
        assert_eq!(found(&[lib, a, b]), [["a.rs", "b.rs"]], "by re-exports and a glob");
        let b = ("b.rs", "pub struct B;");
        assert!(found(&[lib, a, b]).is_empty(), "what re-exports is in no circle");
    }

    #[test]
    fn a_parent_that_does_more_than_declare_can_be_in_one() {
        let parent = ("a/mod.rs", "mod b; pub const N: usize = 1; fn f() { b::g() }");
        let child = ("a/b.rs", "pub fn g() -> usize { super::N }");
        assert_eq!(found(&[("lib.rs", "mod a;"), parent, child]), [["a/b.rs", "a/mod.rs"]]);
        let parent = ("a/mod.rs", "mod b; pub use b::g; pub const N: usize = 1;");
        assert!(found(&[("lib.rs", "mod a;"), parent, child]).is_empty());
    }

    #[test]
    fn folders_can_be_in_a_circle_where_no_file_is() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "mod low; mod high;"),
            ("a/low.rs", "pub struct Low;"),
            ("a/high.rs", "use crate::b::Middle;"),
            ("b/mod.rs", "mod middle; pub use middle::Middle;"),
            ("b/middle.rs", "use crate::a::low::Low; pub struct Middle(Low);"),
        ];
        assert_eq!(found(&files), [["a/", "b/"]]);
    }

    #[test]
    fn tests_comments_and_strings_do_not_count() {
        let a = (
            "a.rs",
            "//! `crate::b::B`\n/* crate::b::B */ const TEXT: &str = \"crate::b::B\"; const C: char = '\"';\n\
             const RAW: &str = r#\"\" crate::b::B\"#; #[cfg(test)] use crate::b::B;\n\
             #[cfg(test)] mod tests { use crate::b::B; } #[cfg(test)] mod more; pub struct A<'a>(&'a u8);",
        );
        let files = [
            ("lib.rs", "mod a; mod b;"),
            a,
            ("a/more.rs", "use crate::b::B;"),
            ("b.rs", "use crate::a::A; pub struct B;"),
        ];
        assert!(found(&files).is_empty(), "{:?}", found(&files));
    }

    #[test]
    fn nested_groups_and_supers_are_resolved() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a/mod.rs", "pub mod c; pub mod d;"),
            ("a/c.rs", "use super::super::b::{x::{Y, Z}, self as bee};"),
            ("a/d.rs", "pub struct D;"),
            ("b.rs", "pub mod x;"),
            ("b/x.rs", "use crate::a::{d::D, c::{self}}; pub struct Y; pub struct Z;"),
        ];
        assert_eq!(found(&files), [vec!["a/", "b/"], vec!["a/c.rs", "b/x.rs"]]);
    }
}
