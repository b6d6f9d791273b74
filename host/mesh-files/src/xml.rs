//! The elements of a VTK file. It is no XML where raw data are appended, so that this looks for the few
//! elements that such a file has.

/// A tag: its name, its attributes as written, and where it begins and ends.
pub(crate) struct Tag<'a> {
    pub(crate) name: &'a str,
    attributes: &'a str,
    pub(crate) begins: usize,
    pub(crate) ends: usize,
}

/// The tags of a text, closing ones with their slash. Comments and declarations are passed over.
pub(crate) fn tags(text: &str) -> impl Iterator<Item = Tag<'_>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        loop {
            let begins = at + text.get(at..)?.find('<')?;
            let rest = &text[begins + 1..];
            if let Some(comment) = rest.strip_prefix("!--") {
                at = begins + 4 + comment.find("-->")? + 3;
                continue;
            }
            let end = rest.find('>')?;
            at = begins + 1 + end + 1;
            let inside = rest[..end].trim_end_matches('/');
            if inside.starts_with(['?', '!']) {
                continue;
            }
            let name_ends = inside.find(char::is_whitespace).unwrap_or(inside.len());
            let (name, attributes) = inside.split_at(name_ends);
            return Some(Tag { name, attributes, begins, ends: at });
        }
    })
}

impl<'a> Tag<'a> {
    /// The value of an attribute.
    pub(crate) fn attribute(&self, name: &str) -> Option<&'a str> {
        let mut rest = self.attributes;
        loop {
            let (key, after) = rest.split_once('=')?;
            let after = after.trim_start();
            let quote = after.chars().next().filter(|quote| matches!(quote, '"' | '\''))?;
            let (value, after) = after[1..].split_once(quote)?;
            if key.trim() == name {
                return Some(value);
            }
            rest = after;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_and_their_attributes_are_found() {
        let text = "<?xml version=\"1.0\"?>\n<!-- <a> --><A b=\"1 > 0\"/><C d='e' f=\"g\">x</C><";
        let found = tags("<A b=\"1\"/><C d='e' f=\"g\">x</C><").collect::<Vec<_>>();
        let names = found.iter().map(|tag| tag.name).collect::<Vec<_>>();
        assert_eq!(names, ["A", "C", "/C"]);
        assert_eq!((found[1].attribute("f"), found[1].attribute("x")), (Some("g"), None));
        assert_eq!(tags(text).next().map(|tag| tag.name), Some("A"));
    }
}
