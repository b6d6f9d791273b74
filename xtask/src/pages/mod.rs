//! Pages of the book that are written from the sources, and pages whose claims are checked.

mod hazards;
mod soup;
mod unsafe_code;

#[cfg(test)]
mod tests {
    use std::fs;

    use crate::shell::root;

    /// Says that a page is not written by hand.
    fn page(title: &str, from: &str, text: &str) -> String {
        format!(
            "# {title}\n\n<!-- Written from {from} by `CATHFORCE_WRITE_PAGES=1 cargo test -p xtask pages`. \
             -->\n\n{text}"
        )
    }

    fn compare(name: &str, text: &str) {
        let path = root().join("docs/reference").join(name);
        if std::env::var_os("CATHFORCE_WRITE_PAGES").is_some() {
            return fs::write(path, text).unwrap();
        }
        let there = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            there == text,
            "docs/reference/{name} is out of date: `CATHFORCE_WRITE_PAGES=1 cargo test -p xtask pages` \
             writes it"
        );
    }

    #[test]
    fn the_page_of_unsafe_code_is_up_to_date_and_each_has_a_proof() {
        let found = super::unsafe_code::all(root()).unwrap();
        let without: Vec<_> = found.iter().filter(|one| one.proof.is_none()).collect();
        assert!(without.is_empty(), "unsafe without a comment `// SAFETY: …`: {without:#?}");
        let text = page("Unsafe code", "the sources", &super::unsafe_code::text(&found));
        compare("unsafe.md", &text);
    }

    #[test]
    fn the_page_of_the_firmwares_dependencies_is_up_to_date() {
        let text = super::soup::text().unwrap();
        compare("soup.md", &page("Dependencies of the firmware", "`Cargo.lock`", &text));
    }

    #[test]
    fn each_control_of_a_hazard_has_a_promise_or_a_test_that_exists() {
        super::hazards::check(root()).unwrap();
    }
}
