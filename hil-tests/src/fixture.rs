//! The example bundles and their device images.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use cathforce_bundle::{Bundle, ImageOptions, device_image};
use cathforce_config::Settings;
use cathforce_test_fixture::once;

/// The bundle that comes with the project.
pub const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/tapered-none");

/// The example, read once.
pub fn bundle() -> &'static Bundle {
    static BUNDLE: OnceLock<Bundle> = OnceLock::new();
    BUNDLE.get_or_init(|| Bundle::open(EXAMPLE).unwrap_or_else(|error| panic!("{error}")))
}

/// The bundle with a guidewire that comes with the project, read once.
pub fn guidewire_bundle() -> &'static Bundle {
    static BUNDLE: OnceLock<Bundle> = OnceLock::new();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/bend-guidewire");
    BUNDLE.get_or_init(|| Bundle::open(path).unwrap_or_else(|error| panic!("{error}")))
}

/// The example's device image with other options.
pub fn image_with(options: &ImageOptions) -> Vec<u8> {
    let image = device_image(bundle(), options);
    image.unwrap_or_else(|error| panic!("{error}")).0
}

/// The example's device image with other options; made once for all tests.
fn image_once(name: &str, options: &ImageOptions) -> Vec<u8> {
    let path = |folder: &Path| folder.join("image.cfim");
    let made = once(name, |folder| std::fs::write(path(folder), image_with(options)).unwrap());
    std::fs::read(path(&made)).unwrap()
}

/// The example's device image as the command builds it.
pub fn image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| image_once("image", &ImageOptions::default()))
}

/// The same with a gain at which the output is often limited.
pub fn strong_image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| {
        let settings = Settings {
            force_gain: 20.0,
            torque_gain: 20.0,
            force_limit_n: 1.0,
            torque_limit_n_m: 4e-3,
            ..Settings::default()
        };
        image_once("strong-image", &ImageOptions { settings, ..ImageOptions::default() })
    })
}

/// A small image on a coarse grid, for tests that send it often.
pub fn small_image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| {
        image_once("small-image", &ImageOptions { cell_m: 2e-3, ..ImageOptions::default() })
    })
}

/// The `cathforce` program, which cargo builds beside the tests.
pub fn program() -> PathBuf {
    let test = std::env::current_exe().expect("a test has a path");
    let built = test.parent().and_then(|deps| deps.parent()).expect("target/PROFILE/deps");
    let program = built.join("cathforce").with_extension(std::env::consts::EXE_EXTENSION);
    assert!(program.is_file(), "{} is missing: `cargo build -p cathforce`", program.display());
    program
}
