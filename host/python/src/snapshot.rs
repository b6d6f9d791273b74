//! A state to come back to.

use pyo3::prelude::*;

use crate::twin::Twin;

/// A state of a catheter. It stays as it is, however often it is restored.
#[pyclass(frozen, module = "cathforce")]
pub struct Snapshot(pub Twin);
