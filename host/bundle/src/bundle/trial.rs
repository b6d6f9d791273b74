//! `trials/NNN.csv`: what was measured in one trial.

use thiserror::Error;

use super::columns;
use crate::error::Place;
use crate::table::{Table, TableCause};

/// Why a trial is refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TrialCause {
    #[error(transparent)]
    Table(#[from] TableCause),
    #[error("the trial has no rows")]
    Empty,
    #[error("t_s goes back: {now} s after {before} s")]
    TimeNotRising { before: f64, now: f64 },
    #[error("column `{column}` has no value for {gap_s:.3} s from here on")]
    EncoderGap { column: &'static str, gap_s: f64 },
    #[error("{column} is {value}; the length inside the vessel cannot be negative")]
    NegativeInsertion { column: &'static str, value: f64 },
    #[error("column `{0}` is missing; rig.toml has a [guidewire], whose drive it is")]
    GuidewireMissing(&'static str),
    #[error("column `{0}` is of a guidewire's drive, but rig.toml has no [guidewire]")]
    NoGuidewire(&'static str),
    #[error("`{missing}` has no value in this row, but `{given}` has one")]
    HalfVector { missing: String, given: String },
    #[error("the shape points leave out p{0:02}")]
    ShapeGap(usize),
}

impl TrialCause {
    /// What to do about it.
    pub fn fix(&self) -> String {
        match self {
            TrialCause::Table(cause) => cause.fix(),
            TrialCause::Empty => "record the trial again, or take the file out".into(),
            TrialCause::TimeNotRising { .. } => {
                "sort the rows by t_s; where the clock was set back, cut the trial in two there".into()
            }
            TrialCause::EncoderGap { .. } => format!(
                "an encoder is read between its values, over {} s at most: give it in more rows, or \
                 drop those that lie in the gap",
                LONGEST_GAP_S
            ),
            TrialCause::NegativeInsertion { .. } => {
                "give the unstretched length past the entry plane, not the feed since the start"
                    .into()
            }
            TrialCause::GuidewireMissing(_) => {
                "add the column; a wire that is withdrawn to the entry plane is at 0".into()
            }
            TrialCause::NoGuidewire(_) => {
                "describe the wire in the table [guidewire], with the keys of [instrument], or take \
                 the column out"
                    .into()
            }
            TrialCause::HalfVector { .. } => {
                "a vector has three components: give all of them, or leave all three empty".into()
            }
            TrialCause::ShapeGap(_) => {
                "number the shape points without gaps, tip first, each with _x_m, _y_m, _z_m".into()
            }
        }
    }
}

type Fault = (Place, TrialCause);

/// Encoder positions at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderReading {
    pub insertion_m: f64,
    pub rotation_rad: f64,
}

/// Column of three components with gaps; a row is there when all three are.
pub type VectorColumn = Vec<Option<[f64; 3]>>;

/// Columns of a catheter's trial, one entry a row.
#[derive(Clone, Debug, PartialEq)]
pub struct CatheterTrial {
    pub insertion_m: Vec<f64>,
    pub rotation_rad: Vec<f64>,
    /// Force of the instrument on the phantom; `None` when the column is missing.
    pub force_n: Option<VectorColumn>,
    /// Axial force on the instrument behind the guide, positive when pushing.
    pub drive_force_n: Option<Vec<Option<f64>>>,
    pub tip_m: Option<VectorColumn>,
    /// Points on the shape, tip first; empty without them.
    pub shape_m: Vec<VectorColumn>,
    /// With a guidewire, and only then.
    pub guidewire: Option<GuidewireTrial>,
}

/// Columns of the guidewire's drive, one entry a row; meant as the catheter's.
#[derive(Clone, Debug, PartialEq)]
pub struct GuidewireTrial {
    pub insertion_m: Vec<f64>,
    pub rotation_rad: Vec<f64>,
    pub drive_force_n: Option<Vec<Option<f64>>>,
}

/// Columns of the encoders of one drive, insertion and rotation, with their names.
pub(super) type Encoders<'a> = [(&'static str, &'a [f64]); 2];

impl CatheterTrial {
    /// Those of the catheter's drive, then those of the guidewire's, if there is one.
    pub(super) fn encoders(&self) -> impl Iterator<Item = Encoders<'_>> {
        let of = |names: [&'static str; 2], insertion_m, rotation_rad| {
            [(names[0], insertion_m), (names[1], rotation_rad)]
        };
        let own =
            of([columns::INSERTION, columns::ROTATION], &self.insertion_m[..], &self.rotation_rad);
        let wire = self.guidewire.as_ref().map(move |wire| {
            let names = [columns::GUIDEWIRE_INSERTION, columns::GUIDEWIRE_ROTATION];
            of(names, &wire.insertion_m[..], &wire.rotation_rad)
        });
        std::iter::once(own).chain(wire)
    }
}

/// Columns of a drive's trial, one entry a row.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveTrial {
    pub position_m: Vec<f64>,
    pub drive_command_n: Vec<f64>,
    pub setpoint_m: Option<Vec<Option<f64>>>,
}

/// What was measured, by plant.
#[derive(Clone, Debug, PartialEq)]
pub enum TrialData {
    Catheter(CatheterTrial),
    Drive(DriveTrial),
}

/// An encoder that goes faster than a drive can.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("{column} goes by {speed:.3} {unit} at t_s = {at_s}, faster than any drive: {why}?")]
pub struct Rush {
    pub column: &'static str,
    pub at_s: f64,
    /// In `unit`.
    pub speed: f64,
    pub unit: &'static str,
    /// What it may be instead.
    pub why: &'static str,
}

/// No instrument is fed faster \[m/s\], or turned faster \[rad/s\] (three turns a second).
const FASTEST_M_PER_S: f64 = 1.0;
const FASTEST_RAD_PER_S: f64 = 20.0;
/// Ways over which that is looked at, longer than the steps of any encoder \[m\], \[rad\].
const RUSH_M: f64 = 5e-3;
const RUSH_RAD: f64 = 1.0;

/// An encoder without a value for longer than this is not known \[s\].
pub const LONGEST_GAP_S: f64 = 0.25;

/// No drive's rows are farther apart, on the whole \[s\]: 0.1 s, and what rounding adds to it.
const LONGEST_STEP_S: f64 = 0.101;
/// Of so few rows nothing can be said.
const FEWEST_STEPS: usize = 10;
/// How far from a thousand a ratio may be and still look like a slip of the unit.
const THOUSANDFOLD: std::ops::RangeInclusive<f64> = 400.0..=2500.0;

/// A trial as it was read, and what was done to its rows, in words.
pub(crate) struct Parsed {
    pub trial: Trial,
    pub remarks: Vec<String>,
}

/// One trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Number in the file's name.
    pub number: u32,
    /// Rising strictly \[s\].
    pub t_s: Vec<f64>,
    pub data: TrialData,
}

