//! Salehizadeh et al., "Dynamic modeling and identification of a robotic intracardiac echo catheter".

use crate::part::{Outcome, Part};
use crate::row::Row;

pub const PARTS: &[Part] =
    &[Part { name: "identification", work: || 0, run: |_| Ok(Outcome::rows(rows())) }];

const WHY: &str = "driven tendons, flow and identification from dynamic records are not part of this \
                   version of the program";

/// Table I: figure, unit, nominal value.
const TABLE_I: [(&str, &str, f64); 6] = [
    ("identified density", "kg/m³", 6169.0),
    ("identified Young's modulus", "GPa", 30.20),
    ("identified air drag", "kg/m²", 2.65e-6),
    ("identified viscous damping", "as printed", 4.93e-6),
    ("identified mass of the tip sensor", "g", 3.50),
    ("sliding friction β of table II", "as printed", 266.0),
];

fn rows() -> Vec<Row> {
    let rows = TABLE_I.iter();
    rows.map(|&(figure, unit, printed)| Row::without(figure, unit, WHY).published(printed))
        .collect()
}
