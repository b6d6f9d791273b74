//! Logs whose columns are named: any CSV, and those of ODrive and moteus.

use std::f64::consts::TAU;
use std::io::Read;

use cathforce_bundle::bundle::{Axis, CommandKind};
use cathforce_bundle::nearest;

use super::numbers::Table;
use super::units::{DriveUnit, Measure};
use super::{DriveLog, Rows};
use crate::import::error::{ImportError, read_text};

/// A column of a log and its unit, `Pos [deg]:deg`; without a unit, that in which the name ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    pub name: String,
    pub unit: Option<DriveUnit>,
}

impl Column {
    /// From `NAME` or `NAME:UNIT`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.rsplit_once(':') {
            Some((name, unit)) if !name.is_empty() => {
                let unit = Some(DriveUnit::parse(unit.trim())?);
                Ok(Self { name: name.trim().to_owned(), unit })
            }
            _ if text.trim().is_empty() => Err("write NAME or NAME:UNIT".to_owned()),
            _ => Ok(Self { name: text.trim().to_owned(), unit: None }),
        }
    }
}

/// The columns of a log that are wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    pub time: Column,
    pub position: Column,
    pub command: Column,
    pub setpoint: Option<Column>,
    pub load: Option<Column>,
}

/// A column of the table that was found.
struct Found {
    at: usize,
    unit: DriveUnit,
}

fn find(
    table: &Table,
    column: &Column,
    option: &str,
    measure: Measure,
) -> Result<Found, ImportError> {
    let at = table.names.iter().position(|name| *name == column.name);
    let Some(at) = at else {
        let names: Vec<&str> = table.names.iter().map(String::as_str).collect();
        let meant = nearest(&column.name, &names);
        let fix = match meant {
            Some(meant) => {
                format!("did you mean --{option} \"{meant}\"? The log has `{}`", names.join("`, `"))
            }
            None => format!("name one of `{}` with --{option}", names.join("`, `")),
        };
        return Err(ImportError::new(1, format!("there is no column `{}`", column.name), fix));
    };
    if table.names.iter().filter(|name| **name == column.name).count() > 1 {
        let problem = format!("column `{}` stands twice in the heading", column.name);
        return Err(ImportError::new(1, problem, "rename one of the two"));
    }
    let unit = column.unit.or_else(|| DriveUnit::of_name(&column.name));
    let Some(unit) = unit else {
        let problem = format!("the unit of column `{}` is not known", column.name);
        let fix = format!(
            "say it behind the name: --{option} \"{}:UNIT\", as in \"{}:deg\"",
            column.name, column.name
        );
        return Err(ImportError::new(1, problem, fix));
    };
    if !unit.measure.is_like(measure) {
        let problem = format!(
            "column `{}` is to be {}, and {} is the unit of {}",
            column.name,
            measure.words(),
            unit.name,
            unit.measure.words()
        );
        return Err(ImportError::new(1, problem, "give the unit of the column, or another column"));
    }
    Ok(Found { at, unit })
}

const POSITION: Measure = Measure::Position(Axis::Linear);
const COMMAND: Measure = Measure::Command(CommandKind::Force, Axis::Linear);

/// Reads a table with these columns.
pub fn read_columns(mut log: impl Read, wanted: &Wanted) -> Result<DriveLog, ImportError> {
    let table = Table::read(&read_text(&mut log)?)?;
    of_table(&table, wanted, Vec::new())
}

