//! The scores of all blind tests so far: one chart over time, and a table.
//!
//! Each set is a file of `docs/reference/blind-tests/`, in the format that `cathforce gap blind-test
//! score` writes. A new set only adds a file.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::figures::Counted;
use crate::score::{FORMAT, Rigs, Score};

/// Why the scores of a folder cannot be shown.
#[derive(Debug, Error)]
pub enum HistoryError {
    #[error("{}: {error}", path.display())]
    File { path: PathBuf, error: std::io::Error },
    #[error("{}: {error}", path.display())]
    Content { path: PathBuf, error: serde_json::Error },
    #[error("{}: the format is `{format}`\n  fix: it should be `{FORMAT}`", path.display())]
    Format { path: PathBuf, format: String },
    #[error(
        "{}: the day on which the seal was published is missing\n  fix: `gap blind-test score FOLDER \
         --date YYYY-MM-DD`",
        .0.display()
    )]
    NoDate(PathBuf),
}

/// The scores in a folder, in the order of their file names, which begin with the day of the seal.
pub fn read(folder: &Path) -> Result<Vec<Score>, HistoryError> {
    let file = |path: &Path| {
        let path = path.to_path_buf();
        move |error| HistoryError::File { path, error }
    };
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(file(folder))? {
        paths.push(entry.map_err(file(folder))?.path());
    }
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    let mut scores = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).map_err(file(&path))?;
        // A file holds one score or a list of them.
        let own: Result<Vec<Score>, _> = match text.trim_start().starts_with('[') {
            true => serde_json::from_str(&text),
            false => serde_json::from_str(&text).map(|score| vec![score]),
        };
        let own = own.map_err(|error| HistoryError::Content { path: path.clone(), error })?;
        for score in own {
            if score.format != FORMAT {
                return Err(HistoryError::Format { path, format: score.format });
            }
            if score.published.date.is_none() {
                return Err(HistoryError::NoDate(path));
            }
            scores.push(score);
        }
    }
    Ok(scores)
}

/// What the chart shows: a panel for each of these, with its title and the top of its scale in percent.
const PANELS: [(Counted, &str, f64); 6] = [
    (Counted::NamedFirst, "single effect: named first", 100.0),
    (Counted::InReportedSet, "single effect: in the reported set", 100.0),
    (Counted::PairFound, "pair: both effects found", 100.0),
    (Counted::OutsideUnknown, "outside the library: answered unknown", 100.0),
    (Counted::ConfidentlyWrong, "wrong with confidence", 20.0),
    (Counted::GapClaimedWithoutEffect, "gap claimed without an effect", 100.0),
];

const COLUMNS: usize = 2;
const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 190.0;
/// Room for the scale, the title, and the days below \[px\].
const LEFT: f64 = 44.0;
const TOP: f64 = 34.0;
const RIGHT: f64 = 12.0;
const BOTTOM: f64 = 26.0;
const LEGEND: f64 = 30.0;