impl Trial {
    /// Number of rows; never 0.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Whether there are no rows; never true of a trial that was read.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// From the first row to the last \[s\].
    pub fn duration_s(&self) -> f64 {
        match (self.t_s.first(), self.t_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Columns of a catheter's trial.
    pub fn catheter(&self) -> Option<&CatheterTrial> {
        match &self.data {
            TrialData::Catheter(catheter) => Some(catheter),
            TrialData::Drive(_) => None,
        }
    }

    /// Encoder positions at any time by linear interpolation, held before the first row and
    /// after the last: how rows of any rate become samples at 1 kHz. `None` for a drive.
    pub fn encoder_at(&self, t_s: f64) -> Option<EncoderReading> {
        let catheter = self.catheter()?;
        self.reading_at(t_s, &catheter.insertion_m, &catheter.rotation_rad)
    }

    /// The same of the guidewire's drive; `None` without one.
    pub fn guidewire_at(&self, t_s: f64) -> Option<EncoderReading> {
        let wire = self.catheter()?.guidewire.as_ref()?;
        self.reading_at(t_s, &wire.insertion_m, &wire.rotation_rad)
    }

    fn reading_at(
        &self,
        t_s: f64,
        insertion_m: &[f64],
        rotation_rad: &[f64],
    ) -> Option<EncoderReading> {
        let after = self.t_s.partition_point(|&t| t <= t_s);
        let (low, high) = (after.saturating_sub(1), after.min(self.len().saturating_sub(1)));
        let (start, end) = (self.t_s.get(low)?, self.t_s.get(high)?);
        let share = if high > low { ((t_s - start) / (end - start)).clamp(0.0, 1.0) } else { 0.0 };
        let at = |column: &[f64]| column[low] + (column[high] - column[low]) * share;
        Some(EncoderReading { insertion_m: at(insertion_m), rotation_rad: at(rotation_rad) })
    }

    /// Where an encoder goes faster than a drive can, if anywhere: a unit is wrong, of the encoder
    /// or of the time, or the encoder jumps.
    pub fn rush(&self) -> Option<Rush> {
        self.catheter()?.encoders().find_map(|[insertion, rotation]| {
            let ((insertion, insertion_m), (rotation, rotation_rad)) = (insertion, rotation);
            let fed = faster(&self.t_s, insertion_m, RUSH_M, FASTEST_M_PER_S);
            let fed = fed.map(|(at_s, speed)| {
                let why = "is t_s in seconds and the insertion in metres, or does the encoder jump";
                Rush { column: insertion, at_s, speed, unit: "m/s", why }
            });
            let turned = || faster(&self.t_s, rotation_rad, RUSH_RAD, FASTEST_RAD_PER_S);
            fed.or_else(|| {
                let (at_s, speed) = turned()?;
                let why = "is it in degrees, or does the encoder begin anew after a turn";
                Some(Rush { column: rotation, at_s, speed, unit: "rad/s", why })
            })
        })
    }

    /// What looks as if `t_s` were in milliseconds, if anything: rows that are too far apart for any
    /// drive, or a thousand times as far as the sensor's are.
    pub fn slow_clock(&self, force_rate_hz: Option<f64>) -> Option<String> {
        let mut steps: Vec<f64> = self.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let step_s = *steps.get(steps.len() / 2).filter(|_| steps.len() >= FEWEST_STEPS)?;
        let of_rate = force_rate_hz.filter(|rate| THOUSANDFOLD.contains(&(rate * step_s)));
        let beside = match of_rate {
            Some(rate) => format!(", and force_rate_hz = {rate} is {} s", 1.0 / rate),
            None if step_s > LONGEST_STEP_S => String::new(),
            None => return None,
        };
        let step_s = (1e6 * step_s).round() / 1e6;
        Some(format!("the rows are {step_s} s apart by t_s{beside}: milliseconds?"))
    }

    /// `has_guidewire`: there is one in `rig.toml`.
    pub(crate) fn parse_catheter(
        number: u32,
        text: &str,
        has_guidewire: bool,
    ) -> Result<Parsed, Fault> {
        Self::read_catheter(number, Table::parse(text).map_err(table_fault)?, has_guidewire)
    }

    /// The same of a table.
    pub(super) fn read_catheter(
        number: u32,
        mut table: Table,
        has_guidewire: bool,
    ) -> Result<Parsed, Fault> {
        table
            .check_columns(&columns::REQUIRED, &columns::ALL, |name| shape_point(name).is_some())
            .map_err(table_fault)?;
        let mut remarks = Vec::new();
        let t_s = times(&mut table, &mut remarks)?;
        let points = table.names().filter_map(shape_point).max().map_or(0, |last| last + 1);
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
            force_n: vectors(&table, columns::FORCE)?,
            drive_force_n: table.sparse_column(columns::DRIVE_FORCE).map_err(table_fault)?,
            tip_m: vectors(&table, columns::TIP)?,
            shape_m,
        });
        Ok(Parsed { trial: Self { number, t_s, data }, remarks })
    }

