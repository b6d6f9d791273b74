//! What the firmware logs, decoded by the ELF it was booted from.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::ChildStdout;
use std::sync::{Arc, Mutex, PoisonError};

use defmt_decoder::{DecodeError, Table};

/// Names a file for the whole log.
pub const LOG_VARIABLE: &str = "CATHFORCE_FIRMWARE_LOG";

const LAST_WORDS: usize = 4;

/// A log being followed.
pub(crate) struct FirmwareLog {
    last: Arc<Mutex<VecDeque<String>>>,
}

impl FirmwareLog {
    /// Reads `source` until its end, in a thread.
    pub(crate) fn follow(elf: &Path, source: Option<ChildStdout>) -> Self {
        let last = Arc::new(Mutex::new(VecDeque::new()));
        // Firmware without a table, or of another defmt, has a log that cannot be read:
        // it is drained all the same.
        let table = std::fs::read(elf).ok().and_then(|elf| Table::parse(&elf).ok().flatten());
        let file = std::env::var_os(LOG_VARIABLE).and_then(|path| File::create(path).ok());
        if let Some(source) = source {
            let sink = Arc::clone(&last);
            std::thread::spawn(move || follow(source, table.as_ref(), file, &sink));
        }
        Self { last }
    }

    /// The last messages, oldest first.
    pub(crate) fn last_words(&self) -> Vec<String> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }
}

fn follow(
    mut source: impl Read,
    table: Option<&Table>,
    mut file: Option<File>,
    last: &Mutex<VecDeque<String>>,
) {
    let mut decoder = table.map(Table::new_stream_decoder);
    let mut buffer = [0; 1024];
    while let Ok(n @ 1..) = source.read(&mut buffer) {
        let Some(decoder) = &mut decoder else { continue };
        decoder.received(&buffer[..n]);
        loop {
            let line = match decoder.decode() {
                Ok(frame) => frame.display(false).to_string(),
                Err(DecodeError::UnexpectedEof) => break,
                // Damaged; the framing finds the next one.
                Err(DecodeError::Malformed) => continue,
            };
            if let Some(file) = &mut file {
                // A log that cannot be written is no reason to stop a run.
                let _ = writeln!(file, "{line}");
            }
            let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
            if last.len() == LAST_WORDS {
                last.pop_front();
            }
            last.push_back(line);
        }
    }
}
