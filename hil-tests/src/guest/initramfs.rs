//! The guest's disk: an archive that its kernel unpacks into memory.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};

/// Writes an archive of `provided`, the script and `files` to `archive`.
///
/// `provided` has the folder `root`, which is copied, and further files that the kernel needs.
pub fn write(archive: &Path, provided: &Path, script: &str, files: &[(&Path, &str)]) {
    let root = archive.with_extension("root");
    copy(&provided.join("root"), &root);
    for (from, to) in files {
        copy(from, &root.join(to.trim_start_matches('/')));
    }
    let init = root.join("init");
    fs::write(&init, include_str!("init.sh")).expect("a temporary file");
    fs::set_permissions(&init, fs::Permissions::from_mode(0o755)).expect("of our own file");
    fs::write(root.join("script.sh"), script).expect("a temporary file");
    let output = fs::File::create(archive).expect("a temporary file");
    let status = Command::new("sh")
        .args(["-c", "find . | cpio --create --format=newc --quiet"])
        .current_dir(&root)
        .stdin(Stdio::null())
        .stdout(output)
        .status();
    assert!(status.is_ok_and(|s| s.success()), "cpio failed: `cargo xtask setup --yes` has one");
    fs::remove_dir_all(&root).expect("of our own folder");
}

fn copy(from: &Path, to: &Path) {
    let parent = to.parent().expect("below the root");
    fs::create_dir_all(parent).unwrap_or_else(|e| panic!("{}: {e}", parent.display()));
    let status = Command::new("cp").arg("-r").arg(from).arg(to).status();
    assert!(status.is_ok_and(|s| s.success()), "{} cannot be copied", from.display());
}
