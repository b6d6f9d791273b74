//! Convergence of the model with the number of its links.

use std::fmt::Write as _;

use cathforce_mechanics::MOST_LINKS;

use crate::{Case, Choices, Links, Record, Score, compare, play};

/// Numbers of links of the models that are compared with the finest one.
const NUMBERS: [usize; 5] = [16, 32, 64, 128, 256];

/// The finest model, with which the others are compared.
pub fn finest(case: &Case) -> anyhow::Result<Vec<Record>> {
    with_links(case, MOST_LINKS)
}

/// A model in double precision, with the device's steps and wall.
fn with_links(case: &Case, links: usize) -> anyhow::Result<Vec<Record>> {
    play::<f64, MOST_LINKS>(case, &Choices { links: Links::Of(links), ..Choices::default() })
}

/// Errors of a case against [`finest`], by the number of links.
pub fn by_links(case: &Case, finest: &[Record]) -> anyhow::Result<Vec<(usize, Score)>> {
    let score = |links| {
        let played = with_links(case, links)?;
        Ok((links, compare(finest, &played, case.scored_from_s)))
    };
    NUMBERS.into_iter().map(score).collect()
}

/// A table of the drive force's error, over the peak with 512 links; one row a case.
pub fn links_table(cases: &[Case]) -> anyhow::Result<String> {
    let mut text = String::from("| case |");
    // Writing to a string does not fail.
    for links in NUMBERS {
        let _ = write!(text, " {links} links |");
    }
    text += "\n| --- |";
    text += &" --- |".repeat(NUMBERS.len());
    text.push('\n');
    for case in cases {
        let _ = write!(text, "| {} |", case.name);
        for (_, score) in by_links(case, &finest(case)?)? {
            let _ = write!(text, " {:.2} % |", 100.0 * score.outside_snaps.drive_force_share);
        }
        text.push('\n');
    }
    Ok(text)
}
