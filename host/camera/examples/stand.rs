//! Writes what a lab would have, rendered: `cathforce_camera::render::lab` says which files.
//!
//!     cargo run --release -p cathforce-camera --example stand FOLDER

use std::path::Path;

/// Two seconds of frames.
const FRAMES: usize = 60;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args_os().nth(1).ok_or("give the name of a new folder")?;
    cathforce_camera::render::lab::write(Path::new(&folder), FRAMES)?;
    Ok(())
}