/// The chart of all sets as SVG, for light and dark pages. The sets stand in their order in time.
pub fn chart(scores: &[Score]) -> String {
    let rows = PANELS.len().div_ceil(COLUMNS) as f64;
    let (width, height) = (WIDTH * COLUMNS as f64, HEIGHT * rows + LEGEND);
    // Writing to a string does not fail.
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\">\n\
         <title>Scores of all blind tests in their order in time</title>\n<style>\n\
         text {{ font: 12px system-ui, sans-serif; fill: #333 }}\n.title {{ font-weight: 600 }}\n\
         .small {{ font-size: 11px; fill: #666 }}\n.axis {{ stroke: #bbb }}\n\
         .target {{ stroke: #b3261e; stroke-dasharray: 5 4 }}\n.bar {{ stroke: #2b6cb0; opacity: .45 }}\n\
         .own {{ fill: #2b6cb0 }}\n.given {{ fill: #fff; stroke: #2b6cb0; stroke-width: 1.5 }}\n\
         .stranger {{ fill: #b7791f }}\n\
         @media (prefers-color-scheme: dark) {{\ntext {{ fill: #ddd }}\n.small {{ fill: #aaa }}\n\
         .axis {{ stroke: #555 }}\n.target {{ stroke: #ff8a80 }}\n.bar {{ stroke: #7cb7f2 }}\n\
         .own {{ fill: #7cb7f2 }}\n.given {{ fill: #1b1b1f; stroke: #7cb7f2 }}\n.stranger {{ fill: #f6c453 }}\n}}\n</style>\n"
    );
    for (index, panel) in PANELS.iter().enumerate() {
        let (column, row) = (index % COLUMNS, index / COLUMNS);
        let (x, y) = (WIDTH * column as f64, HEIGHT * row as f64);
        let _ = writeln!(svg, "<g transform=\"translate({x} {y})\">");
        draw(&mut svg, scores, *panel);
        svg += "</g>\n";
    }
    let y = HEIGHT * rows + 16.0;
    let _ = writeln!(
        svg,
        "<circle class=\"own\" cx=\"50\" cy=\"{0}\" r=\"4\"/><text x=\"60\" y=\"{y}\">own rigs</text>\n\
         <circle class=\"given\" cx=\"140\" cy=\"{0}\" r=\"4\"/><text x=\"150\" y=\"{y}\">rigs of \
         another simulator</text>\n<line class=\"bar\" x1=\"330\" x2=\"330\" y1=\"{1}\" y2=\"{2}\"/>\
         <text x=\"340\" y=\"{y}\">95 % interval</text>\n<line class=\"target\" x1=\"440\" \
         x2=\"470\" y1=\"{0}\" y2=\"{0}\"/><text x=\"478\" y=\"{y}\">target</text>\n\
         <circle class=\"stranger\" cx=\"540\" cy=\"{0}\" r=\"4\"/><text x=\"550\" \
         y=\"{y}\">strangers</text>",
        y - 4.0,
        y - 11.0,
        y + 3.0,
    );
    svg + "</svg>\n"
}

/// One panel.
fn draw(svg: &mut String, scores: &[Score], (counted, title, most): (Counted, &str, f64)) {
    let (plot_w, plot_h) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
    let bottom = TOP + plot_h;
    let at_x = |i: usize| LEFT + plot_w * (i as f64 + 0.5) / scores.len().max(1) as f64;
    let at_y = |percent: f64| bottom - plot_h * percent.min(most) / most;
    let _ = writeln!(svg, "<text class=\"title\" x=\"{LEFT}\" y=\"20\">{title}</text>");
    for percent in [0.0, 0.5 * most, most] {
        let y = at_y(percent);
        let _ = writeln!(
            svg,
            "<line class=\"axis\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
             <text class=\"small\" text-anchor=\"end\" x=\"{}\" y=\"{:.1}\">{percent:.0} %</text>",
            LEFT + plot_w,
            LEFT - 5.0,
            y + 4.0
        );
    }
    let target = counted.target();
    for bound in [target.at_least, target.at_most].into_iter().flatten() {
        let y = at_y(bound);
        let _ = writeln!(
            svg,
            "<line class=\"target\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>",
            LEFT + plot_w
        );
    }
    for (i, score) in scores.iter().enumerate() {
        let Some(figure) = score.figure(counted) else { continue };
        let (Some(reached), Some([low, high])) = (figure.reached, figure.interval()) else {
            continue;
        };
        let x = at_x(i);
        let class = match score.rigs {
            Rigs::Own => "own",
            Rigs::Given => "given",
            Rigs::Strangers => "stranger",
        };
        let _ = writeln!(
            svg,
            "<line class=\"bar\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{:.1}\" y2=\"{:.1}\"/>\
             <circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{:.1}\" r=\"4\"><title>{}: {} of {} \
             cases</title></circle>",
            at_y(low),
            at_y(high),
            at_y(reached),
            day(score),
            figure.reached_text(),
            figure.of
        );
    }
    for (i, anchor) in [(0, "start"), (scores.len().saturating_sub(1), "end")] {
        let Some(score) = scores.get(i) else { continue };
        let x = if i == 0 { LEFT } else { LEFT + plot_w };
        let _ = writeln!(
            svg,
            "<text class=\"small\" text-anchor=\"{anchor}\" x=\"{x}\" y=\"{}\">{}</text>",
            bottom + 16.0,
            day(score)
        );
    }
}

fn day(score: &Score) -> &str {
    score.published.date.as_deref().unwrap_or("no date")
}

