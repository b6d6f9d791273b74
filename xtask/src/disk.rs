//! Room for what a build leaves behind.

use crate::shell::{command, output, target_folder};

/// What the target folder holds after `cargo xtask test` (4.3 GB; `du -sm target`), and a margin
/// \[MB\].
const NEEDED_MB: u64 = 6000;

/// Says so where the disk will not hold the build: what runs out of it names other causes.
pub fn warn() {
    let target = target_folder();
    let built = command("du").arg("-sm").arg(&target).output();
    let built_mb = built.ok().and_then(|du| first_number(&String::from_utf8_lossy(&du.stdout)));
    let needed = NEEDED_MB.saturating_sub(built_mb.unwrap_or(0));
    let parent = target.parent().unwrap_or(&target);
    let free = output(command("df").args(["--output=avail", "-BM"]).arg(parent));
    let free_mb = free.and_then(|df| first_number(df.lines().nth(1)?));
    if let Some(free_mb) = free_mb.filter(|free| *free < needed) {
        eprintln!(
            "warning: {} lies on a disk with {free_mb} MB free; this needs some {needed} MB\n  \
             why: a linker that runs out of disk ends with \"Bus error\", a test with an error of \
             its own\n  fix: free some, or set CARGO_TARGET_DIR to a folder on another disk",
            target.display()
        );
    }
}

/// The number at the beginning of a line, whatever unit follows.
fn first_number(line: &str) -> Option<u64> {
    let line = line.trim_start();
    let digits = line.find(|c: char| !c.is_ascii_digit()).unwrap_or(line.len());
    line[..digits].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::first_number;

    #[test]
    fn sizes_are_read_with_their_unit() {
        assert_eq!(first_number("4250\t/work/target"), Some(4250));
        assert_eq!(first_number("  74842M"), Some(74842));
        assert_eq!(first_number("Avail"), None);
    }
}
