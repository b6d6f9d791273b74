//! The markups of 3D Slicer (`.mrk.json`): a curve's control points, with a radius where it was measured.

use serde_json::Value;

use crate::contents::{Contents, FileError, Format, Point};

const FIX: &str = "save the curve as markups (.mrk.json) in 3D Slicer again";

pub(crate) fn read(bytes: &[u8]) -> Result<Contents, FileError> {
    let value: Value = serde_json::from_slice(bytes)
        .map_err(|e| FileError::at(e.line(), format!("this is no JSON: {e}"), FIX))?;
    let markups = value.get("markups").and_then(Value::as_array);
    let markups = markups.ok_or_else(|| FileError::new("the JSON has no `markups`", FIX))?;
    let mut contents = Contents::new(Format::Markups);
    let mut radii: Vec<Option<f64>> = Vec::new();
    for (index, markup) in markups.iter().enumerate() {
        let text = |key: &str| markup.get(key).and_then(Value::as_str);
        let name = text("name").map_or(format!("markup {index}"), str::to_owned);
        if let Some(system) = text("coordinateSystem") {
            contents
                .remarks
                .push(format!("{name}: coordinates are {system}; the surface must be so too"));
        }
        if let Some(unit) = text("coordinateUnits") {
            let unit_m = match unit {
                "mm" => 1e-3,
                "cm" => 1e-2,
                "m" => 1.0,
                "um" | "µm" => 1e-6,
                other => {
                    let problem =
                        format!("{name}: the unit `{other}` of its coordinates is not known");
                    return Err(FileError::new(problem, "save it in mm"));
                }
            };
            if contents.unit.as_ref().is_some_and(|(_, before)| *before != unit_m) {
                return Err(FileError::new("its markups have different units", FIX));
            }
            contents.unit = Some((unit.to_owned(), unit_m));
        }
        let points = markup.get("controlPoints").and_then(Value::as_array);
        let points =
            points.ok_or_else(|| FileError::new(format!("{name} has no control points"), FIX))?;
        let first = contents.points.len() as u32;
        for (at, point) in points.iter().enumerate() {
            if point
                .get("positionStatus")
                .and_then(Value::as_str)
                .is_some_and(|status| status != "defined")
            {
                contents
                    .remarks
                    .push(format!("{name}: control point {at} is not placed and left out"));
                continue;
            }
            let position = point.get("position").and_then(Value::as_array);
            let position =
                position.map(|axes| axes.iter().filter_map(Value::as_f64).collect::<Vec<_>>());
            let Some([x, y, z]) = position.as_deref() else {
                return Err(FileError::new(
                    format!("{name}: control point {at} has no position"),
                    FIX,
                ));
            };
            contents.points.push(Point::new(*x, *y, *z));
            radii.push(radius(markup, at));
        }
        contents.lines.push((first..contents.points.len() as u32).collect());
    }
    if let Some(radii) = radii.into_iter().collect::<Option<Vec<_>>>() {
        contents.scalars.push(("Radius".into(), radii));
    }
    Ok(contents)
}

/// The radius at a control point, of the measurement whose name says so.
fn radius(markup: &Value, at: usize) -> Option<f64> {
    let measurements = markup.get("measurements")?.as_array()?;
    let is_radius = |measurement: &&Value| {
        let name = measurement.get("name").and_then(Value::as_str).unwrap_or_default();
        name.to_lowercase().contains("radius") && measurement.get("controlPointValues").is_some()
    };
    measurements.iter().find(is_radius)?.get("controlPointValues")?.as_array()?.get(at)?.as_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVE: &str = r#"{"@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#",
        "markups": [{"type": "Curve", "name": "aorta", "coordinateSystem": "LPS", "coordinateUnits": "mm",
        "controlPoints": [{"position": [0, 0, 0], "positionStatus": "defined"},
                          {"position": [0, 0, 5.5], "positionStatus": "defined"},
                          {"position": [0, 0, 9], "positionStatus": "undefined"}],
        "measurements": [{"name": "length", "value": 5.5},
                         {"name": "Radius", "controlPointValues": [3, 2.5, 1]}]}]}"#;

    #[test]
    fn a_curve_has_its_unit_and_its_radii() {
        let contents = Contents::read(CURVE.as_bytes()).unwrap();
        assert_eq!((contents.format, &contents.lines[..]), (Format::Markups, &[vec![0, 1]][..]));
        assert_eq!(contents.scalars, [("Radius".to_owned(), vec![3.0, 2.5])]);
        assert_eq!(contents.unit, Some(("mm".into(), 1e-3)));
        let said = contents.remarks.join("\n");
        assert!(said.contains("LPS") && said.contains("point 2 is not placed"), "{said}");
        let furlong =
            Contents::read(CURVE.replace("\"mm\"", "\"furlong\"").as_bytes()).unwrap_err();
        assert!(furlong.problem.contains("`furlong`"), "{furlong}");
        assert_eq!(Contents::read(b"{\n\"markups\": [,]}").unwrap_err().line, Some(2));
    }
}
