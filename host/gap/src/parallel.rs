//! Work on all processors.
//!
//! Every chain of parallel iterators is a type of its own, for which the whole of rayon is compiled
//! again. [`each`] brings all work to one type.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

/// The results of `make` for all items, in their order; computed on all processors.
pub fn each<I: Send, T: Send>(
    items: impl IntoIterator<Item = I>,
    make: impl Fn(I) -> T + Sync,
) -> Vec<T> {
    let slots: Vec<Mutex<Slot<I, T>>> =
        items.into_iter().map(|item| Mutex::new(Slot { item: Some(item), made: None })).collect();
    let lock = |at: usize| slots[at].lock().unwrap_or_else(PoisonError::into_inner);
    run(slots.len(), &|at| {
        // Not locked while it is computed: what is computed may wait for other work.
        let item = lock(at).item.take();
        let made = item.map(&make);
        lock(at).made = made;
    });
    let made =
        |slot: Mutex<Slot<I, T>>| slot.into_inner().unwrap_or_else(PoisonError::into_inner).made;
    slots.into_iter().filter_map(made).collect()
}

/// The results of `make` for all items that have one, in their order.
pub fn each_some<I: Send, T: Send>(
    items: impl IntoIterator<Item = I>,
    make: impl Fn(I) -> Option<T> + Sync,
) -> Vec<T> {
    each(items, make).into_iter().flatten().collect()
}

/// The results of `make` for all items; `None` when one has none.
pub fn each_or_none<I: Send, T: Send>(
    items: impl IntoIterator<Item = I>,
    make: impl Fn(I) -> Option<T> + Sync,
) -> Option<Vec<T>> {
    each(items, make).into_iter().collect()
}

struct Slot<I, T> {
    item: Option<I>,
    made: Option<T>,
}

fn run(count: usize, job: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(job);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_the_order_of_the_items() {
        let numbers = || (0..1000).map(|n| n.to_string());
        let lengths: Vec<usize> = numbers().map(|text| text.len()).collect();
        assert_eq!(each(numbers(), |text| text.len()), lengths);
    }

    #[test]
    fn what_has_no_result_is_left_out_or_leaves_nothing() {
        let odd = |n: usize| (n % 2 == 1).then_some(n);
        assert_eq!(each_some(0..6, odd), [1, 3, 5]);
        assert_eq!(each_or_none(0..6, odd), None);
        assert_eq!(each_or_none([1, 3], odd), Some(vec![1, 3]));
    }

    #[test]
    fn work_may_hand_out_work() {
        let sums = each(0..8, |n: usize| each(0..n, |m| m).into_iter().sum::<usize>());
        assert_eq!(sums, [0, 0, 1, 3, 6, 10, 15, 21]);
    }
}
