//! Tips of common catheters and the one that a device has, each with a drawing.

use cathforce_bundle::tips::{TIPS, Tip};
use cathforce_config::ImageHead;
use cathforce_mechanics::PrecurvePiece;
use serde_json::{Value, json};

/// Length of the straight shaft that is drawn behind a tip \[m\].
const SHAFT_M: f64 = 15e-3;
/// Points of a drawing are this far apart \[m\].
const STEP_M: f64 = 0.5e-3;

/// What can be chosen, and what the device has.
pub fn list(head: &ImageHead) -> Value {
    let own: Vec<PrecurvePiece<f64>> =
        head.description.instrument.precurve.iter().map(widened).collect();
    let in_use = TIPS.iter().find(|tip| is_tip(tip, &own));
    let known = TIPS.iter().map(|tip| {
        let pieces: Vec<_> = tip.precurve().collect();
        json!({ "name": tip.name, "text": tip.doc, "outline_mm": outline_mm(&pieces) })
    });
    json!({
        "known": known.collect::<Vec<Value>>(),
        "in_use": in_use.map(|tip| tip.name),
        "own_outline_mm": outline_mm(&own),
    })
}

/// The centre line in its plane from the shaft to the tip \[mm\]: x along the shaft, y towards `up`.
fn outline_mm(pieces: &[PrecurvePiece<f64>]) -> Vec<[f64; 2]> {
    let (mut at, mut heading) = ([0.0, 0.0], 0.0_f64);
    let mut points = vec![at];
    let shaft = (SHAFT_M, 0.0);
    let shaped = pieces.iter().rev().map(|piece| (piece.length_m, piece.curvature_per_m));
    for (length_m, curvature_per_m) in std::iter::once(shaft).chain(shaped) {
        let steps = (length_m / STEP_M).ceil().max(1.0);
        for _ in 0..steps as usize {
            let step_m = length_m / steps;
            let middle = heading + 0.5 * curvature_per_m * step_m;
            at = [at[0] + step_m * middle.cos(), at[1] + step_m * middle.sin()];
            heading += curvature_per_m * step_m;
            points.push(at);
        }
    }
    let rounded = |m: f64| (1e5 * m).round() / 100.0;
    points.into_iter().map(|[x, y]| [rounded(x), rounded(y)]).collect()
}

fn widened(piece: &PrecurvePiece<f32>) -> PrecurvePiece<f64> {
    PrecurvePiece {
        length_m: f64::from(piece.length_m),
        curvature_per_m: f64::from(piece.curvature_per_m),
        lateral_curvature_per_m: f64::from(piece.lateral_curvature_per_m),
        torsion_per_m: f64::from(piece.torsion_per_m),
    }
}

/// Whether these are the pieces of a known tip, as far as single precision tells.
fn is_tip(tip: &Tip, own: &[PrecurvePiece<f64>]) -> bool {
    let known: Vec<PrecurvePiece<f32>> = tip.precurve().collect();
    known.len() == own.len() && known.iter().map(widened).eq(own.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hook_ends_beside_the_shaft_and_looks_back() {
        let hook = Tip::find("hook").unwrap();
        let drawn = outline_mm(&hook.precurve().collect::<Vec<_>>());
        let [before, end] = [drawn[drawn.len() - 2], drawn[drawn.len() - 1]];
        // Half a circle of 16 mm diameter.
        assert!((end[0] - 15.0).abs() < 0.05 && (end[1] - 16.0).abs() < 0.05, "{end:?}");
        assert!(end[0] < before[0], "{before:?} {end:?}");
    }
}
