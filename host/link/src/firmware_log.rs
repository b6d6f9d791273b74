//! What the firmware logs, decoded by the ELF it was booted from.

#[cfg(feature = "firmware-log")]
mod decoder;

use std::collections::VecDeque;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::process::ChildStdout;
use std::sync::{Arc, Mutex, PoisonError};

#[cfg(feature = "firmware-log")]
use decoder::{follow, table};

/// Names a file for the whole log.
pub const LOG_VARIABLE: &str = "CATHFORCE_FIRMWARE_LOG";

/// A log being followed.
pub(crate) struct FirmwareLog {
    last: Arc<Mutex<VecDeque<String>>>,
}

impl FirmwareLog {
    /// Reads `source` until its end, in a thread.
    pub(crate) /// Without a decoder the log is drained: its last words are that nobody can read it.
#[cfg(not(feature = "firmware-log"))]
fn follow(mut source: impl Read, (): (), _: Option<File>, last: &Mutex<VecDeque<String>>) {
    let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
    last.push_back("not decoded: this program was built without its feature `firmware-log`".into());
    drop(last);
    let _ = std::io::copy(&mut source, &mut std::io::sink());
}

#[cfg(not(feature = "firmware-log"))]
fn table(_: &Path) {}
