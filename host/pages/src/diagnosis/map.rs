//! Maps of an error over length inside and time.

use std::fmt::Write as _;

use cathforce_gap::Map;
use cathforce_gap::plant::Quantity;
use cathforce_gap::rounding::quantity;

use super::charts::{LABELS, WIDTH, svg};

/// Height of all rows together.
const HEIGHT: f64 = 144.0;
/// Height above them.
const TOP: f64 = 6.0;
/// Steps of colour that the key shows.
const STEPS: usize = 5;

/// All maps, each quantity with one scale of colour for all of its trials.
pub fn maps(maps: &[Map]) -> String {
    let same = maps.chunk_by(|a, b| a.quantity == b.quantity);
    same.flat_map(|own| {
        let cells = own.iter().flat_map(|map| &map.cells).flatten();
        let full = cells.copied().flatten().fold(0.0, f64::max);
        own.iter().map(move |map| figure(map, full))
    })
    .collect()
}

/// `full`: the error that has all of the colour.
fn figure(map: &Map, full: f64) -> String {
    let unit = map.units.of(map.quantity);
    let (what, place) = match map.quantity {
        Quantity::Force if map.units.of_force() == "output" => ("Output", "the input"),
        Quantity::Force => ("Force", "the length inside (or position)"),
        Quantity::DriveForce => ("Drive force", "the length inside"),
        Quantity::Tip => ("Tip", "the length inside"),
        Quantity::Shape => ("Shape", "the arc length from the entry"),
    };
    let label = match what {
        "Output" => "output error",
        _ => label_of(map.quantity),
    };
    let inside =
        key(label, &quantity(full, unit), 0.5 * HEIGHT) + &cells(map, full, unit) + &axes(map);
    format!(
        "<figure>{}<figcaption>{what} error of the nominal model over {place} and time, trial \
         {:03}: {} RMS, floor {}. Nothing was compared where there is no square.</figcaption>\
         </figure>",
        svg(TOP + HEIGHT + 24.0, &inside),
        map.trial,
        quantity(map.rms, unit),
        quantity(map.floor, unit)
    )
}

/// Squares, the last row at the top.
fn cells(map: &Map, full: f64, unit: &str) -> String {
    let rows = map.cells.len().max(1) as f64;
    let mut drawn = String::new();
    for (j, row) in map.cells.iter().enumerate() {
        let columns = row.len().max(1) as f64;
        let (width, height) = ((WIDTH - LABELS) / columns, HEIGHT / rows);
        let arc_m = |k: usize| between(map.arc_m, k as f64 / rows);
        for (i, cell) in row.iter().enumerate() {
            let Some(error) = cell else { continue };
            let time_s = between(map.t_s, (i as f64 + 0.5) / columns);
            // Writing to a string does not fail.
            let _ = write!(
                drawn,
                "<rect class=heat x={:.1} y={:.1} width={width:.1} height={height:.1} \
                 fill-opacity={:.2}><title>{time_s:.2} s, {}: {}</title></rect>",
                LABELS + i as f64 * width,
                TOP + HEIGHT - (j + 1) as f64 * height,
                (error / full.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0),
                map.units.stretch([arc_m(j), arc_m(j + 1)]),
                quantity(*error, unit)
            );
        }
    }
    drawn
}

/// Frame and labels: the two ends and the middle of either axis.
fn axes(map: &Map) -> String {
    let bottom = TOP + HEIGHT;
    let mut drawn = format!(
        "<line class=axis x1={LABELS} x2={LABELS} y1={TOP} y2={bottom} /><line class=axis \
         x1={LABELS} x2={WIDTH} y1={bottom} y2={bottom} />"
    );
    for (share, anchor) in [(0.0, "start"), (0.5, "middle"), (1.0, "end")] {
        let _ = write!(
            drawn,
            "<text class=soft x={:.0} y={:.0} text-anchor={anchor}>{} s</text>\
             <text class=soft x={:.0} y={:.0} text-anchor=end>{}</text>",
            LABELS + share * (WIDTH - LABELS),
            bottom + 16.0,
            label(between(map.t_s, share), 1),
            LABELS - 6.0,
            TOP + (1.0 - share) * (HEIGHT - 12.0) + 10.0,
            match map.units.along_angle() {
                false => label(1e3 * between(map.arc_m, share), 0) + " mm",
                true => label(between(map.arc_m, share), 2) + " rad",
            }
        );
    }
    drawn
}

