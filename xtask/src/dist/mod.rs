//! `cargo xtask dist`: everything to install, in one folder.
//!
//! The folder has the shape of `/usr`: the program finds its firmware in `../lib/cathforce`, wherever the
//! folder is put. Every build of the same source has the same bits; `--check` builds it twice, from two
//! folders with different paths, and compares.

pub mod boards;
mod debian;
mod files;
mod installed;
mod licences;
mod sbom;
pub mod sources;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};
use serde_json::Value;

use crate::arguments::{Choice, Given};
use crate::build;
use crate::consent::{self, Consent};
use crate::setup;
use crate::shell::{cargo, command, line, output, root, run, target_folder};
use boards::{BOARDS, Board};
use sources::Build;

pub const OPTIONS: [Choice; 5] = [
    Choice {
        name: "out",
        value: Some("DIR"),
        about: "New folder for everything; `target/dist/cathforce` if not given, which is replaced.",
    },
    Choice {
        name: "check",
        value: None,
        about: "Build it a second time, from a copy of the checkout elsewhere, and compare every bit.",
    },
    Choice {
        name: "quick",
        value: None,
        about: "Build the program as for `cargo xtask demo`, but whole: to try this in less time.",
    },
    Choice { name: "no-demo", value: None, about: "Do not run the demo from what was built." },
    consent::YES,
];

/// The program is linked against musl, statically: it runs on every Linux of this architecture.
const HOST: &str = "x86_64-unknown-linux-musl";
/// Tells the crates that they are built to be installed, and know no checkout.
const DIST_VARIABLE: &str = "CATHFORCE_DIST";
const EXAMPLE: &str = "examples/tapered-none";
/// Where cargo leaves a firmware, in its target folder.
const ELF: &str = "thumbv7em-none-eabihf/firmware/cathforce-firmware";

pub fn run_task(given: &Given) -> anyhow::Result<()> {
    let consent = Consent::of(given);
    let own = target_folder().join("dist/cathforce");
    let out = match given.path("out")? {
        None => {
            if own.exists() {
                fs::remove_dir_all(&own)?;
            }
            own
        }
        Some(out) if fs::read_dir(&out).is_ok_and(|mut entries| entries.next().is_some()) => {
            bail!(
                "{} is not empty, and nothing in it is touched\n  fix: name a new folder",
                out.display()
            )
        }
        Some(out) => out,
    };
    setup::targets(consent, &[build::TARGET, HOST])?;
    let epoch = epoch()?;
    let profile = if given.has("quick") { build::QUICK } else { "release" };
    let target = target_folder().join("dist/build");
    let source = Source { root: root().to_owned(), target, profile };
    make(&source, &out, epoch)?;
    if given.has("check") {
        check(&out, epoch, profile)?;
    }
    let report = installed::check(&out, !given.has("no-demo"))?;
    println!("{report}");
    println!("{}: {} files", out.display(), files::list(&out)?.len());
    Ok(())
}

/// A checkout, and where it is built.
struct Source {
    root: PathBuf,
    target: PathBuf,
    /// Cargo's profile of the program.
    profile: &'static str,
}

/// Builds everything into `out`.
fn make(source: &Source, out: &Path, epoch: u64) -> anyhow::Result<()> {
    fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    let scratch = source.target.join("scratch");
    if scratch.exists() {
        fs::remove_dir_all(&scratch)?;
    }
    fs::create_dir_all(&scratch)?;
    run(&mut source.host_build()?)?;
    let program = out.join("bin/cathforce");
    files::copy(&source.target.join(HOST).join(source.profile).join("cathforce"), &program)?;
    let versions = Versions::of(&program)?;
    for board in &BOARDS {
        run(&mut source.firmware_build(board)?)?;
        // The next board's ELF has the same name; this one is copied before.
        firmware(board, &source.target.join(ELF), out, &program, &versions)?;
    }
    share(&source.root, out, &program)?;
    let program_build = Build { package: "cathforce", target: HOST, features: &[] };
    let mut linked = sources::behind(&source.root, &program_build)?;
    let bill = |name: &str, package: &str, packages: &[sources::Package]| {
        let text = serde_json::to_string_pretty(&sbom::bill(package, packages))? + "\n";
        fs::write(out.join(format!("{name}.cdx.json")), text).context("the bill of materials")
    };
    bill("cathforce", "cathforce", &linked)?;
    for board in &BOARDS {
        let firmware = sources::behind(&source.root, &board.build())?;
        bill(&format!("cathforce-firmware-{}", board.name), "cathforce-firmware", &firmware)?;
        sources::merge(&mut linked, firmware);
    }
    let documents = out.join("share/doc/cathforce");
    fs::write(documents.join("THIRD-PARTY.txt"), licences::texts(&linked)?)?;
    debian::package(out, &versions.version, epoch, &scratch)?;
    sums(out)
}

