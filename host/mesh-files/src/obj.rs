//! Wavefront's OBJ: vertices and facets; what else it has is passed over.

use crate::contents::{Contents, FileError, Format, Point};

const FIX: &str = "export the surface again as OBJ";

pub(crate) fn is_one(text: &[u8]) -> bool {
    let head = &text[..text.len().min(4096)];
    let head = String::from_utf8_lossy(head);
    let mut lines =
        head.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let words = ["v ", "vn ", "vt ", "f ", "o ", "g ", "mtllib ", "usemtl ", "s "];
    lines.next().is_some_and(|line| words.iter().any(|word| line.starts_with(word)))
}

pub(crate) fn read(bytes: &[u8]) -> Result<Contents, FileError> {
    let mut contents = Contents::new(Format::Obj);
    let text = String::from_utf8_lossy(bytes);
    for (line, text) in (1..).zip(text.lines()) {
        let mut words = text.split_ascii_whitespace();
        let wrong = |problem: String| FileError::at(line, problem, FIX);
        match words.next() {
            Some("v") => {
                let numbers = words.map(str::parse::<f64>).collect::<Result<Vec<_>, _>>();
                let numbers =
                    numbers.map_err(|_| wrong(format!("`{text}` has a word that is no number")))?;
                let [x, y, z, ..] = numbers[..] else {
                    return Err(wrong("a vertex has three coordinates".into()));
                };
                contents.points.push(Point::new(x, y, z));
            }
            Some("f" | "l") => {
                let count = contents.points.len();
                let corner = |word: &str| {
                    // Behind a slash are the texture and the normal; below zero counts from the end.
                    let index = word.split('/').next()?.parse::<i64>().ok()?;
                    let index = if index < 0 { count as i64 + index } else { index - 1 };
                    usize::try_from(index)
                        .ok()
                        .filter(|&index| index < count)
                        .map(|index| index as u32)
                };
                let corners = words.map(corner).collect::<Option<Vec<_>>>();
                let corners = corners
                    .ok_or_else(|| wrong(format!("`{text}` names a vertex that is not there")))?;
                if text.trim_start().starts_with('l') {
                    contents.lines.push(corners);
                } else if corners.len() < 3 {
                    return Err(wrong("a facet has three corners at least".into()));
                } else {
                    contents.add_polygon(&corners);
                }
            }
            _ => {}
        }
    }
    Ok(contents)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facets_of_any_corners_are_read_and_faults_have_their_line() {
        let text = "# by hand\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1 4//1\nf -4 -3 -2\n";
        let contents = Contents::read(text.as_bytes()).unwrap();
        assert_eq!((contents.format, contents.points.len()), (Format::Obj, 4));
        assert_eq!(contents.facets, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
        for (from, to, line) in
            [("f -4", "f 9", 8), ("v 1 1 0", "v 1 one 0", 4), ("f -4 -3 -2", "f 1 2", 8)]
        {
            let error = Contents::read(text.replace(from, to).as_bytes()).unwrap_err();
            assert_eq!(error.line, Some(line), "{error}");
        }
    }
}