    pub(crate) fn parse_drive(number: u32, text: &str) -> Result<Parsed, Fault> {
        Self::read_drive(number, Table::parse(text).map_err(table_fault)?)
    }

    /// The same of a table.
    pub(super) fn read_drive(number: u32, mut table: Table) -> Result<Parsed, Fault> {
        const COLUMNS: [&str; 4] = columns::OF_DRIVE;
        table.check_columns(&COLUMNS[..3], &COLUMNS, |_| false).map_err(table_fault)?;
        let mut remarks = Vec::new();
        let t_s = times(&mut table, &mut remarks)?;
        // Both together tell the force of a motion; what lies between rows is the reader's.
        let rows = t_s.len();
        let dropped = table.drop_rows_without(&COLUMNS[1..3]);
        if dropped == rows {
            let cause = TableCause::MissingValue("position_m` or `drive_command_N".into());
            return Err((Place::Whole, cause.into()));
        }
        if dropped > 0 {
            remarks.push(format!(
                "{dropped} of {rows} rows have no position_m or no drive_command_N and are left out"
            ));
        }
        let data = TrialData::Drive(DriveTrial {
            position_m: table.full_column("position_m").map_err(table_fault)?,
            drive_command_n: table.full_column("drive_command_N").map_err(table_fault)?,
            setpoint_m: table.sparse_column("setpoint_m").map_err(table_fault)?,
        });
        let t_s = table.full_column("t_s").map_err(table_fault)?;
        Ok(Parsed { trial: Self { number, t_s, data }, remarks })
    }
}