fn of_table(
    table: &Table,
    wanted: &Wanted,
    mut understood: Vec<String>,
) -> Result<DriveLog, ImportError> {
    let time = find(table, &wanted.time, "time", Measure::Time)?;
    let position = find(table, &wanted.position, "position", POSITION)?;
    let command = find(table, &wanted.command, "command", COMMAND)?;
    let setpoint =
        wanted.setpoint.as_ref().map(|own| find(table, own, "setpoint", POSITION)).transpose()?;
    let load = wanted.load.as_ref().map(|own| find(table, own, "load", COMMAND)).transpose()?;
    let Measure::Position(axis) = position.unit.measure else {
        return Err(ImportError::new(1, "the position has no unit of a position", "give m or rad"));
    };
    let Measure::Command(kind, of_command) = command.unit.measure else {
        return Err(ImportError::new(
            1,
            "the command has no unit of a command",
            "give N, Nm, A or V",
        ));
    };
    let mixed = |what: &str, unit: &DriveUnit| {
        let problem = format!(
            "{what} is in {}, and the position in {}: the one is of a linear axis, the other of a rotary one",
            unit.name, position.unit.name
        );
        ImportError::new(
            1,
            problem,
            "give N with lengths, Nm with angles; amperes and volts go with both",
        )
    };
    if kind == CommandKind::Force && of_command != axis {
        return Err(mixed("the command", &command.unit));
    }
    if let Some(own) = &setpoint
        && own.unit.measure != Measure::Position(axis)
    {
        return Err(mixed("the set-point", &own.unit));
    }
    if let Some(own) = &load
        && own.unit.measure != Measure::Command(CommandKind::Force, axis)
    {
        return Err(mixed("the load", &own.unit));
    }
    let named = |what: &str, own: &Found| {
        format!("{what} from `{}` in {}", table.names[own.at], own.unit.name)
    };
    let mut of =
        vec![named("time", &time), named("position", &position), named("command", &command)];
    of.extend(setpoint.iter().map(|own| named("set-point", own)));
    of.extend(load.iter().map(|own| named("load", own)));
    understood.push(of.join(", "));
    let mut rows = Rows {
        setpoint: setpoint.as_ref().map(|_| Vec::new()),
        load: load.as_ref().map(|_| Vec::new()),
        ..Rows::default()
    };
    for (row, (line, _)) in table.rows.iter().enumerate() {
        let read = |own: &Found| {
            Ok::<_, ImportError>(table.number(row, own.at)?.map(|x| x * own.unit.factor))
        };
        let needed = (read(&time)?, read(&position)?, read(&command)?);
        let loaded = load.as_ref().map(read).transpose()?;
        let set = setpoint.as_ref().map(read).transpose()?;
        let (Some(t_s), Some(position), Some(command)) = needed else {
            rows.dropped += 1;
            continue;
        };
        if loaded == Some(None) {
            rows.dropped += 1;
            continue;
        }
        rows.t_s.push(t_s);
        rows.position.push(position);
        rows.command.push(command);
        rows.lines.push(*line);
        if let (Some(column), Some(set)) = (&mut rows.setpoint, set) {
            column.push(set);
        }
        if let (Some(column), Some(Some(loaded))) = (&mut rows.load, loaded) {
            column.push(loaded);
        }
    }
    rows.into_log(axis, kind, understood)
}

/// The column whose path ends in one of these names, the first of them first.
fn by_ends(
    table: &Table,
    what: &str,
    ends: &[&str],
    within: Option<&str>,
) -> Result<Option<String>, ImportError> {
    let last = |name: &str| {
        let last = name.rsplit(['.', '/', ':']).next().unwrap_or(name);
        last.split([' ', '[', '(']).next().unwrap_or(last).to_lowercase()
    };
    for end in ends {
        let is_own = |name: &&String| {
            last(name) == end.to_lowercase() && within.is_none_or(|axis| name.contains(axis))
        };
        let found: Vec<&String> = table.names.iter().filter(is_own).collect();
        match found.as_slice() {
            [] => {}
            [only] => return Ok(Some((*only).clone())),
            several => {
                let names: Vec<&str> = several.iter().map(|own| own.as_str()).collect();
                let problem = format!("several columns are {what}: `{}`", names.join("`, `"));
                return Err(ImportError::new(1, problem, "say which axis: --axis axis0"));
            }
        }
    }
    Ok(None)
}

fn needed(
    table: &Table,
    what: &str,
    ends: &[&str],
    within: Option<&str>,
) -> Result<String, ImportError> {
    by_ends(table, what, ends, within)?.ok_or_else(|| {
        let problem = format!("there is no column of {what}: none ends in {}", ends.join(", "));
        let fix = format!(
            "record it, or name the columns with `cathforce import drive`; the log has `{}`",
            table.names.join("`, `")
        );
        ImportError::new(1, problem, fix)
    })
}