impl Source {
    /// Cargo in this checkout, with the same bits wherever it lies.
    fn cargo(&self, rustflags_of: &str) -> anyhow::Result<Command> {
        let mut command = cargo(&["--config"]);
        let home = match std::env::var_os("CARGO_HOME") {
            Some(home) => PathBuf::from(home),
            None => {
                PathBuf::from(std::env::var_os("HOME").context("there is no HOME")?).join(".cargo")
            }
        };
        let remap = |from: &Path, to: &str| format!("--remap-path-prefix={}={to}", from.display());
        // The last one that fits is taken: what build scripts generate lies beside the checkout in one build, and
        // inside it in the other.
        let flags = [
            remap(&self.root, "/cathforce"),
            remap(&home, "/cargo"),
            remap(&self.target, "/build"),
        ];
        // They are added to those of .cargo/config.toml; flags from outside would replace both.
        command.arg(format!("target.{rustflags_of}.rustflags={flags:?}"));
        command.current_dir(&self.root).env_remove("RUSTFLAGS").env_remove(build::ID_BASE);
        // Of the code in it, which is assembler, and takes no library.
        command.env(format!("CC_{}", HOST.replace('-', "_")), "cc");
        command.env(DIST_VARIABLE, "1").env("CARGO_TARGET_DIR", &self.target);
        Ok(command)
    }

    fn host_build(&self) -> anyhow::Result<Command> {
        let mut build = self.cargo(HOST)?;
        build.arg("--config").arg(format!("profile.{}.strip=true", self.profile));
        build.args(["build", "--locked", "--profile", self.profile]);
        build.args(["--package", "cathforce", "--target", HOST]);
        Ok(build)
    }

    fn firmware_build(&self, board: &Board) -> anyhow::Result<Command> {
        let mut build = self.cargo(build::TARGET)?;
        build.args(["build", "--locked"]).args(build::FIRMWARE).args(board.features);
        Ok(build)
    }
}

/// What program and firmware must agree on, as the program says it.
struct Versions {
    version: String,
    protocol: String,
    image_schema: String,
}

impl Versions {
    fn of(program: &Path) -> anyhow::Result<Self> {
        let text = output(command(program).arg("--version"))
            .with_context(|| format!("`{} --version` failed", program.display()))?;
        let after = |begin: &str| {
            let found = text.lines().find_map(|line| line.strip_prefix(begin));
            found
                .map(str::to_owned)
                .with_context(|| format!("`--version` says no `{begin}`: {text}"))
        };
        Ok(Self {
            version: after("cathforce ")?,
            protocol: after("protocol ")?,
            image_schema: after("image schema ")?,
        })
    }
}

/// ELF and Intel hex of a board. The ELF keeps its symbols and the texts of its log, and says in a
/// section of its own for which board it is (host/link/src/identity.rs).
fn firmware(
    board: &Board,
    built: &Path,
    out: &Path,
    program: &Path,
    versions: &Versions,
) -> anyhow::Result<()> {
    let objcopy = build::tool("llvm-objcopy").context("rustc names no folder of its own")?;
    let elf = out.join(board.file()).with_extension("elf");
    fs::create_dir_all(elf.parent().context("it lies in a folder")?)?;
    run(command(&objcopy).arg("--strip-debug").arg(built).arg(&elf))?;
    let said = output(command(program).args(["info", "--json"]).arg(&elf));
    let said: Value =
        serde_json::from_str(&said.context("`cathforce info` of the firmware failed")?)?;
    let build = said["build"].as_str().context("`cathforce info` says no build")?;
    let Versions { version, protocol, image_schema } = versions;
    let text = format!(
        "board={}\nversion={version}\nbuild={build}\nprotocol={protocol}\nimage-schema={image_schema}\n",
        board.name
    );
    let identity = elf.with_extension("identity");
    fs::write(&identity, text)?;
    let section = format!("--add-section=.cathforce={}", identity.display());
    run(command(&objcopy).arg(section).arg(&elf))?;
    fs::remove_file(identity)?;
    run(command(&objcopy).args(["-O", "ihex"]).arg(&elf).arg(elf.with_extension("hex")))
}

