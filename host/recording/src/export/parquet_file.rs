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

use super::columns::{Column, tick_columns};
use crate::decoding::tick::TickEstimate;
use crate::reading::reader::Recording;

/// Ticks in one row group: a minute.
const GROUP: usize = 60_000;

/// Writes one row a tick, with the columns of [`crate::write_ticks_csv`]. A value that is not known is
/// null.
pub fn write_ticks_parquet(
    recording: &Recording,
    ticks: &[TickEstimate],
    entry_m: [f32; 3],
    out: impl Write + Send,
) -> Result<()> {
    let fields = tick_columns(recording, &[], entry_m)
        .into_iter()
        .map(|(name, column)| field(&column, name));
    let fields = fields.collect::<Result<Vec<_>>>()?;
    let schema = Type::group_type_builder("ticks").with_fields(fields).build()?;
    let properties = Arc::new(WriterProperties::builder().build());
    let mut file = SerializedFileWriter::new(out, Arc::new(schema), properties)?;
    for ticks in ticks.chunks(GROUP) {
        let mut group = file.next_row_group()?;
        for (_, column) in tick_columns(recording, ticks, entry_m) {
            let missing = || ParquetError::General("fewer columns than the schema has".into());
            let mut writer = group.next_column()?.ok_or_else(missing)?;
            write(column, writer.untyped())?;
            writer.close()?;
        }
        group.close()?;
    }
    file.close().map(drop)
}

fn field(column: &Column, name: &str) -> Result<Arc<Type>> {
    let (physical, repetition) = match column {
        Column::Integer(_) => (Physical::INT32, Repetition::OPTIONAL),
        Column::Long(_) => (Physical::INT64, Repetition::REQUIRED),
        Column::Flag(_) => (Physical::BOOLEAN, Repetition::OPTIONAL),
        Column::Single(_) => (Physical::FLOAT, Repetition::OPTIONAL),
        Column::Double(_) => (Physical::DOUBLE, Repetition::REQUIRED),
        Column::Text(_) => (Physical::BYTE_ARRAY, Repetition::REQUIRED),
    };
    let text = matches!(column, Column::Text(_)).then_some(LogicalType::String);
    let field = Type::primitive_type_builder(name, physical).with_repetition(repetition);
    Ok(Arc::new(field.with_logical_type(text).build()?))
}

fn write(column: Column, writer: &mut ColumnWriter<'_>) -> Result<()> {
    let written = match (column, writer) {
        (Column::Integer(rows), ColumnWriter::Int32ColumnWriter(to)) => {
            let (values, levels) = nulls(&rows);
            to.write_batch(&values, Some(&levels), None)?
        }
        (Column::Flag(rows), ColumnWriter::BoolColumnWriter(to)) => {
            let (values, levels) = nulls(&rows);
            to.write_batch(&values, Some(&levels), None)?
        }
        (Column::Single(rows), ColumnWriter::FloatColumnWriter(to)) => {
            let (values, levels) = nulls(&rows);
            to.write_batch(&values, Some(&levels), None)?
        }
        (Column::Long(rows), ColumnWriter::Int64ColumnWriter(to)) => {
            to.write_batch(&rows, None, None)?
        }
        (Column::Double(rows), ColumnWriter::DoubleColumnWriter(to)) => {
            to.write_batch(&rows, None, None)?
        }
        (Column::Text(rows), ColumnWriter::ByteArrayColumnWriter(to)) => {
            let rows = rows.iter().map(|row| ByteArray::from(row.as_str())).collect::<Vec<_>>();
            to.write_batch(&rows, None, None)?
        }
        _ => return Err(ParquetError::General("a column has another type".into())),
    };
    let _ = written;
    Ok(())
}

/// The values that are present, and for every row its definition level.
fn nulls<T: Copy>(rows: &[Option<T>]) -> (Vec<T>, Vec<i16>) {
    let levels = rows.iter().map(|row| i16::from(row.is_some())).collect();
    (rows.iter().copied().flatten().collect(), levels)
}