fn fixed(name: String, unit: &'static str, measure: Measure, factor: f64) -> Column {
    Column { name, unit: Some(DriveUnit { name: unit, measure, factor }) }
}

const TURNS: Measure = Measure::Position(Axis::Rotary);
const AMPERES: Measure = Measure::Command(CommandKind::Current, Axis::Rotary);
const NEWTON_METRES: Measure = Measure::Command(CommandKind::Force, Axis::Rotary);

/// The time of a log: seconds, unless its name ends in another unit.
fn time_of(table: &Table) -> Result<Column, ImportError> {
    let ends =
        ["time", "timestamp", "t", "time_s", "t_s", "time_ms", "t_ms", "timestamp_ms", "time_us"];
    let name = needed(table, "the time", &ends, None)?;
    let unit = DriveUnit::of_name(&name).or_else(|| DriveUnit::parse("s").ok());
    Ok(Column { name, unit })
}

/// A CSV of an ODrive: columns are paths of properties, of which the last name counts. Positions are in turns, q-axis
/// currents in amperes, torques in newton metres. `axis`: part of the path of the axis that is meant.
pub fn read_odrive(mut log: impl Read, axis: Option<&str>) -> Result<DriveLog, ImportError> {
    let table = Table::read(&read_text(&mut log)?)?;
    let position = needed(&table, "the position", &["pos_estimate", "pos_rel"], axis)?;
    let current = by_ends(&table, "the current", &["iq_measured", "iq_setpoint"], axis)?;
    let command = match current {
        Some(name) => fixed(name, "A", AMPERES, 1.0),
        None => {
            let ends =
                ["torque_estimate", "effective_torque_setpoint", "torque_setpoint", "input_torque"];
            fixed(
                needed(&table, "the current or the torque", &ends, axis)?,
                "N·m",
                NEWTON_METRES,
                1.0,
            )
        }
    };
    let setpoint = by_ends(&table, "the set-point", &["pos_setpoint", "input_pos"], axis)?;
    let wanted = Wanted {
        time: time_of(&table)?,
        position: fixed(position, "turns", TURNS, TAU),
        command,
        setpoint: setpoint.map(|name| fixed(name, "turns", TURNS, TAU)),
        load: None,
    };
    of_table(&table, &wanted, vec!["a log of an ODrive".to_owned()])
}

/// Telemetry of a moteus: a CSV, or a line of JSON a row. Positions are in turns, q-axis currents in amperes, torques in
/// newton metres.
pub fn read_moteus(mut log: impl Read) -> Result<DriveLog, ImportError> {
    let text = read_text(&mut log)?;
    let table = match text.trim_start().starts_with('{') {
        true => of_json_lines(&text)?,
        false => Table::read(&text)?,
    };
    let position = needed(&table, "the position", &["position"], None)?;
    let current = by_ends(&table, "the current", &["q_current", "q_a"], None)?;
    let command = match current {
        Some(name) => fixed(name, "A", AMPERES, 1.0),
        None => fixed(
            needed(&table, "the current or the torque", &["torque", "torque_nm"], None)?,
            "N·m",
            NEWTON_METRES,
            1.0,
        ),
    };
    let setpoint =
        by_ends(&table, "the set-point", &["control_position", "command_position"], None)?;
    let wanted = Wanted {
        time: time_of(&table)?,
        position: fixed(position, "turns", TURNS, TAU),
        command,
        setpoint: setpoint.map(|name| fixed(name, "turns", TURNS, TAU)),
        load: None,
    };
    of_table(&table, &wanted, vec!["telemetry of a moteus".to_owned()])
}

