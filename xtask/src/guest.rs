//! The Linux guest in which SocketCAN is tested: its kernel, its tools, our program.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use crate::build;
use crate::consent::Consent;
use crate::packages::{as_root, has_apt, install_from_backports, is_installed};
use crate::progress;
use crate::shell::{command, output, run, target_folder};

/// The emulator.
const EMULATOR: &str = "qemu-system-x86_64";
/// Of Debian's kernel, in the order in which they are loaded.
const MODULES: [&str; 7] = [
    "net/can/can",
    "net/can/can-raw",
    "drivers/net/can/dev/can-dev",
    "drivers/net/can/vcan",
    "drivers/net/can/slcan/slcan",
    "drivers/net/can/sja1000/sja1000",
    "drivers/net/can/sja1000/kvaser_pci",
];
/// Of can-utils: witnesses and attackers that share nothing with this project.
const TOOLS: [&str; 4] = ["candump", "cansend", "cangen", "slcand"];
/// Where Debian keeps shared libraries, and those that the tools and our program need.
const LIBRARY: &str = "lib/x86_64-linux-gnu";
const LIBRARIES: [&str; 4] = ["libc.so.6", "libm.so.6", "libgcc_s.so.1", LOADER];
const LOADER: &str = "ld-linux-x86-64.so.2";

/// Installs the emulator and fetches kernel and tools into `target/guest`, unless they are there.
pub fn prepare(consent: Consent) -> anyhow::Result<()> {
    install(consent)?;
    let folder = folder();
    let has = |file: &str| folder.join(file).is_file();
    if !has("vmlinuz") || !LIBRARIES.iter().all(|name| has(&format!("root/{LIBRARY}/{name}"))) {
        fetch(consent, &folder)?;
    }
    Ok(())
}

/// Puts the program that all tests run into the guest.
pub fn give(program: &Path) -> anyhow::Result<()> {
    let objcopy = build::tool("llvm-objcopy").context("rustc names no folder of its own")?;
    // It goes into the guest's memory.
    let inside = folder().join("root/bin/cathforce");
    run(command(objcopy).arg("--strip-all").arg(program).arg(inside))
}

fn folder() -> PathBuf {
    target_folder().join("guest")
}

/// The emulator, a shell without libraries, and what packs them.
fn install(consent: Consent) -> anyhow::Result<()> {
    let is_there = |program: &str| output(command(program).arg("--version")).is_some();
    // A busybox that is not static has no interpreter in the guest.
    if is_there(EMULATOR) && is_there("cpio") && is_installed("busybox-static") {
        return Ok(());
    }
    if !has_apt() {
        bail!(
            "SocketCAN is tested in a Linux guest made of Debian's packages. Run this on Debian \
             (or in its container), where I can fetch them: {EMULATOR}, busybox-static, cpio, \
             linux-image-amd64, can-utils"
        );
    }
    let script = format!(
        "{} && apt-get install -y --no-install-recommends busybox-static cpio",
        install_from_backports("qemu-system-x86")?
    );
    progress::run(&mut as_root(consent, &script)?)
}

/// Kernel, modules, tools and their library, out of Debian's packages, which are not installed.
fn fetch(consent: Consent, folder: &Path) -> anyhow::Result<()> {
    let kernel = match kernel_package() {
        Some(name) => name,
        None => {
            progress::run(&mut as_root(consent, "apt-get update")?)?;
            kernel_package().context("apt knows no linux-image-amd64: is this an amd64 Debian?")?
        }
    };
    let packages = folder.join("packages");
    let root = folder.join("root");
    for sub in ["bin", "modules", "dev", "proc", "sys", "tmp", "lib", "lib64"] {
        std::fs::create_dir_all(root.join(sub))?;
    }
    std::fs::create_dir_all(&packages)?;
    progress::run(
        command("apt-get")
            .args(["download", &kernel, "can-utils", "libc6", "libgcc-s1"])
            .current_dir(&packages),
    )?;
    let unpack = |package: &str, wanted: &str| {
        let script = format!("dpkg-deb --fsys-tarfile {package}_*.deb | tar -x {wanted}");
        run(command("sh").args(["-c", &script]).current_dir(&packages))
    };
    unpack(&kernel, "--wildcards './boot/vmlinuz*' './lib/modules/*/kernel/*/can'")?;
    unpack("can-utils", "./usr/bin")?;
    unpack("libc6", &format!("./{LIBRARY}"))?;
    unpack("libgcc-s1", &format!("./{LIBRARY}"))?;

    let modules = packages.join("lib/modules").join(kernel.trim_start_matches("linux-image-"));
    for module in MODULES {
        let file = format!("{module}.ko");
        let name = Path::new(&file).file_name().context("a module has a name")?;
        copy(&modules.join("kernel").join(&file), &root.join("modules").join(name))?;
    }
    for tool in TOOLS {
        copy(&packages.join("usr/bin").join(tool), &root.join("bin").join(tool))?;
    }
    std::fs::create_dir_all(root.join(LIBRARY))?;
    for library in LIBRARIES {
        copy(&packages.join(LIBRARY).join(library), &root.join(LIBRARY).join(library))?;
    }
    copy(&packages.join(LIBRARY).join(LOADER), &root.join("lib64").join(LOADER))?;
    copy(Path::new("/bin/busybox"), &root.join("bin/busybox"))?;
    // Last: that it is there says that all is.
    let version = kernel.trim_start_matches("linux-image-");
    copy(&packages.join(format!("boot/vmlinuz-{version}")), &folder.join("vmlinuz"))?;
    Ok(std::fs::remove_dir_all(packages)?)
}

fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    std::fs::copy(from, to)
        .with_context(|| format!("{} cannot be copied to {}", from.display(), to.display()))?;
    Ok(())
}

/// The package that the name of all kernels leads to.
fn kernel_package() -> Option<String> {
    let text = output(command("apt-cache").args(["depends", "linux-image-amd64"]))?;
    let mut names = text.split_whitespace().filter(|word| word.starts_with("linux-image-"));
    names.next_back().filter(|name| *name != "linux-image-amd64").map(str::to_owned)
}
