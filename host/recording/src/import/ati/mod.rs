//! Reads the log of a force/torque sensor, of ATI, OnRobot, Bota or others; counts become newtons in the
//! vessel frame.
//!
//! What the log says of itself counts: the unit of its forces, whether its rows are counts, its rate, the
//! numbers of its packets, and the status of each row.

mod axes;
mod calibration;
mod clock;
mod fields;
mod heading;
mod preamble;
mod rows;
mod scale;
pub(crate) mod status;
pub(crate) mod units;

use std::io::Read;

pub use axes::AxisMap;
pub use calibration::ForceCalibration;
use fields::split;
use heading::Heading;
use preamble::Preamble;
use rows::{Rows, Times};
use scale::{Scale, scale};

use crate::import::error::{ImportError, read_text};

/// What a sensor's log does not state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtiOptions {
    /// How many of the rows' numbers are one newton; `None` leaves it to the log's own words.
    pub counts_per_n: Option<f64>,
    pub axes: AxisMap,
    /// Time at the log's beginning whose mean force is subtracted \[s\].
    pub tare_s: f64,
    /// Rows a second, for a log without a column of time; it goes before the log's own rate.
    pub rate_hz: Option<f64>,
    /// The unit of the column of time \[s\]; `None` leaves it to its name.
    pub time_unit_s: Option<f64>,
    /// Forces of the unloaded sensor, which are subtracted; the sensor's axes \[N\].
    pub bias_n: [f64; 3],
    /// Makes newtons of the rows' values, whatever the log says of them.
    pub calibration: Option<ForceCalibration>,
}

impl Default for AtiOptions {
    fn default() -> Self {
        Self {
            counts_per_n: None,
            axes: AxisMap::SAME,
            tare_s: 0.0,
            rate_hz: None,
            time_unit_s: None,
            bias_n: [0.0; 3],
            calibration: None,
        }
    }
}

/// A force \[N\], vessel frame, and its time since the log's first row \[s\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSample {
    pub t_s: f64,
    pub force_n: [f64; 3],
}

/// The forces of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct AtiLog {
    /// At least one sample, sorted by time.
    pub samples: Vec<ForceSample>,
    /// Whether the log has a time column, so that no rate is needed.
    pub has_time: bool,
    /// What was understood: rows, rate, unit.
    pub understood: Vec<String>,
    /// What was left out or looks wrong.
    pub remarks: Vec<String>,
}

/// How far the span by the rate may be from that by the times: clocks of two devices, and the whole
/// seconds of a time of day.
const SAME_SPAN: f64 = 0.02;
const WHOLE_SECONDS_S: f64 = 2.0;
/// Rows of a force sensor are never this far apart \[s\]: then the column of time is in another unit.
const FAR_APART_S: f64 = 1.0;
/// Rows that show it.
const FEWEST_STEPS: usize = 10;
/// Places that a remark names at most.
const MOST_PLACES: usize = 4;

