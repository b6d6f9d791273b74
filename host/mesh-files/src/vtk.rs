//! VTK's XML files: PolyData (VTP) and UnstructuredGrid (VTU), with arrays of text or binary, inline or
//! appended, packed by zlib or LZ4 or not.

use std::collections::HashMap;
use std::io::Read as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::contents::{Contents, FileError, Format, Point};
use crate::xml::{Tag, tags};

const FIX: &str = "save the file again with VTK or ParaView, best as VTP with binary arrays";
/// Largest array that is unpacked \[bytes\].
const LARGEST: u64 = 1 << 32;

/// Numbers of VTK's kinds of cells.
const LINES: [u64; 2] = [3, 4];
const TRIANGLE: u64 = 5;
const STRIP: u64 = 6;
const POLYGON: u64 = 7;
const QUAD: u64 = 9;
const TETRAHEDRON: u64 = 10;

/// How the file's arrays are written.
struct File<'a> {
    is_big_endian: bool,
    /// Bytes of the lengths in front of binary data.
    header_bytes: usize,
    packing: Option<&'a str>,
    /// What follows `_` in `AppendedData`, and whether it is base 64.
    appended: Option<(&'a [u8], bool)>,
    /// Where the arrays in it begin, sorted.
    offsets: Vec<usize>,
}

/// An array by its place, as `Points`, `Polys/connectivity` or `PointData/Radius`.
type Arrays = HashMap<String, Vec<f64>>;

pub(crate) fn read(bytes: &[u8]) -> Result<Contents, FileError> {
    let marker = b"<AppendedData";
    let appended_at = bytes.windows(marker.len()).position(|window| window == marker);
    let text = std::str::from_utf8(&bytes[..appended_at.unwrap_or(bytes.len())])
        .map_err(|_| FileError::new("the file is no text where VTK writes text", FIX))?;
    let all = tags(text).collect::<Vec<_>>();
    let root = all.iter().find(|tag| tag.name == "VTKFile");
    let root = root.ok_or_else(|| FileError::new("this XML has no element VTKFile", FIX))?;
    let kind = root.attribute("type").unwrap_or_default();
    if !["PolyData", "UnstructuredGrid"].contains(&kind) {
        let problem = format!("this is a VTK file of {kind}, not PolyData or UnstructuredGrid");
        return Err(FileError::new(problem, "extract the surface and save it as VTP"));
    }
    let offsets = all.iter().filter_map(|tag| tag.attribute("offset")?.parse().ok());
    let mut offsets = offsets.collect::<Vec<usize>>();
    offsets.sort_unstable();
    let file = File {
        is_big_endian: root.attribute("byte_order") == Some("BigEndian"),
        header_bytes: if root.attribute("header_type") == Some("UInt64") { 8 } else { 4 },
        packing: root.attribute("compressor"),
        appended: appended_at.and_then(|at| appended(&bytes[at..])),
        offsets,
    };
    let mut contents = Contents::new(Format::VtkXml);
    let mut start = 0;
    for (at, tag) in all.iter().enumerate() {
        if tag.name == "/Piece" {
            let arrays = file.arrays(text, &all[start..at])?;
            add_piece(&mut contents, arrays)?;
            start = at + 1;
        }
    }
    Ok(contents)
}

/// The data behind the mark `_`, and whether they are base 64.
fn appended(element: &[u8]) -> Option<(&[u8], bool)> {
    let open = element.iter().position(|byte| *byte == b'>')?;
    let is_base64 = String::from_utf8_lossy(&element[..open]).contains("base64");
    let mark = open + element[open..].iter().position(|byte| *byte == b'_')?;
    Some((&element[mark + 1..], is_base64))
}