/// When a column first goes over a way of at least `way` faster than `limit`, and how fast.
fn faster(t_s: &[f64], column: &[f64], way: f64, limit: f64) -> Option<(f64, f64)> {
    let mut first = 0;
    (1..t_s.len()).find_map(|row| {
        let (time_s, gone) = (t_s[row] - t_s[first], (column[row] - column[first]).abs());
        let found = (gone >= way && gone > limit * time_s).then(|| (t_s[first], gone / time_s));
        if limit * time_s >= way {
            first = row;
        }
        found
    })
}

/// The k of a column `pNN_x_m`.
pub(super) fn shape_point(name: &str) -> Option<usize> {
    let rest = name.strip_prefix('p')?;
    let (digits, axis) = rest.split_once('_')?;
    let two_or_more = digits.len() >= 2 && digits.bytes().all(|byte| byte.is_ascii_digit());
    // The format's names are those that `p{k:02}` gives.
    let k = digits.parse::<usize>().ok().filter(|k| *k < 10_000 && format!("{k:02}") == digits)?;
    (two_or_more && matches!(axis, "x_m" | "y_m" | "z_m")).then_some(k)
}

fn table_fault((place, cause): (Place, TableCause)) -> Fault {
    (place, cause.into())
}

fn at(table: &Table, row: usize, column: &str) -> Place {
    table.place(row, table.column(column).unwrap_or_default())
}

/// The time column, checked to rise once rows of one time are one.
fn times(table: &mut Table, remarks: &mut Vec<String>) -> Result<Vec<f64>, Fault> {
    if let Some(column) = table.column("t_s") {
        let joined = table.join_rows(column).map_err(table_fault)?;
        if joined > 0 {
            remarks.push(format!(
                "{joined} rows have the time of the row before them; rows of one time are read as \
                 one, what several of them have as its mean"
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
    Ok(t_s)
}

/// A table whose encoders are read.
struct Encoded<'a> {
    table: &'a Table,
    t_s: &'a [f64],
    remarks: &'a mut Vec<String>,
}

impl Encoded<'_> {
    /// A column with a number in every row: where it is empty, between its neighbours in time.
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
        // Before the first value and after the last the encoder is taken to stand there.
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
            "{name} has no value in {missing} of {} rows, where it is read between those that have",
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

    /// The same of lengths past the entry plane.
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

/// The columns of the guidewire's drive, which are there if and only if the wire is.
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
