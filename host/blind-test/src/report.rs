//! A score as text.

use std::fmt::Write as _;

use crate::figures::SMALLEST_GAP;
use crate::parts::parts_table;
use crate::reliability::reliability_table;
use crate::score::Score;

impl Score {
    /// All figures in Markdown.
    pub fn markdown(&self) -> String {
        let list = |items: Vec<String>| items.join(", ");
        let mut text = format!(
            "{} cases of seed {}. {} of them have a gap below {SMALLEST_GAP} times the noise and do \
             not count. The floor is the noise, the change from a wall that is 40 µm nearer, and, \
             where a vessel divides, the change from an edge that differs from the mesh. \
             SHA-256 of the program that answered: {}. SHA-256 of seals.json: `{}`.\n\n",
            self.cases,
            list(self.seeds.iter().map(u64::to_string).collect()),
            self.too_small,
            list(self.program_sha256.iter().map(|hash| format!("`{hash}`")).collect()),
            self.seals_sha256.as_deref().unwrap_or("not kept"),
        );
        text += &self.table();
        text += "\nAn answer is right if it is `no_gap` for a case without an effect, `unknown` for \
                 an effect outside the library, names a single effect first, or holds both effects \
                 of a pair in its reported sets.\n\n| vessel and instrument | single effect | pair | \
                 outside the library | no effect |\n| --- | --- | --- | --- | --- |\n";
        // Writing to a string does not fail.
        for row in self.right.chunks(4) {
            let cells: Vec<String> =
                row.iter().map(|c| format!("{} of {}", c.right, c.of)).collect();
            let _ = writeln!(text, "| {} | {} |", row[0].rig, cells.join(" | "));
        }
        if !self.parts.is_empty() {
            text += "\n";
            text += &parts_table(&self.parts);
        }
        if !self.reliability.is_empty() {
            text += "\n";
            text += &reliability_table(&self.reliability);
        }
        text
    }

    /// The figures as a table of Markdown.
    pub fn table(&self) -> String {
        let mut text = String::from(
            "| figure | target | reached | of | 95 % interval |\n| --- | --- | --- | --- | --- |\n",
        );
        for f in &self.figures {
            let (target, reached, interval) =
                (f.target_text(), f.reached_text(), f.interval_text());
            let words = f.figure.words();
            let _ = writeln!(text, "| {words} | {target} | {reached} | {} | {interval} |", f.of);
        }
        text
    }
}
