//! Reads TOML tables strictly: unknown keys first, then types; every fault has its place.

use std::cell::RefCell;
use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::cause::RigCause;
use crate::nearest::nearest;
use crate::place::Place;

pub(crate) type Fault = (Place, RigCause);
/// Something that looks wrong in `rig.toml`, and where.
pub(crate) type RigWarning = (Place, String);

pub(super) const POSITIVE: RangeInclusive<f64> = f64::MIN_POSITIVE..=f64::MAX;
pub(super) const NOT_NEGATIVE: RangeInclusive<f64> = 0.0..=f64::MAX;

/// Turns byte offsets of a text into lines and columns.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a>(pub(crate) &'a str);

impl Source<'_> {
    pub(crate) fn place(&self, span: &Range<usize>) -> Place {
        let before = self.0.get(..span.start).unwrap_or(self.0);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        let column = before[line_start..].chars().count() + 1;
        Place::LineColumn(before.matches('\n').count() + 1, column)
    }
}

/// The place of a key's value, given as `table.keys[2].key`; for a missing key, that of its table.
pub(crate) fn place_of_key(text: &str, key: &str) -> Option<Place> {
    let document = DeTable::parse(text).ok()?;
    let mut found = None;
    let mut table = Some(document.get_ref());
    for part in key.split('.') {
        let (name, index) = part.split_once('[').unwrap_or((part, ""));
        let Some(value) = table.and_then(|table| table.get(name)) else { break };
        let item =
            || value.get_ref().as_array()?.get(index.trim_end_matches(']').parse::<usize>().ok()?);
        let value = item().unwrap_or(value);
        found = Some(value.span());
        table = value.get_ref().as_table();
    }
    Some(Source(text).place(&found?))
}

/// What is wrong with a file, in the order in which it was found.
#[derive(Default)]
pub(crate) struct Faults {
    found: RefCell<Vec<Fault>>,
    /// Stands for a table that is missing.
    empty: DeTable<'static>,
}

impl Faults {
    pub(crate) fn count(&self) -> usize {
        self.found.borrow().len()
    }

    pub(crate) fn take(&self) -> Vec<Fault> {
        self.found.take()
    }
}

/// A table of the document and its name.
///
/// Every method that reads a key reports what is wrong with it and goes on with a value in its
/// range, so that a file is refused with all of its faults and not with the first one.
pub(crate) struct TableReader<'a> {
    source: Source<'a>,
    faults: &'a Faults,
    name: String,
    span: Range<usize>,
    table: &'a DeTable<'a>,
    /// The table is missing, which was reported; its keys are not reported as well.
    is_absent: bool,
}

/// A number and where it stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Number {
    pub(crate) value: f64,
    pub(crate) place: Place,
}

impl<'a> TableReader<'a> {
    /// The whole document; its keys are not checked yet.
    pub(crate) fn document(source: Source<'a>, table: &'a DeTable<'a>, faults: &'a Faults) -> Self {
        Self { source, faults, name: String::new(), span: 0..0, table, is_absent: false }
    }

    /// Reports every key that is not among `known`.
    fn inner(
        &self,
        name: String,
        span: Range<usize>,
        table: &'a DeTable<'a>,
        known: &[&str],
    ) -> Self {
        let Self { source, faults, .. } = *self;
        let own = Self { source, faults, name, span, table, is_absent: false };
        own.check_keys(known);
        own
    }

    pub(crate) fn report(&self, place: Place, cause: RigCause) {
        self.faults.found.borrow_mut().push((place, cause));
    }

    /// Faults of the file so far. What follows from a value that was reported is no fault of its own.
    pub(crate) fn fault_count(&self) -> usize {
        self.faults.count()
    }

