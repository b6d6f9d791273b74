//! Reads any table with a heading; the user names its columns.

use std::io::Read;

use cathforce_bundle::bundle::{
    ColumnMap, DriveTrial, Foreign, ForeignCause, Holes, LeftOut, TransmissionTrial, TrialCause,
    TrialData, columns, read_foreign,
};
use cathforce_bundle::{Place, Trial as BundleTrial};

use super::error::{ImportError, read_text};
use crate::format::trial::Trial;

/// An imported trial with remarks.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedTable {
    pub trial: ImportedTrial,
    /// Remarks on changes to rows, on what looks wrong, and on unused columns.
    pub remarks: Vec<String>,
}

/// The kind of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum ImportedTrial {
    Catheter(Trial),
    /// A drive on its own; times \[s\].
    Drive(Vec<f64>, DriveTrial),
    /// A transmission; times \[s\].
    Transmission(Vec<f64>, TransmissionTrial),
}

impl ImportedTrial {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        match self {
            Self::Catheter(trial) => trial.rows.len(),
            Self::Drive(t_s, _) | Self::Transmission(t_s, _) => t_s.len(),
        }
    }

    /// Subtracts the mean force of the first seconds. `Err` says why there is none.
    pub fn tare(&mut self, seconds: f64) -> Result<(), String> {
        let Self::Catheter(Trial { rows, .. }) = self else {
            return Err("this is no catheter's trial: it has no force on a phantom".into());
        };
        let last_s = rows.last().map_or(0.0, |last| last.t_s);
        if seconds > last_s {
            return Err(format!("the trial ends {last_s} s after its beginning, within the tare"));
        }
        let still = rows.iter().filter(|row| row.t_s < seconds).filter_map(|row| row.force_n);
        let still = still.collect::<Vec<_>>();
        if still.is_empty() {
            return Err(format!("no force was measured in the first {seconds} s"));
        }
        let mean: [f64; 3] = std::array::from_fn(|k| {
            still.iter().map(|force_n| force_n[k]).sum::<f64>() / still.len() as f64
        });
        for force_n in rows.iter_mut().filter_map(|row| row.force_n.as_mut()) {
            force_n.iter_mut().zip(mean).for_each(|(force_n, mean)| *force_n -= mean);
        }
        Ok(())
    }
}

/// The command that reads a table, which decides what an error can advise.
#[derive(Clone, Copy, PartialEq)]
enum Reader {
    /// Has `--column`.
    Import,
    /// Takes a trial as it is.
    Motion,
}

/// Reads a CSV with a heading like a bundle's trial: rows of one time are merged, and encoders are
/// interpolated. Columns that `maps` does not name are taken if a trial has their name; remarks list the
/// others. An empty field is a value that was not measured.
pub fn read_csv(table: impl Read, maps: &[ColumnMap]) -> Result<ImportedTable, ImportError> {
    read(table, maps, Reader::Import)
}

/// Reads the motion of a catheter's drive from a trial of a bundle, with remarks.
pub fn read_motion(table: impl Read) -> Result<(Trial, Vec<String>), ImportError> {
    let ImportedTable { trial, remarks } = read(table, &[], Reader::Motion)?;
    match trial {
        ImportedTrial::Catheter(trial) => Ok((trial, remarks)),
        ImportedTrial::Drive(..) | ImportedTrial::Transmission(..) => {
            let problem = "this is a drive on its own or a transmission, without an insertion";
            Err(ImportError::new(1, problem, "give a catheter's trial"))
        }
    }
}

