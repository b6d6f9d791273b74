//! Trials of a drive on its own: a linear or a rotary axis, commanded by force, current or voltage.

use super::cause::TrialCause;
use super::columns::{self, of_axis, of_command};
use super::read::{Fault, Holes, Parsed, table_fault, times};
use super::types::{DriveTrial, Trial, TrialData};
use crate::axis::{Axis, CommandKind};
use crate::place::Place;
use crate::rig::DriveRig;
use crate::table::{Table, TableCause};

impl DriveTrial {
    /// Checks that the rig has what the trial's columns need. `place`: of a column in the heading.
    fn fits(&self, rig: &DriveRig, place: impl Fn(&str) -> Place) -> Result<(), Fault> {
        let column = of_axis(self.axis)[0];
        if self.axis != rig.axis {
            let (own, other) = (rig.axis.word(), self.axis.word());
            return Err((place(column), TrialCause::OtherAxis { column, own, other }));
        }
        let column = of_command(self.kind, self.axis);
        match (self.kind, rig.motor) {
            (CommandKind::Force, _) => Ok(()),
            (_, None) => Err((place(column), TrialCause::NoMotor(column))),
            (CommandKind::Voltage, Some(motor)) if motor.resistance_ohm.is_none() => {
                Err((place(column), TrialCause::NoResistance(column)))
            }
            _ => Ok(()),
        }
    }
}

impl Trial {
    pub(crate) fn parse_drive(number: u32, text: &str, rig: &DriveRig) -> Result<Parsed, Fault> {
        let table = Table::parse(text).map_err(table_fault)?;
        let heading: Vec<String> = table.names().map(str::to_owned).collect();
        let parsed = Self::read_drive(number, table)?;
        if let TrialData::Drive(data) = &parsed.trial.data {
            let at = |name: &str| heading.iter().position(|own| own == name).unwrap_or_default();
            data.fits(rig, |name| Place::LineColumn(1, at(name) + 1))?;
        }
        Ok(parsed)
    }

    /// The same from a table, whatever the rig.
    pub(super) fn read_drive(number: u32, mut table: Table) -> Result<Parsed, Fault> {
        table
            .check_columns(&[columns::TIME], &columns::OF_DRIVE, |_| false)
            .map_err(table_fault)?;
        let has = |table: &Table, name: &str| table.column(name).is_some();
        let heading = |table: &Table, name: &str| {
            Place::LineColumn(1, table.column(name).unwrap_or_default() + 1)
        };
        let axis = match has(&table, columns::POSITION_RAD) {
            true => Axis::Rotary,
            false => Axis::Linear,
        };
        let [position, setpoint, load] = of_axis(axis);
        if !has(&table, position) {
            let cause = TableCause::MissingColumn(position.into());
            return Err((Place::Line(1), cause.into()));
        }
        let kinds = [CommandKind::Force, CommandKind::Current, CommandKind::Voltage];
        let mut known = vec![columns::TIME, position, setpoint, load];
        known.extend(kinds.map(|kind| of_command(kind, axis)));
        let stray =
            columns::OF_DRIVE.into_iter().find(|name| has(&table, name) && !known.contains(name));
        if let Some(column) = stray {
            let place = heading(&table, column);
            return Err((place, TrialCause::MixedAxes { column, position }));
        }
        let mut given = kinds.into_iter().filter(|&kind| has(&table, of_command(kind, axis)));
        let Some(kind) = given.next() else {
            let cause = TableCause::MissingColumn(of_command(CommandKind::Force, axis).into());
            return Err((Place::Line(1), cause.into()));
        };
        let command = of_command(kind, axis);
        if let Some(other) = given.next() {
            let (column, beside) = (of_command(other, axis), command);
            return Err((heading(&table, column), TrialCause::TwoCommands { column, beside }));
        }
        let mut remarks = Vec::new();
        let t_s = times(&mut table, Holes::Refused, &mut remarks)?;
        // A force belongs to the motion in the same row; readers interpolate between rows.
        let rows = t_s.len();
        let dropped = table.drop_rows_without(&[position, command]);
        if dropped == rows {
            let cause = TableCause::MissingValue(format!("{position}` or `{command}"));
            return Err((Place::Whole, cause.into()));
        }
        if dropped > 0 {
            remarks.push(format!(
                "{dropped} of {rows} rows have no {position} or no {command} and are left out"
            ));
        }
        let is_loaded = has(&table, load);
        let data = TrialData::Drive(DriveTrial {
            axis,
            kind,
            position: table.full_column(position).map_err(table_fault)?,
            command: table.full_column(command).map_err(table_fault)?,
            setpoint: table.sparse_column(setpoint).map_err(table_fault)?,
            load: match is_loaded {
                true => Some(table.full_column(load).map_err(table_fault)?),
                false => None,
            },
        });
        let t_s = table.full_column(columns::TIME).map_err(table_fault)?;
        Ok(Parsed { trial: Self { number, t_s, data }, remarks })
    }
}
