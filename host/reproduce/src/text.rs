//! The rows as text: for a terminal, and as a page of the book.

use std::fmt::Write as _;

use crate::report::{Report, SystemReport, TRUTH};
use crate::row::Row;

/// A number with four significant digits, as it stands beside a printed one.
pub fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let magnitude = x.abs().log10().floor();
    if !(-4.0..6.0).contains(&magnitude) {
        return format!("{x:.2e}");
    }
    let decimals = (3.0 - magnitude).clamp(0.0, 8.0) as usize;
    let text = format!("{x:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// A number, or a dash.
pub fn number_or_dash(x: Option<f64>) -> String {
    x.map_or_else(|| "–".into(), number)
}

/// How a row was obtained, or why there is nothing.
pub fn remark(row: &Row) -> String {
    match &row.why_not {
        Some(why) if row.how.is_empty() => format!("not here: {why}"),
        Some(why) => format!("not here: {why} ({})", row.how),
        None => row.how.clone(),
    }
}

/// Rows that follow each other and were obtained in the same way, with that way.
pub fn groups(rows: &[Row]) -> Vec<(String, &[Row])> {
    let same = |a: &Row, b: &Row| remark(a) == remark(b);
    rows.chunk_by(same).map(|group| (remark(&group[0]), group)).collect()
}

/// Columns for a terminal: the way of a group of rows stands below them.
pub fn table(report: &Report) -> String {
    let width = report.rows().map(|row| row.figure.chars().count()).max().unwrap_or(0);
    let mut text = format!("{TRUTH}\n");
    for own in &report.systems {
        // Writing to a string does not fail.
        let _ = writeln!(text, "\n{}: {} ({:.0} s)", own.name, own.doc, own.seconds);
        let gap = " ".repeat(width.saturating_sub(6));
        let _ = writeln!(text, "  figure{gap}  {:>10}  {:>10}  unit", "published", "ours");
        for (remark, rows) in groups(&own.rows) {
            for row in rows {
                let gap = " ".repeat(width - row.figure.chars().count());
                let _ = writeln!(
                    text,
                    "  {}{gap}  {:>10}  {:>10}  {}",
                    row.figure,
                    number_or_dash(row.published),
                    number_or_dash(row.ours),
                    row.unit
                );
            }
            if !remark.is_empty() {
                let _ = writeln!(text, "    {remark}");
            }
        }
    }
    if report.interrupted {
        text += "\ninterrupted: what was not finished is not in the table\n";
    }
    text
}

/// The page of the book. Times are left out, so that it stays the same on another computer.
pub fn markdown(report: &Report) -> String {
    let mut text = format!(
        "# Reproduced\n\n<!-- Generated. To write it again:\n     cathforce reproduce --page \
         docs/reference/reproduced.md\n-->\n\n{TRUTH}\n\nA dash stands where nothing was printed, or where a \
         figure cannot be had here. The notes below each table say how the figures were obtained, or why there \
         are none.\n"
    );
    for own in &report.systems {
        text += &section(own);
    }
    text
}

fn section(own: &SystemReport) -> String {
    let mut text = format!(
        "\n## {}\n\n`{}`: {}\n\n| figure | published | ours | unit | note |\n| --- | --- | --- | --- | --- |\n",
        own.doc, own.name, own.source
    );
    let mut notes: Vec<String> = Vec::new();
    for row in &own.rows {
        let remark = remark(row);
        let note = notes.iter().position(|known| *known == remark).unwrap_or_else(|| {
            notes.push(remark);
            notes.len() - 1
        });
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            row.figure.replace('|', "\\|"),
            number_or_dash(row.published),
            number_or_dash(row.ours),
            row.unit,
            note + 1,
        );
    }
    text.push('\n');
    for (k, note) in notes.iter().enumerate() {
        let _ = writeln!(text, "{}. {note}", k + 1);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_four_digits() {
        for (x, text) in [
            (0.0058, "0.0058"),
            (24.29, "24.29"),
            (592.54, "592.5"),
            (6169.0, "6169"),
            (-0.47312, "-0.4731"),
            (2.65e-6, "2.65e-6"),
            (0.0, "0"),
            (600.0, "600"),
        ] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn rows_that_were_obtained_in_one_way_say_it_once() {
        let row = |figure: &str, how: &str| Row::of(figure, "N", 0.1).published(0.2).how(how);
        let mut missing = Row::without("c|d", "mm", "no wall");
        missing.published = Some(3.0);
        let own = SystemReport {
            name: "toy",
            doc: "A toy",
            source: "somebody",
            rows: vec![row("a", "so"), row("longer", "so"), missing],
            plots: Vec::new(),
            seconds: 1.0,
            failed: Vec::new(),
        };
        let report = Report { systems: vec![own], interrupted: true };
        let table = table(&report);
        assert_eq!(table.matches("    so\n").count(), 1, "{table}");
        assert!(table.contains("  a              0.2         0.1  N\n"), "{table}");
        assert!(table.starts_with(TRUTH) && table.contains("interrupted:"));
        let page = markdown(&report);
        assert!(page.contains("| longer | 0.2 | 0.1 | N | 1 |"), "{page}");
        assert!(page.contains("| c\\|d | 3 | – | mm | 2 |"), "{page}");
        assert!(page.ends_with("\n\n1. so\n2. not here: no wall\n"), "{page}");
    }
}