    /// Reports every key that is not among `known`.
    pub(crate) fn check_keys(&self, known: &[&str]) {
        #[cfg(test)]
        tests::note(&self.name, known);
        let mut unknown: Vec<_> =
            self.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref())).collect();
        unknown.sort_by_key(|key| key.span().start);
        for key in unknown {
            let cause = RigCause::UnknownKey {
                key: key.get_ref().to_string(),
                table: self.name.clone(),
                nearest: nearest(key.get_ref(), known).map(str::to_owned),
            };
            self.report(self.source.place(&key.span()), cause);
        }
    }

    /// The first key in the file for which `is` holds.
    pub(crate) fn first_key(&self, is: impl Fn(&str) -> bool) -> Option<(&'a str, Place)> {
        let keys = self.table.keys().filter(|key| is(key.get_ref()));
        let first = keys.min_by_key(|key| key.span().start)?;
        Some((first.get_ref().as_ref(), self.source.place(&first.span())))
    }

    /// The key with the name of its table before it.
    pub(crate) fn path(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    /// The place of the table itself.
    pub(crate) fn place(&self) -> Place {
        self.source.place(&self.span)
    }

    fn get(&self, key: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        let found = self.table.iter().find(|(name, _)| name.get_ref().as_ref() == key);
        found.map(|(_, value)| value)
    }

    /// The key is there, whatever its value.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// A key that must be there. One that is misspelt was reported as an unknown key.
    fn require(&self, key: &str, kind: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        let value = self.get(key);
        if value.is_none() && !self.is_absent && !self.is_misspelt(key) {
            self.report(self.place(), RigCause::MissingKey { key: self.path(key), kind });
        }
        value
    }

    fn is_misspelt(&self, key: &str) -> bool {
        self.faults.found.borrow().iter().any(|(_, cause)| {
            matches!(cause, RigCause::UnknownKey { table, nearest: Some(nearest), .. }
                if *table == self.name && nearest == key)
        })
    }

    fn report_type(&self, key: &str, value: &Spanned<DeValue<'_>>, kind: &'static str) {
        let found = value.get_ref().type_str();
        let cause = RigCause::Type { key: self.path(key), kind, found };
        self.report(self.source.place(&value.span()), cause);
    }

    fn as_number(&self, key: &str, value: &Spanned<DeValue<'_>>) -> Option<Number> {
        let place = self.source.place(&value.span());
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            DeValue::Integer(integer) => {
                i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64)
            }
            _ => {
                self.report_type(key, value, "a number");
                return None;
            }
        };
        let number = number.filter(|value| value.is_finite());
        if number.is_none() {
            self.report(place, RigCause::NotFinite { key: self.path(key) });
        }
        number.map(|value| Number { value, place })
    }

    fn required_number(&self, key: &str) -> Option<Number> {
        self.as_number(key, self.require(key, "a number")?)
    }

    /// A number that must be there.
    pub(crate) fn number(&self, key: &'static str) -> Number {
        self.required_number(key).unwrap_or(Number { value: 0.0, place: self.place() })
    }

    /// A number that may be missing.
    pub(crate) fn optional_number(&self, key: &'static str) -> Option<Number> {
        self.as_number(key, self.get(key)?)
    }

    /// A number within bounds, which must be there; `meaning` says what it has to be.
    pub(crate) fn number_in(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
        meaning: &'static str,
    ) -> f64 {
        match self.required_number(key) {
            Some(number) => self.within(key, number, range, meaning),
            None => *range.end(),
        }
    }

    /// A number within bounds, which may be missing.
    pub(crate) fn optional_number_in(
        &self,
        key: &'static str,
        range: RangeInclusive<f64>,
        meaning: &'static str,
    ) -> Option<f64> {
        self.optional_number(key).map(|number| self.within(key, number, range, meaning))
    }

    /// The end of the range stands for a number out of it: limits that depend on it are wide then.
    fn within(
        &self,
        key: &str,
        number: Number,
        range: RangeInclusive<f64>,
        meaning: &'static str,
    ) -> f64 {
        let value = number.value;
        if range.contains(&value) {
            return value;
        }
        self.report(number.place, RigCause::Range { key: self.path(key), value, meaning });
        *range.end()
    }

    /// A text that may be missing.
    pub(crate) fn optional_text(&self, key: &str) -> Option<(&'a str, Place)> {
        let value = self.get(key)?;
        match value.get_ref() {
            DeValue::String(text) => Some((text.as_ref(), self.source.place(&value.span()))),
            _ => {
                self.report_type(key, value, "a text");
                None
            }
        }
    }

    /// A text that must be there.
    pub(crate) fn text(&self, key: &'static str) -> &'a str {
        let text = self.require(key, "a text").and_then(|_| self.optional_text(key));
        text.map_or("", |(text, _)| text)
    }

    /// Three numbers.
    pub(crate) fn vector(&self, key: &'static str) -> Option<([f64; 3], Place)> {
        const KIND: &str = "three numbers, [x, y, z]";
        let value = self.require(key, KIND)?;
        let DeValue::Array(array) = value.get_ref() else {
            self.report_type(key, value, KIND);
            return None;
        };
        let place = self.source.place(&value.span());
        let numbers = array.iter().map(|item| self.as_number(key, item).map(|n| n.value));
        let numbers = numbers.collect::<Option<Vec<_>>>()?;
        let found = numbers.len();
        let vector = <[f64; 3]>::try_from(numbers).ok();
        if vector.is_none() {
            self.report(place, RigCause::Count { key: self.path(key), expected: 3, found });
        }
        vector.map(|vector| (vector, place))
    }

    /// A sub-table that may be missing.
    pub(crate) fn optional_table(
        &self,
        key: &'static str,
        known: &[&str],
    ) -> Option<TableReader<'a>> {
        let value = self.get(key)?;
        match value.get_ref() {
            DeValue::Table(table) => Some(self.inner(self.path(key), value.span(), table, known)),
            _ => {
                self.report_type(key, value, "a table");
                Some(self.absent(key))
            }
        }
    }

    /// A sub-table that must be there.
    pub(crate) fn table(&self, key: &'static str, known: &[&str]) -> TableReader<'a> {
        self.optional_table(key, known).unwrap_or_else(|| {
            if !self.is_misspelt(key) {
                self.report(Place::Whole, RigCause::MissingTable { table: self.path(key) });
            }
            self.absent(key)
        })
    }

    fn absent(&self, key: &str) -> TableReader<'a> {
        let Self { source, faults, .. } = *self;
        let (name, table) = (self.path(key), &faults.empty);
        Self { source, faults, name, span: 0..0, table, is_absent: true }
    }

    /// An array of tables; empty when it is missing.
    pub(crate) fn tables(&self, key: &'static str, known: &[&str]) -> Vec<TableReader<'a>> {
        const KIND: &str = "an array of tables, [ { … }, { … } ]";
        let Some(value) = self.get(key) else { return Vec::new() };
        let DeValue::Array(array) = value.get_ref() else {
            self.report_type(key, value, KIND);
            return Vec::new();
        };
        let items = array.iter().enumerate();
        items
            .filter_map(|(index, item)| match item.get_ref() {
                DeValue::Table(table) => {
                    let name = format!("{}[{index}]", self.path(key));
                    Some(self.inner(name, item.span(), table, known))
                }
                _ => {
                    self.report_type(key, item, KIND);
                    None
                }
            })
            .collect()
    }

    /// The place of a key's value, or of the table when it is missing.
    pub(crate) fn place_of(&self, key: &str) -> Place {
        self.get(key).map_or_else(|| self.place(), |value| self.source.place(&value.span()))
    }
}

#[cfg(test)]
pub(crate) use tests::known_keys;

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::collections::BTreeSet;

    thread_local! {
        static KNOWN: RefCell<BTreeSet<(String, String)>> = const { RefCell::new(BTreeSet::new()) };
    }

    pub(super) fn note(table: &str, known: &[&str]) {
        let keys = known.iter().map(|key| (table.to_owned(), (*key).to_owned()));
        KNOWN.with_borrow_mut(|all| all.extend(keys));
    }

    /// Every table and key that a reader knows of the tables that `read` has it read.
    pub(crate) fn known_keys(read: impl FnOnce()) -> BTreeSet<(String, String)> {
        KNOWN.take();
        read();
        KNOWN.take()
    }
}
