//! Debian's packages: which mirror this machine takes them from, and installing them.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, bail};

use crate::consent::{Consent, is_root};
use crate::shell::{command, output};

/// Debian's release without a right emulator of its own, and the suite that has one.
const RELEASE: &str = "bookworm";
const BACKPORTS: &str = "bookworm-backports";
/// What this program adds to apt's sources.
const ADDED: &str = "/etc/apt/sources.list.d/cathforce-backports.list";
/// apt's sources, of both formats.
const SOURCES: &str = "/etc/apt/sources.list";
const SOURCES_FOLDER: &str = "/etc/apt/sources.list.d";

/// Whether this machine runs the release that needs backports.
pub fn is_bookworm() -> bool {
    let release = std::fs::read_to_string("/etc/os-release").unwrap_or_default();
    release.lines().any(|line| line == format!("VERSION_CODENAME={RELEASE}"))
}

/// A script that installs packages from backports.
pub fn install_from_backports(packages: &str) -> anyhow::Result<String> {
    let sources = sources();
    let has_backports = sources.iter().any(|source| source.suites.iter().any(|s| s == BACKPORTS));
    let add = match has_backports {
        true => String::new(),
        false => format!("echo '{}' > {ADDED} && ", backports(&sources)?),
    };
    Ok(format!(
        "{add}apt-get update && apt-get install -y --no-install-recommends -t {BACKPORTS} {packages}"
    ))
}

/// The line that adds backports, from the mirror that the release itself comes from.
fn backports(sources: &[Source]) -> anyhow::Result<String> {
    let of_release = |source: &&Source| source.suites.iter().any(|suite| suite == RELEASE);
    let Some(source) = sources.iter().find(of_release) else {
        bail!(
            "apt's sources name no mirror of Debian {RELEASE}, so I cannot tell where its backports \
             are. Add them yourself, then try again:\n  \
             echo 'deb MIRROR {BACKPORTS} main' | sudo tee {ADDED}"
        );
    };
    let signed = source.signed_by.as_ref().filter(|key| key.starts_with('/'));
    let signed = signed.map_or(String::new(), |key| format!("[signed-by={key}] "));
    Ok(format!("deb {signed}{} {BACKPORTS} main", source.mirror))
}

/// A place that apt fetches packages from.
#[derive(Debug, PartialEq)]
struct Source {
    mirror: String,
    suites: Vec<String>,
    /// File of the key that signs it.
    signed_by: Option<String>,
}

/// apt's sources on this machine.
fn sources() -> Vec<Source> {
    let folder = std::fs::read_dir(SOURCES_FOLDER).into_iter().flatten();
    let mut files: Vec<_> = folder.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    files.insert(0, SOURCES.into());
    files.iter().flat_map(|file| read(file)).collect()
}

fn read(file: &Path) -> Vec<Source> {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    match file.extension().and_then(|ending| ending.to_str()) {
        Some("sources") => of_paragraphs(&text),
        Some("list") => of_lines(&text),
        _ => Vec::new(),
    }
}

/// `deb [signed-by=KEY] MIRROR SUITE COMPONENTS`, a line each.
fn of_lines(text: &str) -> Vec<Source> {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    lines.filter_map(of_line).collect()
}

fn of_line(line: &str) -> Option<Source> {
    let rest = line.trim().strip_prefix("deb")?;
    let rest = rest.strip_prefix([' ', '\t'])?.trim_start();
    let (options, rest) = match rest.strip_prefix('[') {
        Some(rest) => rest.split_once(']')?,
        None => ("", rest),
    };
    let mut words = rest.split_whitespace().map(str::to_owned);
    let signed_by = options.split_whitespace().find_map(|word| word.strip_prefix("signed-by="));
    Some(Source {
        mirror: words.next()?,
        suites: vec![words.next()?],
        signed_by: signed_by.map(str::to_owned),
    })
}

