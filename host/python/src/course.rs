//! Courses of the drives of a catheter.

use crate::abreast::Course;
use crate::row::Row;
use crate::twin::Outcome;

/// A row for each tick, and a place for each answer.
pub struct Rows<'a> {
    rows: std::slice::Iter<'a, Row>,
    places: std::slice::IterMut<'a, Outcome>,
}

impl<'a> Rows<'a> {
    pub fn new(rows: &'a [Row], places: &'a mut [Outcome]) -> Self {
        Self { rows: rows.iter(), places: places.iter_mut() }
    }
}

impl Course for Rows<'_> {
    fn next(&mut self) -> Option<Row> {
        self.rows.next().copied()
    }

    fn take(&mut self, outcome: Outcome) {
        if let Some(place) = self.places.next() {
            *place = outcome;
        }
    }
}

/// All drives move evenly from one position to another. The answer is the last tick's, with the largest contact
/// force of all of them, and flags that any of them has.
pub struct Even<'a> {
    from: Row,
    goal: &'a Row,
    ticks: usize,
    done: usize,
    /// Ticks after which it pauses.
    pause: usize,
    last: &'a mut Outcome,
    largest_n: &'a mut f64,
    any: [bool; 3],
}

impl<'a> Even<'a> {
    pub fn new(
        from: Row,
        goal: &'a Row,
        ticks: usize,
        last: &'a mut Outcome,
        largest_n: &'a mut f64,
    ) -> Self {
        Self { from, goal, ticks, done: 0, pause: 0, last, largest_n, any: [false; 3] }
    }
}

impl Even<'_> {
    /// Goes on for a number of ticks at most; `false` at the goal.
    pub fn go_on(&mut self, ticks: usize) -> bool {
        self.pause = self.ticks.min(self.done + ticks);
        self.done < self.ticks
    }
}

impl Course for Even<'_> {
    fn next(&mut self) -> Option<Row> {
        if self.done == self.pause {
            return None;
        }
        self.done += 1;
        Some(self.from.towards(self.goal, self.done as f64 / self.ticks as f64))
    }

    fn take(&mut self, outcome: Outcome) {
        *self.last = outcome;
        *self.largest_n = self.largest_n.max(outcome.contact.peak_contact_force_n);
        let refused = outcome.device.is_some_and(|device| device.refused);
        let found = [outcome.contact.unresolved, outcome.contact.lost, refused];
        for (any, found) in self.any.iter_mut().zip(found) {
            *any |= found;
        }
        let [unresolved, lost, refused] = self.any;
        self.last.contact.unresolved = unresolved;
        self.last.contact.lost = lost;
        if let Some(device) = &mut self.last.device {
            device.refused = refused;
        }
    }
}
