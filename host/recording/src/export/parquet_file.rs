//! Ticks as a Parquet table.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::{ParquetError, Result};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::series::trial_time_s;
use crate::decoding::tick::{GuidewireEstimate, TickEstimate};
use crate::reading::reader::Recording;

/// Ticks in one row group: a minute.
const GROUP: usize = 60_000;

/// Values of one column; `None` becomes null.
enum Column {
    Integer(Vec<Option<i32>>),
    Long(Vec<i64>),
    Flag(Vec<Option<bool>>),
    Single(Vec<Option<f32>>),
    Double(Vec<f64>),
    Text(Vec<ByteArray>),
}

/// One row a tick, the columns of [`crate::write_ticks_csv`] and the tip; a value that is not
/// known is null.
pub fn write_ticks_parquet(
    recording: &Recording,
    ticks: &[TickEstimate],
    out: impl Write + Send,
) -> Result<()> {
    let fields = columns(recording, &[]).into_iter().map(|(name, column)| column.field(name));
    let fields = fields.collect::<Result<Vec<_>>>()?;
    let schema = Type::group_type_builder("ticks").with_fields(fields).build()?;
    let properties = Arc::new(WriterProperties::builder().build());
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), properties)?;
    for ticks in ticks.chunks(GROUP) {
        let mut group = file.next_row_group()?;
        for (_, column) in columns(recording, ticks) {
            let missing = || ParquetError::General("fewer columns than the schema has".into());
            let mut writer = group.next_column()?.ok_or_else(missing)?;
            column.write(writer.untyped())?;
            writer.close()?;
        }
        group.close()?;
    }
    file.close().map(drop)
}

fn columns(recording: &Recording, ticks: &[TickEstimate]) -> Vec<(&'static str, Column)> {
    let single =
        |of: &dyn Fn(&TickEstimate) -> Option<f32>| Column::Single(ticks.iter().map(of).collect());
    let integer =
        |of: &dyn Fn(&TickEstimate) -> Option<i32>| Column::Integer(ticks.iter().map(of).collect());
    let flag =
        |of: &dyn Fn(&TickEstimate) -> Option<bool>| Column::Flag(ticks.iter().map(of).collect());
    let wire = |of: fn(GuidewireEstimate) -> Option<f32>| single(&|t| of(t.guidewire?));
    let force = |k: usize| single(&move |t| Some(t.force_n?[k]));
    let half_width = |k: usize| single(&move |t| Some(t.force_half_width_n?[k]));
    let tip = |k: usize| single(&move |t| Some(t.tip_from_entry_m?[k]));
    let mode = |t: &TickEstimate| ByteArray::from(super::series::mode_name(t).as_str());
    vec![
        ("tick", Column::Long(ticks.iter().map(|t| t.tick as i64).collect())),
        ("t_s", Column::Double(ticks.iter().map(|t| trial_time_s(recording, t.at_ns)).collect())),
        ("mode", Column::Text(ticks.iter().map(mode).collect())),
        ("fault", integer(&|t| Some(t.fault.into()))),
        ("unresolved", flag(&|t| Some(t.unresolved))),
        ("limited", flag(&|t| Some(t.limited))),
        ("insertion_m", single(&|t| t.insertion_m)),
        ("rotation_rad", single(&|t| t.rotation_rad)),
        ("haptic_force_n", single(&|t| Some(t.haptic_force_n))),
        ("haptic_torque_n_m", single(&|t| Some(t.haptic_torque_n_m))),
        ("fx_n", force(0)),
        ("fy_n", force(1)),
        ("fz_n", force(2)),
        ("drive_force_n", single(&|t| t.drive_force_n)),
        ("drive_torque_n_m", single(&|t| t.drive_torque_n_m)),
        ("peak_contact_force_n", single(&|t| t.peak_contact_force_n)),
        ("peak_node", integer(&|t| t.peak_node.map(i32::from))),
        ("tip_x_m", tip(0)),
        ("tip_y_m", tip(1)),
        ("tip_z_m", tip(2)),
        ("guidewire_insertion_m", wire(|w| Some(w.insertion_m))),
        ("guidewire_rotation_rad", wire(|w| Some(w.rotation_rad))),
        ("guidewire_force_n", wire(|w| w.drive_force_n)),
        ("guidewire_torque_n_m", wire(|w| w.drive_torque_n_m)),
        ("guidewire_felt", flag(&|t| t.guidewire?.felt)),
        ("fx_half_width_n", half_width(0)),
        ("fy_half_width_n", half_width(1)),
        ("fz_half_width_n", half_width(2)),
        ("drive_force_half_width_n", single(&|t| t.drive_force_half_width_n)),
    ]
}

impl Column {
    fn field(&self, name: &str) -> Result<Arc<Type>> {
        let (physical, repetition) = match self {
            Self::Integer(_) => (Physical::INT32, Repetition::OPTIONAL),
            Self::Long(_) => (Physical::INT64, Repetition::REQUIRED),
            Self::Flag(_) => (Physical::BOOLEAN, Repetition::OPTIONAL),
            Self::Single(_) => (Physical::FLOAT, Repetition::OPTIONAL),
            Self::Double(_) => (Physical::DOUBLE, Repetition::REQUIRED),
            Self::Text(_) => (Physical::BYTE_ARRAY, Repetition::REQUIRED),
        };
        let text = matches!(self, Self::Text(_)).then_some(LogicalType::String);
        let field = Type::primitive_type_builder(name, physical).with_repetition(repetition);
        Ok(Arc::new(field.with_logical_type(text).build()?))
    }

    fn write(self, writer: &mut ColumnWriter<'_>) -> Result<()> {
        let written = match (self, writer) {
            (Self::Integer(rows), ColumnWriter::Int32ColumnWriter(to)) => {
                let (values, levels) = nulls(&rows);
                to.write_batch(&values, Some(&levels), None)?
            }
            (Self::Flag(rows), ColumnWriter::BoolColumnWriter(to)) => {
                let (values, levels) = nulls(&rows);
                to.write_batch(&values, Some(&levels), None)?
            }
            (Self::Single(rows), ColumnWriter::FloatColumnWriter(to)) => {
                let (values, levels) = nulls(&rows);
                to.write_batch(&values, Some(&levels), None)?
            }
            (Self::Long(rows), ColumnWriter::Int64ColumnWriter(to)) => {
                to.write_batch(&rows, None, None)?
            }
            (Self::Double(rows), ColumnWriter::DoubleColumnWriter(to)) => {
                to.write_batch(&rows, None, None)?
            }
            (Self::Text(rows), ColumnWriter::ByteArrayColumnWriter(to)) => {
                to.write_batch(&rows, None, None)?
            }
            _ => return Err(ParquetError::General("a column has another type".into())),
        };
        let _ = written;
        Ok(())
    }
}

/// The values that are present, and for every row its definition level.
fn nulls<T: Copy>(rows: &[Option<T>]) -> (Vec<T>, Vec<i16>) {
    let levels = rows.iter().map(|row| i16::from(row.is_some())).collect();
    (rows.iter().copied().flatten().collect(), levels)
}
