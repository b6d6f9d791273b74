//! Charts of the page, as SVG.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use cathforce_gap::plant::Units;
use cathforce_gap::report::{PathStep, Ranked, Series};
use cathforce_gap::rounding::percent;
use cathforce_gap::wording;
use cathforce_gap::{Band, Cell, Row};

use crate::escape::html as escape;

/// Width of every chart, in its own units.
pub const WIDTH: f64 = 760.0;
/// Width of the labels at the left.
pub const LABELS: f64 = 200.0;
/// The same of bars, whose labels are effects in words.
const BAR_LABELS: f64 = 290.0;
const ROW: f64 = 22.0;
/// Points of a curve at most.
const POINTS: usize = 1500;

pub fn svg(height: f64, inside: &str) -> String {
    format!("<svg viewBox=\"0 0 {WIDTH} {height:.0}\" role=img>{inside}</svg>")
}

/// Sums of gap shares over two names, as squares of more or less colour.
pub fn heat(
    cells: &[Cell],
    row: impl Fn(&Cell) -> String,
    column: impl Fn(&Cell) -> String,
) -> String {
    let (mut rows, mut columns) = (Vec::new(), Vec::new());
    let mut sums: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    let index = |names: &mut Vec<String>, name: String| {
        names.iter().position(|known| *known == name).unwrap_or_else(|| {
            names.push(name);
            names.len() - 1
        })
    };
    for cell in cells {
        let place = (index(&mut rows, row(cell)), index(&mut columns, column(cell)));
        *sums.entry(place).or_default() += cell.gap_share;
    }
    let width = (WIDTH - LABELS) / columns.len().max(1) as f64;
    let mut inside = String::new();
    for (i, name) in columns.iter().enumerate() {
        let x = LABELS + (i as f64 + 0.5) * width;
        let _ = write!(inside, "<text x={x:.0} y=14 text-anchor=middle>{}</text>", escape(name));
    }
    for (j, name) in rows.iter().enumerate() {
        let y = ROW * (j as f64 + 1.0);
        let _ = write!(inside, "<text x=0 y={:.0}>{}</text>", y + 15.0, escape(name));
        for i in 0..columns.len() {
            let share = sums.get(&(j, i)).copied().unwrap_or_default();
            let x = LABELS + i as f64 * width;
            let _ = write!(
                inside,
                "<rect class=heat x={x:.0} y={y:.0} width={width:.0} height={ROW} \
                 fill-opacity={:.2} /><text x={:.0} y={:.0} text-anchor=middle>{}</text>",
                share.sqrt().min(1.0),
                x + 0.5 * width,
                y + 15.0,
                if share > 0.0 { percent(share) } else { String::new() }
            );
        }
    }
    svg(ROW * (rows.len() as f64 + 1.0) + 4.0, &inside)
}

/// One bar a line, from 0 to 1; negative ones are written, not drawn.
fn bars(lines: &[(String, f64, &str)]) -> String {
    let mut inside = String::new();
    let width = WIDTH - BAR_LABELS - 70.0;
    for (i, (name, share, class)) in lines.iter().enumerate() {
        let y = ROW * i as f64;
        let _ = write!(
            inside,
            "<text x=0 y={:.0}>{}</text><rect class={class} x={BAR_LABELS} y={:.0} width={:.1} \
             height={:.0} /><text class=soft x={:.0} y={:.0}>{}</text>",
            y + 15.0,
            escape(name),
            y + 3.0,
            width * share.clamp(0.0, 1.0),
            ROW - 6.0,
            BAR_LABELS + width * share.clamp(0.0, 1.0) + 6.0,
            y + 15.0,
            percent(*share)
        );
    }
    svg(ROW * lines.len() as f64 + 4.0, &inside)
}

/// What each effect closes alone.
pub fn ranking(ranking: &[Ranked]) -> String {
    let lines: Vec<_> =
        ranking.iter().map(|r| (wording::name(&r.id).to_owned(), r.shrink, "bar")).collect();
    bars(&lines)
}

/// What is left after each step of the selection.
pub fn waterfall(path: &[PathStep]) -> String {
    let mut known: Vec<String> = Vec::new();
    let lines = path.iter().map(|step| {
        let words = |e: &String| wording::name(e).to_owned();
        let added: Vec<_> = step.effects.iter().filter(|e| !known.contains(e)).map(words).collect();
        let removed: Vec<_> =
            known.iter().filter(|e| !step.effects.contains(e)).map(words).collect();
        let mut name = if step.effects.is_empty() { "nominal".to_owned() } else { String::new() };
        if !added.is_empty() {
            name += &format!("+ {}", added.join(" + "));
        }
        if !removed.is_empty() {
            name += &format!(" − {}", removed.join(" − "));
        }
        known.clone_from(&step.effects);
        (name, 1.0 - step.shrink, "against")
    });
    let lines: Vec<_> = lines.collect();
    bars(&lines)
}