/// Paragraphs of `Field: value`, each one or several sources (deb822).
fn of_paragraphs(text: &str) -> Vec<Source> {
    let mut found = Vec::new();
    let lines: Vec<_> = text.lines().filter(|line| !line.starts_with('#')).collect();
    for paragraph in lines.split(|line| line.trim().is_empty()) {
        let field = |name: &str| -> Vec<String> {
            let mut words = Vec::new();
            let mut is_in = false;
            for line in paragraph {
                // A line that begins with a space goes on with the field before.
                let value = match line.split_once(':') {
                    Some((key, value)) if !line.starts_with([' ', '\t']) => {
                        is_in = key.trim().eq_ignore_ascii_case(name);
                        value
                    }
                    _ => line,
                };
                words.extend(value.split_whitespace().filter(|_| is_in).map(str::to_owned));
            }
            words
        };
        let is_on = !field("Enabled").iter().any(|word| word.eq_ignore_ascii_case("no"));
        if !is_on || !field("Types").iter().any(|word| word == "deb") {
            continue;
        }
        for mirror in field("URIs") {
            let signed_by = field("Signed-By").into_iter().next();
            found.push(Source { mirror, suites: field("Suites"), signed_by });
        }
    }
    found
}

/// Whether a Debian package is installed.
pub fn is_installed(package: &str) -> bool {
    output(command("dpkg-query").args(["-W", package])).is_some()
}

/// Whether this machine has apt.
pub fn has_apt() -> bool {
    output(command("apt-get").arg("--version")).is_some()
}

/// A command that runs a shell script as root, if that is allowed.
pub fn as_root(consent: Consent, script: &str) -> anyhow::Result<Command> {
    let words = match is_root() {
        true => vec!["sh", "-c", script],
        false => vec!["sudo", "sh", "-c", script],
    };
    consent.to(&format!("{} \"{script}\"", words[..words.len() - 1].join(" ")))?;
    let (program, arguments) = words.split_first().context("a program")?;
    let mut command = command(program);
    command.args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
    Ok(command)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(mirror: &str, suites: &[&str], signed_by: Option<&str>) -> Source {
        Source {
            mirror: mirror.into(),
            suites: suites.iter().map(|&suite| suite.into()).collect(),
            signed_by: signed_by.map(str::to_owned),
        }
    }

    #[test]
    fn lines_of_a_list_are_read() {
        let text = "# deb http://commented.example/debian bookworm main\n\
                    deb-src http://a.example/debian bookworm main\n\
                    deb http://a.example/debian bookworm main contrib # the mirror\n\
                    deb [arch=amd64 signed-by=/keys/b.gpg] https://b.example/debian\tbookworm-security main\n\
                    nonsense\n";
        let expected = [
            source("http://a.example/debian", &["bookworm"], None),
            source("https://b.example/debian", &["bookworm-security"], Some("/keys/b.gpg")),
        ];
        assert_eq!(of_lines(text), expected);
    }

    #[test]
    fn paragraphs_of_deb822_are_read() {
        let text = "Types: deb deb-src\n# a snapshot\nURIs: http://a.example/debian\n \
                    http://c.example/debian\nSuites: bookworm bookworm-updates\nComponents: main\n\
                    Signed-By: /keys/a.gpg\n\n\nTypes: deb-src\nURIs: http://s.example\n\
                    Suites: bookworm\n\nEnabled: no\nTypes: deb\nURIs: http://off.example\nSuites: bookworm\n";
        let suites = ["bookworm", "bookworm-updates"];
        let expected = [
            source("http://a.example/debian", &suites, Some("/keys/a.gpg")),
            source("http://c.example/debian", &suites, Some("/keys/a.gpg")),
        ];
        assert_eq!(of_paragraphs(text), expected);
    }

    #[test]
    fn backports_come_from_the_mirror_of_the_release() {
        let sources = [
            source("https://other.example/", &["nodistro"], None),
            source("http://m.example/debian", &["bookworm", "bookworm-updates"], Some("/k.gpg")),
        ];
        let line = "deb [signed-by=/k.gpg] http://m.example/debian bookworm-backports main";
        assert_eq!(backports(&sources).unwrap(), line);
    }

    #[test]
    fn without_a_mirror_the_line_to_run_is_told() {
        let error = backports(&[source("https://x.example", &["trixie"], None)]).unwrap_err();
        assert!(error.to_string().contains("sudo tee"), "{error}");
    }
}
