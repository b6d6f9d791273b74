//! Where the firmware of the emulated board is.

use std::ffi::OsString;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::LinkError;

/// Names the firmware to boot, if the address does not.
pub const FIRMWARE_VARIABLE: &str = "CATHFORCE_FIRMWARE";

/// Names of the emulated board's ELF beside an installed program.
const NAMES: [&str; 3] =
    ["cathforce-firmware", "cathforce-firmware.elf", "cathforce-firmware-mps2-an500.elf"];
/// Folders that may hold it, from that of the program. The last one is where the Debian package puts it.
const FOLDERS: [&str; 3] = ["", "../lib/cathforce", "/usr/lib/cathforce"];
/// Where a checkout builds it, in its target folder.
const BUILT: &str = "thumbv7em-none-eabihf/firmware/cathforce-firmware";
/// `EM_ARM` of the ELF standard.
const ARM: [u8; 2] = [40, 0];

/// The firmware's ELF: the one given, else the one that [`FIRMWARE_VARIABLE`] names, else one
/// beside this program or in `../lib/cathforce` from there, else one in `/usr/lib/cathforce`, else the one
/// that was built in the checkout from which this program was built.
///
/// One that is named and not there is an error, whatever lies elsewhere.
pub fn find_firmware(given: Option<&Path>) -> Result<PathBuf, LinkError> {
    let places = Places {
        given: given.map(Path::to_path_buf),
        variable: std::env::var_os(FIRMWARE_VARIABLE).filter(|value| !value.is_empty()),
        program_folder: program_folder(),
        built: built(),
    };
    places.find()
}

/// The ELF of a board that was installed with this program.
pub fn firmware_of(board: &str) -> Result<PathBuf, LinkError> {
    let name = format!("cathforce-firmware-{board}.elf");
    let folder = program_folder();
    let places = folder.iter().flat_map(|from| FOLDERS.iter().map(|at| from.join(at).join(&name)));
    let mut tried = Vec::new();
    for path in places {
        match missing(&path) {
            None => return Ok(path),
            Some(why) => tried.push(format!("{}: {why}", path.display())),
        }
    }
    Err(LinkError::Firmware { board: board.into(), tried })
}

fn program_folder() -> Option<PathBuf> {
    let program = std::env::current_exe().and_then(|program| program.canonicalize()).ok();
    program.and_then(|program| Some(program.parent()?.to_path_buf()))
}

/// Where this program's checkout builds the firmware. A program that was built to be installed
/// (`cargo xtask dist`) knows no checkout: it has the same bits wherever it is built.
fn built() -> Option<PathBuf> {
    let checkout = match option_env!("CATHFORCE_DIST") {
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."),
        Some(_) => return None,
    };
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or("target".into(), PathBuf::from);
    let checkout = checkout.canonicalize().unwrap_or(checkout);
    Some(checkout.join(target).join(BUILT))
}

struct Places {
    given: Option<PathBuf>,
    variable: Option<OsString>,
    program_folder: Option<PathBuf>,
    built: Option<PathBuf>,
}

impl Places {
    fn find(self) -> Result<PathBuf, LinkError> {
        let variable = self.variable.as_ref().map(PathBuf::from);
        let named = [(self.given.as_ref(), ""), (variable.as_ref(), FIRMWARE_VARIABLE)];
        if let Some((path, by)) = named.into_iter().find_map(|(path, by)| Some((path?, by))) {
            return match missing(path) {
                None => Ok(path.clone()),
                Some(why) => {
                    let by = if by.is_empty() { String::new() } else { format!("{by} names ") };
                    let fix = format!("Name another file; {BUILD_OR_NAME}");
                    Err(error(format!("{by}{}: {why}", path.display()), fix))
                }
            };
        }
        let beside = self.program_folder.iter().flat_map(|folder| {
            FOLDERS.iter().flat_map(move |at| NAMES.map(|name| folder.join(at).join(name)))
        });
        let mut tried = vec![format!("the variable {FIRMWARE_VARIABLE}: not set")];
        for path in beside.chain(self.built.clone()) {
            match missing(&path) {
                None => return Ok(path),
                Some(why) => tried.push(format!("{}: {why}", path.display())),
            }
        }
        let problem = format!("the firmware was not found; tried were\n  {}", tried.join("\n  "));
        let fix = format!("{BUILD_OR_NAME}; or put it beside this program");
        Err(error(problem, fix))
    }
}