/// What the colours of a quantity are.
pub fn label_of(quantity: Quantity) -> &'static str {
    if quantity.is_force() { "force error" } else { "distance" }
}

/// What the colours mean. `full`: the error that has all of the colour; `y`: of the middle.
pub fn key(label: &str, full: &str, y: f64) -> String {
    let side = 18.0;
    let mut drawn = format!("<text x=0 y={:.0}>{label}, RMS</text>", y - 8.0);
    for step in 0..STEPS {
        let _ = write!(
            drawn,
            "<rect class=heat x={:.0} y={y:.0} width={side} height=12 fill-opacity={:.2} />",
            step as f64 * side,
            step as f64 / (STEPS - 1) as f64
        );
    }
    let _ = write!(
        drawn,
        "<text class=soft x=0 y={0:.0}>0</text><text class=soft x={1:.0} y={0:.0} \
         text-anchor=end>{full}</text>",
        y + 26.0,
        STEPS as f64 * side
    );
    drawn
}

/// A number at an axis, to so many decimals; an edge that is a little below 0 is no -0.
fn label(value: f64, decimals: i32) -> String {
    let unit = 10_f64.powi(decimals);
    format!("{:.*}", decimals as usize, (value * unit).round() / unit + 0.0)
}

fn between([low, high]: [f64; 2], share: f64) -> f64 {
    low + share * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cathforce_gap::plant::Units;

    fn of(trial: u32, quantity: Quantity, cells: Vec<Vec<Option<f64>>>) -> Map {
        let (t_s, arc_m) = ([1.0, 3.0], [0.0, 0.12]);
        Map { quantity, units: Units::Linear, trial, t_s, arc_m, rms: 0.004, floor: 0.001, cells }
    }

    #[test]
    fn a_map_has_a_square_for_what_was_compared_and_units_at_its_axes() {
        let cells = vec![vec![Some(0.002), None], vec![None, Some(0.004)]];
        let drawn = maps(&[of(7, Quantity::Shape, cells)]);
        assert_eq!(drawn.matches("<title>").count(), 2, "{drawn}");
        // Near the entry in the first second: at the bottom left, half as far off as the other.
        let first = "x=200.0 y=78.0 width=280.0 height=72.0 fill-opacity=0.50><title>1.50 s, 0 to \
                     60 mm: 2.00 mm</title>";
        let second = "x=480.0 y=6.0 width=280.0 height=72.0 fill-opacity=1.00><title>2.50 s, 60 to \
                      120 mm: 4.00 mm</title>";
        for part in
            [first, second, ">1.0 s<", ">2.0 s<", ">3.0 s<", ">0 mm<", ">60 mm<", ">120 mm<"]
        {
            assert!(drawn.contains(part), "{part} in {drawn}");
        }
        assert!(drawn.contains("trial 007: 4.00 mm RMS, floor 1.00 mm"), "{drawn}");
    }

    #[test]
    fn an_edge_just_below_zero_is_no_negative_zero() {
        assert_eq!([label(-0.3, 0), label(-0.04, 1), label(-0.06, 1)], ["0", "0.0", "-0.1"]);
        assert_eq!([label(123.4, 0), label(9.26, 1)], ["123", "9.3"]);
    }

    #[test]
    fn trials_share_a_scale_and_quantities_do_not() {
        let one = |trial, quantity, error| of(trial, quantity, vec![vec![Some(error)]]);
        let drawn = maps(&[
            one(0, Quantity::Force, 0.1),
            one(1, Quantity::Force, 0.4),
            one(0, Quantity::Shape, 0.001),
        ]);
        let opacities: Vec<&str> = drawn
            .split("fill-opacity=")
            .skip(1)
            .filter_map(|rest| rest.split_once("><title>"))
            .map(|(opacity, _)| opacity)
            .filter(|opacity| opacity.len() == 4)
            .collect();
        assert_eq!(opacities, ["0.25", "1.00", "1.00"]);
        assert_eq!(drawn.matches(">400 mN</text>").count(), 2, "{drawn}");
        assert_eq!(maps(&[]), "");
    }
}
