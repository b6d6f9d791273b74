//! A page with places to fill in.

/// Fills every `{{name}}` of the template once. A value that holds `{{…}}` itself stays as it is.
pub fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut page = String::with_capacity(template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        page += before;
        let named = after.split_once("}}").and_then(|(name, after)| {
            let (_, value) = values.iter().find(|(known, _)| *known == name)?;
            Some((value, after))
        });
        match named {
            Some((value, after)) => {
                page += value;
                rest = after;
            }
            None => {
                page += "{{";
                rest = after;
            }
        }
    }
    page + rest
}

#[cfg(test)]
mod tests {
    use super::fill;

    #[test]
    fn values_are_not_templates() {
        let values = [("title", "{{data}}"), ("data", "{{title}} {{script}}")];
        assert_eq!(
            fill("<{{title}}> {{data}} {{none}} {{", &values),
            "<{{data}}> {{title}} {{script}} {{none}} {{"
        );
    }
}
