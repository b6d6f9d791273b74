//! Trials of a transmission: where it is driven, and where its output is.

use super::cause::TrialCause;
use super::columns::{self, of_transmission};
use super::read::{Fault, Holes, Parsed, table_fault, times};
use super::types::{TransmissionTrial, Trial, TrialData};
use crate::axis::Axis;
use crate::place::Place;
use crate::rig::TransmissionRig;
use crate::table::{Table, TableCause};

impl Trial {
    pub(crate) fn parse_transmission(
        number: u32,
        text: &str,
        rig: &TransmissionRig,
    ) -> Result<Parsed, Fault> {
        let table = Table::parse(text).map_err(table_fault)?;
        let heading: Vec<String> = table.names().map(str::to_owned).collect();
        let parsed = Self::read_transmission(number, table)?;
        let TrialData::Transmission(data) = &parsed.trial.data else { return Ok(parsed) };
        let at = |name: &str| {
            let column = heading.iter().position(|own| own == name).unwrap_or_default();
            Place::LineColumn(1, column + 1)
        };
        let [input, output, _] = of_transmission(data.input_kind, data.output_kind);
        for (column, own, other) in
            [(input, rig.input, data.input_kind), (output, rig.output, data.output_kind)]
        {
            if own != other {
                return Err((at(column), TrialCause::OtherGain { column, own: own.unit() }));
            }
        }
        if data.bend_rad.is_some() && rig.sheath.is_none() {
            return Err((at(columns::BEND), TrialCause::NoSheath(columns::BEND)));
        }
        Ok(parsed)
    }

    /// The same from a table, whatever the rig.
    pub(super) fn read_transmission(number: u32, mut table: Table) -> Result<Parsed, Fault> {
        table
            .check_columns(&[columns::TIME], &columns::OF_TRANSMISSION, |_| false)
            .map_err(table_fault)?;
        let has = |table: &Table, name: &str| table.column(name).is_some();
        let heading = |table: &Table, name: &str| {
            Place::LineColumn(1, table.column(name).unwrap_or_default() + 1)
        };
        let kind = |table: &Table, [linear, rotary]: [&'static str; 2]| match (
            has(table, linear),
            has(table, rotary),
        ) {
            (true, true) => {
                let place = heading(table, rotary);
                Err((place, TrialCause::Same { column: rotary, beside: linear }))
            }
            (true, false) => Ok(Axis::Linear),
            (false, true) => Ok(Axis::Rotary),
            (false, false) => {
                Err((Place::Line(1), TableCause::MissingColumn(linear.into()).into()))
            }
        };
        let input_kind = kind(&table, columns::INPUTS)?;
        let output_kind = kind(&table, columns::OUTPUTS)?;
        let [input, output, load] = of_transmission(input_kind, output_kind);
        let others = [columns::LOAD, columns::LOAD_NM];
        if let Some(column) = others.into_iter().find(|own| *own != load && has(&table, own)) {
            return Err((heading(&table, column), TrialCause::OtherLoad { column, load }));
        }
        let mut remarks = Vec::new();
        let t_s = times(&mut table, Holes::Refused, &mut remarks)?;
        // An output belongs to the input in the same row; a reader interpolates between rows.
        let rows = t_s.len();
        let dropped = table.drop_rows_without(&[input, output]);
        if dropped == rows {
            let cause = TableCause::MissingValue(format!("{input}` or `{output}"));
            return Err((Place::Whole, cause.into()));
        }
        if dropped > 0 {
            remarks.push(format!(
                "{dropped} of {rows} rows have no {input} or no {output} and are left out"
            ));
        }
        let optional = |table: &Table, name: &str| match has(table, name) {
            true => table.full_column(name).map(Some).map_err(table_fault),
            false => Ok(None),
        };
        let data = TransmissionTrial {
            input_kind,
            output_kind,
            input: table.full_column(input).map_err(table_fault)?,
            output: table.full_column(output).map_err(table_fault)?,
            load: optional(&table, load)?,
            bend_rad: optional(&table, columns::BEND)?,
        };
        let negative = data.bend_rad.iter().flatten().position(|bend| *bend < 0.0);
        if let Some(row) = negative {
            let place = table.place(row, table.column(columns::BEND).unwrap_or_default());
            return Err((place, TrialCause::NegativeBend(columns::BEND)));
        }
        let t_s = table.full_column(columns::TIME).map_err(table_fault)?;
        let data = TrialData::Transmission(data);
        Ok(Parsed { trial: Self { number, t_s, data }, remarks })
    }
}
