//! PLY, of text or binary.

use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};

use crate::contents::{Contents, FileError, Format, Point};

const FIX: &str = "export the surface again as PLY";

pub(crate) fn read(mut bytes: &[u8]) -> Result<Contents, FileError> {
    let parser = Parser::<DefaultElement>::new();
    let ply = parser.read_ply(&mut bytes);
    let ply = ply.map_err(|e| FileError::new(format!("this is no whole PLY: {e}"), FIX))?;
    let mut contents = Contents::new(Format::Ply);
    let empty = Vec::new();
    let vertices = ply.payload.get("vertex").unwrap_or(&empty);
    for (at, vertex) in vertices.iter().enumerate() {
        let axis = |name: &str| {
            let number = vertex.get(name).and_then(number);
            number
                .ok_or_else(|| FileError::new(format!("vertex {at} has no coordinate {name}"), FIX))
        };
        contents.points.push(Point::new(axis("x")?, axis("y")?, axis("z")?));
    }
    for name in ["radius", "Radius", "MaximumInscribedSphereRadius"] {
        let values = vertices.iter().map(|vertex| vertex.get(name).and_then(number));
        if let Some(values) = values.collect::<Option<Vec<_>>>().filter(|values| !values.is_empty())
        {
            contents.scalars.push((name.to_owned(), values));
        }
    }
    for (at, face) in ply.payload.get("face").unwrap_or(&empty).iter().enumerate() {
        let list = face.get("vertex_indices").or_else(|| face.get("vertex_index"));
        let corners = list.and_then(corners);
        let corners =
            corners.ok_or_else(|| FileError::new(format!("face {at} names no vertices"), FIX))?;
        contents.add_polygon(&corners);
    }
    Ok(contents)
}

fn number(property: &Property) -> Option<f64> {
    Some(match property {
        Property::Char(x) => f64::from(*x),
        Property::UChar(x) => f64::from(*x),
        Property::Short(x) => f64::from(*x),
        Property::UShort(x) => f64::from(*x),
        Property::Int(x) => f64::from(*x),
        Property::UInt(x) => f64::from(*x),
        Property::Float(x) => f64::from(*x),
        Property::Double(x) => *x,
        _ => return None,
    })
}

fn corners(property: &Property) -> Option<Vec<u32>> {
    match property {
        Property::ListChar(list) => list.iter().map(|&x| u32::try_from(x).ok()).collect(),
        Property::ListUChar(list) => Some(list.iter().map(|&x| u32::from(x)).collect()),
        Property::ListShort(list) => list.iter().map(|&x| u32::try_from(x).ok()).collect(),
        Property::ListUShort(list) => Some(list.iter().map(|&x| u32::from(x)).collect()),
        Property::ListInt(list) => list.iter().map(|&x| u32::try_from(x).ok()).collect(),
        Property::ListUInt(list) => Some(list.clone()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 2 0\n3 0 1 2\n";

    #[test]
    fn text_and_binary_give_the_same_surface() {
        let text = Contents::read(TEXT.as_bytes()).unwrap();
        assert_eq!((text.format, &text.facets[..]), (Format::Ply, &[[0, 1, 2]][..]));
        let heading =
            TEXT.split("end_header\n").next().unwrap().replace("ascii", "binary_little_endian");
        let mut binary = (heading + "end_header\n").into_bytes();
        for x in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0] {
            binary.extend(x.to_le_bytes());
        }
        binary.push(3);
        [0_i32, 1, 2].iter().for_each(|corner| binary.extend(corner.to_le_bytes()));
        assert_eq!(Contents::read(&binary).unwrap(), text);
        for length in 3..binary.len() {
            assert!(Contents::read(&binary[..length]).is_err(), "{length}");
        }
    }
}
