//! Reads the tables of a settings file and collects everything that is wrong with them.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::entry::misspelt;
use super::problem::Problem;

/// A value with its place in the text.
pub type Value<'t> = Spanned<DeValue<'t>>;

/// The text of a file, and what was found to be wrong so far.
pub struct Reader<'t> {
    text: &'t str,
    problems: Vec<Problem>,
}

impl<'t> Reader<'t> {
    pub fn new(text: &'t str) -> Self {
        Self { text, problems: Vec::new() }
    }

    /// Everything that was found to be wrong, by line.
    pub fn into_problems(mut self) -> Vec<Problem> {
        self.problems.sort_by_key(|problem| problem.line);
        self.problems
    }

    pub fn add(&mut self, problems: impl IntoIterator<Item = Problem>) {
        self.problems.extend(problems);
    }

    pub fn has_problems(&self) -> bool {
        !self.problems.is_empty()
    }

    /// Line of a place in the text, from 1.
    pub fn line(&self, span: &Range<usize>) -> usize {
        1 + self.text.get(..span.start).unwrap_or(self.text).matches('\n').count()
    }

    pub fn report(
        &mut self,
        span: &Range<usize>,
        message: impl Into<String>,
        fix: impl Into<String>,
    ) {
        let line = self.line(span);
        self.problems.push(Problem { line, message: message.into(), fix: fix.into() });
    }

    /// Reports the keys of a table that are none of `known`; `form` says what the table may hold.
    pub fn check_keys(&mut self, path: &str, table: &DeTable<'_>, known: &[&str], form: &str) {
        for key in table.keys().filter(|key| !known.contains(&key.get_ref().as_ref())) {
            let name = key.get_ref();
            let place = if path.is_empty() { "here".into() } else { format!("in `{path}`") };
            let fix = misspelt(name, known, form);
            self.report(&key.span(), format!("there is no key `{name}` {place}"), fix);
        }
    }

    /// A table; reports anything else.
    pub fn table<'v>(
        &mut self,
        path: &str,
        value: &'v Value<'_>,
        form: &str,
    ) -> Option<&'v DeTable<'v>> {
        let table = value.get_ref().as_table();
        self.report_unless(table.is_some(), path, value, "a table", form);
        table
    }

    /// A key that has to be there, in a table that begins at `span`.
    pub fn required<'v>(
        &mut self,
        path: &str,
        table: &'v DeTable<'_>,
        name: &str,
        span: &Range<usize>,
        form: &str,
    ) -> Option<&'v Value<'v>> {
        let value = table.get(name);
        if value.is_none() {
            self.report(span, format!("`{path}` has no `{name}`"), form);
        }
        value
    }

    /// A whole number from 0 to `max`.
    pub fn whole(&mut self, path: &str, value: &Value<'_>, max: u32, form: &str) -> Option<u32> {
        let whole = value
            .get_ref()
            .as_integer()
            .and_then(|whole| i64::from_str_radix(whole.as_str(), whole.radix()).ok());
        let whole = whole.and_then(|n| u32::try_from(n).ok()).filter(|n| *n <= max);
        let wanted = format!("a whole number from 0 to {max}");
        self.report_unless(whole.is_some(), path, value, &wanted, form);
        whole
    }

    /// A number in double precision.
    pub fn number(&mut self, path: &str, value: &Value<'_>, form: &str) -> Option<f64> {
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(whole) => {
                i64::from_str_radix(whole.as_str(), whole.radix()).ok().map(|n| n as f64)
            }
            _ => None,
        };
        self.report_unless(number.is_some(), path, value, "a number", form);
        number
    }

    pub fn flag(&mut self, path: &str, value: &Value<'_>, form: &str) -> Option<bool> {
        let flag = value.get_ref().as_bool();
        self.report_unless(flag.is_some(), path, value, "true or false", form);
        flag
    }

    /// A text; with `words`, one of these.
    pub fn word<'v>(
        &mut self,
        path: &str,
        value: &'v Value<'_>,
        words: &[&str],
        form: &str,
    ) -> Option<&'v str> {
        let text = value.get_ref().as_str();
        let word = text.filter(|text| words.is_empty() || words.contains(text));
        let wanted = match words {
            [] => "a text".to_owned(),
            words => {
                words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or ")
            }
        };
        let form = text.map_or(form.to_owned(), |text| misspelt(text, words, form));
        self.report_unless(word.is_some(), path, value, &wanted, &form);
        word
    }

    fn report_unless(
        &mut self,
        is_right: bool,
        path: &str,
        value: &Value<'_>,
        wanted: &str,
        form: &str,
    ) {
        if is_right {
            return;
        }
        // The words of TOML's grammar: "integer", "string", ...
        let found =
            self.text.get(value.span()).filter(|text| text.len() < 40 && !text.contains('\n'));
        let found =
            found.map_or_else(|| value.get_ref().type_str().to_owned(), |text| format!("`{text}`"));
        self.report(&value.span(), format!("`{path}` must be {wanted}, not {found}"), form);
    }
}
