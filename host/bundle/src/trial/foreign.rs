//! Tables of other tools: columns are renamed and converted to a trial's units, then read like a
//! bundle's trial.

use thiserror::Error;

use super::cause::TrialCause;
use super::columns::{self, shape_index};
use super::read::{Holes, Parsed};
use super::types::Trial;
use crate::nearest::nearest;
use crate::place::Place;
use crate::table::{Table, TableCause};

/// A column of a trial, and the one of another table that it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnMap {
    pub to: String,
    pub from: String,
    pub factor: f64,
    /// In the unit of the trial's column.
    pub offset: f64,
}

impl ColumnMap {
    /// From `insertion_m=feed [mm]*0.001+0.028`; factor and offset may be left out. A number in the place
    /// of a column, `rotation_rad=0`, is the value in every row.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}`: write COLUMN=THEIRS, COLUMN=THEIRS*FACTOR or COLUMN=THEIRS*FACTOR+OFFSET"
            )
        };
        let (to, from) = text.split_once('=').ok_or_else(wrong)?;
        let (from, (factor, offset)) = match from.rsplit_once('*') {
            Some((from, scale)) => (from, scale_of(scale).ok_or_else(wrong)?),
            None => (from, (1.0, 0.0)),
        };
        let (to, from) = (to.trim(), from.trim());
        if !is_known(to) {
            let others = [&columns::OF_DRIVE[1..], &columns::OF_TRANSMISSION[1..]].concat();
            let all = [&columns::ALL[..], &others].concat();
            let meant = nearest(to, &all);
            let meant = meant.map_or(String::new(), |name| format!("; did you mean `{name}`?"));
            return Err(format!(
                "a trial has no column `{to}`{meant} It has {}, and p00_x_m, p00_y_m, p00_z_m and so \
                 on; a drive's has {}; a transmission's has {}",
                columns::ALL.join(", "),
                columns::OF_DRIVE.join(", "),
                columns::OF_TRANSMISSION.join(", ")
            ));
        }
        if from.is_empty() {
            return Err(wrong());
        }
        Ok(Self { to: to.into(), from: from.into(), factor, offset })
    }

    /// The value in every row, if a number stands in the place of a column.
    fn constant(&self) -> Option<f64> {
        let number = self.from.parse::<f64>().ok().filter(|x| x.is_finite())?;
        Some(number * self.factor + self.offset)
    }

    fn is_identity(&self) -> bool {
        (self.factor, self.offset) == (1.0, 0.0)
    }
}

/// `FACTOR` or `FACTOR+OFFSET`; a sign may belong to an exponent or to a number.
fn scale_of(text: &str) -> Option<(f64, f64)> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let whole = number(text).map(|factor| (factor, 0.0));
    let signs = text.match_indices(['+', '-']).map(|(at, _)| at);
    let mut sums =
        signs.filter_map(|at| Some((number(&text[..at])?, number(&joined(&text[at..]))?)));
    whole.or_else(|| sums.next()).filter(|(factor, _)| *factor != 0.0)
}

/// A sign may stand apart from its number.
fn joined(text: &str) -> String {
    text.split_whitespace().collect()
}

fn is_known(name: &str) -> bool {
    columns::ALL.contains(&name)
        || columns::OF_DRIVE.contains(&name)
        || columns::OF_TRANSMISSION.contains(&name)
        || shape_index(name).is_some()
}

/// A column of the table that the trial does not have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    pub name: String,
    /// The column of a trial that is probably meant.
    pub nearest: Option<&'static str>,
}

/// A trial that was read from a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Foreign {
    pub trial: Trial,
    /// Remarks on what was done to its rows and on what looks wrong.
    pub remarks: Vec<String>,
    pub left_out: Vec<LeftOut>,
}

/// Why a table gives no trial.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ForeignCause {
    #[error(transparent)]
    Trial(#[from] TrialCause),
    #[error("there is no column `{name}`")]
    NoColumn { name: String, there: Vec<String> },
    #[error("there is no column `{0}`")]
    NotNamed(String),
    #[error("column `{0}` stands twice in the heading")]
    Ambiguous(String),
    #[error("the trial's column `{0}` is given twice")]
    GivenTwice(String),
}

type Fault = (Place, ForeignCause);

/// What a table is a trial of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Catheter,
    Drive,
    Transmission,
}

impl Kind {
    fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Catheter => &columns::ALL,
            Self::Drive => &columns::OF_DRIVE,
            Self::Transmission => &columns::OF_TRANSMISSION,
        }
    }
}

