//! The example bundles and their device images.

use std::path::PathBuf;
use std::sync::OnceLock;

use cathforce_bundle::{Bundle, ImageOptions, device_image};
use cathforce_config::Settings;

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

/// Its device image as the command builds it; made once.
pub fn image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| image_with(&ImageOptions::default()))
}

/// The same with a gain at which the output is often limited. Made once.
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
        image_with(&ImageOptions { settings, ..ImageOptions::default() })
    })
}

/// A small image on a coarse grid, for tests that send it often. Made once.
pub fn small_image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| image_with(&ImageOptions { cell_m: 2e-3, ..ImageOptions::default() }))
}

/// The `cathforce` program, which cargo builds beside the tests.
pub fn program() -> PathBuf {
    let test = std::env::current_exe().expect("a test has a path");
    let built = test.parent().and_then(|deps| deps.parent()).expect("target/PROFILE/deps");
    let program = built.join("cathforce").with_extension(std::env::consts::EXE_EXTENSION);
    assert!(program.is_file(), "{} is missing: `cargo build -p cathforce`", program.display());
    program
}
