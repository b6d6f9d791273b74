//! The JSON schema of settings files, for editors.

use cathforce_config::{BAND_ROWS, Key, keys};
use serde_json::{Map, Value, json};

use crate::settings::SCHEMA_VERSION;

/// The schema of a settings file.
pub fn json() -> Value {
    let property = |key: Key| {
        let [min, max] = key.range().map(number);
        let kind = if key.is_whole() { "integer" } else { "number" };
        let mut value = json!({ "type": kind, "minimum": min, "maximum": max });
        if let (Some(default), Value::Object(fields)) = (key.default(), &mut value) {
            fields.insert("default".into(), number(default));
        }
        let diagnosed = json!({
            "type": "object",
            "properties": { "value": value, "effect": { "type": "string" } },
            "required": ["value", "effect"],
            "additionalProperties": false,
        });
        let fields = json!({
            "description": format!("{} Unit: {}. Not changed while armed.", key.doc(), key.unit()),
            "anyOf": [value, diagnosed],
        });
        (key.name().to_owned(), fields)
    };
    let properties = keys().map(property).collect::<Map<_, _>>();
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Settings of cathforce for one rig",
        "description": "A device takes them as a whole, and never while its output is armed.",
        "type": "object",
        "properties": {
            "schema_version": { "const": SCHEMA_VERSION },
            "rig": { "type": "string", "description": "Name in the bundle's rig.toml." },
            "set": {
                "type": "object", "properties": properties, "additionalProperties": false,
            },
            "master": {
                "type": "object",
                "properties": { "catheter": drive(), "guidewire": drive(), "grip": place(true) },
                "additionalProperties": false,
            },
            "band": band(),
        },
        "required": ["schema_version", "rig"],
        "additionalProperties": false,
    })
}

/// The uncertainty of the forces, which `gap apply` writes.
fn band() -> Value {
    let rows = json!({
        "type": "array", "minItems": BAND_ROWS, "maxItems": BAND_ROWS,
        "items": { "type": "array", "minItems": 4, "maxItems": 4, "items": { "type": "number" } },
    });
    json!({
        "type": "object",
        "properties": {
            "model_sha256": {
                "type": "string", "description": "SHA-256 of the model that the band belongs to.",
            },
            "from_m": { "type": "number" },
            "step_m": { "type": "number" },
            "feed": rows,
            "withdrawal": rows,
        },
        "required": ["from_m", "step_m", "feed", "withdrawal"],
        "additionalProperties": false,
    })
}

/// A quantity in a frame of the master.
fn place(needs_id: bool) -> Value {
    let mut required = vec!["start_bit", "bits"];
    required.extend(needs_id.then_some("id"));
    json!({
        "type": "object",
        "properties": {
            "id": identifier(),
            "start_bit": { "type": "integer", "minimum": 0, "maximum": 63 },
            "bits": { "type": "integer", "minimum": 1, "maximum": 32 },
            "byte_order": { "enum": ["little", "big"], "default": "little" },
            "signed": { "type": "boolean", "default": false },
            "scale": { "type": "number", "default": 1.0 },
            "offset": { "type": "number", "default": 0.0 },
        },
        "required": required,
        "additionalProperties": false,
    })
}

fn identifier() -> Value {
    json!({ "type": "integer", "minimum": 0, "maximum": 0x7FF })
}

/// A drive in the master's frames; `id` is that of all its quantities without one.
fn drive() -> Value {
    json!({
        "type": "object",
        "properties": {
            "id": identifier(),
            "insertion": place(false), "rotation": place(false), "held": place(false),
        },
        "required": ["insertion", "rotation"],
        "additionalProperties": false,
    })
}

/// A number as it is declared: 0.1, not its single-precision neighbour.
fn number(value: f32) -> Value {
    serde_json::from_str(&value.to_string()).unwrap_or(Value::Null)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_is_in_the_schema_with_its_default_in_its_range() {
        let schema = json();
        let properties = &schema["properties"]["set"]["properties"];
        for key in keys() {
            let value = &properties[key.name()]["anyOf"][0];
            let of = |name: &str| value[name].as_f64();
            let (min, max) = (of("minimum").unwrap(), of("maximum").unwrap());
            assert!(of("default").is_none_or(|x| (min..=max).contains(&x)), "{}", key.name());
        }
    }
}