/// What is neither program nor firmware.
fn share(root: &Path, out: &Path, program: &Path) -> anyhow::Result<()> {
    let share = out.join("share");
    let own = share.join("cathforce");
    files::copy(&root.join("docs/cathforce.dbc"), &own.join("cathforce.dbc"))?;
    files::copy(&root.join("docs/layouts"), &own.join("layouts"))?;
    files::copy(&root.join(EXAMPLE), &own.join(EXAMPLE))?;
    let documents = share.join("doc/cathforce");
    for name in ["LICENSE-MIT", "LICENSE-APACHE", "CHANGELOG.md"] {
        files::copy(&root.join(name), &documents.join(name))?;
    }
    fs::write(
        documents.join("copyright"),
        "The Cathforce authors. Licensed under MIT or Apache-2.0, as you choose: LICENSE-MIT and\n\
         LICENSE-APACHE beside this file. THIRD-PARTY.txt has the licences of the packages of others.\n",
    )?;
    // Where each shell looks for them below /usr/share.
    let shells = [
        ("bash", "bash-completion/completions/cathforce"),
        ("zsh", "zsh/vendor-completions/_cathforce"),
        ("fish", "fish/vendor_completions.d/cathforce.fish"),
    ];
    for (shell, place) in shells {
        let script = output(command(program).args(["completions", shell]));
        let path = share.join(place);
        fs::create_dir_all(path.parent().context("it lies in a folder")?)?;
        fs::write(
            path,
            script.with_context(|| format!("`cathforce completions {shell}` failed"))?,
        )?;
    }
    run(command(program).args(["--quiet", "man"]).arg(share.join("man/man1")))
}

/// SHA256SUMS of every file, as `sha256sum --check` reads it.
fn sums(out: &Path) -> anyhow::Result<()> {
    let mut sha = command("sha256sum");
    sha.current_dir(out);
    for file in files::list(out)? {
        sha.arg(file.strip_prefix(out)?);
    }
    let text = output(&mut sha).context("`sha256sum` of coreutils failed")?;
    Ok(fs::write(out.join("SHA256SUMS"), text)?)
}

/// The time of the source: of its last commit, unless SOURCE_DATE_EPOCH gives another one.
fn epoch() -> anyhow::Result<u64> {
    let given = std::env::var("SOURCE_DATE_EPOCH").ok();
    let commit = || output(command("git").args(["log", "-1", "--format=%ct"]));
    let text = given.or_else(commit).context(
        "the time of the source is not known, because this is no git checkout\n  fix: set \
         SOURCE_DATE_EPOCH to seconds since 1970",
    )?;
    text.trim().parse().with_context(|| format!("`{}` is no number of seconds", text.trim()))
}

/// Builds it again from a copy of the files that git knows, below another path and into another folder,
/// and compares every file.
fn check(out: &Path, epoch: u64, profile: &'static str) -> anyhow::Result<()> {
    let place = target_folder().join("dist/another-checkout-at-a-longer-path");
    if place.exists() {
        fs::remove_dir_all(&place)?;
    }
    let copy = place.join("source");
    let mut list = command("git");
    list.args(["ls-files", "--cached", "--others", "--exclude-standard"]);
    let names = output(&mut list).with_context(|| format!("`{}` failed", line(&list)))?;
    for name in names.lines().filter(|name| root().join(name).is_file()) {
        files::copy(&root().join(name), &copy.join(name))?;
    }
    let again = place.join("out");
    make(&Source { root: copy, target: place.join("build"), profile }, &again, epoch)?;
    let differences = files::differences(out, &again)?;
    if !differences.is_empty() {
        bail!("two builds of one source differ:\n  {}", differences.join("\n  "));
    }
    println!("\nbuilt twice, from two folders: {} files, equal bits", files::list(out)?.len());
    Ok(fs::remove_dir_all(place)?)
}
