//! What a settings file may hold, for editors and for people.

use cathforce_config::{BAND_ROWS, Key, keys};
use serde_json::{Map, Value, json};

use crate::settings::SCHEMA_VERSION;
use crate::settings::parse::unit;

/// JSON schema of a settings file.
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
            "description": format!("{} Unit: {}. Not while armed.", key.doc(), key.unit()),
            "anyOf": [value, diagnosed],
        });
        (key.name().to_owned(), fields)
    };
    let properties = keys().map(property).collect::<Map<_, _>>();
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Settings of cathforce for one rig",
        "description": "A device takes them whole, and none while its output is armed.",
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

/// How far the forces may be off, which a diagnosis says and nobody writes.
fn band() -> Value {
    let rows = json!({
        "type": "array", "minItems": BAND_ROWS, "maxItems": BAND_ROWS,
        "items": { "type": "array", "minItems": 4, "maxItems": 4, "items": { "type": "number" } },
    });
    json!({
        "type": "object",
        "properties": {
            "model_sha256": {
                "type": "string", "description": "Of the model that the band is of.",
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

/// A quantity of the master's, and its frame.
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

/// A drive, as the master tells of it; `id` is of the quantities that have none.
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

/// As it is written in the declaration: 0.1, not what single precision makes of it.
fn number(value: f32) -> Value {
    serde_json::from_str(&value.to_string()).unwrap_or(Value::Null)
}

/// `docs/config.md`.
pub fn markdown() -> String {
    let mut text = format!(
        "# Configuration\n\n<!-- Written by `cathforce config schema --markdown`. -->\n\n{INTRODUCTION}\n\
         Names and layout are version {SCHEMA_VERSION} (`schema_version`).\n"
    );
    for (title, is_here) in [
        ("Settings of the operator", (|key| matches!(key, Key::Setting(_))) as fn(&Key) -> bool),
        ("Numbers of the rig and its effects", |key| matches!(key, Key::Parameter(_))),
    ] {
        text += &format!(
            "\n## {title}\n\n| name | default | range | what it does |\n\
             | --- | --- | --- | --- |\n"
        );
        for key in keys().filter(is_here) {
            let [min, max] = key.range();
            let default = key.default().map_or("rig.toml".to_owned(), |value| value.to_string());
            text += &format!(
                "| `{}` | {default} | {min} to {max}{} | {} |\n",
                key.name(),
                unit(key),
                key.doc()
            );
        }
    }
    text
}

const INTRODUCTION: &str = "\
A bundle says what the rig is; a settings file says what its operator wants, and what a diagnosis
found. One file, TOML, for one rig:

```toml
schema_version = 1
rig = \"tapered-bifurcation\"

[set]
force_gain = 2.0
wall.friction_coefficient = 0.25
\"effects.wall.stiffness.factor\" = { value = 0.8, effect = \"wall.stiffness\" }
```

    cathforce config init BUNDLE S.toml              # a file with everything in it, as comments
    cathforce config set S.toml force_gain=2         # change it; comments stay
    cathforce config validate S.toml                 # names, ranges, slips of the unit
    cathforce config diff S.toml [OTHER|LINK]        # against the defaults, a file, a device
    cathforce config apply S.toml BUNDLE --link …    # show what changes, send it, read it back
    cathforce config save BUNDLE S.toml --link …     # from the device into a file
    cathforce config restore OLD.toml BUNDLE --link … # what carries over, and a list of the rest
    cathforce config show BUNDLE --origin            # every value, and who says so
    cathforce config schema                          # JSON schema, for editors

A robot whose master does not send ENCODER and GUIDEWIRE says where its frames have a drive's
position; bits are counted as in a DBC. Nothing of it is compiled in: the device reads it from its
image. Such frames carry neither our counter nor our CRC, so repeated and damaged ones are left to
the checks of freshness, range and speed.

```toml
[master.catheter]
id = 0x3a1
insertion = { start_bit = 7, bits = 16, byte_order = \"big\", signed = false, scale = 1e-5, offset = 0.0 }
rotation = { start_bit = 23, bits = 16, byte_order = \"big\", signed = true, scale = 1e-3, offset = 0.0 }
```

    cathforce config import-dbc LAB.dbc --list        # its signals
    cathforce config import-dbc LAB.dbc --settings S.toml --insertion MSG.FEED --rotation MSG.TURN \\
        --button MSG.CATHETER --grip MSG.GRIP --guidewire-insertion …

`[master.guidewire]` is the same. `held` is a drive's button, `grip` under `[master]` the handle's:
from one half on they are held. The load on the drive whose button is held is felt; with neither or
both held, or the handle let go, force and torque slew to zero and the limit flag RELEASED says so.
Without `held` the catheter counts as held whenever the guidewire is not. ENCODER has a bit
`Released` for the same, GUIDEWIRE its `Held`.

Any of them may come in a frame of its own, with an `id` of its own, and frames may be shared. A
drive has a new position when each of its frames, button and grip included, has come since the last
one: the oldest counts, and one frame that stops coming is a drive that is lost.

`run`, `simulate` and the others take the file with `--settings S.toml`; `gap apply` writes the
same format, with the effect that each value comes from. Its `[band]` is a table of how far the
forces may be off, with a hash of the model that it is of: where another one is set, none is stated
([how to close a gap](how-to/close-a-gap.md)). Errors name file and line, and an unknown name its nearest neighbour. A value
with a unit that is a thousand times its default, or a thousandth, is allowed and warned of.

A device takes a configuration whole, and **no setting changes while output is armed** or ramps to
zero (P17): it refuses, `apply` and `run` say so before they send anything, and what was in use
stays. Disarming takes 20 ms. So nothing changes under the operator's hand, and every tick of a
recording is explained by the one configuration that it carries.
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_in_docs_is_the_one_that_is_declared() {
        let page = include_str!("../../../../../docs/config.md");
        assert_eq!(page, markdown(), "write it again: cathforce config schema --markdown");
    }

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
