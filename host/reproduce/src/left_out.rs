//! What a program that was built without finite elements says in the place of figures that need them.

use crate::part::{Outcome, Part};
use crate::row::Row;

const WHY: &str = "this program was built without its feature `wall`, which is on by default";

/// The silicone of Pescio et al.
pub const SILICONE: Part = Part {
    name: "silicone",
    work: || 0,
    run: |_| Ok(without("tensile test, and displacement of the loaded wall", "mm")),
};

/// The vessel under an ultrasound probe.
pub const ULTRASOUND: Part = Part {
    name: "identification",
    work: || 0,
    run: |_| Ok(without("Young's modulus found", "kPa")),
};

fn without(figure: &str, unit: &'static str) -> Outcome {
    Outcome::rows(vec![Row::without(figure, unit, WHY)])
}
