//! Errors on the vessel, seen from one side.

use std::fmt::Write as _;

use cathforce_gap::plant::{Quantity, Silhouette};
use cathforce_gap::rounding::{percent, quantity};
use cathforce_gap::{OnVessel, Square, VesselMap};

use super::charts::{LABELS, WIDTH, svg};
use super::map::{key, label_of};

/// Height of a vessel at most.
const MOST_HEIGHT: f64 = 340.0;
/// Least height, so that the key has room.
const LEAST_HEIGHT: f64 = 110.0;
/// Around the vessel.
const MARGIN: f64 = 8.0;
/// Below it, for the bar of a length.
const BELOW: f64 = 30.0;
/// Lengths of that bar \[mm\].
const BARS_MM: [f64; 8] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0];
/// Error over the floor that has all of the colour, at least: what noise leaves is pale.
const FLOORS: f64 = 3.0;
/// Error over the floor from which on the squares above it are marked.
const CLEAR: f64 = 1.1;
/// Share of the squares whose colours differ by their errors; the others have all of it.
const COLOURED: f64 = 0.95;
/// Share of the gap that the marked squares hold.
const MARKED: f64 = 0.5;

/// A figure for each quantity. `model`: whose errors they are.
pub fn figures(of: &OnVessel, model: &str) -> String {
    let scale = Scale::of(&of.silhouette);
    of.maps.iter().map(|map| figure(of, map, &scale, model)).collect()
}

/// From the plane to the figure.
struct Scale {
    per_m: f64,
    left_m: f64,
    top_m: f64,
    top: f64,
    height: f64,
}

impl Scale {
    fn of(silhouette: &Silhouette) -> Self {
        let [[left_m, _], [_, top_m]] = silhouette.bounds_m();
        let [width_m, height_m] = silhouette.size_m().map(|x| x.max(f64::MIN_POSITIVE));
        let room = WIDTH - LABELS - 2.0 * MARGIN;
        let per_m = (room / width_m).min(MOST_HEIGHT / height_m);
        let height = (height_m * per_m).max(LEAST_HEIGHT);
        let top = MARGIN + 0.5 * (height - height_m * per_m);
        Self { per_m, left_m, top_m, top, height }
    }

    fn x(&self, at_m: f64) -> f64 {
        LABELS + MARGIN + (at_m - self.left_m) * self.per_m
    }

    fn y(&self, at_m: f64) -> f64 {
        self.top + (self.top_m - at_m) * self.per_m
    }
}

fn figure(of: &OnVessel, map: &VesselMap, scale: &Scale, model: &str) -> String {
    let unit = map.quantity.unit();
    let full = full(&map.squares).max(FLOORS * map.floor);
    let marked = if is_clear(map) {
        "The squares with a dark edge hold half of what is above the floor."
    } else {
        "Hardly anything is above the floor."
    };
    let (what, place) = match map.quantity {
        Quantity::Force => ("Force", "the tip was when it was made"),
        Quantity::DriveForce => ("Drive force", "the tip was when it was made"),
        Quantity::Tip => ("Tip", "the tip was"),
        Quantity::Shape => ("Shape", "each point was"),
    };
    let inside = outline(&of.silhouette, scale)
        + &squares(of, map, scale, (full, unit))
        + &marks(&of.silhouette, scale)
        + &key(label_of(map.quantity), &format!("≥{}", quantity(full, unit)), 0.5 * scale.height);
    format!(
        "<figure>{}<figcaption>{what} error of {model} on the vessel, where {place}; all \
         trials, {} RMS, floor {}. Seen along the {}. {marked}</figcaption></figure>",
        svg(scale.height + MARGIN + BELOW, &inside),
        quantity(map.rms, unit),
        quantity(map.floor, unit),
        of.silhouette.seen_along()
    )
}

/// The wall.
fn outline(silhouette: &Silhouette, scale: &Scale) -> String {
    let mut path = String::new();
    for line in &silhouette.outline_m {
        for (i, [x, y]) in line.iter().enumerate() {
            // Writing to a string does not fail.
            let _ = write!(
                path,
                "{}{:.1} {:.1}",
                if i == 0 { "M" } else { "L" },
                scale.x(*x),
                scale.y(*y)
            );
        }
        path.push('Z');
    }
    format!("<path class=vessel fill-rule=evenodd d=\"{path}\" />")
}

fn squares(of: &OnVessel, map: &VesselMap, scale: &Scale, (full, unit): (f64, &str)) -> String {
    let side = of.side_m * scale.per_m;
    let least = if is_clear(map) { marked_from(&map.squares) } else { f64::INFINITY };
    let mut drawn = String::new();
    // What has an edge is drawn over what has none.
    for marked in [false, true] {
        for square in map.squares.iter().filter(|own| (own.gap_share >= least) == marked) {
            let [x, y] = square.centre_m;
            let _ = write!(
                drawn,
                "<rect class=\"heat{}\" x={:.1} y={:.1} width={side:.1} height={side:.1} \
                 fill-opacity={:.2}><title>{}: {} of the gap in {} of the time</title></rect>",
                if marked { " marked" } else { "" },
                scale.x(x) - 0.5 * side,
                scale.y(y) - 0.5 * side,
                (square.rms / full.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0),
                quantity(square.rms, unit),
                percent(square.gap_share),
                percent(square.time_share)
            );
        }
    }
    drawn
}

/// Whether there is anything to mark.
fn is_clear(map: &VesselMap) -> bool {
    map.rms > CLEAR * map.floor
}

