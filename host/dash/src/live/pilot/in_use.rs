//! The image that the device uses.

use std::sync::{Arc, Mutex, PoisonError};

/// The image that the device uses.
#[derive(Clone, Default)]
pub struct InUse(Arc<Mutex<Option<Arc<Vec<u8>>>>>);

impl InUse {
    pub(super) fn set(&self, image: Vec<u8>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(image));
    }

    /// `None` while it is not known.
    pub fn get(&self) -> Option<Arc<Vec<u8>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
