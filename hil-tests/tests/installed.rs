//! An installed program: beside its firmware, in an environment of its own, where there is no checkout.
//!
//! `cargo xtask dist` does the same with what it has built.

use std::fs;
use std::process::Command;

use cathforce_hil_tests::program;
use cathforce_link::qemu::find_firmware;

#[test]
fn the_demo_needs_its_firmware_and_an_emulator_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let usr = folder.path().join("usr");
    let (bin, lib) = (usr.join("bin"), usr.join("lib/cathforce"));
    fs::create_dir_all(&bin).expect("a folder");
    fs::create_dir_all(&lib).expect("a folder");
    let installed = bin.join("cathforce");
    fs::copy(program(), &installed).expect("copied");
    let firmware = lib.join("cathforce-firmware-mps2-an500.elf");
    fs::copy(find_firmware(None).expect("the suite builds it"), &firmware).expect("copied");
    let run = |arguments: &[&str]| {
        let mut command = Command::new(&installed);
        command.env_clear().env("PATH", "/usr/local/bin:/usr/bin:/bin");
        command.current_dir(folder.path()).args(arguments).output().expect("it starts")
    };
    let output = run(&["demo", "--out", "demo"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(table.contains("device and host     0 bits differ"), "{table}");
    for name in
        ["run.mcap", "summary.json", "ticks.csv", "nodes.csv", "report.html", "tapered-none"]
    {
        assert!(folder.path().join("demo").join(name).exists(), "{name}");
    }
    // What is there is not replaced unasked.
    let output = run(&["demo", "--out", "demo"]);
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
}
