//! A diagnosis as a source. Its JSON goes to the browser as it is.

use serde_json::{Value, json};

/// The JSON of a diagnosis, of any version of its format; `Err` says what is wrong with it.
pub fn read_diagnosis(bytes: &[u8]) -> Result<Value, String> {
    let answer: Value = serde_json::from_slice(bytes).map_err(|e| format!("it is no JSON: {e}"))?;
    match answer.get("format").and_then(Value::as_str) {
        Some(format) if format.starts_with("gap-diagnosis/") => Ok(answer),
        Some(format) => Err(format!("its format is `{format}`, not gap-diagnosis/1 or /2")),
        None => Err("it has no `format`, so it is no diagnosis".to_owned()),
    }
}

/// What `GET /api/state` says of a diagnosis: there is no tick and no age, and the forces are errors.
pub fn state(answer: &Value) -> Value {
    let at = |path: &str| answer.pointer(path).cloned().unwrap_or(Value::Null);
    json!({
        "source": "diagnosis",
        "mode": "diagnosis",
        "tick": null,
        "age_ms": null,
        "forces": null,
        "force_rms_N": at("/gap/force_rms_N"),
        "verdict": at("/verdict"),
        "sentence": at("/sentence"),
        "bundle": at("/bundle"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_versions_are_read_and_other_files_are_refused() {
        for version in [1, 2] {
            let text =
                format!("{{\"format\": \"gap-diagnosis/{version}\", \"verdict\": \"no_gap\"}}");
            let answer = read_diagnosis(text.as_bytes()).unwrap();
            assert_eq!(state(&answer)["verdict"], "no_gap");
            assert!(state(&answer)["sentence"].is_null());
        }
        assert!(read_diagnosis(b"[1").unwrap_err().contains("no JSON"));
        assert!(read_diagnosis(b"{}").unwrap_err().contains("no `format`"));
        assert!(read_diagnosis(b"{\"format\": \"x\"}").unwrap_err().contains("`x`"));
    }
}
