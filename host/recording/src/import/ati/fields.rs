//! The fields of a line of a sensor's log.

/// Splits a line at commas, semicolons and tabs outside of quotes. A separator at the end begins no
/// further field. ATI's program quotes every field, and a date has a comma in it.
pub(super) fn split(line: &str) -> Vec<&str> {
    let mut fields = Vec::new();
    let (mut start, mut quoted) = (0, false);
    for (at, letter) in line.char_indices() {
        match letter {
            '"' => quoted = !quoted,
            ',' | ';' | '\t' if !quoted => {
                fields.push(bare(&line[start..at]));
                start = at + 1;
            }
            _ => {}
        }
    }
    fields.push(bare(&line[start..]));
    if fields.len() > 1 && fields.last() == Some(&"") {
        fields.pop();
    }
    fields
}

/// A field without the blanks and the quotes around it.
fn bare(field: &str) -> &str {
    let field = field.trim();
    let inside = field.strip_prefix('"').and_then(|field| field.strip_suffix('"'));
    inside.unwrap_or(field).trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_separator_in_quotes_separates_nothing() {
        let line = "\"0x0\", \"1\";-3\t\"Jan 1, 2024 1:00:00 PM\",";
        assert_eq!(split(line), ["0x0", "1", "-3", "Jan 1, 2024 1:00:00 PM"]);
        assert_eq!(split(""), [""]);
        assert_eq!(split("a,\"b,c"), ["a", "\"b,c"], "a quote that is not closed");
    }
}