/// The page: how to read it, the chart, one row a set, and the newest set in full.
pub fn page(scores: &[Score]) -> String {
    let mut text = String::from(
        "# Blind tests of the diagnosis\n\n\
         A blind test draws cases, simulates them with a solver that is not the device's model, and \
         seals the true effects before any case is diagnosed. The program answers every case. Only \
         then are the labels opened and the answers scored. A set whose labels are known is used for \
         tuning, so each set is blind once. [How a diagnosis works](../explanation/diagnosis.md) \
         explains the terms.\n\n\
         Own rigs are two vessels with two instruments each. Given rigs are bundles that another \
         simulator made; their vessels divide, and their noise is larger. Strangers differ from \
         all of these: eight vessels and six instruments, no two rigs alike and some with a segmented \
         geometry; motions that are not the protocol's; sensors that are filtered, coarse, incomplete \
         or stated wrongly; nuisances beyond the priors; and effects of other shapes. Four of the \
         vessels and three of the instruments serve for tuning, the others for scores \
         alone.\n\n\
         This page is made from the files in `docs/reference/blind-tests/`, one for each set. \
         `cathforce gap blind-test score FOLDER --json` prints a set in the same format.\n\n\
         ![Scores of all blind tests in their order in time, with targets and 95 % \
         intervals](blind-tests.svg)\n\n\
         ## All sets\n\n\
         Each cell is a share and the number of cases that it is taken over. \"Found\" means both \
         effects of a pair. Earlier sets have no figures over the floor.\n\n\
         | sealed | rigs | cases | named first | in the set | found | found, gap above the floor | \
         outside: unknown | wrong with confidence | gap claimed without an effect | seal |\n\
         | --- | --- | ---: | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    text += &rows(scores);
    for score in scores {
        if let Some(note) = &score.note {
            let _ = write!(text, "\n{}, {} cases: {note}\n", day(score), score.cases);
        }
    }
    text + &newest_in_full(scores)
}

/// One row of the table a set, the newest first.
fn rows(scores: &[Score]) -> String {
    let mut text = String::new();
    let columns = [
        Counted::NamedFirst,
        Counted::InReportedSet,
        Counted::PairFound,
        Counted::PairFoundAboveFloor,
        Counted::OutsideUnknown,
        Counted::ConfidentlyWrong,
        Counted::GapClaimedWithoutEffect,
    ];
    for score in scores.iter().rev() {
        let cell = |counted: &Counted| {
            let figure = score.figure(*counted);
            figure.map_or("–".to_owned(), |own| format!("{} of {}", own.reached_text(), own.of))
        };
        let cells: Vec<String> = columns.iter().map(cell).collect();
        let seal = score.seals_sha256.as_deref().and_then(|hash| hash.get(..8));
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            day(score),
            rigs(score),
            score.cases,
            cells.join(" | "),
            seal.map_or("–".to_owned(), |hash| format!("`{hash}`"))
        );
    }
    text
}

/// The newest set of each kind of rigs, with all figures.
fn newest_in_full(scores: &[Score]) -> String {
    let mut text = String::new();
    let newest = |rigs: Rigs| scores.iter().rev().find(|score| score.rigs == rigs);
    for (kind, score) in Rigs::ALL.map(|kind| (kind, newest(kind))) {
        let Some(score) = score else { continue };
        let title = match kind {
            Rigs::Own => "The newest set on own rigs",
            Rigs::Given => "The newest set on given rigs",
            Rigs::Strangers => "The newest set of strangers",
        };
        let published = &score.published;
        let commit = |commit: &Option<String>| {
            commit.as_deref().map_or("a commit that is not stated".to_owned(), |c| format!("`{c}`"))
        };
        let _ = write!(
            text,
            "\n## {title}\n\nThe seal was published on {} in {}, before any case was answered. The \
             program is that of {}.\n\n{}",
            day(score),
            commit(&published.sealed_in),
            commit(&published.program_commit),
            score.markdown()
        );
    }
    text
}

fn rigs(score: &Score) -> &'static str {
    match score.rigs {
        Rigs::Own => "own",
        Rigs::Given => "given",
        Rigs::Strangers => "strangers",
    }
}
