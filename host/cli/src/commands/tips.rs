//! `cathforce tips`.

use cathforce_bundle::tips::TIPS;
use serde_json::json;

use crate::failure::Failure;
use crate::ui::{Ui, two_columns};

pub fn list(ui: &Ui) -> Result<(), Failure> {
    let json = TIPS
        .iter()
        .map(|tip| {
            let pieces = tip
                .precurve::<f64>()
                .map(|p| json!({ "length_m": p.length_m, "curvature_per_m": p.curvature_per_m }));
            json!({
                "name": tip.name, "doc": tip.doc, "length_m": tip.length_m(),
                "turn_deg": tip.turn_deg(), "tip_precurve": pieces.collect::<Vec<_>>(),
            })
        })
        .collect::<Vec<_>>();
    let rows = TIPS
        .iter()
        .map(|tip| {
            let (length_mm, turn_deg) = (1e3 * tip.length_m(), tip.turn_deg());
            let size = if tip.pieces.is_empty() {
                String::new()
            } else {
                format!(" {length_mm:.0} mm, {turn_deg:.0}° in all.")
            };
            (tip.name.to_owned(), format!("{}{size}", tip.doc))
        })
        .collect::<Vec<_>>();
    let origin = "\nThe shapes are read from makers' drawings; that of the hook was published. `--tip NAME` \
                  replaces the tip_precurve of rig.toml.\n";
    ui.data(&json, two_columns(&rows) + origin)
}
