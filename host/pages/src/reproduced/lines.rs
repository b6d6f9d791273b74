//! Curves over two axes, as SVG.

use std::fmt::Write as _;

use cathforce_reproduce::{Plot, Style};

use crate::diagnosis::charts::{WIDTH, svg};
use crate::escape::html as escape;

/// Room for labels at the left, and at the bottom.
const LEFT: f64 = 64.0;
const BOTTOM: f64 = 40.0;
const TOP: f64 = 10.0;
/// Height of a chart whose axes have scales of their own, and the largest height of a drawing.
const HEIGHT: f64 = 240.0;
const MOST_HEIGHT: f64 = 420.0;
/// Points of a curve at most.
const POINTS: usize = 1500;

/// The scales of a plot.
struct Scales {
    low: [f64; 2],
    /// Pixels per unit.
    per: [f64; 2],
    height: f64,
}

impl Scales {
    fn of(plot: &Plot) -> Option<Self> {
        let points = || plot.curves.iter().flat_map(|curve| &curve.points);
        let bound = |axis: usize, pick: fn(f64, f64) -> f64| {
            points().map(|p| p[axis]).filter(|x| x.is_finite()).reduce(pick)
        };
        let low = [bound(0, f64::min)?, bound(1, f64::min)?];
        let high = [bound(0, f64::max)?, bound(1, f64::max)?];
        let range: [f64; 2] = std::array::from_fn(|k| (high[k] - low[k]).max(1e-9));
        let width = WIDTH - LEFT - 10.0;
        if plot.equal {
            let per = (width / range[0]).min((MOST_HEIGHT - TOP - BOTTOM) / range[1]);
            let height = (per * range[1] + TOP + BOTTOM).max(TOP + BOTTOM + 30.0);
            return Some(Self { low, per: [per; 2], height });
        }
        let per = [width / range[0], (HEIGHT - TOP - BOTTOM) / range[1]];
        Some(Self { low, per, height: HEIGHT })
    }

    fn x(&self, x: f64) -> f64 {
        LEFT + (x - self.low[0]) * self.per[0]
    }

    fn y(&self, y: f64) -> f64 {
        self.height - BOTTOM - (y - self.low[1]) * self.per[1]
    }

    /// Round numbers along an axis of this many pixels.
    fn ticks(&self, axis: usize, pixels: f64) -> Vec<f64> {
        let range = pixels / self.per[axis];
        let wanted = (pixels / 70.0).clamp(1.0, 8.0);
        let raw = range / wanted;
        let power = 10f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|s| *s >= raw);
        let step = step.unwrap_or(10.0 * power);
        let first = (self.low[axis] / step).ceil() as i64;
        let last = ((self.low[axis] + range) / step).floor() as i64;
        (first..=last).map(|k| k as f64 * step).collect()
    }
}

/// A plot with its key and its title.
pub fn figure(plot: &Plot) -> String {
    let Some(scales) = Scales::of(plot) else { return String::new() };
    let mut inside = axes(plot, &scales);
    for curve in &plot.curves {
        let every = curve.points.len().div_ceil(POINTS).max(1);
        let finite = curve.points.iter().filter(|p| p.iter().all(|x| x.is_finite()));
        let points: String = finite
            .step_by(every)
            .map(|[x, y]| format!("{:.1},{:.1} ", scales.x(*x), scales.y(*y)))
            .collect();
        // Writing to a string does not fail.
        let _ = write!(
            inside,
            "<polyline class={} points=\"{}\" />",
            class(curve.style),
            points.trim_end()
        );
    }
    format!(
        "<figure>{}<figcaption>{}.{}</figcaption></figure>",
        svg(scales.height, &inside),
        escape(&plot.title),
        key(plot)
    )
}

