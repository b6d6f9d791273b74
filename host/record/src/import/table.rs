//! Any table with a heading, whose columns are named one by one.

use std::io::Read;

use cathforce_rig::bundle::columns;

use super::{ImportError, number};
use crate::trial::{Measured, MeasuredDrive};

/// A column of a trial, and the one of another table that it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnMap {
    pub to: String,
    pub from: String,
    pub factor: f64,
}

impl ColumnMap {
    /// From `insertion_m=feed [mm]*0.001`; without a factor it is 1.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}`: write COLUMN=THEIRS or COLUMN=THEIRS*FACTOR");
        let (to, from) = text.split_once('=').ok_or_else(wrong)?;
        let (from, factor) = match from.rsplit_once('*') {
            Some((from, factor)) => (from, factor.trim().parse().map_err(|_| wrong())?),
            None => (from, 1.0_f64),
        };
        let (to, from) = (to.trim(), from.trim());
        if !columns::ALL.contains(&to) {
            return Err(format!(
                "a trial has no column `{to}`; it has {}",
                columns::ALL.join(", ")
            ));
        }
        if from.is_empty() || !factor.is_finite() || factor == 0.0 {
            return Err(wrong());
        }
        Ok(Self { to: to.into(), from: from.into(), factor })
    }
}

/// The position of the guidewire's drive.
const WIRE: [&str; 2] = [columns::GUIDEWIRE_INSERTION, columns::GUIDEWIRE_ROTATION];
/// Where one of them is, the others must be.
const TOGETHER: [&[&str]; 4] = [&columns::REQUIRED, &columns::FORCE, &columns::TIP, &WIRE];

/// Reads a CSV with a heading. Columns that `maps` does not name are taken by their own name if
/// a trial has it; all others are left out. An empty field is a value that was not measured.
pub fn read_csv(table: impl Read, maps: &[ColumnMap]) -> Result<Vec<Measured>, ImportError> {
    let mut csv = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(table);
    let headings = csv.headers().map_err(|e| of_csv(&e))?.clone();
    let mut places = [None; columns::ALL.len()];
    for (place, name) in places.iter_mut().zip(columns::ALL) {
        let map = maps.iter().find(|map| map.to == name);
        let from = map.map_or(name, |map| &map.from);
        let index = headings.iter().position(|heading| heading == from);
        if let (Some(_), None) = (map, index) {
            let problem = format!("there is no column `{from}`");
            let there = headings.iter().collect::<Vec<_>>().join("`, `");
            return Err(ImportError::new(1, problem, format!("name one of `{there}`")));
        }
        *place = index.map(|index| (index, map.map_or(1.0, |map| map.factor)));
    }
    let has =
        |name: &str| columns::ALL.iter().zip(places).any(|(n, at)| *n == name && at.is_some());
    let has_wire = WIRE.into_iter().any(has) || has(columns::GUIDEWIRE_DRIVE_FORCE);
    for group in TOGETHER {
        let is_begun = group == columns::REQUIRED
            || group == WIRE && has_wire
            || group.iter().any(|name| has(name));
        if let Some(name) = group.iter().find(|name| is_begun && !has(name)) {
            let problem = format!("there is no column `{name}`");
            let fix = format!("say which one it is: --column {name}=THEIRS*FACTOR");
            return Err(ImportError::new(1, problem, fix));
        }
    }
    let mut rows: Vec<Measured> = Vec::new();
    for record in csv.records() {
        let record = record.map_err(|e| of_csv(&e))?;
        let line = record.position().map_or(0, csv::Position::line);
        let mut values = [None; columns::ALL.len()];
        for (value, place) in values.iter_mut().zip(places) {
            let Some((index, factor)) = place else { continue };
            let field = record.get(index).unwrap_or("");
            *value = match field {
                "" => None,
                field => Some(factor * number(line, field)?),
            };
        }
        let [t_s, insertion_m, rotation_rad, fx, fy, fz, drive_force_n, x, y, z, wire @ ..] =
            values;
        let [wire_insertion_m, wire_rotation_rad, wire_force_n] = wire;
        let missing = || {
            let problem = "time, insertion or rotation is missing";
            ImportError::new(line, problem, "fill it in, or take the row out")
        };
        let (Some(t_s), Some(insertion_m), Some(rotation_rad)) = (t_s, insertion_m, rotation_rad)
        else {
            return Err(missing());
        };
        let guidewire = match (wire_insertion_m, wire_rotation_rad) {
            (Some(insertion_m), Some(rotation_rad)) => {
                Some(MeasuredDrive { insertion_m, rotation_rad, drive_force_n: wire_force_n })
            }
            _ if has_wire => return Err(missing()),
            _ => None,
        };
        if let Some(before) = rows.last().filter(|before| before.t_s >= t_s) {
            let problem = format!("time goes from {} s to {t_s} s", before.t_s);
            return Err(ImportError::new(line, problem, "sort the rows, drop repeated ones"));
        }
        let three = |[a, b, c]: [Option<f64>; 3]| Some([a?, b?, c?]);
        rows.push(Measured {
            t_s,
            insertion_m,
            rotation_rad,
            force_n: three([fx, fy, fz]),
            drive_force_n,
            tip_m: three([x, y, z]),
            guidewire,
        });
    }
    if rows.is_empty() {
        return Err(ImportError::new(1, "no row follows the heading", "record the trial again"));
    }
    Ok(rows)
}