fn read(
    mut table: impl Read,
    maps: &[ColumnMap],
    reader: Reader,
) -> Result<ImportedTable, ImportError> {
    let text = read_text(&mut table)?;
    let holes = if reader == Reader::Import { Holes::Refused } else { Holes::Kept };
    let foreign = read_foreign(&text, maps, holes).map_err(|fault| error(fault, reader))?;
    let Foreign { trial: BundleTrial { t_s, data, .. }, mut remarks, left_out } = foreign;
    remarks.extend(left_out_of(&left_out, reader));
    let trial = match data {
        TrialData::Catheter(data) => ImportedTrial::Catheter(Trial::of(&t_s, &data)),
        TrialData::Drive(data) => ImportedTrial::Drive(t_s, data),
        TrialData::Transmission(data) => ImportedTrial::Transmission(t_s, data),
    };
    Ok(ImportedTable { trial, remarks })
}

fn left_out_of(left_out: &[LeftOut], reader: Reader) -> Option<String> {
    let one = |LeftOut { name, nearest }: &LeftOut| match nearest {
        Some(nearest) if reader == Reader::Import => {
            format!("`{name}` (if it is {nearest}: --column \"{nearest}={name}\")")
        }
        Some(nearest) => format!("`{name}` (is it {nearest}?)"),
        None => format!("`{name}`"),
    };
    let names = left_out.iter().map(one).collect::<Vec<_>>().join(", ");
    (!names.is_empty()).then(|| format!("columns that a trial does not have are left out: {names}"))
}

fn error((place, cause): (Place, ForeignCause), reader: Reader) -> ImportError {
    let (line, column) = match place {
        Place::LineColumn(line, column) => (line, Some(column)),
        Place::Line(line) => (line, None),
        Place::Whole | Place::Byte(_) => (1, None),
    };
    let fix = match (&cause, reader) {
        (ForeignCause::NotNamed(name), Reader::Import) => {
            format!(
                "say which one it is: --column {name}=THEIRS*FACTOR+OFFSET; what never changes is a \
                 number, like --column rotation_rad=0"
            )
        }
        (ForeignCause::NotNamed(_), Reader::Motion) => {
            "give a trial in a bundle's format; `cathforce import csv` makes one of any table"
                .into()
        }
        (ForeignCause::NoColumn { there, .. }, _) => {
            format!("name one of `{}`", there.join("`, `"))
        }
        (ForeignCause::Ambiguous(_), _) => "rename one of the two, or take it out".into(),
        (ForeignCause::GivenTwice(name), _) => format!("give --column {name}=… once"),
        (ForeignCause::Trial(TrialCause::NegativeInsertion { column, .. }), Reader::Import) => {
            format!(
                "give the unstretched length past the entry plane; what was inside at the beginning is \
                 added by --column {column}=THEIRS*FACTOR+OFFSET"
            )
        }
        (ForeignCause::Trial(cause), _) => cause.fix(),
    };
    ImportError { line: line as u64, column, problem: cause.to_string(), fix }
}