/// Reads the log of an ATI sensor: lines of text, among them one that names the columns, then
/// rows of numbers.
///
/// `Fx`, `Fy`, `Fz` must be among the names, with or without a unit; `Time` \[s\] may be.
/// Commas, semicolons and tabs separate outside of quotes. Numbers have a point.
pub fn read_ati(mut log: impl Read, options: &AtiOptions) -> Result<AtiLog, ImportError> {
    let text = read_text(&mut log)?;
    if text.trim().is_empty() {
        return Err(ImportError::new(1, "the file is empty", "log anew"));
    }
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()).peekable();
    let mut said = Preamble::default();
    let named = loop {
        let Some((at, line)) = lines.next() else { break None };
        let names = split(line);
        if Heading::is_one(&names) {
            break Some((at, names));
        }
        let wrong = |(problem, fix): (String, String)| ImportError::new(at, problem, fix);
        said.take(line).map_err(wrong)?;
    };
    let Some((named_at, names)) = named else {
        let fix = "give the log with its heading, which names Fx, Fy and Fz";
        return Err(ImportError::new(1, "no line names the columns Fx, Fy and Fz", fix));
    };
    let wrong = |(problem, fix): (String, String)| ImportError::new(named_at, problem, fix);
    let heading = Heading::read(&names).map_err(wrong)?;
    if options.calibration.is_some_and(|own| own.has_torques()) && heading.torque.is_none() {
        let problem = "the calibration has torques, but the log has no columns Tx, Ty and Tz";
        let fix = "log the torques too, or give a calibration of three columns";
        return Err(ImportError::new(named_at, problem, fix));
    }
    let first = lines.peek().map(|(_, line)| *line);
    let times = times(&heading, first, said.rate_hz, options).map_err(wrong)?;
    let mut rows = Rows::new(names, heading, times);
    let is_whole = text.ends_with('\n');
    let mut last_line = named_at;
    let mut remarks = Vec::new();
    while let Some((line, row)) = lines.next() {
        let is_cut = !is_whole && lines.peek().is_none() && split(row).len() < rows.names.len();
        if is_cut && rows.count > 0 {
            remarks.push(format!("line {line}, the last, is cut off and left out"));
            break;
        }
        rows.take(line, row)?;
        last_line = line;
    }
    if rows.samples.is_empty() {
        let problem = match &rows.faulty[..] {
            [] => "no row of numbers follows".to_owned(),
            [faulty, ..] => {
                format!("every row has {}", faulty.what)
            }
        };
        return Err(ImportError::new(named_at, problem, "log anew"));
    }
    let at_last = |(problem, fix): (String, String)| ImportError::new(last_line, problem, fix);
    check_rate(&rows, said.rate_hz, options.rate_hz).map_err(at_last)?;
    check_steps(&rows).map_err(at_last)?;
    let scale = match options.calibration {
        Some(_) => Scale { newtons: 1.0, text: "forces by the calibration".into() },
        None => scale(&said, &rows.heading, &rows, options.counts_per_n).map_err(wrong)?,
    };
    remarks.extend(left_out(&rows));
    let has_time = matches!(rows.times, Times::Column(..) | Times::OfDay(_));
    let understood = understood(&rows, &scale);
    let sample = |&(t_s, values): &(f64, [f64; 6])| {
        let [x, y, z, ..] = values.map(|x| x * scale.newtons);
        let own = options.calibration.map_or([x, y, z], |calibration| calibration.apply(values));
        let force_n = std::array::from_fn(|k| own[k] - options.bias_n[k]);
        ForceSample { t_s, force_n: options.axes.apply(force_n) }
    };
    let mut samples = rows.samples.iter().map(sample).collect::<Vec<_>>();
    // The mean would then include the contact force.
    let last_s = samples.last().map_or(0.0, |last| last.t_s);
    if options.tare_s > last_s && samples.len() > 1 {
        let problem = format!("the log ends {last_s} s after its beginning, within the tare");
        let fix = "give --tare only the seconds in which nothing touched";
        return Err(ImportError::new(last_line, problem, fix));
    }
    tare(&mut samples, options.tare_s);
    Ok(AtiLog { samples, has_time, understood, remarks })
}

/// What gives the rows their time, judged by the first of them.
fn times(
    heading: &Heading,
    first: Option<&str>,
    said_hz: Option<f64>,
    options: &AtiOptions,
) -> Result<Times, (String, String)> {
    let given_hz = options.rate_hz;
    let field = |at: usize| first.and_then(|row| split(row).get(at).copied());
    // ATI's program writes when its computer received a row, in whole seconds.
    let is_of_day = |at: &usize| field(*at).is_some_and(|text| clock::of_day_s(text).is_some());
    if let Some((at, named_s)) = heading.time.filter(|(at, _)| !is_of_day(at)) {
        return match (named_s, options.time_unit_s) {
            (Some(named_s), Some(given_s)) if named_s != given_s => {
                let problem = "the column of time names its unit, and --time-unit another one";
                Err((problem.into(), "leave --time-unit out, or correct the name".into()))
            }
            (named_s, given_s) => Ok(Times::Column(at, named_s.or(given_s).unwrap_or(1.0))),
        };
    }
    // Without a fraction it is in whole seconds, in which many rows stand.
    let is_fine = |at: usize| field(at).is_some_and(clock::has_fraction);
    if let Some((at, _)) = heading.time.filter(|(at, _)| given_hz.is_none() && is_fine(*at)) {
        return Ok(Times::OfDay(at));
    }
    match (given_hz.or(said_hz), heading.sequence) {
        (Some(rate_hz), Some(at)) => Ok(Times::Sequence(at, rate_hz)),
        (Some(rate_hz), None) => Ok(Times::Rows(rate_hz)),
        (None, _) => {
            let problem = match heading.time {
                Some(_) => "the column Time has times of day, and the log names no rate",
                None => "there is no column Time",
            };
            Err((problem.into(), "give the rate of the sensor with --rate".into()))
        }
    }
}

