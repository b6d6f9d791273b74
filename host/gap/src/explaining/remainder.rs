//! The gap that remains when the explanation is partial or unknown: its size, and where it lies.

use serde::Serialize;

use crate::explaining::figures::{self, Gap};
use crate::explaining::locate::{Cell, locate};
use crate::rounding::closed_and_left;
use crate::searching::selection::Selection;
use crate::searching::selector::Selector;

/// Cells of the same channel and phase that are told together, at most.
const TOLD: usize = 3;
/// Groups with a smaller share are not told.
const LEAST: f64 = 0.05;
/// Cells at most.
const CELLS: usize = 40;

/// The gap that the best model leaves on held-out data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Left {
    /// Effects of this model, named or not; empty for the nominal model.
    pub after: Vec<String>,
    /// Share of the gap above the floor.
    pub gap_share: f64,
    /// Errors of this model, as if it were named.
    pub gap: Gap,
    /// Where the remaining gap lies, largest first. Shares are of the remaining gap.
    #[serde(rename = "where")]
    pub places: Vec<Cell>,
    /// The same in words.
    pub words: String,
}

/// What the best model of a selection leaves.
pub fn left(selector: &Selector<'_>, selection: &Selection) -> Left {
    let problem = selector.problem;
    let best = &selection.best;
    let effects = problem.plant.effects();
    let after = best.fit.effects.iter().map(|&effect| effects[effect].id.to_owned());
    let shrink = best.score.shrink(&selection.nominal.score);
    let gap = figures::gap(selector, &selection.nominal, best);
    Left::new(after.collect(), gap, shrink, locate(problem, &best.score))
}

impl Left {
    /// `shrink`: of the model; `places`: of its error, as [`locate`] gives them.
    fn new(after: Vec<String>, gap: Gap, shrink: f64, mut places: Vec<Cell>) -> Self {
        let gap_share = 1.0 - shrink;
        let words = words(&after, gap_share, &places);
        places.truncate(CELLS);
        Self { after, gap_share, gap, places, words }
    }
}

fn words(after: &[String], gap_share: f64, places: &[Cell]) -> String {
    let model = match after {
        [] => "the nominal model".to_owned(),
        effects => format!("the model with {}", effects.join(" and ")),
    };
    let mut words = format!(
        "after {model}, the best that was found, {} of the gap above the floor is left",
        closed_and_left(1.0 - gap_share)[1]
    );
    let groups = groups(places);
    for (i, group) in groups.iter().take(TOLD).filter(|group| group.share >= LEAST).enumerate() {
        words += if i == 0 { "; of that, " } else { "; " };
        words += &format!(
            "{:.0} % in {}, {}, most at {}",
            100.0 * group.share,
            group.top.channel,
            group.top.phase,
            group.top.stretch()
        );
        words += ": ";
        words += match group.top.note.as_str() {
            "" => "no simple shape",
            note => note,
        };
    }
    words
}

/// Cells of one channel in one phase.
struct Group<'a> {
    share: f64,
    /// The largest.
    top: &'a Cell,
}

/// Largest first. `places`: largest first.
fn groups(places: &[Cell]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    for cell in places {
        let same = |group: &&mut Group<'_>| {
            (&group.top.channel, &group.top.phase) == (&cell.channel, &cell.phase)
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.share += cell.gap_share,
            None => groups.push(Group { share: cell.gap_share, top: cell }),
        }
    }
    groups.sort_by(|a, b| b.share.total_cmp(&a.share));
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(channel: &str, phase: &str, from_m: f64, gap_share: f64, note: &str) -> Cell {
        Cell {
            channel: channel.to_owned(),
            phase: phase.to_owned(),
            arc_m: [from_m, from_m + 0.02],
            gap_share,
            note: note.to_owned(),
            ..Cell::default()
        }
    }

    #[test]
    fn what_is_left_is_told_by_channel_and_phase_the_largest_first() {
        let places = vec![
            cell("fx_N", "dwell", 0.04, 0.3, ""),
            cell("fz_N", "sliding", 0.02, 0.25, "swings"),
            cell("fz_N", "sliding", 0.06, 0.15, "swings"),
            cell("fy_N", "dwell", 0.0, 0.04, ""),
        ];
        let left = Left::new(vec!["wall.motion".to_owned()], Gap::default(), 0.65, places);
        assert_eq!(
            left.words,
            "after the model with wall.motion, the best that was found, 35 % of the gap above the floor \
             is left; of that, 40 % in fz_N, sliding, most at 20 to 40 mm: swings; 30 % in fx_N, \
             dwell, most at 40 to 60 mm: no simple shape"
        );
        assert!((left.gap_share - 0.35).abs() < 1e-12);
        let json = serde_json::to_value(&left).unwrap();
        assert_eq!(json["where"][0]["channel"], "fx_N");
        assert!(json["where"][0]["descriptors"]["mean"].is_f64());
    }

    #[test]
    fn the_nominal_model_leaves_all_of_it() {
        let left = Left::new(Vec::new(), Gap::default(), 0.0, Vec::new());
        assert!(left.words.starts_with("after the nominal model, the best that was found, 100 %"));
    }
}
