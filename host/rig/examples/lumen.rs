//! Builds the lumen of a bundle and prints what it costs:
//! `cargo run -p cathforce-rig --release --example lumen -- BUNDLE [CELL_MM] [FILE]`
//!
//! FILE gets the raw bytes, directory and bricks; the header is printed.

use std::time::Instant;

use cathforce_rig::{Bundle, lumen_from_bundle};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: lumen BUNDLE [CELL_MM] [FILE]")?;
    let cell_mm: f64 = arguments.next().as_deref().unwrap_or("1").parse()?;
    let start = Instant::now();
    let bundle = Bundle::open(path)?;
    for warning in &bundle.warnings {
        println!("warning: {warning}");
    }
    println!(
        "{}: {} trials, read in {:.2?}",
        bundle.rig.name,
        bundle.trials.len(),
        start.elapsed()
    );
    let start = Instant::now();
    let (header, bytes, report) = lumen_from_bundle(&bundle, cell_mm * 1e-3)?;
    println!("{report}\nbuilt and measured in {:.2?}\n{header:?}", start.elapsed());
    if let Some(file) = arguments.next() {
        std::fs::write(&file, &bytes)?;
        println!("{} bytes written to {file}", bytes.len());
    }
    Ok(())
}