impl File<'_> {
    /// The arrays of a piece.
    fn arrays(&self, text: &str, piece: &[Tag<'_>]) -> Result<Arrays, FileError> {
        let mut arrays = Arrays::new();
        let mut section = "";
        for (at, tag) in piece.iter().enumerate() {
            if ["Points", "Polys", "Lines", "Strips", "Cells", "PointData", "Verts", "CellData"]
                .contains(&tag.name)
            {
                section = tag.name;
            }
            if tag.name != "DataArray" || ["Verts", "CellData", ""].contains(&section) {
                continue;
            }
            let name = tag.attribute("Name").unwrap_or_default();
            let place = match section {
                "Points" => "Points".to_owned(),
                _ => format!("{section}/{name}"),
            };
            // Of the arrays of points only those of one number are of use.
            let components = tag.attribute("NumberOfComponents").unwrap_or("1");
            if section == "PointData" && components != "1" {
                continue;
            }
            let numbers = self.array(text, piece, at);
            let numbers = numbers.map_err(|problem| {
                let line = 1 + text[..tag.begins].matches('\n').count();
                FileError::at(line, format!("the array {place}: {problem}"), FIX)
            })?;
            arrays.insert(place, numbers);
        }
        Ok(arrays)
    }

    fn array(&self, text: &str, piece: &[Tag<'_>], at: usize) -> Result<Vec<f64>, String> {
        let tag = &piece[at];
        let kind = tag.attribute("type").unwrap_or_default();
        let format = tag.attribute("format").unwrap_or("ascii");
        if format == "appended" {
            let offset = tag.attribute("offset").and_then(|offset| offset.parse::<usize>().ok());
            let offset = offset.ok_or("it has no offset")?;
            let (data, is_base64) = self.appended.ok_or("the file has no AppendedData")?;
            let next = self.offsets.iter().copied().find(|&next| next > offset);
            let own = data.get(offset..).ok_or("it begins behind the end of the file")?;
            let bytes = match is_base64 {
                true => {
                    let end = next.map_or(own.len(), |next| next - offset).min(own.len());
                    decoded(&own[..end])?
                }
                false => own.to_vec(),
            };
            return self.numbers(kind, &self.unpacked(&bytes)?);
        }
        // Elements of further information may stand in it.
        let end =
            piece[at..].iter().find(|tag| tag.name == "/DataArray").ok_or("it does not end")?;
        let mut inside = text[tag.ends..end.begins].to_owned();
        while let (Some(from), Some(to)) = (inside.find('<'), inside.rfind('>')) {
            if from > to {
                break;
            }
            inside.replace_range(from..=to, " ");
        }
        match format {
            "ascii" => {
                let number = |word: &str| {
                    word.parse::<f64>()
                        .map_err(|_| format!("`{}` is no number", word.escape_debug()))
                };
                inside.split_ascii_whitespace().map(number).collect()
            }
            "binary" => self.numbers(kind, &self.unpacked(&decoded(inside.as_bytes())?)?),
            other => Err(format!("its format `{other}` is not known")),
        }
    }

    /// The data behind the lengths in front of them.
    fn unpacked(&self, bytes: &[u8]) -> Result<Vec<u8>, String> {
        let size = self.header_bytes;
        let length = |index: usize| {
            let own = bytes.get(index * size..(index + 1) * size).ok_or("it is cut off")?;
            let digits: Vec<u8> = match self.is_big_endian {
                true => own.iter().rev().copied().collect(),
                false => own.to_vec(),
            };
            let number = digits.iter().rev().fold(0_u64, |sum, digit| sum << 8 | u64::from(*digit));
            usize::try_from(number).map_err(|_| "a length is out of range".to_owned())
        };
        let Some(packing) = self.packing else {
            let count = length(0)?;
            let data = bytes.get(size..).and_then(|data| data.get(..count));
            return data.map(<[u8]>::to_vec).ok_or_else(|| "it is cut off".into());
        };
        let (blocks, block, last) = (length(0)?, length(1)?, length(2)?);
        if (blocks as u64).saturating_mul(block as u64) > LARGEST {
            return Err("it would have more than 4 GiB".into());
        }
        let mut at = blocks
            .checked_add(3)
            .and_then(|count| count.checked_mul(size))
            .ok_or("it is cut off")?;
        let mut data = Vec::new();
        for index in 0..blocks {
            let packed = length(3 + index)?;
            let own =
                at.checked_add(packed).and_then(|end| bytes.get(at..end)).ok_or("it is cut off")?;
            at += packed;
            let is_last = index + 1 == blocks;
            let expected = if is_last && last > 0 { last } else { block };
            let before = data.len();
            match packing {
                "vtkZLibDataCompressor" => {
                    let decoder = flate2::read::ZlibDecoder::new(own);
                    let read = decoder.take(expected as u64 + 1).read_to_end(&mut data);
                    read.map_err(|e| format!("block {index} is damaged: {e}"))?;
                }
                "vtkLZ4DataCompressor" => {
                    let block = lz4_flex::block::decompress(own, expected);
                    data.extend(block.map_err(|e| format!("block {index} is damaged: {e}"))?);
                }
                other => return Err(format!("it is packed by {other}, which is not known")),
            }
            if data.len() - before != expected {
                return Err(format!("block {index} has not its {expected} bytes"));
            }
        }
        Ok(data)
    }

    fn numbers(&self, kind: &str, bytes: &[u8]) -> Result<Vec<f64>, String> {
        macro_rules! numbers {
            ($type:ty) => {{
                let (chunks, rest) = bytes.as_chunks::<{ size_of::<$type>() }>();
                if !rest.is_empty() {
                    return Err("it ends within a number".into());
                }
                let number = |chunk: &[u8; size_of::<$type>()]| match self.is_big_endian {
                    true => <$type>::from_be_bytes(*chunk) as f64,
                    false => <$type>::from_le_bytes(*chunk) as f64,
                };
                chunks.iter().map(number).collect()
            }};
        }
        Ok(match kind {
            "Float32" => numbers!(f32),
            "Float64" => numbers!(f64),
            "Int8" => numbers!(i8),
            "UInt8" => numbers!(u8),
            "Int16" => numbers!(i16),
            "UInt16" => numbers!(u16),
            "Int32" => numbers!(i32),
            "UInt32" => numbers!(u32),
            "Int64" | "vtkIdType" => numbers!(i64),
            "UInt64" => numbers!(u64),
            other => return Err(format!("its type `{other}` is not known")),
        })
    }
}

/// Base 64 in several parts, each of which may be filled up at its end.
fn decoded(text: &[u8]) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let letters: Vec<u8> =
        text.iter().copied().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let mut rest = &letters[..];
    while !rest.is_empty() {
        let fill = rest.iter().position(|byte| *byte == b'=').map(|at| (at / 4 + 1) * 4);
        // What follows the last array is the end of its element.
        let end = rest.iter().position(|byte| *byte == b'<').unwrap_or(rest.len());
        let end = fill.unwrap_or(end).min(end);
        let part = &rest[..end / 4 * 4];
        bytes.extend(STANDARD.decode(part).map_err(|e| format!("it is no base 64: {e}"))?);
        if part.len() < end || fill.is_none_or(|fill| fill > end) {
            break;
        }
        rest = &rest[part.len()..];
        if rest.first() == Some(&b'<') {
            break;
        }
    }
    Ok(bytes)
}

