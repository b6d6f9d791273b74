//! Reading `trials/NNN.csv`.

use super::cause::{LATEST_S, LONGEST_GAP_S, TrialCause};
use super::columns::{self, shape_index};
use super::types::{CatheterTrial, GuidewireTrial, Trial, TrialData, VectorColumn};
use crate::place::Place;
use crate::table::{Table, TableCause};

pub(super) type Fault = (Place, TrialCause);

/// What becomes of rows that are farther apart than an encoder is interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holes {
    /// A trial is played, and nothing is known of the drive between the rows.
    Refused,
    /// The rows are joined with others, and nothing is taken from between them.
    Kept,
}

/// A trial as it was read, and remarks on what was done to its rows.
pub(crate) struct Parsed {
    pub trial: Trial,
    pub remarks: Vec<String>,
}

impl Trial {
    /// `has_guidewire`: there is one in `rig.toml`; `tendons`: number of its `[[tendons]]`.
    pub(crate) fn parse_catheter(
        number: u32,
        text: &str,
        has_guidewire: bool,
        tendons: usize,
    ) -> Result<Parsed, Fault> {
        let table = Table::parse(text).map_err(table_fault)?;
        Self::read_catheter(number, table, has_guidewire, tendons, Holes::Refused)
    }

    /// The same from a table.
    pub(super) fn read_catheter(
        number: u32,
        mut table: Table,
        has_guidewire: bool,
        tendons: usize,
        holes: Holes,
    ) -> Result<Parsed, Fault> {
        table
            .check_columns(&columns::REQUIRED, &columns::ALL, |name| shape_index(name).is_some())
            .map_err(table_fault)?;
        let mut remarks = Vec::new();
        let t_s = times(&mut table, holes, &mut remarks)?;
        let points = table.names().filter_map(shape_index).max().map_or(0, |last| last + 1);
        let shape_m = (0..points)
            .map(|k| {
                let names = columns::shape_point(k);
                vectors(&table, names.each_ref().map(String::as_str))?
                    .ok_or((Place::Line(1), TrialCause::ShapeGap(k)))
            })
            .collect::<Result<_, Fault>>()?;
        let encoders = &mut Encoded { table: &table, t_s: &t_s, remarks: &mut remarks };
        let data = TrialData::Catheter(CatheterTrial {
            insertion_m: encoders.insertions(columns::INSERTION)?,
            rotation_rad: encoders.column(columns::ROTATION)?,
            guidewire: guidewire(encoders, has_guidewire)?,
            tendons_m: displacements(encoders, tendons)?,
            force_n: vectors(&table, columns::FORCE)?,
            drive_force_n: table.sparse_column(columns::DRIVE_FORCE).map_err(table_fault)?,
            tip_m: vectors(&table, columns::TIP)?,
            shape_m,
        });
        Ok(Parsed { trial: Self { number, t_s, data }, remarks })
    }
}

pub(super) fn table_fault((place, cause): (Place, TableCause)) -> Fault {
    (place, cause.into())
}

fn at(table: &Table, row: usize, column: &str) -> Place {
    table.place(row, table.column(column).unwrap_or_default())
}

/// The time column, checked to rise after rows of one time were merged.
pub(super) fn times(
    table: &mut Table,
    holes: Holes,
    remarks: &mut Vec<String>,
) -> Result<Vec<f64>, Fault> {
    if let Some(column) = table.column("t_s") {
        let joined = table.join_rows(column).map_err(table_fault)?;
        if joined > 0 {
            remarks.push(format!(
                "{joined} rows have the time of the row before them; rows of one time are merged, and \
                 values that several of them have are averaged"
            ));
        }
    }
    let t_s = table.full_column("t_s").map_err(table_fault)?;
    if t_s.is_empty() {
        return Err((Place::Whole, TrialCause::Empty));
    }
    if let Some(before) = t_s.windows(2).position(|pair| pair[1] <= pair[0]) {
        let cause = TrialCause::TimeNotRising { before: t_s[before], now: t_s[before + 1] };
        return Err((at(table, before + 1, "t_s"), cause));
    }
    if let Some(row) = t_s.iter().position(|t_s| t_s.abs() > LATEST_S) {
        return Err((at(table, row, "t_s"), TrialCause::Time(t_s[row])));
    }
    let hole = t_s.windows(2).position(|pair| pair[1] - pair[0] > LONGEST_GAP_S);
    if let Some(before) = hole.filter(|_| holes == Holes::Refused) {
        let cause = TrialCause::Hole { before: t_s[before], now: t_s[before + 1] };
        return Err((at(table, before + 1, "t_s"), cause));
    }
    Ok(t_s)
}

/// A table whose encoders are read.
struct Encoded<'a> {
    table: &'a Table,
    t_s: &'a [f64],
    remarks: &'a mut Vec<String>,
}