/// Measured, nominal and best over time.
pub fn series(series: &Series) -> String {
    const HEIGHT: f64 = 190.0;
    let curves =
        [("before", &series.nominal), ("measured", &series.measured), ("after", &series.best)];
    let values = || curves.iter().flat_map(|(_, values)| values.iter().copied());
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    let (Some(&start), Some(&end)) = (series.t_s.first(), series.t_s.last()) else {
        return String::new();
    };
    let x = |t: f64| 50.0 + (WIDTH - 60.0) * (t - start) / (end - start).max(f64::MIN_POSITIVE);
    let y = |v: f64| 10.0 + (HEIGHT - 40.0) * (high - v) / (high - low).max(f64::MIN_POSITIVE);
    let mut inside = format!(
        "<line class=axis x1=50 x2={WIDTH} y1={0:.1} y2={0:.1} /><text class=soft x=0 y=18>{1}\
         </text><text class=soft x=0 y={2:.0}>{3}</text><text class=soft x=50 y={4:.0}>{start:.1} s\
         </text><text class=soft x={WIDTH} y={4:.0} text-anchor=end>{end:.1} s</text>",
        y(0.0_f64.clamp(low, high)),
        label(high, series.units),
        HEIGHT - 28.0,
        label(low, series.units),
        HEIGHT - 8.0,
    );
    let every = series.t_s.len().div_ceil(POINTS).max(1);
    for (class, values) in curves {
        let points = series.t_s.iter().zip(values).step_by(every);
        let points: String = points.map(|(t, v)| format!("{:.1},{:.1} ", x(*t), y(*v))).collect();
        let _ = write!(inside, "<polyline class={class} points=\"{}\" />", points.trim_end());
    }
    format!(
        "<figure>{}<figcaption>{}, trial {:03}.</figcaption></figure>",
        svg(HEIGHT, &inside),
        escape(&series.channel),
        series.trial
    )
}

/// Half widths of one force over insertion; what is not stated is left out.
pub fn band(band: &Band, column: usize, name: &str, units: Units) -> String {
    const HEIGHT: f64 = 130.0;
    let directions = [("after", &band.feed), ("before", &band.withdrawal)];
    let widths = || directions.iter().flat_map(|(_, rows)| rows.iter().filter_map(|r| r[column]));
    let Some(high) = widths().reduce(f64::max) else { return String::new() };
    let last = directions.iter().map(|(_, rows)| rows.len()).max().unwrap_or(0).saturating_sub(1);
    let x = |k: usize| 50.0 + (WIDTH - 60.0) * k as f64 / last.max(1) as f64;
    let y = |n: f64| 10.0 + (HEIGHT - 40.0) * (1.0 - n / high.max(f64::MIN_POSITIVE));
    let mut inside = format!(
        "<line class=axis x1=50 x2={WIDTH} y1={0:.1} y2={0:.1} /><text class=soft x=0 y=18>{1}\
         </text><text class=soft x=50 y={2:.0}>{3:.0} mm</text><text class=soft x={WIDTH} y={2:.0} \
         text-anchor=end>{4:.0} mm</text>",
        y(0.0),
        label(high, units),
        HEIGHT - 8.0,
        1e3 * band.from_m,
        1e3 * (band.from_m + last as f64 * band.step_m),
    );
    for (class, rows) in directions {
        // One line for each stretch of insertion at which it is stated.
        for stretch in
            rows.iter().enumerate().collect::<Vec<_>>().split(|(_, r)| r[column].is_none())
        {
            let point = |&(k, row): &(usize, &Row)| {
                row[column].map(|n| format!("{:.1},{:.1}", x(k), y(n))).unwrap_or_default()
            };
            let points: Vec<String> = stretch.iter().map(point).collect();
            if points.len() > 1 {
                let _ =
                    write!(inside, "<polyline class={class} points=\"{}\" />", points.join(" "));
            }
        }
    }
    format!("<figure>{}<figcaption>{name}</figcaption></figure>", svg(HEIGHT, &inside))
}

/// A force at an axis.
fn label(value: f64, units: Units) -> String {
    let unit = units.force();
    if value.abs() < 1.0 {
        format!("{:.0} m{unit}", 1e3 * value)
    } else {
        format!("{value:.0} {unit}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cathforce_gap::{COLUMNS, Coverage};

    #[test]
    fn a_band_is_drawn_where_it_is_stated_and_nowhere_else() {
        let row = |n: Option<f64>| [n; COLUMNS];
        let known = row(Some(0.002));
        let band_of = |withdrawal: Vec<Row>| Band {
            from_m: 0.01,
            step_m: 0.02,
            feed: vec![known, row(Some(0.004)), row(None), known, known],
            withdrawal,
            coverage: Coverage::default(),
        };
        let chart = band(&band_of(vec![row(None); 5]), 3, "force behind the guide", Units::Linear);
        // Two stretches of feed, the higher end at the top.
        assert_eq!(chart.matches("polyline class=after").count(), 2, "{chart}");
        assert!(chart.contains("points=\"50.0,55.0 225.0,10.0\""), "{chart}");
        assert!(!chart.contains("polyline class=before"), "{chart}");
        for label in ["10 mm", "90 mm", "4 mN", "force behind the guide"] {
            assert!(chart.contains(label), "{label} in {chart}");
        }
        let both = band(&band_of(vec![known; 5]), 0, "x", Units::Linear);
        assert_eq!(both.matches("polyline class=before").count(), 1, "{both}");
    }
}