/// Adds the points, facets, lines and arrays of a piece.
fn add_piece(contents: &mut Contents, mut arrays: Arrays) -> Result<(), FileError> {
    let wrong = |problem: String| FileError::new(problem, FIX);
    let first = contents.points.len() as u64;
    let points = arrays.remove("Points").ok_or_else(|| wrong("a piece has no Points".into()))?;
    let (points, []) = points.as_chunks::<3>() else {
        return Err(wrong("its Points are not three numbers each".into()));
    };
    contents.points.extend(points.iter().map(|[x, y, z]| Point::new(*x, *y, *z)));
    let mut tetrahedra: Vec<[u32; 4]> = Vec::new();
    let mut others = 0;
    for section in ["Polys", "Strips", "Lines", "Cells"] {
        let Some(connectivity) = arrays.remove(&format!("{section}/connectivity")) else {
            continue;
        };
        let offsets = arrays.remove(&format!("{section}/offsets")).unwrap_or_default();
        let types = arrays.remove(&format!("{section}/types")).unwrap_or_default();
        let mut start = 0;
        for (cell, &end) in offsets.iter().enumerate() {
            let end = end as usize;
            let corners = connectivity.get(start..end);
            let corners =
                corners.ok_or_else(|| wrong(format!("cell {cell} of {section} is cut off")))?;
            start = end;
            let corner = |&corner: &f64| {
                let index = (corner >= 0.0).then_some(corner as u64)?.checked_add(first)?;
                u32::try_from(index).ok()
            };
            let corners = corners.iter().map(corner).collect::<Option<Vec<u32>>>();
            let corners = corners
                .ok_or_else(|| wrong(format!("cell {cell} of {section} has a corner below 0")))?;
            let kind = match section {
                "Polys" => POLYGON,
                "Strips" => STRIP,
                "Lines" => LINES[1],
                _ => types.get(cell).map_or(0, |kind| *kind as u64),
            };
            match kind {
                TRIANGLE | POLYGON | QUAD => contents.add_polygon(&corners),
                STRIP => {
                    for (k, corners) in corners.windows(3).enumerate() {
                        // Every second one of a strip faces the other way.
                        let [a, b, c] = [corners[0], corners[1], corners[2]];
                        contents.facets.push(if k % 2 == 0 { [a, b, c] } else { [b, a, c] });
                    }
                }
                TETRAHEDRON => match corners[..] {
                    [a, b, c, d] => tetrahedra.push([a, b, c, d]),
                    _ => return Err(wrong(format!("cell {cell} is no tetrahedron"))),
                },
                kind if LINES.contains(&kind) => contents.lines.push(corners),
                _ => others += 1,
            }
        }
    }
    if !tetrahedra.is_empty() {
        let facets = hull(&tetrahedra);
        let remark = format!(
            "{} tetrahedra: their hull of {} triangles is taken",
            tetrahedra.len(),
            facets.len()
        );
        contents.remarks.push(remark);
        contents.facets.extend(facets);
    }
    if others > 0 {
        contents.remarks.push(format!("{others} cells of other kinds are left out"));
    }
    for (place, values) in arrays {
        if let Some(name) = place.strip_prefix("PointData/") {
            match contents.scalars.iter_mut().find(|(own, _)| own == name) {
                Some((_, own)) => own.extend(values),
                None if first == 0 => contents.scalars.push((name.to_owned(), values)),
                None => {}
            }
        }
    }
    contents.scalars.retain(|(_, values)| values.len() == contents.points.len());
    contents.scalars.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(())
}

