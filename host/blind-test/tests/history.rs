//! `docs/reference/blind-tests.md` and its chart are those of the sets beside them.

use std::fs;
use std::path::PathBuf;

use cathforce_blind_test::history::{chart, page, read};
use cathforce_blind_test::{Counted, Rigs};

fn reference() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference")
}

/// With `CATHFORCE_WRITE_PAGES=1` the page and the chart are written again.
#[test]
fn the_page_and_the_chart_of_all_sets_are_up_to_date() {
    let scores = read(&reference().join("blind-tests")).unwrap();
    for (name, text) in [("blind-tests.md", page(&scores)), ("blind-tests.svg", chart(&scores))] {
        let path = reference().join(name);
        if std::env::var_os("CATHFORCE_WRITE_PAGES").is_some_and(|value| value == "1") {
            fs::write(&path, &text).unwrap();
        }
        assert_eq!(
            fs::read_to_string(&path).unwrap_or_default(),
            text,
            "{} is not up to date: run this test with CATHFORCE_WRITE_PAGES=1",
            path.display()
        );
    }
}

/// What is counted in each file agrees, and no set is lost.
#[test]
fn the_sets_are_those_that_were_published() {
    let scores = read(&reference().join("blind-tests")).unwrap();
    assert_eq!(scores.len(), 30);
    assert_eq!(scores.iter().filter(|score| score.rigs == Rigs::Own).count(), 18);
    assert_eq!(scores.iter().map(|score| score.cases).sum::<usize>(), 4384);
    for score in &scores {
        assert!(score.figures.len() >= 13, "{score:?}");
        // A figure is taken over cases that count, and right answers are counted over the same.
        let counted: usize = score.right.iter().map(|right| right.of).sum();
        assert_eq!(counted, score.cases - score.too_small, "{:?}", score.published);
        let wrong = score.figure(Counted::ConfidentlyWrong).unwrap();
        assert_eq!(wrong.of, counted, "{:?}", score.published);
    }
}
