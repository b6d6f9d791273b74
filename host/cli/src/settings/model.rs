//! Identifies the model that a band belongs to.

use std::collections::BTreeMap;

use cathforce_config::Key;
use cathforce_mechanics::{Description, Effects};
use serde::Serialize;
use serde_json::Value;
use sha2::{Digest, Sha256};

/// Names of how a model computes, which is not part of the model itself.
const SOLVER: &str = "solver.";

/// Whether a setting of this name changes the model of a rig.
pub fn is_of_model(name: &str) -> bool {
    matches!(Key::find(name), Some(Key::Parameter(_))) && !name.starts_with(SOLVER)
}

/// SHA-256 of a model without its vessel: the rig and its effects as they are sent to a device.
///
/// It leaves out `solver`, which sets how finely the model is computed and depends on the trials. It
/// leaves out effects that are off, so that a version with more effects finds the same hash.
pub fn model_sha256(description: &Description<f32>) -> String {
    let off = numbers("effects", &Effects::<f32>::off());
    let mut hash = Sha256::new();
    for (path, value) in numbers("", description) {
        if !path.starts_with(SOLVER) && off.get(&path) != Some(&value) {
            hash.update(format!("{path} = {value}\n"));
        }
    }
    format!("{:x}", hash.finalize())
}

/// Every number of a structure by its path below `path`, such as `entry.position_m.0`.
pub fn numbers(path: &str, of: &impl Serialize) -> BTreeMap<String, String> {
    let mut numbers = BTreeMap::new();
    // JSON can represent every structure of plain numbers.
    if let Ok(value) = serde_json::to_value(of) {
        flatten(path.to_owned(), &value, &mut numbers);
    }
    numbers
}

fn flatten(path: String, value: &Value, numbers: &mut BTreeMap<String, String>) {
    let inner = |name: &str| if path.is_empty() { name.into() } else { format!("{path}.{name}") };
    match value {
        Value::Object(fields) => fields.iter().for_each(|(k, v)| flatten(inner(k), v, numbers)),
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, v)| flatten(inner(&i.to_string()), v, numbers));
        }
        leaf => {
            numbers.insert(path, leaf.to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use cathforce_bundle::{Bundle, ImageOptions, rig_description};

    use super::*;

    const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/tapered-none");

    fn with(options: ImageOptions) -> String {
        let bundle = Bundle::open(std::path::Path::new(EXAMPLE)).unwrap();
        model_sha256(&rig_description(&bundle, &options).unwrap())
    }

    fn set(key: &str, value: f32) -> ImageOptions {
        ImageOptions { parameters: vec![(key.to_owned(), value)], ..ImageOptions::default() }
    }

    #[test]
    fn rig_effects_and_tip_make_another_model_and_how_it_computes_does_not() {
        let nominal = with(ImageOptions::default());
        assert_eq!(nominal.len(), 64);
        for same in [
            set("effects.wall.stiffness.factor", 1.0),
            set("solver.solves", 2.0),
            ImageOptions { link_length_m: Some(2e-3), ..ImageOptions::default() },
            ImageOptions { cell_m: 2e-3, ..ImageOptions::default() },
        ] {
            assert_eq!(with(same.clone()), nominal, "{same:?}");
        }
        let tip = cathforce_bundle::tips::Tip::find("j");
        for other in [
            set("wall.friction_coefficient", 0.9),
            // The next number in single precision.
            set("effects.wall.stiffness.factor", 1.0_f32.next_up()),
            ImageOptions { tip, ..ImageOptions::default() },
        ] {
            assert_ne!(with(other.clone()), nominal, "{other:?}");
        }
    }
}
