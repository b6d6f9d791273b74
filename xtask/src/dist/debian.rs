//! The Debian package, made by `dpkg-deb`.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::files;
use crate::shell::{command, output, run};

/// Static programs of this architecture.
const ARCHITECTURE: &str = "amd64";

/// Makes the package from what lies in `dist`; gives its path.
///
/// `SOURCE_DATE_EPOCH` is the time of every file in it, and nobody's account owns one.
pub fn package(dist: &Path, version: &str, epoch: u64, scratch: &Path) -> anyhow::Result<PathBuf> {
    let tree = scratch.join("debian");
    let usr = tree.join("usr");
    for folder in ["bin", "lib", "share"] {
        files::copy(&dist.join(folder), &usr.join(folder))?;
    }
    let control = tree.join("DEBIAN");
    fs::create_dir_all(&control)?;
    let sizes: u64 = files::list(&usr)?
        .iter()
        .map(|file| Ok(file.metadata()?.len()))
        .sum::<anyhow::Result<_>>()?;
    fs::write(control.join("control"), text(version, sizes.div_ceil(1024)))?;
    fs::write(control.join("md5sums"), sums(&tree, &usr)?)?;
    modes(&tree)?;
    let file = dist.join(format!("cathforce_{version}_{ARCHITECTURE}.deb"));
    // One thread: the parts of a compressed file depend on their number.
    let build = ["--root-owner-group", "-Zxz", "--threads-max=1", "--build"];
    let mut dpkg = command("dpkg-deb");
    dpkg.args(build).arg(&tree).arg(&file).env("SOURCE_DATE_EPOCH", epoch.to_string());
    run(&mut dpkg).context("the package is made by dpkg-deb of Debian's package dpkg")?;
    fs::remove_dir_all(tree)?;
    Ok(file)
}

fn text(version: &str, kib: u64) -> String {
    format!(
        "Package: cathforce\n\
         Version: {version}\n\
         Architecture: {ARCHITECTURE}\n\
         Maintainer: The Cathforce authors <cathforce@localhost>\n\
         Section: science\n\
         Priority: optional\n\
         Installed-Size: {kib}\n\
         Suggests: qemu-system-arm (>= 1:10), can-utils\n\
         Description: forces between a catheter and its vessel, from motor encoders\n \
         Estimates in real time the forces between a catheter and the vessel from the\n \
         encoders of the robot that drives it. This package holds the program, which\n \
         needs no libraries, and the firmware of each board.\n"
    )
}

/// What `dpkg --verify` compares.
fn sums(tree: &Path, usr: &Path) -> anyhow::Result<String> {
    let mut md5 = command("md5sum");
    md5.current_dir(tree);
    for file in files::list(usr)? {
        md5.arg(file.strip_prefix(tree)?);
    }
    output(&mut md5).context("`md5sum` failed")
}

/// The modes of a package, whatever the mask of who makes it.
fn modes(folder: &Path) -> anyhow::Result<()> {
    fs::set_permissions(folder, fs::Permissions::from_mode(0o755))?;
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            modes(&path)?;
        } else {
            let is_program = path.parent().is_some_and(|parent| parent.ends_with("bin"));
            let mode = if is_program { 0o755 } else { 0o644 };
            fs::set_permissions(&path, fs::Permissions::from_mode(mode))?;
        }
    }
    Ok(())
}
