//! Convergence of the model with the number of its links.

#[cfg(feature = "any-length")]
use std::fmt::Write as _;

use crate::{Case, Choices, Record, Score, compare, play};

type Player = fn(&Case, &Choices) -> anyhow::Result<Vec<Record>>;

/// Models by number of links, in double precision, with the device's steps and wall.
const BY_LINKS: &[(usize, Player)] = &[
    #[cfg(feature = "any-length")]
    (16, play::<f64, 16>),
    (32, play::<f64, 32>),
    (64, play::<f64, 64>),
    (128, play::<f64, 128>),
    (256, play::<f64, 256>),
];

/// The finest model, with which the others are compared.
pub fn finest(case: &Case) -> anyhow::Result<Vec<Record>> {
    play::<f64, 512>(case, &Choices::default())
}

/// Errors of a case against [`finest`], by the number of links.
pub fn by_links(case: &Case, finest: &[Record]) -> anyhow::Result<Vec<(usize, Score)>> {
    let score = |&(links, play): &(usize, Player)| {
        let played = play(case, &Choices::default())?;
        Ok((links, compare(finest, &played, case.scored_from_s)))
    };
    BY_LINKS.iter().map(score).collect()
}

/// A table of the drive force's error, over the peak with 512 links; one row a case.
#[cfg(feature = "any-length")]
pub fn links_table(cases: &[Case]) -> anyhow::Result<String> {
    let mut text = String::from("| case |");
    // Writing to a string does not fail.
    for (links, _) in BY_LINKS {
        let _ = write!(text, " {links} links |");
    }
    text += "\n| --- |";
    text += &" --- |".repeat(BY_LINKS.len());
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