fn of_csv(error: &csv::Error) -> ImportError {
    let line = error.position().map_or(1, csv::Position::line);
    let fix = "give every row as many fields as the heading has, as UTF-8";
    ImportError::new(line, error.to_string(), fix)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_named_scaled_and_may_have_gaps() {
        let maps = ["t_s=ms*0.001", "insertion_m=feed [mm]*0.001"];
        let maps = maps.map(|text| ColumnMap::parse(text).unwrap());
        let table = "ms, feed [mm], rotation_rad, fx_N, fy_N, fz_N, note\n\
                     0, 50, 0.5, 1, 2, 3, a\n4, 51, 0.5, , , , b\n";
        let rows = read_csv(table.as_bytes(), &maps).unwrap();
        assert_eq!((rows[0].insertion_m, rows[0].force_n), (0.05, Some([1.0, 2.0, 3.0])));
        assert_eq!((rows[1].t_s, rows[1].force_n), (0.004, None));

        let wrong = |from: &str, to: &str| {
            let text = table.replace(from, to);
            let error = read_csv(text.as_bytes(), &maps).unwrap_err().to_string();
            assert!(error.contains("fix:"), "{error}");
            error
        };
        let missing = wrong("feed [mm]", "feed");
        assert!(missing.contains("line 1: there is no column `feed [mm]`"), "{missing}");
        assert!(missing.contains("`ms`, `feed`, `rotation_rad`"), "{missing}");
        assert!(wrong("rotation_rad", "angle").contains("--column rotation_rad=THEIRS"));
        assert!(wrong("4, 51", "4, ").contains("line 3: time, insertion or rotation"));
        assert!(wrong("4, 51", "0, 51").contains("line 3: time goes"));
        assert!(wrong("4, 51", "4 51").contains("line 3"), "a field is missing");
        assert!(wrong("0, 50", "0, 5O").contains("line 2: `5O` is no number"));
        assert!(wrong("fy_N", "fy").contains("--column fy_N=THEIRS"), "half a force is none");
        assert!(ColumnMap::parse("force=x").unwrap_err().contains("insertion_m"));
        assert!(ColumnMap::parse("t_s=x*0").is_err() && ColumnMap::parse("t_s").is_err());
    }

    #[test]
    fn a_guidewires_drive_comes_along_whole_or_not_at_all() {
        let maps = [ColumnMap::parse("guidewire_insertion_m=wire*0.001").unwrap()];
        let heading = "t_s,insertion_m,rotation_rad,wire,guidewire_rotation_rad";
        let table =
            format!("{heading},guidewire_drive_fx_N\n0,0.05,0,60,0.5,0.1\n1,0.05,0,61,0.5,\n");
        let rows = read_csv(table.as_bytes(), &maps).unwrap();
        let wire =
            |drive_force_n| MeasuredDrive { insertion_m: 0.06, rotation_rad: 0.5, drive_force_n };
        assert_eq!(rows[0].guidewire, Some(wire(Some(0.1))));
        assert_eq!(rows[1].guidewire.unwrap().drive_force_n, None);
        let wrong = |from: &str, to: &str| {
            read_csv(table.replacen(from, to, 1).as_bytes(), &maps).unwrap_err().to_string()
        };
        let missing = wrong("guidewire_rotation_rad", "turn");
        assert!(
            missing.contains("line 1: there is no column `guidewire_rotation_rad`"),
            "{missing}"
        );
        assert!(wrong("61,0.5", "61,").contains("line 3: time, insertion or rotation"));
    }
}