/// Lines of JSON as a table; objects within an object are joined by points.
fn of_json_lines(text: &str) -> Result<Table, ImportError> {
    let mut objects = Vec::new();
    let mut names: Vec<String> = Vec::new();
    for (i, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let line_number = i as u64 + 1;
        let value: serde_json::Value = serde_json::from_str(line).map_err(|e| {
            ImportError::new(
                line_number,
                format!("this line is no JSON: {e}"),
                "take the line out if the log was cut there",
            )
        })?;
        let mut fields = Vec::new();
        flatten("", &value, &mut fields);
        for (name, _) in &fields {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        objects.push((line_number, fields));
    }
    let mut text = csv::Writer::from_writer(Vec::new());
    let failed = |e: csv::Error| ImportError::new(1, e.to_string(), "copy the log again");
    text.write_record(&names).map_err(failed)?;
    let mut lines = Vec::new();
    for (line, fields) in objects {
        let of = |name: &String| {
            fields
                .iter()
                .find(|(own, _)| own == name)
                .map_or(String::new(), |(_, value)| value.clone())
        };
        text.write_record(names.iter().map(of)).map_err(failed)?;
        lines.push(line);
    }
    let bytes =
        text.into_inner().map_err(|e| ImportError::new(1, e.to_string(), "copy the log again"))?;
    let mut table = Table::read(&String::from_utf8_lossy(&bytes))?;
    for ((own, _), line) in table.rows.iter_mut().zip(lines) {
        *own = line;
    }
    Ok(table)
}

fn flatten(before: &str, value: &serde_json::Value, fields: &mut Vec<(String, String)>) {
    match value {
        serde_json::Value::Object(own) => {
            for (name, value) in own {
                let path =
                    if before.is_empty() { name.clone() } else { format!("{before}.{name}") };
                flatten(&path, value, fields);
            }
        }
        serde_json::Value::Number(x) => fields.push((before.to_owned(), x.to_string())),
        serde_json::Value::Null => fields.push((before.to_owned(), String::new())),
        // Texts and flags are no numbers of a trial.
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(line: impl Fn(usize) -> String) -> String {
        (0..200).map(|i| line(i) + "\n").collect()
    }

    fn wanted(time: &str, position: &str, command: &str) -> Wanted {
        let of = |text| Column::parse(text).unwrap();
        Wanted {
            time: of(time),
            position: of(position),
            command: of(command),
            setpoint: None,
            load: None,
        }
    }

    fn any() -> String {
        format!("t_ms;Pos [deg];Strom\n{}", rows(|i| format!("{};{},5;{}", 2 * i, i % 90, i % 7)))
    }

    #[test]
    fn any_names_and_units_are_read_with_decimal_commas() {
        let log = read_columns(any().as_bytes(), &wanted("t_ms", "Pos [deg]", "Strom:mA")).unwrap();
        let (t_s, data) = &log.trials[0];
        assert_eq!((t_s.len(), data.axis, data.kind), (200, Axis::Rotary, CommandKind::Current));
        assert!((t_s[1] - 0.002).abs() < 1e-12);
        assert!((data.position[1] - 1.5_f64.to_radians()).abs() < 1e-12);
        assert!((data.command[1] - 1e-3).abs() < 1e-15);
        assert!(
            log.understood[0].contains("position from `Pos [deg]` in deg"),
            "{:?}",
            log.understood
        );
        assert!(
            log.understood[1].contains("200 rows over 0.398 s, 500 a second"),
            "{:?}",
            log.understood
        );
    }

    #[track_caller]
    fn refused(log: &str, own: &Wanted, words: &[&str]) {
        let error = read_columns(log.as_bytes(), own).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "`{word}` in: {error}");
        }
    }

    #[test]
    fn wrong_columns_and_units_are_refused_with_what_mends_them() {
        refused(
            &any(),
            &wanted("t_ms", "Pos", "Strom:mA"),
            &["no column `Pos`", "--position \"Pos [deg]\""],
        );
        refused(
            &any(),
            &wanted("t_ms", "Pos [deg]", "Strom"),
            &["unit of column `Strom`", "\"Strom:UNIT\""],
        );
        refused(
            &any(),
            &wanted("t_ms", "Pos [deg]", "Strom:deg"),
            &["a force or a torque", "deg is the unit of a position"],
        );
        refused(
            &any(),
            &wanted("t_ms", "Pos [deg]", "Strom:N"),
            &["the command is in N", "position in deg"],
        );
        refused(
            &any(),
            &wanted("t_ms:s", "Pos [deg]", "Strom:mA"),
            &["without a gap", "milliseconds"],
        );
        let back = any().replace("\n8;", "\n1;");
        refused(&back, &wanted("t_ms", "Pos [deg]", "Strom:mA"), &["line 6", "time goes back"]);
        let word = any().replace("\n8;4,5", "\n8;vier");
        refused(
            &word,
            &wanted("t_ms", "Pos [deg]", "Strom:mA"),
            &["line 6:2", "`vier`", "not a number"],
        );
        refused("", &wanted("t_ms", "Pos [deg]", "Strom:mA"), &["empty"]);
    }

    #[test]
    fn gaps_cut_a_log_and_missing_values_are_counted() {
        let text = format!(
            "t_s,x_mm,F_N\n{}",
            (0..400)
                .map(|i| {
                    let t = f64::from(i) * 0.01 + if i >= 200 { 3.0 } else { 0.0 };
                    let force = if i == 5 { String::new() } else { i.to_string() };
                    format!("{t},{i},{force}\n")
                })
                .collect::<String>()
        );
        let log = read_columns(text.as_bytes(), &wanted("t_s", "x_mm", "F_N")).unwrap();
        assert_eq!(log.trials.iter().map(|(t_s, _)| t_s.len()).collect::<Vec<_>>(), [199, 200]);
        assert_eq!(log.trials[1].0[0], 0.0);
        assert!(log.remarks[0].contains("1 of 400 rows are dropped"), "{:?}", log.remarks);
        assert!(log.remarks[1].contains("3.010 s after 1.990 s"), "{:?}", log.remarks);
    }

    #[test]
    fn an_odrive_counts_turns() {
        let heading =
            "time,axis0.pos_estimate,axis0.motor.foc.Iq_measured,axis0.controller.input_pos";
        let text = format!(
            "{heading}\n{}",
            rows(|i| format!("{},{},{},0.5", 0.01 * i as f64, 0.001 * i as f64, i % 5))
        );
        let log = read_odrive(text.as_bytes(), None).unwrap();
        let data = &log.trials[0].1;
        assert!((data.position[100] - 0.1 * TAU).abs() < 1e-9 && data.kind == CommandKind::Current);
        assert!((data.setpoint.as_ref().unwrap()[0].unwrap() - 0.5 * TAU).abs() < 1e-9);
        let two = text.replacen("axis0.controller.input_pos", "axis1.pos_estimate", 1);
        let error = read_odrive(two.as_bytes(), None).unwrap_err().to_string();
        assert!(error.contains("--axis axis0"), "{error}");
        assert!(read_odrive(two.as_bytes(), Some("axis0")).is_ok());
        let none = text.replace("Iq_measured", "Iq");
        let error = read_odrive(none.as_bytes(), None).unwrap_err().to_string();
        assert!(error.contains("no column of the current or the torque"), "{error}");
    }

    #[test]
    fn a_moteus_is_read_from_csv_and_from_lines_of_json() {
        let csv = format!(
            "time,position,velocity,torque\n{}",
            rows(|i| format!("{},{},0,{}", 0.01 * i as f64, 0.5, i % 3))
        );
        let log = read_moteus(csv.as_bytes()).unwrap();
        assert_eq!(log.trials[0].1.kind, CommandKind::Force);
        let json = rows(|i| {
            format!(
                "{{\"time\":{},\"id\":1,\"values\":{{\"position\":0.25,\"q_current\":{},\"mode\":\"x\"}}}}",
                0.01 * i as f64,
                i % 3
            )
        });
        let log = read_moteus(json.as_bytes()).unwrap();
        let data = &log.trials[0].1;
        assert_eq!(data.kind, CommandKind::Current);
        assert!((data.position[0] - 0.25 * TAU).abs() < 1e-12);
        let broken = json.replace("{\"time\":0.05", "{time:0.05");
        assert!(
            read_moteus(broken.as_bytes())
                .unwrap_err()
                .to_string()
                .contains("line 6: this line is no JSON")
        );
    }
}