/// Refuses a rate that other times of the log contradict: all would be too early or too late.
fn check_rate(
    rows: &Rows<'_>,
    said_hz: Option<f64>,
    given_hz: Option<f64>,
) -> Result<(), (String, String)> {
    let (span_s, of_day_s) = rows.spans_s();
    let differ = |a: f64, b: f64, within_s: f64| (a - b).abs() > within_s + SAME_SPAN * a.max(b);
    match rows.times {
        // A rate that the user gives is known better.
        Times::Sequence(..) | Times::Rows(_) if given_hz.is_none() => {
            let Some(of_day_s) =
                of_day_s.filter(|&of_day_s| differ(span_s, of_day_s, WHOLE_SECONDS_S))
            else {
                return Ok(());
            };
            let rate_hz = span_s / of_day_s * said_hz.unwrap_or_default();
            let problem = format!(
                "the rows last {span_s:.3} s by the log's RDT Sample Rate, but {of_day_s:.0} s by their times of day"
            );
            Err((
                problem,
                format!(
                    "give the rate that was set in the sensor with --rate (about {rate_hz:.0})"
                ),
            ))
        }
        Times::Column(..) | Times::OfDay(_) => match said_hz.map(|rate_hz| rows.span_at_s(rate_hz))
        {
            // The column may be of another clock, but not of another unit.
            Some(at_rate_s)
                if at_rate_s > 0.0 && !(0.01..100.0).contains(&(span_s / at_rate_s)) =>
            {
                let problem = format!(
                    "the rows last {span_s:.3} s by the column Time, but {at_rate_s:.3} s by the log's rate"
                );
                Err((problem, "write the column Time in seconds, or take it out".into()))
            }
            _ => Ok(()),
        },
        _ => Ok(()),
    }
}

/// Refuses a column of time in another unit than is thought.
fn check_steps(rows: &Rows<'_>) -> Result<(), (String, String)> {
    let mut steps_s = rows.samples.windows(2).map(|pair| pair[1].0 - pair[0].0).collect::<Vec<_>>();
    steps_s.sort_by(f64::total_cmp);
    let middle_s = steps_s.get(steps_s.len() / 2).copied().unwrap_or_default();
    let Times::Column(at, _) = rows.times else { return Ok(()) };
    match steps_s.len() >= FEWEST_STEPS && middle_s >= FAR_APART_S {
        false => Ok(()),
        true => {
            let name = rows.names[at];
            let problem = format!(
                "the rows are {middle_s} s apart by the column {name}: is it in another unit?"
            );
            Err((problem, "name its unit: --time-unit ms, us or ns".into()))
        }
    }
}

fn understood(rows: &Rows<'_>, scale: &Scale) -> Vec<String> {
    let (span_s, _) = rows.spans_s();
    let times = match rows.times {
        Times::Column(at, _) | Times::OfDay(at) => format!("by the column {}", rows.names[at]),
        Times::Sequence(at, rate_hz) => format!("by {} at {rate_hz} Hz", rows.names[at]),
        Times::Rows(rate_hz) => format!("at {rate_hz} Hz"),
    };
    vec![format!("{} rows over {span_s:.3} s, timed {times}; {}", rows.count, scale.text)]
}

