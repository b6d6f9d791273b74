//! Drawing in turn, so that nothing comes twice before everything has come once.

use rand::Rng;

/// Draws without putting back until all are drawn.
pub(crate) struct Deck<T: Clone> {
    all: Vec<T>,
    left: Vec<T>,
}

impl<T: Clone> Deck<T> {
    /// All of them, none drawn yet.
    pub(crate) fn of(all: &[T]) -> Self {
        Self { all: all.to_vec(), left: Vec::new() }
    }

    /// The next one.
    pub(crate) fn draw(&mut self, rng: &mut impl Rng) -> T {
        if self.left.is_empty() {
            self.left.clone_from(&self.all);
        }
        let at = rng.random_range(0..self.left.len());
        self.left.swap_remove(at)
    }
}

/// Puts items into a random order.
pub(crate) fn shuffle<T>(items: &mut [T], rng: &mut impl Rng) {
    for last in (1..items.len()).rev() {
        items.swap(last, rng.random_range(0..=last));
    }
}
