//! Hands the linker its scripts, for the device only.

use std::{env, fs, path::PathBuf};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../memory.x");
    println!("cargo:rerun-if-env-changed=CATHFORCE_ID_BASE");
    println!("cargo:rerun-if-changed=mps2-an500.x");
    println!("cargo:rerun-if-changed=nucleo-h743.x");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let nucleo = env::var_os("CARGO_FEATURE_BOARD_NUCLEO_H743").is_some();
    // cortex-m-rt includes memory.x of the checkout, and that includes the board's map.
    let map = if nucleo { "nucleo-h743.x" } else { "mps2-an500.x" };
    fs::copy(map, out.join("board.x")).expect("a memory map lies there");
    fs::copy("../memory.x", out.join("memory.x")).expect("it lies in the checkout");
    // cortex-m-rt includes a table of default handlers; the emulated board's vector table names
    // every handler itself (src/board/*/vectors.rs). That of the STM32 brings its own table.
    if !nucleo {
        fs::write(out.join("device.x"), "").expect("OUT_DIR is writable");
    }
    println!("cargo:rustc-link-search={}", out.display());
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
