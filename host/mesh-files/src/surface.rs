//! A surface as triangles, and as STL in millimetres.

use cathforce_bundle::geometry::{Triangle, read_stl as read_bundle_stl};

use crate::contents::{Contents, FileError, Format};

/// STL is read as millimetres by the bundle; here it keeps the file's own numbers.
const PER_METRE: f64 = 1e3;

pub(crate) fn read_stl(bytes: &[u8]) -> Result<Contents, FileError> {
    let triangles = read_bundle_stl(bytes).map_err(|(place, cause)| {
        let fix = "give a file of VTP, VTU, OBJ, PLY, STL, Slicer's markups, or a CSV of points";
        FileError::new(format!("{cause}{place}"), fix)
    })?;
    let mut contents = Contents::new(Format::Stl);
    for triangle in triangles {
        let first = contents.points.len() as u32;
        contents.points.extend(triangle.map(|corner| corner * PER_METRE));
        contents.facets.push([first, first + 1, first + 2]);
    }
    Ok(contents)
}

/// The facets in metres; `unit_m` is the file's unit.
pub fn triangles(contents: &Contents, unit_m: f64) -> Vec<Triangle> {
    let corner = |corner: u32| contents.points[corner as usize] * unit_m;
    contents.facets.iter().map(|facet| facet.map(corner)).collect()
}

/// Triangles in metres as a binary STL in millimetres.
pub fn stl(triangles: &[Triangle]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    let heading = b"cathforce, millimetres";
    bytes[..heading.len()].copy_from_slice(heading);
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        let [a, b, c] = triangle;
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        let corners = triangle.iter().map(|corner| corner * PER_METRE);
        for vector in std::iter::once(normal).chain(corners) {
            vector.iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
        }
        bytes.extend([0, 0]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contents::Point;

    #[test]
    fn an_stl_comes_back_in_its_own_numbers() {
        let triangle = [Point::zeros(), Point::new(2e-3, 0.0, 0.0), Point::new(0.0, 3e-3, 0.0)];
        let contents = Contents::read(&stl(&[triangle])).unwrap();
        assert_eq!((contents.format, contents.facets.len()), (Format::Stl, 1));
        assert!((contents.points[1].x - 2.0).abs() < 1e-6);
        let back = triangles(&contents, 0.01);
        assert!((back[0][2].y - 0.03).abs() < 1e-8, "three centimetres");
    }
}
