//! The browser that the tests of the web front end drive.

use anyhow::bail;

use crate::consent::Consent;
use crate::packages::{as_root, has_apt};
use crate::progress;
use crate::shell::{command, output};

/// Names of the browser on Debian and elsewhere, as `host/dash/tests/support/mod.rs` tries them.
const PROGRAMS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Installs Debian's chromium where no such browser is.
pub fn ensure(consent: Consent) -> anyhow::Result<()> {
    let is_there = |name: &&str| output(command(name).arg("--version")).is_some();
    if PROGRAMS.iter().any(is_there) {
        return Ok(());
    }
    if !has_apt() {
        bail!(
            "the web front end is tested in a real browser, and none is installed\n  fix: install \
             chromium or Google Chrome, so that one of {} runs",
            PROGRAMS.join(", ")
        );
    }
    let script = "apt-get update && apt-get install -y --no-install-recommends chromium";
    progress::run(&mut as_root(consent, script)?)
}
