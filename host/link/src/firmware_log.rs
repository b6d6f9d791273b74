//! What the firmware logs, decoded by the ELF it was booted from.

#[cfg(feature = "firmware-log")]
mod decoder;

use std::collections::VecDeque;
use std::fs::File;
use std::path::Path;
use std::process::ChildStdout;
use std::sync::{Arc, Mutex, PoisonError};

#[cfg(feature = "firmware-log")]
use decoder::follow;

/// Names a file for the whole log.
pub const LOG_VARIABLE: &str = "CATHFORCE_FIRMWARE_LOG";

/// A log being followed.
pub(crate) struct FirmwareLog {
    last: Arc<Mutex<VecDeque<String>>>,
}

impl FirmwareLog {
    /// Reads `source` until its end, in a thread.
    pub(crate) fn follow(elf: &Path, source: Option<ChildStdout>) -> Self {
        let last = Arc::new(Mutex::new(VecDeque::new()));
        let elf = elf.to_path_buf();
        let file = std::env::var_os(LOG_VARIABLE).and_then(|path| File::create(path).ok());
        if let Some(source) = source {
            let sink = Arc::clone(&last);
            std::thread::spawn(move || follow(source, &elf, file, &sink));
        }
        Self { last }
    }

    /// The last messages, oldest first.
    pub(crate) fn last_words(&self) -> Vec<String> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }
}

/// Without a decoder the log is drained: its last words are that nobody can read it.
#[cfg(not(feature = "firmware-log"))]
fn follow(mut source: ChildStdout, _: &Path, _: Option<File>, last: &Mutex<VecDeque<String>>) {
    let why = "not decoded: this program was built without its feature `firmware-log`";
    last.lock().unwrap_or_else(PoisonError::into_inner).push_back(why.into());
    let _ = std::io::copy(&mut source, &mut std::io::sink());
}
