//! A centre line as a table: a point a row, named by its heading.

use crate::contents::{Contents, FileError, Format, Point};

/// Units that a heading may name, in metres.
const UNITS: [(&str, f64); 6] =
    [("um", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("in", 0.0254), ("inch", 0.0254)];
/// Names of the three coordinates, of which one row is meant. ParaView numbers them.
const COORDINATES: [[&str; 3]; 4] = [
    ["x", "y", "z"],
    ["points:0", "points:1", "points:2"],
    ["points_0", "points_1", "points_2"],
    ["position_x", "position_y", "position_z"],
];
const BRANCH: [&str; 4] = ["branch", "line", "centerlineid", "centerlineids"];
const FIX: &str =
    "name the columns of the coordinates x, y and z, with their unit if it is not mm, like x_m";

/// A column of the heading.
struct Column<'a> {
    /// Without its unit.
    name: &'a str,
    unit: Option<(&'a str, f64)>,
}

/// Whether a text begins with a heading that names coordinates.
pub(crate) fn is_one(text: &[u8]) -> bool {
    let first = text.split(|byte| *byte == b'\n').next().unwrap_or_default();
    std::str::from_utf8(first).is_ok_and(|heading| {
        let names = split(heading, separator(heading));
        names.len() > 2 && names.iter().any(|name| name.starts_with(char::is_alphabetic))
    })
}

pub(crate) fn read(text: &[u8]) -> Result<Contents, FileError> {
    let text = std::str::from_utf8(text)
        .map_err(|_| FileError::new("this is no text of UTF-8", "save it as UTF-8"))?;
    let heading = text.lines().next().unwrap_or_default();
    let separator = separator(heading);
    let columns = split(heading, separator).into_iter().map(Column::read).collect::<Vec<_>>();
    let [x, y, z] = coordinates(&columns)?;
    let branch = columns.iter().position(|column| is_among(column.name, &BRANCH));
    let mut contents = Contents::new(Format::Table);
    contents.unit = columns[x].unit.map(|(name, metres)| (name.to_owned(), metres));
    let others = (0..columns.len()).filter(|at| ![x, y, z].contains(at) && Some(*at) != branch);
    let others = others.collect::<Vec<_>>();
    let mut scalars = vec![Some(Vec::new()); others.len()];
    let mut lines: Vec<(&str, Vec<u32>)> = Vec::new();
    for (row, line) in (2..).zip(text.lines().skip(1)) {
        if line.trim().is_empty() {
            continue;
        }
        let fields = split(line, separator);
        if fields.len() != columns.len() {
            let problem =
                format!("{} fields, but {} columns are named", fields.len(), columns.len());
            let fix = "correct the line; a number has a point, e.g. 0.25";
            return Err(FileError::at(row, problem, fix));
        }
        let number = |at: usize| {
            fields[at].parse::<f64>().map_err(|_| {
                let problem =
                    format!("`{}` in column `{}` is no number", fields[at], columns[at].name);
                FileError::at(row, problem, "correct the line; a number has a point, e.g. 0.25")
            })
        };
        let point = u32::try_from(contents.points.len())
            .map_err(|_| FileError::at(row, "the table has too many rows", "take fewer points"))?;
        contents.points.push(Point::new(number(x)?, number(y)?, number(z)?));
        for (values, &at) in scalars.iter_mut().zip(&others) {
            // A column of words is none of numbers.
            *values = values.take().zip(number(at).ok()).map(|(mut values, number)| {
                values.push(number);
                values
            });
        }
        let name = branch.map_or("", |at| fields[at]);
        match lines.iter_mut().find(|(known, _)| *known == name) {
            Some((_, line)) => line.push(point),
            None => lines.push((name, vec![point])),
        }
    }
    contents.lines = lines.into_iter().map(|(_, line)| line).collect();
    let own = columns[x].unit.map_or(1.0, |(_, metres)| metres);
    for (values, at) in scalars.into_iter().zip(others) {
        let Some(values) = values else {
            contents
                .remarks
                .push(format!("column `{}` has no numbers and is left out", columns[at].name));
            continue;
        };
        // In the unit of the coordinates, as the arrays of other files are.
        let scale = columns[at].unit.map_or(1.0, |(_, metres)| metres / own);
        let values = values.into_iter().map(|value| value * scale).collect();
        contents.scalars.push((columns[at].name.to_owned(), values));
    }
    Ok(contents)
}

impl<'a> Column<'a> {
    /// From `x_mm`, `x [mm]`, `x (mm)` or `x`.
    fn read(text: &'a str) -> Self {
        let parts = text.rsplit_once(['_', '[', '(']);
        let unit = parts.and_then(|(name, unit)| {
            let unit = unit.trim_end_matches([']', ')']).trim();
            let known = UNITS.iter().find(|(known, _)| known.eq_ignore_ascii_case(unit))?;
            Some((name.trim(), (unit, known.1)))
        });
        match unit {
            Some((name, unit)) => Self { name, unit: Some(unit) },
            None => Self { name: text, unit: None },
        }
    }
}

fn coordinates(columns: &[Column<'_>]) -> Result<[usize; 3], FileError> {
    let found = COORDINATES.iter().find_map(|names| {
        let at = names.map(|name| columns.iter().position(|column| is_among(column.name, &[name])));
        Some([at[0]?, at[1]?, at[2]?])
    });
    let Some(at) = found else {
        let names = columns.iter().map(|column| format!("`{}`", column.name)).collect::<Vec<_>>();
        let problem = format!("this is a table without coordinates: it has {}", names.join(", "));
        return Err(FileError::at(1, problem, FIX));
    };
    let metres = |at: usize| columns[at].unit.map(|(_, metres)| metres);
    match at.iter().all(|&k| metres(k) == metres(at[0])) {
        true => Ok(at),
        false => Err(FileError::at(1, "the coordinates have different units", FIX)),
    }
}

fn is_among(name: &str, known: &[&str]) -> bool {
    known.iter().any(|known| known.eq_ignore_ascii_case(name))
}

fn separator(heading: &str) -> char {
    [',', ';', '\t'].into_iter().max_by_key(|one| heading.matches(*one).count()).unwrap_or(',')
}

fn split(line: &str, separator: char) -> Vec<&str> {
    line.split(separator).map(|field| field.trim().trim_matches('"')).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LineOptions, branches};

    fn options(unit_m: f64) -> LineOptions {
        LineOptions { unit_m, array: None, radius_m: None }
    }

    #[test]
    fn a_table_of_points_is_a_line_with_radii() {
        let text = "\"Points:0\";Points:1;Points:2;Radius [cm];note\n0;0;0;0.2;a\n10;0;0;0.2;b\n";
        let contents = Contents::read(text.as_bytes()).unwrap();
        assert_eq!(
            (contents.format, contents.points.len(), &contents.unit),
            (Format::Table, 2, &None)
        );
        // Without a unit of the coordinates, that of the radius has nothing to be compared with.
        let own = "x_mm,y_mm,z_mm,radius [cm]\n0,0,0,0.2\n10,0,0,0.2\n";
        let contents = Contents::read(own.as_bytes()).unwrap();
        assert_eq!(contents.unit, Some(("mm".into(), 1e-3)));
        let (branches, _) = branches(&contents, &options(1e-3)).unwrap();
        let [first, last] = &branches[0].stations[..] else { panic!("{branches:?}") };
        assert!((first.radius_m - 2e-3).abs() < 1e-12 && (last.s_m - 0.01).abs() < 1e-12);
    }

    #[test]
    fn the_centre_line_of_a_bundle_is_such_a_table() {
        let text = "branch,s_m,x_m,y_m,z_m,radius_m\na,0,0,0,0,0.002\na,0.01,0.01,0,0,0.002\n\
                    b,0,0.01,0,0,0.002\nb,0.01,0.01,0.01,0,0.002\n";
        let contents = Contents::read(text.as_bytes()).unwrap();
        assert_eq!(contents.lines, [[0, 1], [2, 3]]);
        assert_eq!(contents.unit, Some(("m".into(), 1.0)));
        let (branches, _) = branches(&contents, &options(1.0)).unwrap();
        assert_eq!(branches[0].stations[1].radius_m, 0.002);
    }

    #[test]
    fn what_is_no_line_is_named() {
        let refused = |text: &str| Contents::read(text.as_bytes()).unwrap_err().to_string();
        let trial = refused("t_s,insertion_m,rotation_rad\n0,0.1,0\n");
        assert!(
            trial.contains("a table without coordinates: it has `t_s`, `insertion`"),
            "{trial}"
        );
        let comma = refused("x,y,z\n1,5,2,3\n");
        assert!(comma.starts_with("line 2: 4 fields, but 3 columns"), "{comma}");
        assert!(refused("x,y,z\n1,2,o\n").contains("`o` in column `z` is no number"));
        assert!(refused("x_m,y_mm,z_m\n1,2,3\n").contains("different units"));
    }
}
