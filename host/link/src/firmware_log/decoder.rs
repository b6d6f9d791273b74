//! The log's own format, defmt's.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use defmt_decoder::{DecodeError, Table};

const LAST_WORDS: usize = 4;

/// What the messages of an ELF are. Firmware without a table, or of another defmt, has a log that
/// cannot be read: it is drained all the same.
fn table(elf: &Path) -> Option<Table> {
    Table::parse(&std::fs::read(elf).ok()?).ok().flatten()
}

/// Decodes `source` until its end into the last lines and the file of the whole log.
pub fn follow(
    mut source: impl Read,
    elf: &Path,
    mut file: Option<File>,
    last: &Mutex<VecDeque<String>>,
) {
    let table = table(elf);
    let mut decoder = table.as_ref().map(Table::new_stream_decoder);
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