/// What is missing of the log and what was not taken, with its places.
fn left_out(rows: &Rows<'_>) -> Vec<String> {
    let mut remarks = Vec::new();
    let packets: u64 = rows.lost.iter().map(|lost| lost.packets).sum();
    if packets > 0 {
        let places = rows.lost.iter().take(MOST_PLACES);
        let places = places.map(|lost| format!("{} before line {}", lost.packets, lost.line));
        let more = rows.lost.len().saturating_sub(MOST_PLACES);
        let more = if more > 0 { format!(" and at {more} more places") } else { String::new() };
        let places = places.collect::<Vec<_>>().join(", ");
        remarks.push(format!("{packets} packets were lost: {places}{more}; their time is kept"));
    }
    if rows.repeated > 0 {
        remarks.push(format!("{} rows repeat a packet and are left out", rows.repeated));
    }
    remarks.extend(rows.faulty.iter().map(|faulty| {
        format!(
            "{} rows from line {} on have {} and are left out",
            faulty.rows, faulty.first_line, faulty.what
        )
    }));
    remarks
}

fn tare(samples: &mut [ForceSample], tare_s: f64) {
    let still = samples.partition_point(|sample| sample.t_s < tare_s);
    let Some(still) = samples.get(..still).filter(|still| !still.is_empty()) else { return };
    let mean: [f64; 3] = std::array::from_fn(|k| {
        still.iter().map(|sample| sample.force_n[k]).sum::<f64>() / still.len() as f64
    });
    for sample in samples {
        for (force_n, mean) in sample.force_n.iter_mut().zip(mean) {
            *force_n -= mean;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &str = "ATI Industrial Automation\n\
        Status (hex),RDT Sequence,Fx,Fy,Fz,Tx,Ty,Tz,Time (s)\n\
        0,1,100,200,-300,1,1,1,10.0\n\
        0,2,100,200,-300,1,1,1,10.5\n\
        0,3,1100,200,-300,1,1,1,11.0,\n";

    fn options() -> AtiOptions {
        let axes = AxisMap::parse("+y,-x,+z").unwrap();
        AtiOptions { counts_per_n: Some(1000.0), axes, ..AtiOptions::default() }
    }

    #[test]
    fn counts_become_newtons_in_the_vessel_frame() {
        let AtiLog { samples, has_time, .. } = read_ati(LOG.as_bytes(), &options()).unwrap();
        assert!(has_time);
        assert_eq!(samples[0], ForceSample { t_s: 0.0, force_n: [0.2, -0.1, -0.3] });
        assert_eq!(samples[2], ForceSample { t_s: 1.0, force_n: [0.2, -1.1, -0.3] });
        let tared = AtiOptions { tare_s: 0.75, ..options() };
        let tared = read_ati(LOG.as_bytes(), &tared).unwrap().samples;
        assert_eq!(tared[1].force_n, [0.0; 3]);
        assert_eq!(tared[2].force_n, [0.0, -1.0, 0.0]);
    }

    #[test]
    fn without_time_the_rate_says_when() {
        let log = "Fx;Fy;Fz\n1;2;3\n4;5;6\n";
        let error = read_ati(log.as_bytes(), &options()).unwrap_err().to_string();
        assert!(error.contains("no column Time") && error.contains("--rate"), "{error}");
        let log =
            read_ati(log.as_bytes(), &AtiOptions { rate_hz: Some(4.0), ..options() }).unwrap();
        assert_eq!((log.samples[1].t_s, log.has_time), (0.25, false));
    }

    #[test]
    fn what_is_wrong_in_a_log_is_named_with_its_line() {
        let wrong = |from: &str, to: &str| {
            let text = LOG.replace(from, to);
            let error = read_ati(text.as_bytes(), &options()).unwrap_err().to_string();
            assert!(error.contains("fix:"), "{error}");
            error
        };
        assert!(wrong("Fy", "Fq").starts_with("line 1: no line names"));
        assert!(wrong("0,2,100,", "0,2,").starts_with("line 4: 8 fields, but 9"));
        assert!(wrong("0,2,100,", "0,2,1OO,").starts_with("line 4: `1OO` is no number"));
        let nan = wrong("0,2,100,", "0,2,NaN,");
        assert!(nan.starts_with("line 4: `NaN` is no number, in column `Fx`"), "{nan}");
        assert!(wrong("0,2,100,", "0,2,,").starts_with("line 4: column `Fx` is empty"));
        let units = wrong("Time (s)\n", "Time (s)\n-,-,N,N,N,Nm,Nm,Nm,s\n");
        assert!(units.contains("line 3: the row has words") && units.contains("Fx (N)"), "{units}");
        assert!(wrong("10.5", "9.5").starts_with("line 4: time goes"));
        let bytes = [LOG.as_bytes(), &[0xFF]].concat();
        let error = read_ati(&bytes[..], &options()).unwrap_err().to_string();
        assert!(error.starts_with("line 6: this is no UTF-8"), "{error}");
        let heading = LOG.lines().take(2).collect::<Vec<_>>().join("\n");
        let error = read_ati(heading.as_bytes(), &options()).unwrap_err().to_string();
        assert!(error.starts_with("line 2: no row"), "{error}");
        let empty = read_ati("\n".as_bytes(), &options()).unwrap_err().to_string();
        assert!(empty.contains("the file is empty"), "{empty}");
        let comma = "Fx;Fy;Fz;Time\n1,5;2;3;0\n";
        let comma = read_ati(comma.as_bytes(), &options()).unwrap_err().to_string();
        assert!(comma.contains("numbers with a point"), "{comma}");
    }

    #[test]
    fn a_tare_that_is_longer_than_the_log_is_refused() {
        let long = AtiOptions { tare_s: 1.5, ..options() };
        let error = read_ati(LOG.as_bytes(), &long).unwrap_err().to_string();
        assert!(
            error.contains("ends 1 s after its beginning") && error.contains("--tare"),
            "{error}"
        );
    }

    fn newtons(text: &str) -> Result<AtiLog, String> {
        read_ati(text.as_bytes(), &AtiOptions::default()).map_err(|error| error.to_string())
    }

    /// As ATI's own program writes a log, but for the words that a test changes.
    fn program_log(units: &str, counts: &str, rows: &str) -> String {
        format!(
            "Start Time: 3/2/25 9:15 AM\nRDT Sample Rate: 50\n{units}\n{counts}\n\
             Status (hex), RDT Sequence, F/T Sequence, Fx, Fy, Fz, Tx, Ty, Tz, Time\n{rows}"
        )
    }

    const COUNTS: &str = "Counts per Unit Force: 1000000.0";
    const DATE: &str = "\"Mar 2, 2025 9:15:00 AM\"";

    #[test]
    fn the_logs_own_unit_and_rate_count() {
        let rows = format!(
            "\"0x0\",\"7\",\"70\",\"0.5\",\"0\",\"-1\",\"0\",\"0\",\"0\",{DATE}\n\
             \"0x0\",\"8\",\"80\",\"0.5\",\"0\",\"-1\",\"0\",\"0\",\"0\",{DATE}\n"
        );
        let log = newtons(&program_log("Force Units: lbf", COUNTS, &rows)).unwrap();
        let [first, second] = log.samples[..] else { panic!("{log:?}") };
        assert!((first.force_n[0] - 2.224_110_807_63).abs() < 1e-9, "{first:?}");
        assert!((first.force_n[2] + 4.448_221_615_26).abs() < 1e-9, "{first:?}");
        assert_eq!(second.t_s, 0.02);
        assert!(log.understood[0].contains("in lbf") && log.remarks.is_empty(), "{log:?}");
        // The columns say it.
        let named = newtons("Fx (lbf),Fy (lbf),Fz (lbf),Time\n1,0,0,0\n").unwrap();
        assert!((named.samples[0].force_n[0] - 4.448_221_615_26).abs() < 1e-9, "{named:?}");
        let both = "Force Units: N\nFx (lbf),Fy (lbf),Fz (lbf),Time\n1,0,0,0\n";
        assert!(newtons(both).unwrap_err().contains("columns are in lbf"));
    }

    #[test]
    fn counts_are_divided_and_forces_are_not() {
        let rows = |values: &str| format!("0x0,1,10,{values},0,0,0,{DATE}\n");
        let read = |values: &str| newtons(&program_log("Force Units: N", COUNTS, &rows(values)));
        assert_eq!(read("250000,-4000,0").unwrap().samples[0].force_n[..2], [0.25, -0.004]);
        assert_eq!(read("0.25,-0.004,0").unwrap().samples[0].force_n[..2], [0.25, -0.004]);
        // Neither reading is likely, so that the user must say it.
        for values in ["1,2,0", "250000.5,3,0"] {
            let error = read(values).unwrap_err();
            assert!(
                error.contains("--counts-per-n 1000000") && error.contains("--counts-per-n 1 "),
                "{error}"
            );
        }
        let log = program_log("Force Units: N", COUNTS, &rows("250000,-4000,0"));
        let given = |counts| {
            let options = AtiOptions { counts_per_n: Some(counts), ..AtiOptions::default() };
            read_ati(log.as_bytes(), &options).map_err(|error| error.to_string())
        };
        assert_eq!(given(1e6).unwrap().samples[0].force_n[0], 0.25);
        assert!(given(1e3).unwrap_err().contains("but --counts-per-n says that 1000"));
        let unnamed = newtons("Fx,Fy,Fz,Time\n250000,0,0,0\n").unwrap_err();
        assert!(unnamed.contains("are they counts?"), "{unnamed}");
    }

    #[test]
    fn lost_packets_keep_their_time_and_rows_with_an_error_are_left_out() {
        let row = |status: &str, packet: u32| format!("{status},{packet},1,0.1,0,0,0,0,0,{DATE}\n");
        let rows = [
            row("0x0", u32::MAX - 1),
            row("0x0", u32::MAX),
            row("0x0", 49),
            row("0x0", 49),
            row("0x88000000", 50),
            row("0x00010000", 51),
        ];
        let log = newtons(&program_log("Force Units: N", COUNTS, &rows.concat())).unwrap();
        let times = log.samples.iter().map(|sample| sample.t_s).collect::<Vec<_>>();
        assert_eq!(times, [0.0, 0.02, 1.02, 1.06]);
        let said = log.remarks.join("\n");
        for says in [
            "49 packets were lost: 49 before line 8",
            "1 rows repeat",
            "line 10",
            "gage out of range",
        ] {
            assert!(said.contains(says), "{says}: {said}");
        }
        let back = [row("0x0", 9), row("0x0", 1)].concat();
        let back = newtons(&program_log("Force Units: N", COUNTS, &back)).unwrap_err();
        assert!(
            back.starts_with("line 7: the number of the packet goes from 9 back to 1"),
            "{back}"
        );
        let none =
            newtons(&program_log("Force Units: N", COUNTS, &row("80000001", 1))).unwrap_err();
        assert!(none.contains("every row has the error status 0x80000001 (temperature)"), "{none}");
    }

    #[test]
    fn a_rate_that_the_times_of_day_contradict_is_refused() {
        let row = |packet: u32| {
            let second = packet / 10;
            format!("0x0,{packet},1,0.1,0,0,0,0,0,\"Mar 2, 2025 9:15:{second:02} AM\"\n")
        };
        let rows = (0..300).map(row).collect::<String>();
        let error = newtons(&program_log("Force Units: N", COUNTS, &rows)).unwrap_err();
        assert!(
            error.contains("5.980 s") && error.contains("29 s") && error.contains("--rate"),
            "{error}"
        );
    }

    #[test]
    fn a_cut_last_line_is_left_out_and_a_comma_in_every_row_is_named() {
        let log = newtons("Fx,Fy,Fz,Time\n1,2,3,0\n1,2").unwrap();
        assert_eq!(log.samples.len(), 1);
        assert!(log.remarks[0].contains("line 3, the last, is cut off"), "{log:?}");
        let date = newtons("Fx,Fy,Fz,Time\n1,2,3,Mar 2, 2025\n1,2,3,Mar 2, 2025\n").unwrap_err();
        assert!(date.contains("in quotes") && !date.contains("take this line out"), "{date}");
    }

    /// A log of Bota's driver: times in microseconds, moments, flags.
    #[test]
    fn times_in_microseconds_and_rows_with_a_flag_are_understood() {
        let row =
            |k: u32, over: u32| format!("{},{over},0.5,-0.25,1,0,0,0,31.5\n", 7_000_000 + 1250 * k);
        let rows = (0..20).map(|k| row(k, u32::from(k == 4))).collect::<String>();
        let log = |time: &str| {
            let heading =
                format!("{time},overrange,Force_X,Force_Y,Force_Z,Mx,My,Mz,temperature\n");
            newtons(&format!("{heading}{rows}"))
        };
        for time in ["timestamp_us", "Sensor timestamp (µs)"] {
            let log = log(time).unwrap();
            assert_eq!(log.samples.len(), 19, "{time}");
            assert!((log.samples[1].t_s - 1.25e-3).abs() < 1e-12, "{log:?}");
            assert_eq!(log.samples[0].force_n, [0.5, -0.25, 1.0]);
            assert!(log.remarks[0].contains("1 rows from line 6 on have overrange set"), "{log:?}");
        }
        let error = log("timestamp").unwrap_err();
        assert!(error.contains("1250 s apart") && error.contains("--time-unit ms, us"), "{error}");
        let text = format!("timestamp,overrange,Fx,Fy,Fz,Mx,My,Mz,temperature\n{rows}");
        let given = AtiOptions { time_unit_s: Some(1e-6), ..AtiOptions::default() };
        let given = read_ati(text.as_bytes(), &given).unwrap();
        assert!((given.samples[18].t_s - 19.0 * 1.25e-3).abs() < 1e-12);
        let twice = AtiOptions { time_unit_s: Some(1e-3), ..AtiOptions::default() };
        let text = text.replace("timestamp,", "timestamp_us,");
        let twice = read_ati(text.as_bytes(), &twice).unwrap_err().to_string();
        assert!(twice.contains("names its unit, and --time-unit another"), "{twice}");
    }

    /// Counts of an OptoForce, whose axes have sensitivities of their own.
    #[test]
    fn a_calibration_and_a_bias_make_the_force() {
        let text = "Time [ms];Fx;Fy;Fz;Tx;Ty;Tz\n0;1000;500;-200;0;0;10\n10;1100;500;-200;0;0;10\n";
        let calibration = |text| Some(ForceCalibration::parse(text).unwrap());
        let read = |options: &AtiOptions| read_ati(text.as_bytes(), options);
        let options = AtiOptions {
            calibration: calibration("0.01 0 0\n0 0.01 0\n0 0 0.05\n"),
            bias_n: [10.0, 0.0, 0.0],
            axes: AxisMap::parse("-z,+y,+x").unwrap(),
            ..AtiOptions::default()
        };
        let samples = read(&options).unwrap().samples;
        assert_eq!(samples[0], ForceSample { t_s: 0.0, force_n: [10.0, 5.0, 0.0] });
        assert_eq!((samples[1].t_s, samples[1].force_n[2]), (0.01, 1.0));
        let crossed = AtiOptions {
            calibration: calibration("0.01 0 0 0 0 1\n0 0.01 0 0 0 0\n0 0 0.05 0 0 0\n"),
            ..AtiOptions::default()
        };
        assert_eq!(read(&crossed).unwrap().samples[0].force_n[0], 20.0);
        let error = read_ati("Fx,Fy,Fz,Time\n1,2,3,0\n".as_bytes(), &crossed).unwrap_err();
        assert!(error.to_string().contains("no columns Tx, Ty and Tz"), "{error}");
    }

    #[test]
    fn a_time_of_day_with_fractions_is_a_time() {
        let row = |ms: u32| format!("2026-11-27 23:59:59.{ms:03},1,2,3\n");
        let log =
            format!("Timestamp,Fx,Fy,Fz\n{}{}2026-11-28 00:00:00.250,1,2,3\n", row(500), row(750));
        let log = newtons(&log).unwrap();
        let times = log.samples.iter().map(|sample| sample.t_s).collect::<Vec<_>>();
        assert_eq!((times, log.has_time), (vec![0.0, 0.25, 0.75], true));
    }

    /// The bits of an ATI sensor have names; another's status is an error as a whole.
    #[test]
    fn the_status_of_another_maker_is_not_read_as_atis() {
        let log = newtons("time,fx,fy,fz,status\n0,1,2,3,0\n1,1,2,3,65536\n").unwrap();
        assert_eq!(log.samples.len(), 1);
        assert!(log.remarks[0].contains("have the status 65536 and are left out"), "{log:?}");
    }
}
