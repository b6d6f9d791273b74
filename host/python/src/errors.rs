//! Errors of the command line as exceptions; the classes are declared in `python/cathforce/errors.py`.

use cathforce_bundle::{BundleError, ImageBuildError};
use pyo3::PyErr;

pyo3::import_exception!(cathforce.errors, FaultError);
pyo3::import_exception!(cathforce.errors, InputError);
pyo3::import_exception!(cathforce.errors, UsageError);

/// A bundle that is refused.
pub fn of_bundle(error: &BundleError) -> PyErr {
    InputError::new_err(error.to_string())
}

/// A bundle of which no model can be made.
pub fn of_image(path: &std::path::Path, error: &ImageBuildError) -> PyErr {
    match error {
        // This error names its file itself.
        ImageBuildError::Bundle(error) => of_bundle(error),
        ImageBuildError::Parameter { key, value, error } => {
            UsageError::new_err(format!("settings {key}={value}: {error}"))
        }
        error => InputError::new_err(format!("{}: {error}", path.display())),
    }
}