fn axes(plot: &Plot, scales: &Scales) -> String {
    let (bottom, right) = (scales.height - BOTTOM, WIDTH - 10.0);
    let mut inside = String::new();
    // Writing to a string does not fail.
    for x in scales.ticks(0, right - LEFT) {
        let at = scales.x(x);
        let _ = write!(
            inside,
            "<line class=axis x1={at:.1} x2={at:.1} y1={TOP} y2={bottom:.1} /><text class=soft x={at:.1} \
             y={:.0} text-anchor=middle>{}</text>",
            bottom + 15.0,
            label(x)
        );
    }
    for y in scales.ticks(1, bottom - TOP) {
        let at = scales.y(y);
        let _ = write!(
            inside,
            "<line class=axis x1={LEFT} x2={right} y1={at:.1} y2={at:.1} /><text class=soft x={} y={:.1} \
             text-anchor=end>{}</text>",
            LEFT - 6.0,
            at + 4.0,
            label(y)
        );
    }
    let [across, up] = plot.axes.map(escape);
    let middle = 0.5 * (TOP + bottom);
    let _ = write!(
        inside,
        "<text class=soft x={right} y={:.0} text-anchor=end>{across}</text><text class=soft x=12 y={middle:.0} \
         text-anchor=middle transform=\"rotate(-90 12 {middle:.0})\">{up}</text>",
        scales.height - 6.0,
    );
    inside
}

/// A round number.
fn label(x: f64) -> String {
    let text = format!("{x:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.replace('-', "−") }
}

fn class(style: Style) -> &'static str {
    match style {
        Style::Truth => "measured",
        Style::Ours => "after",
        Style::Other => "before",
    }
}

/// The names of the curves by their colour.
fn key(plot: &Plot) -> String {
    let mut key = String::new();
    for style in [Style::Truth, Style::Ours, Style::Other] {
        let mut names: Vec<&str> = Vec::new();
        for curve in plot.curves.iter().filter(|curve| curve.style == style) {
            if !names.contains(&curve.name.as_str()) {
                names.push(&curve.name);
            }
        }
        if !names.is_empty() {
            let colour = class(style);
            // Writing to a string does not fail.
            let _ = write!(
                key,
                "<span class=key><i style=\"border-color:var(--{colour})\"></i>{}</span>",
                escape(&names.join("; "))
            );
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use cathforce_reproduce::Curve;

    use super::*;

    fn plot(equal: bool) -> Plot {
        let curve = |name: &str, style, points| Curve { name: name.into(), style, points };
        Plot {
            title: "Shapes".into(),
            axes: ["x, mm", "y, mm"],
            equal,
            curves: vec![
                curve("truth", Style::Truth, vec![[0.0, 0.0], [100.0, 0.0], [100.0, 20.0]]),
                curve("truth", Style::Truth, vec![[0.0, 5.0], [f64::NAN, 5.0], [50.0, 5.0]]),
                curve("ours", Style::Ours, vec![[0.0, 10.0], [100.0, 10.0]]),
            ],
        }
    }

    #[test]
    fn a_drawing_has_one_scale_and_a_chart_two() {
        let scales = Scales::of(&plot(true)).unwrap();
        assert_eq!(scales.per[0], scales.per[1]);
        assert!((scales.x(100.0) - (WIDTH - 10.0)).abs() < 1e-9);
        let scales = Scales::of(&plot(false)).unwrap();
        assert!(
            (scales.y(20.0) - TOP).abs() < 1e-9 && (scales.y(0.0) - (HEIGHT - BOTTOM)).abs() < 1e-9
        );
        assert_eq!(scales.ticks(1, HEIGHT - TOP - BOTTOM), [0.0, 10.0, 20.0]);
    }

    #[test]
    fn a_name_is_in_the_key_once_and_what_is_not_finite_is_not_drawn() {
        let figure = figure(&plot(true));
        assert_eq!(figure.matches("truth").count(), 1, "{figure}");
        assert_eq!(figure.matches("<polyline").count(), 3);
        assert!(!figure.contains("NaN"), "{figure}");
        let empty = Plot { curves: Vec::new(), ..plot(true) };
        assert_eq!(super::figure(&empty), "");
    }
}