/// Whether a text is a trial of a bundle, judged by its heading.
pub fn is_trial(text: &str) -> bool {
    let heading = text.trim_start_matches('\u{feff}').lines().next().unwrap_or_default();
    let has = |name| heading.split(',').any(|field| field.trim() == name);
    has(columns::TIME)
        && (has(columns::INSERTION)
            || has(columns::POSITION)
            || columns::OUTPUTS.into_iter().any(has))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::trial::MeasuredDrive;

    fn maps<const N: usize>(texts: [&str; N]) -> Vec<ColumnMap> {
        texts.iter().map(|text| ColumnMap::parse(text).unwrap()).collect()
    }

    #[track_caller]
    fn catheter(table: &str, maps: &[ColumnMap]) -> (Trial, Vec<String>) {
        let ImportedTable { trial, remarks } = read_csv(table.as_bytes(), maps).unwrap();
        let ImportedTrial::Catheter(trial) = trial else { panic!("a catheter's") };
        (trial, remarks)
    }

    #[track_caller]
    fn refused(table: &str, maps: &[ColumnMap]) -> String {
        let error = read_csv(table.as_bytes(), maps).unwrap_err().to_string();
        assert!(error.contains("fix:"), "{error}");
        error
    }

    const TABLE: &str = "ms, feed [mm], rotation_rad, fx_N, fy_N, fz_N, note\n\
                         0, 50, 0.5, 1, 2, 3, a\n4, 51, 0.5, , , , b\n";

    #[test]
    fn columns_are_named_scaled_shifted_and_may_have_gaps() {
        let own = maps(["t_s=ms*0.001", "insertion_m=feed [mm]*1e-3+0.028"]);
        let (Trial { rows, .. }, remarks) = catheter(TABLE, &own);
        assert_eq!((rows[0].insertion_m, rows[0].force_n), (0.05 + 0.028, Some([1.0, 2.0, 3.0])));
        assert_eq!((rows[1].t_s, rows[1].force_n), (0.004, None));
        assert_eq!(remarks, ["columns that a trial does not have are left out: `note`"]);

        let wrong = |from: &str, to: &str| refused(&TABLE.replace(from, to), &own);
        let missing = wrong("feed [mm]", "feed");
        assert!(missing.contains("line 1: there is no column `feed [mm]`"), "{missing}");
        assert!(missing.contains("`ms`, `feed`, `rotation_rad`"), "{missing}");
        assert!(wrong("rotation_rad", "angle").contains("--column rotation_rad=THEIRS"));
        assert!(wrong("4, 51", ", 51").contains("line 3:1: column `t_s` has no value in this row"));
        assert!(wrong("4, 51", "-1, 51").contains("line 3:1: t_s goes back"));
        assert!(wrong("4, 51", "4 51").contains("line 3:7"), "a field is missing");
        let word = wrong("0, 50", "0, 5O");
        assert!(word.contains("line 2:2: `5O` in column `feed [mm]` is not a number"), "{word}");
        assert!(wrong("fy_N", "fy").contains("--column fy_N=THEIRS"), "half a force is none");
        let negative = wrong("4, 51", "4, -29");
        assert!(
            negative.contains("line 3:2: insertion_m is -0.00") && negative.contains("+OFFSET")
        );
    }

    #[test]
    fn a_column_is_given_as_a_sum_and_by_a_name_that_a_trial_has() {
        for (text, factor, offset) in [
            ("t_s=x", 1.0, 0.0),
            ("t_s=x*2", 2.0, 0.0),
            ("t_s=x * -1e-3 + 2.5e+1", -1e-3, 25.0),
            ("t_s=x*1e-3-4e-2", 1e-3, -0.04),
            ("p00_x_m=x*1+1", 1.0, 1.0),
            ("position_m=x*1", 1.0, 0.0),
        ] {
            let map = ColumnMap::parse(text).unwrap();
            assert_eq!(
                (map.from.as_str(), map.factor, map.offset),
                ("x", factor, offset),
                "{text}"
            );
        }
        for text in ["t_s=x*0", "t_s", "t_s=x*1+", "t_s=x*1+inf", "t_s=x*one", "t_s="] {
            assert!(ColumnMap::parse(text).unwrap_err().contains("THEIRS*FACTOR+OFFSET"), "{text}");
        }
        let other = ColumnMap::parse("insertion=x").unwrap_err();
        assert!(other.contains("did you mean `insertion_m`?"), "{other}");
    }

    #[test]
    fn what_the_table_does_not_have_may_be_a_number() {
        let own = maps(["t_s=t", "insertion_m=feed_mm*0.001", "rotation_rad=0.5"]);
        let (Trial { rows, .. }, remarks) = catheter("t,feed_mm,fx\n0,10,0\n0.01,10.1,0\n", &own);
        assert_eq!((rows[1].insertion_m, rows[1].rotation_rad), (10.1 * 0.001, 0.5));
        assert!(remarks[0].contains("`fx`") && !remarks[0].contains("`t`"), "{remarks:?}");
        // A column of that name is meant first.
        let own = maps(["t_s=t", "insertion_m=2*0.001", "rotation_rad=0"]);
        assert_eq!(catheter("t,2\n0,10\n", &own).0.rows[0].insertion_m, 0.01);
    }

    #[test]
    fn half_a_vector_is_refused_with_its_place() {
        let own = maps(["t_s=ms*0.001", "insertion_m=feed [mm]*0.001"]);
        let error = refused(&TABLE.replace("1, 2, 3", "1, , 3"), &own);
        assert!(error.contains("line 2:5: `fy_N` has no value in this row, but `fx_N`"), "{error}");
    }

    #[test]
    fn what_is_left_out_is_said_with_what_it_probably_is() {
        let (_, remarks) = catheter(
            "t_s,insertion_m,rotation_rad,Fx [N],drive_fx,camera\n0,0.1,0,1,2,3\n0.1,0.1,0,1,2,3\n",
            &[],
        );
        let [said] = &remarks[..] else { panic!("{remarks:?}") };
        assert!(said.contains("--column \"fx_N=Fx [N]\""), "{said}");
        assert!(said.contains("--column \"drive_fx_N=drive_fx\""), "{said}");
        assert!(said.ends_with("`camera`"), "{said}");
    }

    #[test]
    fn shape_points_come_along() {
        let table = "t_s,insertion_m,rotation_rad,p00_x_m,p00_y_m,p00_z_m,x,y,z\n\
                     0,0.1,0,0.1,0,0,200,0,1\n0.1,0.1,0,,,,,,\n";
        let own = maps(["p01_x_m=x*0.001", "p01_y_m=y*0.001", "p01_z_m=z*0.001"]);
        let (trial, _) = catheter(table, &own);
        assert_eq!(trial.shapes_m, [vec![[0.1, 0.0, 0.0], [0.2, 0.0, 0.001]], vec![]]);
    }

    #[test]
    fn a_heading_or_a_column_that_is_given_twice_is_refused() {
        let twice = "t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N,fx_N\n0,0.1,0,1,2,3,4\n";
        let error = refused(twice, &[]);
        assert!(error.contains("line 1: column `fx_N` stands twice"), "{error}");
        let own = maps(["fx_N=a", "fx_N=b"]);
        let error = refused("t_s,insertion_m,rotation_rad,a,b\n0,0.1,0,1,2\n", &own);
        assert!(error.contains("the trial's column `fx_N` is given twice"), "{error}");
        // Columns that are not used may have the same name.
        let unused = "t_s,insertion_m,rotation_rad,note,note,,\n0,0.1,0,,,,\n";
        assert_eq!(catheter(unused, &[]).0.rows.len(), 1);
    }

    /// The same rules as those of a bundle's reader.
    #[test]
    fn rows_of_one_time_and_encoders_of_fewer_rows_are_read_as_a_bundles() {
        let table = "t_s,insertion_m,rotation_rad,fx_N,fy_N,fz_N\n0,0.1,0,1,0,0\n0,,,3,0,0\n\
                     0.1,,0.2,,,\n0.2,0.2,0.4,,,\n";
        let (Trial { rows, .. }, remarks) = catheter(table, &[]);
        assert_eq!(rows.len(), 3);
        assert_eq!(rows[0].force_n, Some([2.0, 0.0, 0.0]));
        assert!((rows[1].insertion_m - 0.15).abs() < 1e-12);
        assert!(remarks[0].contains("1 rows have the time of the row before"), "{remarks:?}");
        assert!(remarks[1].contains("insertion_m has no value in 1 of 3 rows"), "{remarks:?}");
    }

    #[test]
    fn a_drive_on_its_own_is_imported_too() {
        let table = "t,mm,drive_command_N,setpoint_m,insertion\n0,1,5,0.1,0\n0.001,2,6,,0\n";
        let own = maps(["t_s=t", "position_m=mm*0.001"]);
        let ImportedTable { trial, remarks } = read_csv(table.as_bytes(), &own).unwrap();
        let ImportedTrial::Drive(t_s, data) = trial else { panic!("a drive's") };
        assert_eq!((t_s, data.position), (vec![0.0, 0.001], vec![0.001, 0.002]));
        assert_eq!(data.setpoint, Some(vec![Some(0.1), None]));
        assert!(remarks[0].contains("`insertion`"), "{remarks:?}");
        let missing = refused("t_s,drive_command_N\n0,1\n", &[]);
        assert!(missing.contains("--column position_m="), "{missing}");
    }

    #[test]
    fn milliseconds_are_suspected() {
        let table = |step: f64| {
            let rows = (0..50).map(|i| format!("{},0.1,0\n", step * f64::from(i)));
            format!("t_s,insertion_m,rotation_rad\n{}", rows.collect::<String>())
        };
        let (_, remarks) = catheter(&table(0.2), &[]);
        assert!(remarks[0].contains("0.2 s apart by t_s: milliseconds?"), "{remarks:?}");
        let error = refused(&table(4.0), &[]);
        assert!(
            error.contains("line 3:1: no row for 4.000 s") && error.contains("seconds"),
            "{error}"
        );
        // A motion is only joined with what was measured.
        assert_eq!(read_motion(table(4.0).as_bytes()).unwrap().0.rows.len(), 50);
    }

    #[test]
    fn what_is_no_such_table_is_named_with_what_mends_it() {
        for (table, says, fix) in [
            ("", "line 1: the file is empty", "heading|header"),
            ("t_s;insertion_m;rotation_rad\n0;0;0\n", "semicolons", "by commas"),
            ("t_s\tinsertion_m\n0\t0\n", "tabs", "by commas"),
            (
                "# by hand\nt_s,insertion_m,rotation_rad\n0,0,0\n",
                "line 1: this line is a remark",
                "#",
            ),
            ("t_s,insertion_m,rotation_rad\ns,m,rad\n0,0,0\n", "line 2: the row has words", "unit"),
            (
                "t_s,insertion_m,rotation_rad\n0,NaN,0\n",
                "line 2:2: `NaN` in",
                "leave the field empty",
            ),
            ("t_s,insertion_m,rotation_rad\n", "line 1: the trial has no rows", "record"),
        ] {
            let error = refused(table, &[]);
            let said = error.contains(says) && fix.split('|').any(|fix| error.contains(fix));
            assert!(said, "{table}: {error}");
        }
    }

    #[test]
    fn a_motion_is_not_told_of_options_that_its_command_has_not() {
        let error = read_motion("t,insertion_m\n0,1\n".as_bytes()).unwrap_err().to_string();
        assert!(error.contains("`cathforce import csv`") && !error.contains("--column"), "{error}");
    }

    #[test]
    fn a_guidewires_drive_comes_along_whole_or_not_at_all() {
        let own = maps(["guidewire_insertion_m=wire*0.001"]);
        let heading = "t_s,insertion_m,rotation_rad,wire,guidewire_rotation_rad";
        let table = format!(
            "{heading},guidewire_drive_fx_N\n0,0.05,0,60,0.5,0.1\n0.25,0.05,0,61,0.5,\n0.5,0.05,0,61,0.5,\n"
        );
        let (Trial { rows, .. }, _) = catheter(&table, &own);
        let wire =
            |drive_force_n| MeasuredDrive { insertion_m: 0.06, rotation_rad: 0.5, drive_force_n };
        assert_eq!(rows[0].guidewire, Some(wire(Some(0.1))));
        assert_eq!(rows[1].guidewire.unwrap().drive_force_n, None);
        let wrong = |from: &str, to: &str| refused(&table.replacen(from, to, 1), &own);
        let missing = wrong("guidewire_rotation_rad", "turn");
        assert!(
            missing.contains("line 1: there is no column `guidewire_rotation_rad`"),
            "{missing}"
        );
        let gap = wrong("61,0.5", "61,");
        assert!(
            gap.contains("line 3:5: column `guidewire_rotation_rad` has no value for 0.5"),
            "{gap}"
        );
    }
}