/// The error that has all of the colour: what few squares exceed would leave none to the others.
fn full(squares: &[Square]) -> f64 {
    let mut errors: Vec<f64> = squares.iter().map(|square| square.rms).collect();
    errors.sort_by(f64::total_cmp);
    let last = errors.len().saturating_sub(1) as f64;
    errors.get((COLOURED * last).floor() as usize).copied().unwrap_or_default()
}

/// The share of the gap of the least of the fewest squares that hold [`MARKED`] of it.
fn marked_from(squares: &[Square]) -> f64 {
    let mut shares: Vec<f64> = squares.iter().map(|square| square.gap_share).collect();
    shares.sort_by(|a, b| b.total_cmp(a));
    let mut held = 0.0;
    let reached = shares.into_iter().find(|share| {
        held += share;
        held >= MARKED
    });
    reached.filter(|share| *share > 0.0).unwrap_or(f64::INFINITY)
}

/// The entry, and how long a length is.
fn marks(silhouette: &Silhouette, scale: &Scale) -> String {
    let [x, y] = [scale.x(silhouette.entry_m[0]), scale.y(silhouette.entry_m[1])];
    let [width_m, _] = silhouette.size_m();
    let most_mm = 1e3 * width_m / 3.0;
    let bar_mm = BARS_MM.into_iter().rev().find(|mm| *mm <= most_mm).unwrap_or(BARS_MM[0]);
    let (left, right) = (WIDTH - MARGIN - 1e-3 * bar_mm * scale.per_m, WIDTH - MARGIN);
    let bottom = scale.height + MARGIN + 12.0;
    format!(
        "<circle class=entry cx={x:.1} cy={y:.1} r=4><title>entry</title></circle>\
         <text class=soft x={:.1} y={:.1} text-anchor=end>entry</text>\
         <line class=length x1={left:.1} x2={right:.1} y1={bottom:.1} y2={bottom:.1} />\
         <text class=soft x={right:.1} y={:.1} text-anchor=end>{bar_mm:.0} mm</text>",
        // Left of the wall.
        LABELS + MARGIN - 6.0,
        y + 4.0,
        bottom + 14.0
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, rms: f64, gap_share: f64) -> Square {
        Square { centre_m: [x, 0.0], rms, gap_share, time_share: 0.25 }
    }

    fn of(squares: Vec<Square>) -> OnVessel {
        let map = VesselMap { quantity: Quantity::Force, squares, rms: 0.02, floor: 0.005 };
        // 100 mm long and 20 mm high.
        let silhouette = Silhouette::rectangle([0.0, 0.1], [-0.01, 0.01]);
        OnVessel { silhouette, side_m: 0.002, maps: vec![map] }
    }

    #[test]
    fn a_figure_has_wall_entry_squares_and_a_length_in_one_scale() {
        let drawn = figures(
            &of(vec![square(0.05, 0.02, 0.6), square(0.1, 0.005, 0.4)]),
            "the nominal model",
        );
        // 544 units for 100 mm: the wall spans them, the middle is the middle.
        assert!(drawn.contains("d=\"M208.0 117.4L752.0 117.4L752.0 8.6L208.0 8.6Z\""), "{drawn}");
        assert!(drawn.contains("<circle class=entry cx=208.0 cy=63.0"), "{drawn}");
        let first = "<rect class=\"heat marked\" x=474.6 y=57.6 width=10.9 height=10.9 \
                     fill-opacity=1.00><title>20.0 mN: 60 % of the gap in 25 % of the time";
        assert!(drawn.contains(first), "{drawn}");
        assert!(drawn.contains("x1=588.8 x2=752.0") || drawn.contains(">20 mm<"), "{drawn}");
        assert!(drawn.contains("Seen along the z axis"), "{drawn}");
        assert!(drawn.contains("20.0 mN RMS, floor 5.00 mN"), "{drawn}");
    }

    #[test]
    fn the_fewest_squares_that_hold_half_of_the_gap_are_marked() {
        let marked = |shares: &[f64]| {
            let squares = shares.iter().enumerate().map(|(i, s)| square(1e-2 * i as f64, 0.01, *s));
            figures(&of(squares.collect()), "x").matches("heat marked").count()
        };
        assert_eq!(marked(&[0.1, 0.45, 0.2, 0.25]), 2);
        assert_eq!(marked(&[0.05, 0.9, 0.05]), 1);
        assert_eq!(marked(&[0.0, 0.0]), 0);
    }

    #[test]
    fn what_noise_leaves_is_pale_and_not_marked() {
        let mut noise = of(vec![square(0.0, 0.006, 0.7), square(0.01, 0.003, 0.3)]);
        (noise.maps[0].rms, noise.maps[0].floor) = (0.005, 0.005);
        let drawn = figures(&noise, "x");
        assert!(drawn.contains("fill-opacity=0.40>") && drawn.contains("≥15.0 mN"), "{drawn}");
        assert!(!drawn.contains("heat marked") && drawn.contains("Hardly anything is above"));
    }

    #[test]
    fn one_square_that_is_far_off_leaves_colour_to_the_others() {
        let mut squares: Vec<Square> = (1..=40).map(|i| square(1e-3, f64::from(i), 0.0)).collect();
        squares.push(square(1e-3, 1e4, 1.0));
        assert_eq!(full(&squares), 39.0);
        assert_eq!(full(&squares[..1]), 1.0);
        assert_eq!(full(&[]), 0.0);
    }
}
