//! The figures of strangers, split by what is strange about them.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::count::{Case, figures};
use crate::figures::{Counted, Figure};

/// The cases of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// What it is a kind of: `nuisances`, `sensors` or `motion`.
    pub by: String,
    /// A case whose sensors are unusual in several ways is in the part of each.
    pub kind: String,
    pub cases: usize,
    pub figures: Vec<Figure>,
}

/// What a row of the text shows of a part; JSON has all figures.
const COLUMNS: [(Counted, &str); 8] = [
    (Counted::NamedFirst, "named first"),
    (Counted::InReportedSet, "in the set"),
    (Counted::PairFound, "pair found"),
    (Counted::OutsideUnknown, "outside: unknown"),
    (Counted::GapClaimedWithoutEffect, "gap claimed without an effect"),
    (Counted::ConfidentlyWrong, "wrong with confidence"),
    (Counted::IntervalsHoldTruth, "intervals hold the truth"),
    (Counted::ShrinkWithinTenPoints, "shrink within 10 points"),
];

/// Strangers among these cases by kind; none if there are none.
pub(crate) fn parts(cases: &[Case<'_>]) -> Vec<Part> {
    let mut kinds: BTreeMap<(&str, String), Vec<Case<'_>>> = BTreeMap::new();
    for case in cases {
        for kind in case.revealed.0.stranger.iter().flat_map(|own| own.kinds()) {
            kinds.entry(kind).or_default().push(*case);
        }
    }
    let part = |((by, kind), own): ((&str, String), Vec<Case<'_>>)| Part {
        by: by.to_owned(),
        kind,
        cases: own.len(),
        figures: figures(&own),
    };
    kinds.into_iter().map(part).collect()
}

/// A row a part.
pub(crate) fn parts_table(parts: &[Part]) -> String {
    let names: Vec<&str> = COLUMNS.iter().map(|(_, name)| *name).collect();
    let mut text = format!(
        "| kind | cases | {} |\n| --- | ---: |{}\n",
        names.join(" | "),
        " --- |".repeat(COLUMNS.len())
    );
    for part in parts {
        let cell = |(counted, _): &(Counted, &str)| {
            let figure = part.figures.iter().find(|figure| figure.figure == *counted);
            match figure.filter(|figure| figure.of > 0) {
                Some(figure) => format!("{} of {}", figure.reached_text(), figure.of),
                None => "–".to_owned(),
            }
        };
        let cells: Vec<String> = COLUMNS.iter().map(cell).collect();
        let (by, kind) = (&part.by, &part.kind);
        // Writing to a string does not fail.
        let _ = writeln!(text, "| {by}: {kind} | {} | {} |", part.cases, cells.join(" | "));
    }
    text
}