/// Reads a table as a trial after renaming columns by `maps`; other columns are taken if a trial has
/// their name. The columns tell whether there is a guidewire, a drive on its own, or a transmission.
pub fn read_foreign(text: &str, maps: &[ColumnMap], holes: Holes) -> Result<Foreign, Fault> {
    let table = Table::split(text).map_err(of_table)?;
    let wanted = wanted(&table, maps)?;
    let has = |name: &str| wanted.iter().any(|column| column.to == name);
    let kind = match () {
        () if has(columns::INSERTION) => Kind::Catheter,
        () if columns::COMMANDS.into_iter().any(has) => Kind::Drive,
        () if columns::OUTPUTS.into_iter().any(has) => Kind::Transmission,
        () => Kind::Catheter,
    };
    let known = kind.columns();
    let taken = wanted.iter().filter(|column| {
        let to = column.to.as_str();
        known.contains(&to) || (kind == Kind::Catheter && shape_index(to).is_some())
    });
    let taken = taken.collect::<Vec<_>>();
    let has = |name: &str| taken.iter().any(|column| column.to == name);
    let position = match has(columns::POSITION_RAD) {
        true => columns::POSITION_RAD,
        false => columns::POSITION,
    };
    let of_drive = [columns::TIME, position];
    let input = if has(columns::INPUTS[1]) { columns::INPUTS[1] } else { columns::INPUTS[0] };
    let of_transmission = [columns::TIME, input];
    let required = match kind {
        Kind::Catheter => &columns::REQUIRED[..],
        Kind::Drive => &of_drive,
        Kind::Transmission => &of_transmission,
    };
    if let Some(name) = required.iter().find(|name| !has(name)) {
        return Err((Place::Line(1), ForeignCause::NotNamed((*name).into())));
    }
    let places: Vec<(usize, &str)> = taken.iter().map(|c| (c.at, c.to.as_str())).collect();
    let selected = table.select(&places, |row, k| {
        if let Some(constant) = taken[k].constant {
            return Ok(constant.to_string());
        }
        let number = table.number(row, taken[k].at)?;
        let text = table.text(row, taken[k].at);
        Ok(match (number, taken[k].map.filter(|map| !map.is_identity())) {
            (Some(x), Some(map)) => (x * map.factor + map.offset).to_string(),
            _ => text.to_owned(),
        })
    });
    let selected = selected.map_err(of_table)?;
    let has_guidewire = has(columns::GUIDEWIRE_INSERTION)
        || has(columns::GUIDEWIRE_ROTATION)
        || has(columns::GUIDEWIRE_DRIVE_FORCE);
    let parsed = match kind {
        Kind::Drive => Trial::read_drive(0, selected),
        Kind::Transmission => Trial::read_transmission(0, selected),
        Kind::Catheter => {
            // Their columns are numbered from 1 on.
            let tendons = columns::TENDONS.iter().rposition(|name| has(name)).map_or(0, |i| i + 1);
            Trial::read_catheter(0, selected, has_guidewire, tendons, holes)
        }
    };
    let Parsed { trial, mut remarks } = parsed.map_err(|(place, cause)| (place, named(cause)))?;
    remarks.extend(trial.rush().map(|rush| rush.to_string()));
    remarks.extend(trial.slow_clock(None));
    let missing: Vec<&'static str> = known.iter().copied().filter(|name| !has(name)).collect();
    let is_taken =
        |at: usize| taken.iter().any(|column| column.at == at && column.constant.is_none());
    let others = table.names().enumerate().filter(|(at, name)| !name.is_empty() && !is_taken(*at));
    let left_out =
        others.map(|(_, name)| LeftOut { name: name.into(), nearest: nearest(name, &missing) });
    let left_out = left_out.collect();
    Ok(Foreign { trial, remarks, left_out })
}

/// A column of the trial and where it stands in the table.
struct Wanted<'a> {
    to: String,
    at: usize,
    map: Option<&'a ColumnMap>,
    /// The value in every row, instead of a column.
    constant: Option<f64>,
}

fn wanted<'a>(table: &Table, maps: &'a [ColumnMap]) -> Result<Vec<Wanted<'a>>, Fault> {
    let heading = |fault| (Place::Line(1), fault);
    let mut wanted: Vec<Wanted<'a>> = Vec::new();
    for map in maps {
        let found = table.column(&map.from);
        let constant = map.constant().filter(|_| found.is_none());
        let Some(at) = found.or(constant.map(|_| 0)) else {
            let there = table.names().map(str::to_owned).collect();
            return Err(heading(ForeignCause::NoColumn { name: map.from.clone(), there }));
        };
        if wanted.iter().any(|column| column.to == map.to) {
            return Err(heading(ForeignCause::GivenTwice(map.to.clone())));
        }
        wanted.push(Wanted { to: map.to.clone(), at, map: Some(map), constant });
    }
    for (at, name) in table.names().enumerate() {
        let is_first = table.column(name) == Some(at);
        if is_known(name) && is_first && wanted.iter().all(|column| column.to != name) {
            wanted.push(Wanted { to: name.into(), at, map: None, constant: None });
        }
    }
    for Wanted { at, .. } in wanted.iter().filter(|column| column.constant.is_none()) {
        let name = table.names().nth(*at).unwrap_or_default();
        if table.names().filter(|other| *other == name).count() > 1 {
            return Err(heading(ForeignCause::Ambiguous(name.into())));
        }
    }
    Ok(wanted)
}

fn of_table((place, cause): (Place, TableCause)) -> Fault {
    (place, ForeignCause::Trial(cause.into()))
}

/// A missing column is reported as one that was not mapped.
fn named(cause: TrialCause) -> ForeignCause {
    match cause {
        TrialCause::Table(TableCause::MissingColumn(name)) => ForeignCause::NotNamed(name),
        TrialCause::GuidewireMissing(column) | TrialCause::TendonMissing { column, .. } => {
            ForeignCause::NotNamed(column.into())
        }
        cause => cause.into(),
    }
}
