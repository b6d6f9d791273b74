//! Names on the command line that are not known.

/// Says that a name is not known, which one is near, and which command lists them all.
pub fn unknown(what: &str, name: &str, known: &[&str], list: &str) -> String {
    let hint = match cathforce_bundle::nearest(name, known) {
        Some(nearest) => format!("did you mean `{nearest}`? "),
        None => String::new(),
    };
    format!("there is no {what} `{name}`; {hint}`{list}` lists them")
}
