//! "3D deformation simulation for vascular tissue with 2D medical imaging".

use crate::part::{Outcome, Part};
use crate::row::Row;

pub const PARTS: &[Part] =
    &[Part { name: "identification", work: || 0, run: |_| Ok(Outcome::rows(rows())) }];

const WHY: &str = "the vessel under a probe and its cross-section masks are not part of this version \
                   of the program";

/// Figure, unit, printed.
const FIGURES: [(&str, &str, f64); 5] = [
    ("Young's modulus found", "kPa", 592.54),
    ("Poisson's ratio found", "1", 0.482),
    ("overlap of masks, mean", "1", 0.72),
    ("epochs to convergence, at most", "1", 10.0),
    ("time of an epoch", "min", 40.0),
];

fn rows() -> Vec<Row> {
    let rows = FIGURES.iter();
    rows.map(|&(figure, unit, printed)| Row::without(figure, unit, WHY).published(printed))
        .collect()
}
