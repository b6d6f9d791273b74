//! One HTML page of the reproduced figures: it needs nothing else, not even a script.

mod lines;

use std::fmt::Write as _;

use cathforce_reproduce::{Report, Row, SystemReport, TRUTH, groups, number_or_dash};

use crate::escape::html as escape;

/// The same style as a diagnosis.
const STYLE: &str = include_str!("../diagnosis/page.css");

/// The page: where the truth comes from, then every system with its rows and drawings.
pub fn reproduced_page(report: &Report) -> String {
    let mut body =
        format!("<p>{}</p><h1>Published systems, reproduced</h1>{}", escape(TRUTH), tiles(report));
    if report.interrupted {
        body += "<p class=soft>It was interrupted: what was not finished is not shown.</p>";
    }
    body.extend(report.systems.iter().map(system));
    format!(
        "<!doctype html>\n<html lang=en><meta charset=utf-8>\
         <meta name=\"generator\" content=\"cathforce\">\
         <meta name=viewport content=\"width=device-width,initial-scale=1\">\
         <title>Published systems, reproduced</title><style>{STYLE}</style><body>{body}</body></html>\n"
    )
}

fn tiles(report: &Report) -> String {
    let count = |keep: &dyn Fn(&Row) -> bool| report.rows().filter(|row| keep(row)).count();
    let both = count(&|row| row.published.is_some() && row.ours.is_some());
    let without = count(&|row| row.ours.is_none());
    let more = count(&|row| row.published.is_none() && row.ours.is_some());
    let tile = |value: usize, label: &str| {
        format!("<div class=tile><b>{value}</b><span>{label}</span></div>")
    };
    format!(
        "<div class=tiles>{}{}{}</div>",
        tile(both, "printed figures with ours beside them"),
        tile(more, "figures of ours that are not printed"),
        tile(without, "figures that cannot be had here, with the reason")
    )
}

fn system(own: &SystemReport) -> String {
    let mut html = format!(
        "<h2>{}</h2><p class=soft><code>{}</code> · {} · computed in {:.0} s</p><div class=wide><table>\
         <tr><th>figure<th class=number>published<th class=number>ours<th>unit<th>how",
        escape(own.doc),
        escape(own.name),
        escape(own.source),
        own.seconds
    );
    for (remark, rows) in groups(&own.rows) {
        for (k, row) in rows.iter().enumerate() {
            // Writing to a string does not fail.
            let _ = write!(
                html,
                "<tr><td>{}<td class=number>{}<td class=number>{}<td>{}",
                escape(&row.figure),
                number_or_dash(row.published),
                number_or_dash(row.ours),
                escape(row.unit)
            );
            if k == 0 {
                let _ = write!(html, "<td rowspan={}>{}", rows.len(), escape(&remark));
            }
        }
    }
    html += "</table></div>";
    html.extend(own.plots.iter().map(lines::figure));
    html
}

#[cfg(test)]
mod tests {
    use cathforce_reproduce::{Curve, Plot, Style};

    use super::*;

    fn report() -> Report {
        let row = |figure: &str, ours: Option<f64>| Row {
            system: "toy",
            figure: figure.into(),
            published: Some(0.25),
            ours,
            unit: "N",
            how: "in one <way>".into(),
            why_not: None,
        };
        let points = (0..50).map(|k| [f64::from(k), f64::from(k * k)]).collect();
        let curve = Curve { name: "sensor".into(), style: Style::Truth, points };
        let plot = Plot {
            title: "Force".into(),
            axes: ["time, s", "force, N"],
            equal: false,
            curves: vec![curve],
        };
        let own = SystemReport {
            name: "toy",
            doc: "A toy",
            source: "somebody",
            rows: vec![row("a", Some(0.5)), row("b", Some(0.125))],
            plots: vec![plot],
            seconds: 2.0,
            failed: Vec::new(),
        };
        Report { systems: vec![own], interrupted: false }
    }

    #[test]
    fn the_page_begins_with_where_the_truth_comes_from_and_loads_nothing() {
        let page = reproduced_page(&report());
        let body = page.split_once("<body>").unwrap().1;
        assert!(body.starts_with(&format!("<p>{}", escape(TRUTH))), "{body}");
        assert!(page.contains("<td rowspan=2>in one &lt;way&gt;"), "{page}");
        assert!(page.contains("<td class=number>0.25<td class=number>0.125"), "{page}");
        assert_eq!(page.matches("<polyline").count(), 1);
        for loads in ["http:", "https:", "src=", "@import", "url(", "<script"] {
            assert!(!page.contains(loads), "{loads}");
        }
    }
}