/// The faces that belong to one tetrahedron alone, facing outwards.
fn hull(tetrahedra: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let mut faces: HashMap<[u32; 3], ([u32; 3], usize)> = HashMap::new();
    for &[a, b, c, d] in tetrahedra {
        for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
            let mut key = face;
            key.sort_unstable();
            faces.entry(key).or_insert((face, 0)).1 += 1;
        }
    }
    let mut hull: Vec<[u32; 3]> =
        faces.into_values().filter(|(_, count)| *count == 1).map(|(face, _)| face).collect();
    hull.sort_unstable();
    hull
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    const RADIUS: [f32; 4] = [3.0, 2.5, 2.0, 1.5];
    const POINTS: [f32; 12] = [0.0, 0.0, 0.0, 10.0, 0.0, 0.0, 20.0, 0.0, 0.0, 20.0, 10.0, 0.0];
    const CORNERS: [i64; 7] = [0, 1, 2, 3, 0, 1, 3];

    fn bytes() -> [Vec<u8>; 4] {
        let floats = |numbers: &[f32]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let whole = |numbers: &[i64]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        [floats(&POINTS), floats(&RADIUS), whole(&CORNERS), whole(&[4, 7])]
    }

    /// A file whose arrays are written by `array`, with what follows the piece.
    fn file(root: &str, array: &mut dyn FnMut(usize) -> (String, String), tail: &[u8]) -> Vec<u8> {
        let mut element = |index: usize, head: &str| {
            let (attributes, content) = array(index);
            format!(
                "<DataArray {head} {attributes}>{content}<InformationKey name=\"L2\">1</InformationKey></DataArray>\n"
            )
        };
        let points = element(0, "type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\"");
        let radius = element(1, "type=\"Float32\" Name=\"MaximumInscribedSphereRadius\"");
        let corners = element(2, "type=\"Int64\" Name=\"connectivity\"");
        let offsets = element(3, "type=\"Int64\" Name=\"offsets\"");
        let mut file = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" {root}>\n<PolyData>\n<Piece NumberOfPoints=\"4\">\n\
             <PointData>\n{radius}</PointData>\n<Points>\n{points}</Points>\n<Lines>\n{corners}{offsets}</Lines>\n\
             </Piece>\n</PolyData>\n"
        )
        .into_bytes();
        file.extend(tail);
        file.extend(b"</VTKFile>\n");
        file
    }

    fn packed(data: &[u8], lz4: bool) -> Vec<u8> {
        let block = match lz4 {
            true => lz4_flex::block::compress(data),
            false => {
                let mut packer =
                    flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
                packer.write_all(data).unwrap();
                packer.finish().unwrap()
            }
        };
        let lengths = [1, data.len() as u32, data.len() as u32, block.len() as u32];
        lengths.iter().flat_map(|length| length.to_le_bytes()).chain(block).collect()
    }

    fn with_length(data: &[u8]) -> Vec<u8> {
        (data.len() as u32).to_le_bytes().iter().chain(data).copied().collect()
    }

    #[test]
    fn every_way_of_writing_arrays_gives_the_same_lines() {
        let data = bytes();
        let ascii = file(
            "",
            &mut |index| {
                let text = match index {
                    0 => format!("{POINTS:?}"),
                    1 => format!("{RADIUS:?}"),
                    2 => format!("{CORNERS:?}"),
                    _ => "4 7".into(),
                };
                ("format=\"ascii\"".into(), text.replace(['[', ']', ','], " "))
            },
            b"",
        );
        let expected = Contents::read(&ascii).unwrap();
        assert_eq!(expected.lines, [vec![0, 1, 2, 3], vec![0, 1, 3]]);
        assert_eq!(expected.scalars[0].0, "MaximumInscribedSphereRadius");
        assert_eq!(expected.scalars[0].1, [3.0, 2.5, 2.0, 1.5]);
        let inline = file(
            "",
            &mut |index| {
                // The length is a part of its own, filled up.
                let length = STANDARD.encode((data[index].len() as u32).to_le_bytes());
                ("format=\"binary\"".into(), length + &STANDARD.encode(&data[index]))
            },
            b"",
        );
        assert_eq!(Contents::read(&inline).unwrap(), expected);
        for (lz4, name) in [(false, "vtkZLibDataCompressor"), (true, "vtkLZ4DataCompressor")] {
            let root = format!("compressor=\"{name}\"");
            let parts = data.each_ref().map(|data| packed(data, lz4));
            let inline = file(
                &root,
                &mut |index| {
                    let (lengths, blocks) = parts[index].split_at(16);
                    (
                        "format=\"binary\"".into(),
                        STANDARD.encode(lengths) + &STANDARD.encode(blocks),
                    )
                },
                b"",
            );
            assert_eq!(Contents::read(&inline).unwrap(), expected, "{name}");
            let mut raw = b"<AppendedData encoding=\"raw\">\n_".to_vec();
            let begins = raw.len();
            let mut offsets = Vec::new();
            for part in &parts {
                offsets.push(raw.len() - begins);
                raw.extend(part);
            }
            raw.extend(b"\n</AppendedData>\n");
            let appended = file(
                &root,
                &mut |index| {
                    (format!("format=\"appended\" offset=\"{}\"", offsets[index]), String::new())
                },
                &raw,
            );
            assert_eq!(Contents::read(&appended).unwrap(), expected, "{name}");
            for length in (0..appended.len()).step_by(13) {
                let _ = Contents::read(&appended[..length]);
            }
            // Any byte may be any other: no panic, and no corner that is not there.
            for at in (0..appended.len()).step_by(3) {
                let mut damaged = appended.clone();
                damaged[at] ^= 0x15;
                if let Ok(found) = Contents::read(&damaged) {
                    let corners = found.lines.iter().flatten();
                    assert!(
                        corners.copied().all(|corner| (corner as usize) < found.points.len()),
                        "byte {at}"
                    );
                }
            }
        }
        let mut text = "<AppendedData encoding=\"base64\">\n_".to_owned();
        let begins = text.len();
        let mut offsets = Vec::new();
        for data in &data {
            offsets.push(text.len() - begins);
            text += &STANDARD.encode(with_length(data));
        }
        text += "\n</AppendedData>\n";
        let appended = file(
            "",
            &mut |index| {
                (format!("format=\"appended\" offset=\"{}\"", offsets[index]), String::new())
            },
            text.as_bytes(),
        );
        assert_eq!(Contents::read(&appended).unwrap(), expected);
    }

    #[test]
    fn a_volume_gives_its_hull_and_what_is_wrong_has_its_line() {
        let grid = "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece>\n\
            <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1</DataArray></Points>\n\
            <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 1 2 3 4</DataArray>\n\
            <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4 8</DataArray>\n\
            <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>";
        let contents = Contents::read(grid.as_bytes()).unwrap();
        assert_eq!(contents.facets.len(), 6, "the face between the two is inside");
        assert!(contents.remarks[0].contains("2 tetrahedra"), "{:?}", contents.remarks);
        let word = Contents::read(grid.replace("4 8<", "4 x<").as_bytes()).unwrap_err();
        assert!(word.line == Some(4) && word.problem.contains("Cells/offsets"), "{word}");
        let far = Contents::read(grid.replace("2 3 4<", "2 3 9<").as_bytes()).unwrap_err();
        assert!(far.problem.contains("point 9"), "{far}");
        let image = Contents::read(
            grid.replace("type=\"UnstructuredGrid\"", "type=\"ImageData\"").as_bytes(),
        );
        assert!(image.unwrap_err().problem.contains("ImageData"));
    }
}
