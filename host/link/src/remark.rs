//! What a link has to say while it works, e.g. that it waits for the other side.

use std::sync::{PoisonError, RwLock};

type Tell = Box<dyn Fn(&str) + Send + Sync>;

static TELL: RwLock<Option<Tell>> = RwLock::new(None);

/// Sets who is told every remark of every link of this program, a sentence each; without one
/// nobody is. A later call replaces the earlier one.
pub fn set_remarks(tell: impl Fn(&str) + Send + Sync + 'static) {
    *TELL.write().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(tell));
}

pub(crate) fn remark(text: &str) {
    if let Some(tell) = &*TELL.read().unwrap_or_else(PoisonError::into_inner) {
        tell(text);
    }
}