const BUILD_OR_NAME: &str = match option_env!("CATHFORCE_DIST") {
    None => "`cargo xtask firmware` builds it in a checkout; CATHFORCE_FIRMWARE=FILE names one",
    Some(_) => {
        "install it together with this program, in ../lib/cathforce from there; \
         CATHFORCE_FIRMWARE=FILE names one"
    }
};

fn error(problem: String, fix: String) -> LinkError {
    LinkError::Emulator { link: "qemu".into(), problem, fix }
}

/// Why a file cannot be booted, if so. A program of the same name for this computer is not
/// firmware.
fn missing(path: &Path) -> Option<&'static str> {
    if !path.is_file() {
        return Some("no such file");
    }
    let mut head = [0; 20];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut head));
    let is_elf = read.is_ok() && head.starts_with(b"\x7fELF");
    (!is_elf || head[18..] != ARM).then_some("not an ELF file for ARM")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder that goes with the test.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let name = format!("cathforce-firmware-{name}-{}", std::process::id());
            let folder = std::env::temp_dir().join(name);
            std::fs::create_dir_all(folder.join("bin")).unwrap();
            std::fs::create_dir_all(folder.join("lib/cathforce")).unwrap();
            Self(folder)
        }

        fn elf(&self, name: &str) -> PathBuf {
            let path = self.0.join(name);
            let mut bytes = b"\x7fELF\x01\x01\x01".to_vec();
            bytes.resize(18, 0);
            bytes.extend(ARM);
            std::fs::write(&path, bytes).unwrap();
            path
        }

        fn places(&self) -> Places {
            Places {
                given: None,
                variable: None,
                program_folder: Some(self.0.join("bin")),
                built: Some(self.0.join("built")),
            }
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn each_place_is_looked_at_and_the_earlier_one_wins() {
        let folder = Folder::new("order");
        let found = |places: Places| places.find().unwrap().canonicalize().unwrap();
        // From the last place to the first: each new one wins over those before.
        let built = folder.elf("built");
        assert_eq!(found(folder.places()), built.canonicalize().unwrap());
        for name in ["lib/cathforce/cathforce-firmware.elf", "bin/cathforce-firmware.elf"] {
            let elf = folder.elf(name);
            assert_eq!(found(folder.places()), elf.canonicalize().unwrap(), "{name}");
        }
        let beside = folder.elf("bin/cathforce-firmware");
        assert_eq!(found(folder.places()), beside.canonicalize().unwrap());
        let variable = Some(folder.elf("by-variable").into_os_string());
        let named = Places { variable: variable.clone(), ..folder.places() };
        assert!(found(named).ends_with("by-variable"));
        let given = Some(folder.elf("given"));
        assert!(found(Places { given, variable, ..folder.places() }).ends_with("given"));
    }

    #[test]
    fn what_was_tried_is_said() {
        let folder = Folder::new("tried");
        // A program for this computer may have the same name.
        let own = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        std::fs::write(folder.0.join("bin/cathforce-firmware"), &own[..4096]).unwrap();
        let error = folder.places().find().unwrap_err().to_string();
        for word in [
            "CATHFORCE_FIRMWARE: not set",
            "bin/cathforce-firmware: not an ELF file for ARM",
            "bin/cathforce-firmware.elf: no such file",
            "lib/cathforce/cathforce-firmware: no such file",
            "built: no such file",
            "cargo xtask firmware",
        ] {
            assert!(error.contains(word), "{word} in {error}");
        }
    }

    #[test]
    fn a_file_that_is_named_and_missing_is_not_replaced_by_another() {
        let folder = Folder::new("named");
        folder.elf("built");
        let variable = Some("/no/such.elf".into());
        let error = Places { variable, ..folder.places() }.find().unwrap_err().to_string();
        assert!(error.contains("CATHFORCE_FIRMWARE names /no/such.elf: no such file"), "{error}");
        let given = Some("/no/other.elf".into());
        let error = Places { given, ..folder.places() }.find().unwrap_err().to_string();
        assert!(error.contains("/no/other.elf: no such file"), "{error}");
        assert!(error.contains("cargo xtask firmware"), "{error}");
    }
}
