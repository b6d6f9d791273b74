//! Long calls without the interpreter's lock, which Ctrl-C ends.

use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// How long the interpreter waits for a signal to be noticed; a person does not notice it.
const PATIENCE: Duration = Duration::from_millis(50);

/// Calls `part` until it returns `true`, without the interpreter's lock, and asks for signals in between.
///
/// On Ctrl-C the error is `KeyboardInterrupt`, and what was computed so far stays.
pub fn until_done(py: Python<'_>, mut part: impl FnMut() -> PyResult<bool> + Send) -> PyResult<()> {
    loop {
        let done = py.detach(|| {
            let began = Instant::now();
            loop {
                if part()? {
                    return Ok::<_, PyErr>(true);
                }
                if began.elapsed() > PATIENCE {
                    return Ok(false);
                }
            }
        })?;
        if done {
            return Ok(());
        }
        py.check_signals()?;
    }
}
