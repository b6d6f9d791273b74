//! Reads TOML tables strictly: unknown keys first, then types; every fault has its place.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::cause::RigCause;
use crate::nearest::nearest;
use crate::place::Place;

pub(crate) type Fault = (Place, RigCause);
/// Something that looks wrong in `rig.toml`, and where.
pub(crate) type RigWarning = (Place, String);

pub(super) const POSITIVE: std::ops::RangeInclusive<f64> = f64::MIN_POSITIVE..=f64::MAX;
pub(super) const NOT_NEGATIVE: std::ops::RangeInclusive<f64> = 0.0..=f64::MAX;

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

/// A table of the document with the name it goes by.
pub(crate) struct TableReader<'a> {
    source: Source<'a>,
    name: String,
    span: Range<usize>,
    table: &'a DeTable<'a>,
}

/// A number and where it stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Number {
    pub(crate) value: f64,
    pub(crate) place: Place,
}

impl<'a> TableReader<'a> {
    /// The whole document; its keys are not checked yet.
    pub(crate) fn document(source: Source<'a>, table: &'a DeTable<'a>) -> Self {
        Self { source, name: String::new(), span: 0..0, table }
    }

    /// Refuses any key that is not among `known`.
    fn new(
        source: Source<'a>,
        name: String,
        span: Range<usize>,
        table: &'a DeTable<'a>,
        known: &[&str],
    ) -> Result<Self, Fault> {
        let own = Self { source, name, span, table };
        own.check_keys(known)?;
        Ok(own)
    }

    /// Refuses any key that is not among `known`.
    pub(crate) fn check_keys(&self, known: &[&str]) -> Result<(), Fault> {
        #[cfg(test)]
        tests::note(&self.name, known);
        let Some((key, place)) = self.first_key(|key| !known.contains(&key)) else { return Ok(()) };
        let cause = RigCause::UnknownKey {
            key: key.to_owned(),
            table: self.name.clone(),
            nearest: nearest(key, known).map(str::to_owned),
        };
        Err((place, cause))
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

    fn require(
        &self,
        key: &'static str,
        kind: &'static str,
    ) -> Result<&'a Spanned<DeValue<'a>>, Fault> {
        self.get(key)
            .ok_or_else(|| (self.place(), RigCause::MissingKey { key: self.path(key), kind }))
    }

    fn mistyped(&self, key: &str, value: &Spanned<DeValue<'_>>, kind: &'static str) -> Fault {
        let found = value.get_ref().type_str();
        (self.source.place(&value.span()), RigCause::Type { key: self.path(key), kind, found })
    }

    fn as_number(&self, key: &str, value: &Spanned<DeValue<'_>>) -> Result<Number, Fault> {
        let place = self.source.place(&value.span());
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            DeValue::Integer(integer) => {
                i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64)
            }
            _ => return Err(self.mistyped(key, value, "a number")),
        };
        match number {
            Some(value) if value.is_finite() => Ok(Number { value, place }),
            _ => Err((place, RigCause::NotFinite { key: self.path(key) })),
        }
    }

    /// A number that must be there.
    pub(crate) fn number(&self, key: &'static str) -> Result<Number, Fault> {
        let value = self.require(key, "a number")?;
        self.as_number(key, value)
    }

    /// A number that may be missing.
    pub(crate) fn optional_number(&self, key: &'static str) -> Result<Option<Number>, Fault> {
        self.get(key).map(|value| self.as_number(key, value)).transpose()
    }

    /// A number within bounds; `meaning` says what it has to be.
    pub(crate) fn number_in(
        &self,
        key: &'static str,
        range: std::ops::RangeInclusive<f64>,
        meaning: &'static str,
    ) -> Result<f64, Fault> {
        let number = self.number(key)?;
        self.within(key, number, range, meaning)
    }

    /// The same for a number that may be missing.
    pub(crate) fn optional_number_in(
        &self,
        key: &'static str,
        range: std::ops::RangeInclusive<f64>,
        meaning: &'static str,
    ) -> Result<Option<f64>, Fault> {
        let number = self.optional_number(key)?;
        number.map(|number| self.within(key, number, range, meaning)).transpose()
    }

    fn within(
        &self,
        key: &str,
        number: Number,
        range: std::ops::RangeInclusive<f64>,
        meaning: &'static str,
    ) -> Result<f64, Fault> {
        let value = number.value;
        if range.contains(&value) {
            return Ok(value);
        }
        Err((number.place, RigCause::Range { key: self.path(key), value, meaning }))
    }

    /// A text that may be missing.
    pub(crate) fn optional_text(
        &self,
        key: &'static str,
    ) -> Result<Option<(&'a str, Place)>, Fault> {
        let Some(value) = self.get(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::String(text) => Ok(Some((text.as_ref(), self.source.place(&value.span())))),
            _ => Err(self.mistyped(key, value, "a text")),
        }
    }

    /// A text that must be there.
    pub(crate) fn text(&self, key: &'static str) -> Result<(&'a str, Place), Fault> {
        let missing =
            || (self.place(), RigCause::MissingKey { key: self.path(key), kind: "a text" });
        self.optional_text(key)?.ok_or_else(missing)
    }

    /// Three numbers.
    pub(crate) fn vector(&self, key: &'static str) -> Result<([f64; 3], Place), Fault> {
        const KIND: &str = "three numbers, [x, y, z]";
        let value = self.require(key, KIND)?;
        let DeValue::Array(array) = value.get_ref() else {
            return Err(self.mistyped(key, value, KIND));
        };
        let place = self.source.place(&value.span());
        let numbers = array.iter().map(|item| self.as_number(key, item).map(|n| n.value));
        let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
        let vector = <[f64; 3]>::try_from(numbers).map_err(|numbers| {
            (place, RigCause::Count { key: self.path(key), expected: 3, found: numbers.len() })
        })?;
        Ok((vector, place))
    }

    /// A sub-table that may be missing.
    pub(crate) fn optional_table(
        &self,
        key: &'static str,
        known: &[&str],
    ) -> Result<Option<TableReader<'a>>, Fault> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let DeValue::Table(table) = value.get_ref() else {
            return Err(self.mistyped(key, value, "a table"));
        };
        Self::new(self.source, self.path(key), value.span(), table, known).map(Some)
    }

    /// A sub-table that must be there.
    pub(crate) fn table(
        &self,
        key: &'static str,
        known: &[&str],
    ) -> Result<TableReader<'a>, Fault> {
        self.optional_table(key, known)?
            .ok_or_else(|| (Place::Whole, RigCause::MissingTable { table: self.path(key) }))
    }

    /// An array of tables; empty when it is missing.
    pub(crate) fn tables(
        &self,
        key: &'static str,
        known: &[&str],
    ) -> Result<Vec<TableReader<'a>>, Fault> {
        const KIND: &str = "an array of tables, [ { … }, { … } ]";
        let Some(value) = self.get(key) else { return Ok(Vec::new()) };
        let DeValue::Array(array) = value.get_ref() else {
            return Err(self.mistyped(key, value, KIND));
        };
        let items = array.iter().enumerate();
        items
            .map(|(index, item)| match item.get_ref() {
                DeValue::Table(table) => {
                    let name = format!("{}[{index}]", self.path(key));
                    Self::new(self.source, name, item.span(), table, known)
                }
                _ => Err(self.mistyped(key, item, KIND)),
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