impl Encoded<'_> {
    /// A column with a number in every row; empty fields are interpolated in time.
    fn column(&mut self, name: &'static str) -> Result<Vec<f64>, Fault> {
        let sparse = self.table.sparse_column(name).map_err(table_fault)?;
        let sparse = sparse.ok_or_else(|| {
            (Place::Line(1), TrialCause::from(TableCause::MissingColumn(name.into())))
        })?;
        let known = sparse.iter().enumerate().filter_map(|(row, value)| Some((row, (*value)?)));
        let known: Vec<(usize, f64)> = known.collect();
        let missing = sparse.len() - known.len();
        if missing == 0 {
            return Ok(known.into_iter().map(|(_, value)| value).collect());
        }
        let (Some(&(first, _)), Some(&(last, _))) = (known.first(), known.last()) else {
            let cause = TableCause::MissingValue(name.into());
            return Err((at(self.table, 0, name), cause.into()));
        };
        // Before its first value and after its last the encoder is assumed to rest.
        let ends = [(0, first), (last, sparse.len() - 1)];
        let between = known.windows(2).map(|pair| (pair[0].0, pair[1].0));
        for (from, to) in ends.into_iter().chain(between.filter(|(from, to)| to - from > 1)) {
            let gap_s = self.t_s[to] - self.t_s[from];
            if gap_s > LONGEST_GAP_S {
                let empty = if sparse[from].is_none() { from } else { from + 1 };
                let cause = TrialCause::EncoderGap { column: name, gap_s };
                return Err((at(self.table, empty, name), cause));
            }
        }
        self.remarks.push(format!(
            "{name} has no value in {missing} of {} rows; it is interpolated there",
            sparse.len()
        ));
        let mut after = 0;
        let value = |row: usize| {
            while after + 1 < known.len() && known[after].0 < row {
                after += 1;
            }
            let ((low, a), (high, b)) = (known[after.saturating_sub(1)], known[after]);
            let (start, end) = (self.t_s[low], self.t_s[high]);
            let share = if end > start { (self.t_s[row] - start) / (end - start) } else { 0.0 };
            a + share.clamp(0.0, 1.0) * (b - a)
        };
        Ok((0..sparse.len()).map(value).collect())
    }

    /// The same for lengths past the entry plane, which are not negative.
    fn insertions(&mut self, name: &'static str) -> Result<Vec<f64>, Fault> {
        let insertion_m = self.column(name)?;
        match insertion_m.iter().position(|&x| x < 0.0) {
            Some(row) => {
                let cause = TrialCause::NegativeInsertion { column: name, value: insertion_m[row] };
                Err((at(self.table, row, name), cause))
            }
            None => Ok(insertion_m),
        }
    }
}

/// Three columns as one; `None` when none of them is there.
fn vectors(table: &Table, names: [&str; 3]) -> Result<Option<VectorColumn>, Fault> {
    let present = names.map(|name| table.column(name));
    if present == [None; 3] {
        return Ok(None);
    }
    let mut axes = Vec::with_capacity(3);
    for name in names {
        let missing = || (Place::Line(1), TableCause::MissingColumn(name.into()).into());
        axes.push(table.sparse_column(name).map_err(table_fault)?.ok_or_else(missing)?);
    }
    let row = |row: usize| {
        let values = [axes[0][row], axes[1][row], axes[2][row]];
        match values {
            [Some(x), Some(y), Some(z)] => Ok(Some([x, y, z])),
            [None, None, None] => Ok(None),
            _ => {
                let name = |is: fn(&Option<f64>) -> bool| {
                    names[values.iter().position(is).unwrap_or_default()].to_owned()
                };
                let (missing, given) = (name(Option::is_none), name(Option::is_some));
                let place = at(table, row, &missing);
                Err((place, TrialCause::HalfVector { missing, given }))
            }
        }
    };
    (0..table.len()).map(row).collect::<Result<_, _>>().map(Some)
}

/// The columns of the guidewire's drive: required with a guidewire, refused without one.
fn guidewire(
    encoders: &mut Encoded<'_>,
    has_guidewire: bool,
) -> Result<Option<GuidewireTrial>, Fault> {
    let table = encoders.table;
    if !has_guidewire {
        let of_wire = [
            columns::GUIDEWIRE_INSERTION,
            columns::GUIDEWIRE_ROTATION,
            columns::GUIDEWIRE_DRIVE_FORCE,
        ];
        let stray = of_wire.into_iter().find_map(|name| table.column(name).map(|at| (name, at)));
        return match stray {
            Some((name, column)) => {
                Err((Place::LineColumn(1, column + 1), TrialCause::NoGuidewire(name)))
            }
            None => Ok(None),
        };
    }
    for name in [columns::GUIDEWIRE_INSERTION, columns::GUIDEWIRE_ROTATION] {
        if table.column(name).is_none() {
            return Err((Place::Line(1), TrialCause::GuidewireMissing(name)));
        }
    }
    Ok(Some(GuidewireTrial {
        insertion_m: encoders.insertions(columns::GUIDEWIRE_INSERTION)?,
        rotation_rad: encoders.column(columns::GUIDEWIRE_ROTATION)?,
        drive_force_n: table.sparse_column(columns::GUIDEWIRE_DRIVE_FORCE).map_err(table_fault)?,
    }))
}

/// The columns of the tendons' drives: one for each of the rig's `[[tendons]]`, and no others.
fn displacements(encoders: &mut Encoded<'_>, tendons: usize) -> Result<Vec<Vec<f64>>, Fault> {
    let table = encoders.table;
    let (own, others) = columns::TENDONS.split_at(tendons.min(columns::TENDONS.len()));
    for &column in others {
        if let Some(at) = table.column(column) {
            let cause = TrialCause::NoTendon { column, tendons };
            return Err((Place::LineColumn(1, at + 1), cause));
        }
    }
    if let Some(&column) = own.iter().find(|name| table.column(name).is_none()) {
        return Err((Place::Line(1), TrialCause::TendonMissing { column, tendons }));
    }
    own.iter().map(|name| encoders.column(name)).collect()
}
